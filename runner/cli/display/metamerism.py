"""`cyclopean display metamerism`: how differently observers see an object beside its match on the screen."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from runner.cli.options import NUMBER, SEED, several

if TYPE_CHECKING:
    from devices.diagnostics import ObserverMetamerism


@click.command(name="metamerism")
@click.argument("objects", type=click.Path(path_type=Path), metavar="OBJECTS.csv")
@click.argument("readings", type=click.Path(path_type=Path), metavar="READINGS")
@click.option("--illuminant", required=True, metavar="NAME|LIGHT.csv", help="Light on the objects: A, D50, D65, … .")
@click.option("--observer", default="CIE 1931 2", show_default=True, metavar="NAME", help="Observer of the match.")
@click.option("--field", type=NUMBER, metavar="DEG", help="Field of the persons. Default: the observer's.")
@click.option("--persons", type=click.IntRange(1, 100_000), default=1000, show_default=True, help="How many to draw.")
@click.option("--ages", default="20..60", show_default=True, metavar="FROM..TO", help="Ages of the persons in years.")
@click.option("--seed", type=SEED, default=1, show_default=True, help="Random seed of the persons.")
@click.option("--categories", is_flag=True, help="Take the ten categorical observers instead of drawn persons.")
@click.option("--white-luminance", "white", type=NUMBER, metavar="CD_M2", help="Luminance of a perfect diffuser.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON, every observer's difference included.")
def command(
    objects: Path,
    readings: Path,
    illuminant: str,
    observer: str,
    field: float | None,
    persons: int,
    ages: str,
    seed: int,
    categories: bool,
    white: float | None,
    as_json: bool,
) -> None:
    """Find how differently observers see an object beside its match on the screen.

    OBJECTS.csv has the columns wavelength_nm and the reflectance of each object. READINGS are readings of the screen
    with spectra, its primaries at full drive among them. Each object in the light is matched on the screen for one
    observer; the differences that others see are in ΔE00 against their own white.
    """
    import json

    from devices.colour_matching import categorical_observers, colorimetric_observer, individual_observers
    from devices.readings import read_measurements
    from stimuli.spectral import metamerism_of_files

    matched_for = colorimetric_observer(observer)
    degrees = matched_for.field_deg if field is None else field
    try:
        youngest, oldest = several(ages, "..")
    except ValueError:
        raise click.UsageError(f"--ages is '{ages}'; write it as 20..60") from None
    group = (
        categorical_observers(degrees)
        if categories
        else individual_observers(persons, degrees, ages_years=(youngest, oldest), seed=seed)
    )
    found = metamerism_of_files(
        objects,
        read_measurements(readings),
        illuminant,
        group,
        matched_for=matched_for.name,
        white_luminance_cd_m2=white,
        file=str(readings),
    )
    if as_json:
        click.echo(json.dumps(found.to_json(), indent=2, allow_nan=False))
        return
    who = "categorical observers" if categories else f"persons of {ages} years"
    click.echo(
        f"Matched for {found.matched_for}, white at {found.white_luminance_cd_m2:.4g} cd/m²; "
        f"ΔE00 that {len(found.observers)} {who} see in a field of {degrees:g}°"
    )
    _print_table(found)
    for note in found.notes:
        click.echo(f"Note: {note}.")


def _print_table(found: ObserverMetamerism) -> None:
    from documents.pages import Table, print_blocks
    from documents.text import clean_console

    rows = []
    for index, name in enumerate(found.objects):
        if name in found.outside:
            rows.append([name, *["–"] * 4, "outside the gamut"])
            continue
        of = found.summary(index)
        numbers = [f"{of[key]:.2f}" for key in ("median", "p90", "p95", "worst")]
        standard = [f"{values[index]:.2f}" for values in found.standard_delta_e_00.values()]
        rows.append([name, *numbers, str(of["worst_observer"]), *standard])
    headings = ("object", "median", "90 %", "95 %", "worst", "seen by", *found.standard_delta_e_00)
    print_blocks([Table.of_texts("", headings, rows, words=(0, 5))], clean_console(width=160))
