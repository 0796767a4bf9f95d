"""Help texts end with examples that the commands themselves can read; shells can complete at Tab."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import click
import pytest

from runner.cli.examples import EXAMPLES
from runner.cli.main import group
from tests.choice import nightly
from tests.runner.cli.every_command import commands

ROOT = Path(__file__).parents[3]
LINES = [line for lines in EXAMPLES.values() for line in lines]
# What takes a moment, and writes at most into the current folder.
QUICK = [
    line
    for line in LINES
    if re.search(
        r"^cyclopean (schema|help|stimuli list|scores|display new)|completion|patches .*--list|check configs|--from",
        line,
    )
]


def _words(line: str) -> list[str]:
    """Return a line's words for the program: what a shell does with its output is left out."""
    match = re.search(r"cyclopean [^)|>]*", line)
    assert match
    return shlex.split(match[0])[1:]


def test_every_command_has_examples_and_there_are_no_others() -> None:
    assert set(EXAMPLES) == {called for called, each in commands(group) if not isinstance(each, click.Group)}


@pytest.mark.parametrize("line", LINES)
def test_the_command_itself_can_read_its_example(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    context, words = click.Context(group, info_name="cyclopean"), _words(line)
    command: click.Command = group
    while isinstance(command, click.Group):
        name, below, words = command.resolve_command(context, words)
        assert below is not None
        command = below
        if not isinstance(command, click.Group):
            command.make_context(name, list(words), parent=context)
    named = [word for word in _words(line) if re.match(r"(experiments|configs)/", word)]
    assert all(Path(word).exists() for word in named)


@pytest.mark.parametrize("line", QUICK)
def test_quick_examples_run(line: str, tmp_path: Path, cyclopean: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    for folder in ("experiments", "configs"):
        (tmp_path / folder).symlink_to(ROOT / folder)
    (tmp_path / "table.csv").write_text("winner,loser\na,b\nb,c\nc,a\na,c\n", encoding="utf-8")
    assert cyclopean(*_words(line)).stdout


def test_help_prints_what_the_option_prints(cyclopean: Any) -> None:
    for words in (["check"], ["display", "fit"], ["display"]):
        assert cyclopean("help", *words).stdout == cyclopean(*words, "--help").stdout
    assert cyclopean("help").stdout == cyclopean("--help").stdout
    assert "Examples:\n    cyclopean check experiments/dynamic_range.yaml\n" in cyclopean("help", "check").stdout
    assert "Did you mean 'check'?" in cyclopean("help", "chek", expect=2).stderr
    assert "has no commands of its own" in cyclopean("help", "check", "it", expect=2).stderr


@pytest.mark.parametrize(
    ("typed", "completed"),
    [("cyclopean display ver", ["verify"]), *nightly(("cyclopean di", ["display"]), ("cyclopean schema ri", ["rig"]))],
)
def test_a_shell_completes_commands_and_values(typed: str, completed: list[str]) -> None:
    code = "from runner.cli.main import main; main()"
    environment = {
        **os.environ,
        "COMP_WORDS": typed,
        "COMP_CWORD": str(len(typed.split()) - 1),
        "_CYCLOPEAN_COMPLETE": "bash_complete",
    }
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    assert [line.split(",")[1] for line in done.stdout.splitlines()] == completed


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_each_shell_gets_its_lines(shell: str, cyclopean: Any) -> None:
    assert f"_CYCLOPEAN_COMPLETE={shell}_complete" in cyclopean("completion", shell).stdout
