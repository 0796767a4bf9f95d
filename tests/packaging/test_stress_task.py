"""`tools/stress.py` runs every sweep once, whatever fails, and says so."""

from __future__ import annotations

import runpy
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

TOOL = Path(__file__).parents[2] / "tools/stress.py"


def run_with(monkeypatch: pytest.MonkeyPatch, words: list[str], statuses: list[int]) -> tuple[int, list[list[str]]]:
    """Return the exit status and the commands, where the parts end with ``statuses``."""
    commands: list[list[str]] = []

    def run(command: list[str], **_: Any) -> SimpleNamespace:
        commands.append(command)
        return SimpleNamespace(returncode=statuses[len(commands) - 1])

    monkeypatch.setattr(subprocess, "run", run)
    monkeypatch.setattr(sys, "argv", ["stress.py", *words])
    with pytest.raises(SystemExit) as left:
        runpy.run_path(str(TOOL), run_name="__main__")
    return int(left.value.code or 0), commands


@pytest.mark.parametrize("failing", range(4))
def test_every_part_runs_and_a_failure_is_the_exit_status(
    failing: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    status, commands = run_with(monkeypatch, [], [int(part == failing) for part in range(4)])
    assert status == 1
    assert len(commands) == 4
    said = capsys.readouterr().out.strip().splitlines()[-4:]
    assert [line.endswith("FAILED (exit status 1)") for line in said] == [part == failing for part in range(4)]


def test_every_sweep_is_in_one_of_two_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    status, commands = run_with(monkeypatch, [], [0] * 4)
    assert status == 0
    marks = [command[command.index("-m", 2) + 1] for command in commands[:2]]
    assert marks == ["stress and not alone", "stress and alone"]
    assert all("tests" in command for command in commands[:2])  # sweeps stand beside other tests too


def test_nightly_has_its_tests_other_platforms_mutants_and_all_sweeps(monkeypatch: pytest.MonkeyPatch) -> None:
    status, commands = run_with(monkeypatch, ["--nightly"], [0] * 10)
    assert status == 0
    parts = ["pytest", "tools.golden", "mypy", "mypy", "tools.core_alone", "tools.mutants"]
    assert [command[2] for command in commands[:6]] == parts
    assert commands[6:] == run_with(monkeypatch, [], [0] * 4)[1]


@pytest.mark.parametrize(("words", "expected"), [(["-k", "cable"], 0), ([], 1)])
def test_a_part_without_tests_is_right_only_where_some_were_asked_for(
    words: list[str], expected: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    status, commands = run_with(monkeypatch, words, [0, 5, 0, 0])
    assert status == expected
    assert len(commands) == (2 if words else 4)
