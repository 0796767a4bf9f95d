"""docs/ as a site: every page in the navigation, every link leads somewhere, search, and nothing from other hosts."""

from __future__ import annotations

import importlib.util
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

from tests.kept import known

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


@pytest.fixture(scope="module")
def hooks() -> ModuleType:
    spec = known(importlib.util.spec_from_file_location("docs_site", ROOT / "tools" / "docs_site.py"))
    module = importlib.util.module_from_spec(spec)
    known(spec.loader).exec_module(module)
    return module


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("material", reason="mkdocs-material is not installed: the site is not built")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "-d", str(folder)]
    built = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert built.returncode == 0, built.stderr
    return folder


def _pages(nav: object) -> list[str]:
    if isinstance(nav, str):
        return [nav]
    parts = nav.values() if isinstance(nav, dict) else nav if isinstance(nav, list) else ()
    return [page for part in parts for page in _pages(part)]


def test_the_navigation_lists_every_page_once(hooks: ModuleType) -> None:
    nav = hooks.navigation(*((DOCS / name).read_text("utf-8") for name in ("index.md", "decisions/README.md")))
    pages = _pages(nav)
    there = {page.relative_to(DOCS).as_posix() for page in DOCS.rglob("*.md")} | set(hooks.BESIDE)
    assert sorted(pages) == sorted(there)
    assert len(nav) > 5  # sections by task


def test_links_out_of_docs_lead_to_the_repository_or_are_words(
    hooks: ModuleType, caplog: pytest.LogCaptureFixture
) -> None:
    page, text = DOCS / "python.md", "[examples/](../examples), [change it](../CONTRIBUTING.md#x), `[a](../b)`"
    assert hooks.relink(text, page, "") == "examples/, [change it](CONTRIBUTING.md#x), `[a](../b)`"
    assert "[examples/](https://host/blob/main/examples)" in hooks.relink(text, page, "https://host/blob/main/")
    assert hooks.relink("[api](docs/api.md)", ROOT / "CONTRIBUTING.md", "") == "[api](api.md)"
    assert hooks.relink("[s](../scores.md)", DOCS / "decisions" / "README.md", "") == "[s](../scores.md)"
    assert not caplog.records
    hooks.relink("[gone](../experiments/no_such.yaml)", page, "")
    assert "docs/python.md links ../experiments/no_such.yaml" in caplog.text


def test_the_address_is_pyproject_s(hooks: ModuleType) -> None:
    assert hooks.repository_url('[project]\nname = "x"\n') == ""
    urls = '[project]\nname = "x"\n[project.urls]\nRepository = "https://host/x/"\n'
    assert hooks.repository_url(urls) == "https://host/x/blob/main/"


@pytest.mark.nightly
def test_the_site_is_whole_and_asks_no_other_host(site: Path) -> None:
    made = {page.relative_to(site).as_posix() for page in site.rglob("*.html")}
    for page in DOCS.rglob("*.md"):
        name = page.relative_to(DOCS).with_suffix(".html").as_posix()
        assert name.replace("README", "index") in made
    for page in site.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        fetched = re.findall(
            r"""<(?:script|img|link|iframe|source)\b[^>]*?(?:src|href)=["']?((?:https?:)?//[^"'\s>]+)""", text
        )
        assert not fetched, page.name
        for link in re.findall(r'<img[^>]*src="([^":]+)"', text):
            assert (page.parent / link).is_file(), link
    index = json.loads((site / "search" / "search_index.json").read_text(encoding="utf-8"))
    assert {"report.html", "api.html", "decisions/index.html"} <= {entry["location"] for entry in index["docs"]}


@pytest.mark.nightly
def test_search_works_in_pages_opened_as_files(site: Path, tmp_path: Path) -> None:
    if CHROMIUM is None:
        pytest.skip("no Chromium is installed: the site is not opened in a browser")
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"]
    options += ["--virtual-time-budget=20000", f"--user-data-dir={tmp_path / 'profile'}", "--dump-dom"]
    page = f"{(site / 'index.html').as_uri()}?q=separation"
    shown = subprocess.run([CHROMIUM, *options, page], capture_output=True, text=True, timeout=120, check=True).stdout
    assert re.search(r"[1-9]\d* matching documents", shown)
    assert "md-search-result__item" in shown
