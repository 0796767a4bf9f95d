"""A group of commands that are loaded one at a time, so that its help text appears at once."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any

import click


class LazyGroup(click.Group):
    """Commands by name, each the ``command`` of the module of its name in ``package``.

    ``commands_help`` gives each command's line in the help; a command whose module does not exist is none.
    """

    def __init__(self, *args: Any, package: str, commands_help: Mapping[str, str], **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._package = package
        self._commands_help = commands_help

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the commands' names in the order of the help."""
        return list(self._commands_help)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Load a command, or return None if there is no such one."""
        if cmd_name not in self._commands_help:
            return None
        command: click.Command = importlib.import_module(f"{self._package}.{cmd_name}").command
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command that ``args`` begins with; a misspelt one is refused with the nearest spelling."""
        name = click.utils.make_str(args[0])
        if name not in self._commands_help and not name.startswith("-"):
            from documents.text.words import nearest  # only now: it brings pydantic

            near = nearest(name, self._commands_help)
            hint = f" Did you mean '{near}'?" if near else ""
            within = f"{self.name} " if ctx.parent else ""
            raise click.UsageError(f"There is no command '{within}{name}'.{hint}", ctx)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the commands' lines without loading them."""
        with formatter.section("Commands"):
            formatter.write_dl(list(self._commands_help.items()))
