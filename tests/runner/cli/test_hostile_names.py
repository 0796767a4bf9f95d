"""No command prints what a terminal obeys, nor a line that a name forged, whatever files and arguments contain."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from documents.text import hidden_character
from runner.commands import COMMANDS
from runner.session import simulate
from tests.choice import nightly

Cyclopean = Callable[..., subprocess.CompletedProcess[str]]  # tests/conftest.py
Study = Any
Unchained = Callable[[Path], None]

# Clear the screen, ring, set the window's title, C1's control sequence, reading direction, a line of its own.
HOSTILE = "\x1b[2J\x07\x1b]0;owned\x07\x9b31m\u202eevil\u2066\rover\nFORGED: all is well"
WORDS = HOSTILE.replace("\n", " ")


@pytest.fixture(autouse=True)
def wide(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no line be folded, so that a line that begins with a name's second line was forged."""
    monkeypatch.setenv("COLUMNS", "2000")


def check_printed(done: subprocess.CompletedProcess[str]) -> None:
    """Assert that nothing printed moves a terminal, and that no line is forged."""
    for text in (done.stdout, done.stderr):
        assert hidden_character(text) is None, ascii(text[-2000:])
        assert "\r" not in text
        assert not [line for line in text.splitlines() if line.lstrip().startswith("FORGED")], text[-3000:]


@pytest.mark.parametrize(
    "options",
    [("--pairs", "--checks", "--multiverse"), *nightly(((),), (("--margin", "0.5jnd"),), (("--observers", "random"),))],
)
def test_scores_of_items_with_hostile_names(cyclopean: Cyclopean, tmp_path: Path, options: tuple[str, ...]) -> None:
    names = [f"{HOSTILE} {number}" for number in range(4)]
    rows = [
        f'"{one}","{other}",{2 + (first + second) % 2},"{observer}","{HOSTILE}"'
        for observer in (HOSTILE, "2", "3")
        for first, one in enumerate(names)
        for second, other in enumerate(names)
        if first != second
    ]
    table = tmp_path / "table.csv"
    table.write_text("winner,loser,count,observer,scene\n" + "\n".join(rows) + "\n", encoding="utf-8", newline="")
    check_printed(cyclopean("scores", table, *options, expect=None))
    table.write_text(table.read_text(encoding="utf-8").replace("\nFORGED", " "), encoding="utf-8", newline="")
    check_printed(cyclopean("scores", table, *options, expect=None))


@pytest.mark.parametrize("command", ["report", "export", *nightly("agreement", "verify", "seal", "power")])
def test_logs_with_hostile_texts(study: Study, unchained: Unchained, cyclopean: Cyclopean, command: str) -> None:
    simulate(study.experiment, study.observers, 2, results=study.results)
    for number, file in enumerate(sorted(study.results.rglob("session.jsonl"))):
        unchained(file)
        lines = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]
        lines[0]["simulated"] = number == 1
        lines[0]["remarks"] = [HOSTILE]
        lines[0]["question"] = HOSTILE
        lines[0]["display"]["mode"] = HOSTILE
        if number == 0:
            lines[0]["software"]["system"] = HOSTILE
            lines[0]["hashes"][HOSTILE] = HOSTILE
        note = {"record": "note", "text": HOSTILE, "by": HOSTILE, "block": 0, "trial": 0, "utc": HOSTILE}
        lines.insert(2, note)
        file.write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8", newline="")
    output = ["-o", str(study.folder / "out")] if command in ("report", "export") else []
    place = [study.experiment, "--scores", study.results] if command == "power" else [study.results]
    check_printed(cyclopean(command, *place, *output, expect=None))
    for file in study.results.rglob("session.jsonl"):
        text = file.read_text(encoding="utf-8")
        file.write_text(text.replace('"one"', json.dumps(HOSTILE)), encoding="utf-8", newline="")
    check_printed(cyclopean(command, *place, *output, expect=None))
    for file in study.results.rglob("session.jsonl"):
        lines = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]
        lines[0]["observer"] = HOSTILE
        file.write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8", newline="")
    check_printed(cyclopean(command, *place, *output, expect=None))


# A call of each command that reads a file, with the place of the file.
CALLS = [
    *((name, "{}") for name in ("check", "report", "scores", "power", "preview", "show", "verify", "seal", "new")),
    ("run", "{}", "--observer", "01"),
    ("run", "experiments/dynamic_range.yaml", "--observer", "{}"),
    ("run", "experiments/dynamic_range.yaml", "--observer", "01", "--simulate", "{}"),
    ("export", "{}", "-o", "dataset"),
    ("agreement", "{}"),
    ("compare", "{}", "{}"),
    ("stimuli", "build", "{}"),
    ("stimuli", "contrast", "{}"),
    ("display", "fit", "{}"),
    ("display", "verify", "{}", "{}"),
    ("display", "report", "{}"),
    ("display", "convert", "{}", "--display", "{}"),
    ("display", "metamerism", "{}"),
    ("camera", "fit", "{}"),
    ("camera", "develop", "{}", "--camera", "{}"),
    ("camera", "bracket", "{}"),
    ("watch", "{}", "--once"),
    ("schema", "{}"),
    ("help", "{}"),
    ("completion", "{}"),
    ("{}",),
    ("check", "--{}"),
    ("stimuli", "{}"),
]


@pytest.mark.parametrize("call", CALLS, ids=" ".join)
def test_files_and_arguments_with_hostile_names(
    cyclopean: Cyclopean, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: tuple[str, ...]
) -> None:
    root = Path(__file__).parents[3]
    words = [str(root / word) if word.startswith("experiments/") else word for word in call]
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    missing = [word.format(HOSTILE) for word in words]
    check_printed(cyclopean(*missing, expect=None))
    name = f"{WORDS}\nFORGED" if os.name == "posix" else "plain"
    (tmp_path / name).write_text(f'"{WORDS}": [1, 2', encoding="utf-8")
    check_printed(cyclopean(*(word.format(name) for word in words), expect=None))


def test_every_command_is_tried() -> None:
    named = {call[0] for call in CALLS}
    assert set(COMMANDS) - named <= {"demo", "doctor"}, "these name no file"


def test_a_traceback_is_clean() -> None:
    code = f"from documents.text import clean_streams\nclean_streams()\nraise ValueError({HOSTILE!r})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, encoding="utf-8", check=False)
    assert "ValueError" in done.stderr
    assert hidden_character(done.stderr) is None
