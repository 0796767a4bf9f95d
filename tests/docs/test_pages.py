"""Every fenced snippet of the pages is collected, and a wrong one fails."""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

from tests.kept import known
from tools.count_rooms import GENERATED

ROOT = Path(__file__).parents[2]
# The examples of api.md are those of docstrings, which test_docstring_examples.py runs.
PAGES = [ROOT / "README.md", *sorted(page for page in (ROOT / "docs").glob("*.md") if page.name not in GENERATED)]
LANGUAGES = ("python", "yaml", "csv")
MOST_SKIPPED = 2


@pytest.fixture(scope="module")
def collector() -> ModuleType:
    """The conftest that collects the pages."""
    spec = known(importlib.util.spec_from_file_location("conftest_of_pages", ROOT / "conftest.py"))
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    known(spec.loader).exec_module(module)
    return module


def _fences(page: Path) -> list[tuple[int, str]]:
    """Return line and language of each fenced block, by the fences alone."""
    opened: list[tuple[int, str]] = []
    inside = False
    for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), start=1):
        if re.match(r"\s*(```|~~~)", line):
            if not inside:
                opened.append((number, line.strip().strip("`~").strip()))
            inside = not inside
    assert not inside, f"{page.name}: a fence is not closed"
    return opened


def test_every_block_is_collected(collector: ModuleType) -> None:
    for page in PAGES:
        fenced = _fences(page)
        assert {language for _, language in fenced} <= set(LANGUAGES), page.name
        assert collector.SYBIL.should_parse(page)
        collected = {example.line for example in collector.SYBIL.parse(page).examples()}
        missing = [line for line, _ in fenced if line not in collected and line + 1 not in collected]  # >>> on the next
        assert not missing, f"{page.name}: the blocks at lines {missing} are not collected"


def test_there_are_many_and_few_are_skipped() -> None:
    assert sum(len(_fences(page)) for page in PAGES) > 80
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    assert len(re.findall(r"<!-+ *skip", text)) <= MOST_SKIPPED


def test_no_python_hides_in_an_indented_block() -> None:
    for page in PAGES:
        text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
        assert not re.search(r"^    (?:from \S+ )?import ", text, flags=re.MULTILINE), page.name


WRONG = {
    "an unknown key": ("```yaml\n- {kind: all_pairs, break_evry: 15}\n```\n", "break_evry"),
    "a part of no file": ("```yaml\nlamps: {red: 1}\n```\n", "lamps"),
    "a model that cannot be undone": (
        "```yaml\nschema_version: 1\npanel: {resolution_px: [64, 48], pixel_pitch_mm: 0.25}\nmodes:\n  flat:\n"
        "    black_XYZ_cd_m2: [0, 0, 0]\n    primaries_XYZ_cd_m2: {red: [1, 1, 1], green: [1, 1, 1], blue: [1, 1, 1]}\n"
        "    curve: {kind: gamma, red: {gamma: 2}, green: {gamma: 2}, blue: {gamma: 2}}\n    source: made up\n```\n",
        "primaries",
    ),
    "an option of no mode": ("```yaml\nmode_options: {swap_eye: true}\n```\n", "swap_eye"),
    "a shipped plate with an unknown key": (
        "```yaml\nschema_version: 1\nkind: sparkle_series\nplate: {...}\nlamps: {...}\n```\n",
        "lamps",
    ),
    "an unknown column": ("```csv\nwinner,looser\na,b\n```\n", "loser"),
    "a missing name": ("```python\nimport cyclopean\n\ncyclopean.no_such_function()\n```\n", "no_such_function"),
    "another value": ("```python\n>>> 1 + 1\n3\n```\n", "Expected"),
    "a warning": ("```python\nimport warnings\n\nwarnings.warn('old')\n```\n", "old"),
}


def _run(folder: Path, page: str) -> subprocess.CompletedProcess[str]:
    """Run the page as one of a checkout of its own."""
    (folder / "docs").mkdir()
    (folder / "docs" / "page.md").write_text(page, encoding="utf-8")
    for name in ("conftest.py", "pyproject.toml"):
        shutil.copy(ROOT / name, folder / name)
    for name in ("configs", "experiments"):
        shutil.copytree(ROOT / name, folder / name)
    command = [sys.executable, "-m", "pytest", "-p", "no:xdist", "-p", "no:cacheprovider", "docs"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    environment.pop("PYTEST_ADDOPTS", None)
    return subprocess.run(command, capture_output=True, text=True, env=environment, cwd=folder, timeout=300)


@pytest.mark.nightly
def test_wrong_snippets_fail(tmp_path: Path) -> None:
    page = "# Wrong\n\n" + "\n".join(snippet for snippet, _ in WRONG.values())
    done = _run(tmp_path, page)
    assert done.returncode == 1, done.stdout
    assert f"{len(WRONG)} failed" in done.stdout
    assert "passed" not in done.stdout.splitlines()[-1]
    for what, (_, word) in WRONG.items():
        assert word in done.stdout, what


@pytest.mark.nightly
def test_right_snippets_pass(tmp_path: Path) -> None:
    page = (
        "```yaml\n- {kind: all_pairs, break_every: 15}\n```\n\n```python\nx = 1\n```\n\n```python\nassert x == 1\n```\n"
    )
    done = _run(tmp_path, page)
    assert done.returncode == 0, done.stdout
    assert "3 passed" in done.stdout
