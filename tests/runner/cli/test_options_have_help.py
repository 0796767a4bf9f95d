"""Every option of every command says what it is for."""

from __future__ import annotations

from collections.abc import Iterator

import click

from runner.cli.main import group


def _commands(command: click.Command, called: str) -> Iterator[tuple[str, click.Command]]:
    yield called, command
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            below = command.get_command(context, name)
            assert below is not None
            yield from _commands(below, f"{called} {name}")


def test_every_option_has_help() -> None:
    commands = list(_commands(group, "cyclopean"))
    options = [(called, one) for called, each in commands for one in each.params if isinstance(one, click.Option)]
    assert ("cyclopean run", "results") in [(called, one.name) for called, one in options]
    assert [f"{called} {one.opts[0]}" for called, one in options if not one.help] == []
