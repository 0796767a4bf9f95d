"""The commands as they are typed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import click

from runner.commands import OURS

EXTENDED = (Path(__file__).parents[3] / "extensions").is_dir()  # not in `make core`


def offered(called: str) -> bool:
    """Return whether a command is there: all are, but without extensions only the core's."""
    return EXTENDED or called.replace(" ", ".") in OURS


def commands(command: click.Command, called: str = "") -> Iterator[tuple[str, click.Command]]:
    """Yield each command below ``command``, and how it is called; groups too. Only those `offered`."""
    yield called, command
    if isinstance(command, click.Group):
        context = click.Context(command)
        typed = {name: f"{called} {name}".strip() for name in command.list_commands(context)}
        for name in (name for name, words in typed.items() if offered(words.removeprefix("cyclopean "))):
            below = command.get_command(context, name)
            assert below is not None
            yield from commands(below, typed[name])
