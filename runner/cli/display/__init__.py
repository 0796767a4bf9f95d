"""`cyclopean display`: measure a display, fit a model to it, and check both; its commands load one at a time."""

from __future__ import annotations

import importlib

import click

# A command's module is runner.cli.display.<name>; the text is its line in the help.
COMMANDS = {
    "patches": "Show patches of known device codes full-screen in a stereo mode.",
    "measure": "Show patches and read each with an instrument.",
    "fit": "Fit display models to measurements and choose the one that predicts best.",
    "verify": "Show fresh colours, read them, and say how far off they are.",
    "convert": "Convert a table of device codes to XYZ, or back.",
    "report": "Write an HTML page that judges a display by its measurements.",
}


class _LazyCommands(click.Group):
    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        module = f"runner.cli.display.{cmd_name}"
        try:
            command: click.Command = importlib.import_module(module).command
        except ModuleNotFoundError as error:
            if error.name != module:
                raise
            return None
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        name = click.utils.make_str(args[0])
        if name not in COMMANDS and not name.startswith("-"):
            import difflib

            near = difflib.get_close_matches(name, COMMANDS, n=1)
            hint = f" Did you mean '{near[0]}'?" if near else ""
            raise click.UsageError(f"There is no command 'display {name}'.{hint}", ctx)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.group(cls=_LazyCommands, name="display")
def command() -> None:
    """Measure a display, fit a model to it, and check both."""
