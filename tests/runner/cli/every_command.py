"""The commands as they are typed."""

from __future__ import annotations

from collections.abc import Iterator

import click


def commands(command: click.Command, called: str = "") -> Iterator[tuple[str, click.Command]]:
    """Yield each command below ``command``, and how it is called; groups too."""
    yield called, command
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            below = command.get_command(context, name)
            assert below is not None
            yield from commands(below, f"{called} {name}".strip())
