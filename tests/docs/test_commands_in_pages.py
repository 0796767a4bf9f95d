"""Every command that a page tells the reader to type exists, with every option it names."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import click
import pytest

from runner.cli.main import group

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
_COMMAND = re.compile(r"^(?:\.venv/bin/)?cyclopean(?: \S|$)")


def _block_commands(page: Path) -> list[str]:
    """Return the commands that stand on lines of their own in code blocks; a backslash continues a line."""
    lines = page.read_text(encoding="utf-8").splitlines()
    commands, fenced, number = [], False, 0
    while number < len(lines):
        line = lines[number]
        fenced ^= line.startswith("```")
        if (fenced or line.startswith("    ")) and _COMMAND.match(line.strip()):
            words = line.strip()
            while words.endswith("\\"):
                number += 1
                words = words[:-1] + " " + lines[number].strip()
            commands.append(words)
        number += 1
    return commands


def _inline_commands(page: Path) -> list[str]:
    """Return the commands between backticks."""
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    return [words.replace("\n", " ") for words in re.findall(r"`((?:\.venv/bin/)?cyclopean [-a-z][^`]*)`", text)]


def _find(words: list[str]) -> tuple[click.Command, list[str]]:
    """Return the command that ``words`` name, and the words after its name."""
    command: click.Command = group
    rest = words[1:]
    while isinstance(command, click.Group) and rest and not rest[0].startswith("-"):
        found = command.get_command(click.Context(command), rest[0])
        assert found is not None, f"there is no command '{rest[0]}'"
        command, rest = found, rest[1:]
    return command, rest


def _check_options(command: click.Command, words: list[str]) -> None:
    known = {"--help", *(name for one in command.params for name in (*one.opts, *one.secondary_opts))}
    for word in words:
        if re.match(r"^--?[a-zA-Z]", word):
            assert word.split("=")[0] in known, f"'{command.name}' has no option '{word}'"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_exist(page: Path) -> None:
    for text in _block_commands(page):
        words = shlex.split(re.split(r"[|<>]", text)[0], comments=True)
        command, rest = _find(words)
        _check_options(command, rest)
        if not isinstance(command, click.Group):
            command.make_context("cyclopean", list(rest))
    for text in _inline_commands(page):
        words = text.replace("[", "").replace("]", "").split()
        command, rest = _find(words)
        _check_options(command, rest)


def test_the_pages_name_commands() -> None:
    assert sum(len(_block_commands(page)) for page in PAGES) > 30
    assert sum(len(_inline_commands(page)) for page in PAGES) > 20
