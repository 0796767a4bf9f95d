"""`cyclopean`: the group of commands, loaded one at a time so that the help text appears at once."""

from __future__ import annotations

import importlib
import sys

import click

# A command's module is runner.cli.<name>; the text is its line in the group's help.
COMMANDS = {
    "check": "Check an experiment file and everything it names.",
    "run": "Run a session with an observer.",
    "report": "Write an HTML report on the results of one experiment.",
    "export": "Write results as a BIDS dataset.",
    "scores": "Fit scores and perceptual classes to a table of paired comparisons.",
    "power": "Say how many observers an experiment needs, by simulated studies.",
    "preview": "Write what each eye sees in every trial, as PNG.",
    "display": "Measure a display, fit a model to it, and check both.",
    "show": "Show one stereo image with the display's response undone.",
    "demo": "Re-enact the thesis's second experiment with simulated observers.",
    "doctor": "Say what this machine can do.",
    "schema": "Print the JSON Schema of a file that you write.",
}


class _LazyGroup(click.Group):
    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        command: click.Command = importlib.import_module(f"runner.cli.{cmd_name}").command
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        name = click.utils.make_str(args[0])
        if name not in COMMANDS:
            import difflib

            near = difflib.get_close_matches(name, COMMANDS, n=1)
            hint = f" Did you mean '{near[0]}'?" if near else ""
            raise click.UsageError(f"There is no command '{name}'.{hint}", ctx)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


class WorkError(click.ClickException):
    """The input was right but the work could not be done; exit status 1."""

    exit_code = 1

    def show(self, file: object = None) -> None:
        """Print the reason on the error stream."""
        click.echo(f"cyclopean: {self.format_message()}", err=True)


@click.group(cls=_LazyGroup, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="cyclopean")
def group() -> None:
    """Show colorimetrically exact stereo pictures to observers, and score what they answer.

    Start with `cyclopean demo`. Then open experiments/dynamic_range.yaml, change it, and let
    `cyclopean check` read it.

    Exit status: 0 done, 1 the work failed, 2 the input was wrong.
    """


def main() -> None:
    """Run the command line; what goes wrong ends with a line each and exit status 2, or 1 if it was not the input."""
    try:
        group(prog_name="cyclopean")
    except Exception as error:
        # Only now: these bring pydantic, which the help text must not wait for.
        from documents import InputError
        from runner.presenter.errors import GraphicsError

        if isinstance(error, InputError):
            for finding in error.findings:
                click.echo(f"error: {finding}", err=True)
            sys.exit(2)
        if isinstance(error, GraphicsError):
            click.echo(f"cyclopean: {error}", err=True)
            sys.exit(1)
        raise
