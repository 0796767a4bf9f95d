"""`cyclopean stimuli clean`: remove from the cache what killed builds left."""

from __future__ import annotations

import click


@click.command(name="clean", short_help="Remove what killed builds left in the cache.")
@click.option(
    "--hours",
    type=click.FloatRange(0),
    default=24.0,
    show_default=True,
    help="Only what nobody has written to for so long.",
)
@click.option("--json", "as_json", is_flag=True, help="Print what was removed as JSON.")
def command(hours: float, as_json: bool) -> None:
    """Remove from the cache what killed builds left.

    The next build of the same recipe would have gone on from it. Finished sets stay, and so does what a build is at.
    """
    import json

    from documents import Finding, InputError
    from stimuli.build.leftovers import leftovers, remove
    from stimuli.build.recipe_to_set import cache_folder

    removed = []
    for one in leftovers(cache_folder(), hours * 3600):
        try:
            if remove(one):
                removed.append(one)
        except OSError as error:
            raise InputError(Finding(f"it cannot be removed: {error.strerror or error}", str(one.folder))) from error
    if as_json:
        click.echo(json.dumps([one.to_json() for one in removed], indent=1))
        return
    for one in removed:
        click.echo(f"Removed {one}")
    left = sum(1 for _ in leftovers(cache_folder()))
    if left:
        click.echo(f"Left alone: {left} unfinished, built or touched in the last {hours:g} hours")
    elif not removed:
        click.echo(f"There is nothing to remove in {cache_folder()}")
