"""docs/first_study.md does what it says: its commands, typed in order from an empty folder, end with a report.

A simulated observer sits in place of the person; the page's three edits are made. Counted: commands and edited lines.
"""

from __future__ import annotations

import json
import re
import shlex
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.runner.studies.drawn_pictures import draw_pairs

pytestmark = pytest.mark.nightly

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "first_study.md"
MOST_COMMANDS, MOST_EDITED_LINES = 5, 3


def _commands() -> list[list[str]]:
    """Return the page's commands: its indented lines that begin with a program."""
    lines = re.findall(
        r"^    ((?:make|\.venv/bin/|cyclopean|git) ?\S.*)$", PAGE.read_text(encoding="utf-8"), re.MULTILINE
    )
    return [shlex.split(line) for line in lines]


def _edits() -> list[tuple[str, str, str]]:
    """Return file, beginning of a line, and the new line, of the page's table of edits."""
    rows = re.findall(r"^\| `(my_study/\S+)` \| `(.+?)` \| `(.+?)` \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    return [(file, begins, new) for file, begins, new in rows]


def _edit(file: Path, begins: str, new: str) -> int:
    """Put ``new`` in place of the value of the lines that begin so; return how many lines changed."""
    lines, changed = file.read_text(encoding="utf-8").splitlines(), 0
    for number, line in enumerate(lines):
        if line.strip().startswith(begins):
            indent = line[: len(line) - len(line.lstrip())]
            lines[number] = indent + new
            changed += 1
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return changed


@pytest.mark.usefixtures("undrawn")
def test_the_page_ends_with_a_report(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cyclopean: Callable[..., subprocess.CompletedProcess[str]]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv("DISPLAY", "")
    draw_pairs(tmp_path / "photos", [f"photo{number}" for number in range(1, 11)], (90, 60))
    commands = _commands()
    assert len(commands) <= MOST_COMMANDS
    assert [words[1] for words in commands] == ["env", "new", "check", "run", "report"]
    assert "env:" in (ROOT / "Makefile").read_text(encoding="utf-8")
    edited = 0
    for words in commands[1:]:
        simulated = ["--simulate", "my_study/simulated.yaml"] if words[1] == "run" else []
        assert words[0] == ".venv/bin/cyclopean"
        said = cyclopean(*words[1:], *simulated).stdout
        if words[1] == "new":
            assert "\n".join(said.splitlines()[-3:]).count("my_study") == 3  # the three commands that follow
            edited = sum(_edit(tmp_path / file, begins, new) for file, begins, new in _edits())
    assert 0 < edited <= MOST_EDITED_LINES
    page = (tmp_path / "results" / "my_study" / "report.html").read_text(encoding="utf-8")
    assert "Which photograph looks more natural?" in page
    assert "nominal, not measured" in page
    assert "photo10" in page
    session = next((tmp_path / "results" / "my_study").rglob("session.jsonl"))
    lines = [json.loads(line) for line in session.read_text(encoding="utf-8").splitlines()]
    scored = [line for line in lines if line.get("kind") == "all_pairs"]
    assert len(scored) == 45
    assert all(line["nominal"] == "srgb" for line in scored)
