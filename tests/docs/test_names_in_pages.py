"""Every module, function and file that a page or a docstring names exists, and every link leads somewhere."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
_NAME = re.compile(r"\b(?:documents|devices|stimuli|analysis|runner|cyclopean)(?:\.[A-Za-z_0-9]+)+")
_FILE = re.compile(
    r"\b(?:documents|devices|stimuli|analysis|runner|cyclopean|configs|experiments|tests|benchmarks|examples|docs|tools)"
    r"/[\w./-]*\w"
)
_LINK = re.compile(r"\]\(([^)#\s]*)(#[^)\s]*)?\)")
# Made by a benchmark, in the cache folder of the user, and in a wheel only.
_NOT_HERE = ("benchmarks/out", "cyclopean/stimuli", "runner/shipped")
_PLACEHOLDER = re.compile(r"[A-Z]{2,}")  # experiments/NAME.yaml


def _prose(page: Path) -> str:
    return re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)


def _exists(name: str) -> bool:
    """Whether a dotted name is a module, or what hangs on one."""
    parts = name.split(".")
    for end in range(len(parts), 0, -1):
        try:
            value: object = importlib.import_module(".".join(parts[:end]))
        except ModuleNotFoundError:
            continue
        for part in parts[end:]:
            fields = getattr(value, "__annotations__", {})
            if not hasattr(value, part) and part not in fields:
                return False
            value = getattr(value, part, None)
        return True
    return False


def _wrong_names(text: str) -> list[str]:
    """Return the dotted names between backticks that do not exist."""
    code = " ".join(re.findall(r"`([^`\n]+)`", text))
    names = {name for name in _NAME.findall(code) if not name.endswith((".py", ".md", ".yaml", ".json"))}
    return sorted(name for name in names if not _exists(name))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_names_exist(page: Path) -> None:
    wrong = _wrong_names(_prose(page))
    assert not wrong, f"{page.name} names {', '.join(wrong)}"


@pytest.mark.parametrize("package", ["documents", "devices", "stimuli", "analysis", "runner", "cyclopean"])
def test_names_in_docstrings_and_comments_exist(package: str) -> None:
    files = sorted((ROOT / package).rglob("*.py"))
    wrong = {str(file.relative_to(ROOT)): _wrong_names(file.read_text(encoding="utf-8")) for file in files}
    assert not any(wrong.values()), {file: names for file, names in wrong.items() if names}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_files_exist(page: Path) -> None:
    code = " ".join(re.findall(r"`([^`]+)`", _prose(page)))
    files = {file for file in _FILE.findall(code) if not file.startswith(_NOT_HERE)}
    wrong = sorted(file for file in files if not ((ROOT / file).exists() or _PLACEHOLDER.search(file)))
    assert not wrong, f"{page.name} names {', '.join(wrong)}"


def _anchors(page: Path) -> set[str]:
    """Return the anchors of the page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", _prose(page), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    wrong = []
    for target, anchor in set(_LINK.findall(_prose(page))):
        if "://" in target:
            continue
        file = page.parent / target if target else page
        if not file.exists() or (anchor and anchor[1:] not in _anchors(file)):
            wrong.append(target + anchor)
    assert not wrong, f"{page.name} links to {', '.join(sorted(wrong))}"


def test_a_wrong_name_is_seen() -> None:
    assert _exists("devices.display.display_file.read_display")
    assert _exists("cyclopean.scores")
    assert not _exists("devices.display.display_file.no_such_function")
    assert not _exists("devices.no_such_module")
    assert _wrong_names("`devices.no_such_module.at_all` and `devices.display`") == ["devices.no_such_module.at_all"]
