"""`cyclopean help`: the help text of any command."""

from __future__ import annotations

import click


@click.command(short_help="Print the help text of a command.")
@click.argument("words", nargs=-1, metavar="[COMMAND]...")
@click.pass_context
def command(ctx: click.Context, words: tuple[str, ...]) -> None:
    """Print the help text of a command.

    Without COMMAND, print what commands there are. `cyclopean COMMAND --help` prints the same.
    """
    here = ctx.find_root()
    for word in words:
        if not isinstance(here.command, click.Group):
            raise click.UsageError(f"'{here.command_path}' has no commands of its own: cyclopean help {here.info_name}")
        _, below, _ = here.command.resolve_command(here, [word])
        if below is None:
            raise click.UsageError(f"There is no command '{word}'.", here)
        here = click.Context(below, info_name=word, parent=here)
    click.echo(here.get_help())
