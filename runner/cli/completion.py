"""`cyclopean completion`: what a shell needs to complete commands and options at Tab."""

from __future__ import annotations

import click
from click.shell_completion import get_completion_class

SHELLS = ("bash", "zsh", "fish")


@click.command(short_help="Print what makes a shell complete commands at Tab.")
@click.argument("shell", type=click.Choice(SHELLS))
@click.pass_context
def command(ctx: click.Context, shell: str) -> None:
    """Print what makes a shell complete commands at Tab.

    Put the line of the example that suits your shell into ~/.bashrc, ~/.zshrc or ~/.config/fish/config.fish. Tab then
    completes commands, options, their values and files.
    """
    kind = get_completion_class(shell)
    if kind is None:
        raise click.UsageError(f"nothing is known of the shell '{shell}'")
    click.echo(kind(ctx.find_root().command, {}, "cyclopean", "_CYCLOPEAN_COMPLETE").source())
