"""`cyclopean stimuli clean`: remove leftovers of killed builds from the cache."""

from __future__ import annotations

import click

from runner.cli.options import NOT_NEGATIVE


@click.command(name="clean", short_help="Remove leftovers of killed builds from the cache.")
@click.option(
    "--hours",
    type=NOT_NEGATIVE,
    default=24.0,
    show_default=True,
    help="Hours since the last write after which a build counts as killed.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(hours: float, as_json: bool) -> None:
    """Remove leftovers of killed builds from the cache.

    The next build of the same recipe would have resumed there. Finished sets stay, and so do those being built now.
    """
    import json

    from stimuli.build import cache_folder, leftovers, remove_leftovers

    removed = remove_leftovers(hours * 3600)
    if as_json:
        click.echo(json.dumps([leftover.to_json() for leftover in removed], indent=1))
        return
    for leftover in removed:
        click.echo(f"Removed {leftover}")
    left = sum(1 for _ in leftovers())
    if left:
        click.echo(f"Left alone: {left} unfinished, built or touched in the last {hours:g} hours")
    elif not removed:
        click.echo(f"There is nothing to remove in {cache_folder()}")
