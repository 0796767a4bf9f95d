"""What `cyclopean stimuli build` prints of the stimuli."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import click

# So many names are listed; of more, the first and how many others.
_NAMED = 3


def tone_mapped(step: Mapping[str, Any]) -> str:
    """Say what tone mapping did."""
    asked, used = step["asked_luminance_scale"], step["luminance_scale"]
    if not step["held_back"]:
        return f"tone mapped by {used:.3g}"
    return f"tone mapped by {used:.3g} in place of {asked:.3g}: no more than {step['limit_percent']:g} % may saturate"


def tell(told: Mapping[str, Any]) -> None:
    """Print a table of the stimuli, what is to be noted of them, and where they lie."""
    from rich.table import Table
    from rich.text import Text

    from runner.cli.print_table import print_table

    has_rig = "saturated_percent" in told["stimuli"][0]
    title = "Luminance in cd/m², left and right eye; range in stops from the darkest to the brightest thousandth"
    if has_rig:
        title += "; pixels beyond the display in %"
    table = Table(title=title, title_justify="left", box=None, pad_edge=False)
    columns = [
        "stimulus",
        "view",
        "size",
        "mean",
        "max",
        "range",
        "RMS contrast",
        *(["saturated %"] if has_rig else []),
    ]
    for name in columns:
        table.add_column(name, justify="left" if name in ("stimulus", "view") else "right", overflow="fold")
    for one in told["stimuli"]:
        eyes = one["statistics"]["eyes"]
        shown = ["left"] if one["flat"] else ["left", "right"]
        stops = [eyes[eye]["dynamic_range_robust"]["stops"] for eye in shown]
        cells = [
            " ".join(f"{eyes[eye]['mean_luminance_cd_m2']:.3g}" for eye in shown),
            " ".join(f"{eyes[eye]['max_luminance_cd_m2']:.3g}" for eye in shown),
            " ".join("∞" if value is None else f"{value:.1f}" for value in stops),
            " ".join(f"{eyes[eye]['rms_contrast']:.2f}" for eye in shown),
        ]
        if has_rig:
            cells.append(" ".join(f"{one['saturated_percent'][eye]['any']:.2f}" for eye in ("left", "right")))
        size = "×".join(str(side) for side in one["size_px"])
        table.add_row(Text(one["name"]), "flat" if one["flat"] else "stereo", size, *cells)
    print_table(table)
    for note in notes(told["stimuli"]):
        click.echo(f"Note: {note}")
    count = len(told["stimuli"])
    stimuli = "1 stimulus" if count == 1 else f"{count} stimuli"
    click.echo(f"{stimuli}, {told['rendered']} of them made now; digest {told['digest'][:16]}")
    click.echo(f"Manifest: {told['manifest']}")
    if "output" in told:
        click.echo(f"Copied to: {told['output']}")


def notes(stimuli: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Yield what is said of the stimuli: each sentence once, with those that it holds for."""
    said: dict[str, list[str]] = {}
    for one in stimuli:
        for sentence in dict.fromkeys(one["said"]):
            said.setdefault(sentence, []).append(one["name"])
    for sentence, names in said.items():
        yield f"{_those(names, len(stimuli))}: {sentence}."


def _those(names: Sequence[str], of: int) -> str:
    if len(names) == of > 1:
        return "every picture"
    if len(names) <= _NAMED:
        return ", ".join(names)
    return f"{names[0]} and {len(names) - 1} others of the {of} pictures"
