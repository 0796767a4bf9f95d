"""`cyclopean stimuli list`: the sets in the cache."""

from __future__ import annotations

import click

# Columns of a terminal from which a folder's 32 digits leave room for the rest.


@click.command(name="list", short_help="List the stimulus sets in the cache.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(as_json: bool) -> None:
    """List the stimulus sets in the cache: how many pictures, of which kind, how large. Any may be deleted."""
    import json

    from stimuli.build import cache_folder, cached_sets, leftovers

    sets = list(cached_sets())
    if as_json:
        click.echo(json.dumps([cached.to_json() for cached in sets], indent=1))
        return
    from documents.pages import Table, print_blocks

    rows = []
    for cached in sets:
        cells = (cached.kind, len(cached.names), cached.names[0], f"{cached.pixel_pitch_mm:g}")
        rows.append((*map(str, cells), f"{cached.bytes / 1e6:.1f}", cached.folder.name))
    headings = ("kind", "stimuli", "first", "pitch mm", "MB", "folder")
    print_blocks([Table.of_texts("", headings, rows, words=(0, 2))])
    click.echo(f"In {cache_folder()}")
    for left in leftovers():
        click.echo(
            f"Unfinished: {left}, untouched for {left.untouched_s / 3600:.1f} hours "
            "(its next build resumes there; `cyclopean stimuli clean` removes it)"
        )
