"""`cyclopean stimuli list`: the sets in the cache."""

from __future__ import annotations

import click

# Columns of a terminal from which a folder's 32 digits leave room for the rest.
_ROOMY = 76


@click.command(name="list", short_help="List the stimulus sets in the cache.")
@click.option("--json", "as_json", is_flag=True, help="Print them as JSON.")
def command(as_json: bool) -> None:
    """List the stimulus sets in the cache: how many pictures, of which kind, how large. Any may be deleted."""
    import json

    from stimuli.build.leftovers import leftovers
    from stimuli.build.recipe_to_set import cache_folder
    from stimuli.build.stimulus_set import MANIFEST

    sets = []
    for manifest in sorted(cache_folder().glob(f"[!.]*/{MANIFEST}")):
        try:
            known = json.loads(manifest.read_text(encoding="utf-8"))
            size = sum(file.stat().st_size for file in manifest.parent.iterdir())
            names = [entry["name"] for entry in known["stimuli"]]
            facts = {"kind": known["recipe"]["kind"], "pixel_pitch_mm": known["pixel_pitch_mm"], "stimuli": names}
        except (OSError, ValueError, KeyError, TypeError):
            continue
        sets.append({"folder": str(manifest.parent), "digest": known.get("digest"), **facts, "bytes": size})
    if as_json:
        click.echo(json.dumps(sets, indent=1))
        return
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from runner.cli.print_table import print_table

    table = Table(box=None, pad_edge=False)
    roomy = Console().width >= _ROOMY
    for name in ("kind", "stimuli", "first", "pitch mm", "MB", "folder"):
        number = name in ("stimuli", "pitch mm", "MB")
        # Words go on in the next line; numbers stay whole, and the folder where there is room to copy it.
        whole = number or (name == "folder" and roomy)
        table.add_column(name, justify="right" if number else "left", overflow="fold", no_wrap=whole)
    for one in sets:
        cells = [one["kind"], len(one["stimuli"]), one["stimuli"][0], f"{one['pixel_pitch_mm']:g}"]
        texts = (*map(str, cells), f"{one['bytes'] / 1e6:.1f}", one["folder"].rpartition("/")[2])
        table.add_row(*map(Text, texts))
    print_table(table)
    click.echo(f"In {cache_folder()}")
    for left in leftovers(cache_folder()):
        click.echo(
            f"Unfinished: {left}, untouched for {left.untouched_s / 3600:.1f} hours "
            "(its next build goes on from there; `cyclopean stimuli clean` removes it)"
        )
