"""`cyclopean display convert`: device codes to XYZ, or back, by a display file; or the display for another program."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from runner.cli.options import POSITIVE, Whole

if TYPE_CHECKING:
    from devices.display import Eye
    from devices.readings import Kind

_FILES = ("icc", "cube")


@click.command(name="convert", short_help="Convert codes to XYZ or back, or a display file to an ICC profile or .cube.")
@click.argument("file", metavar="[FILE]", default="-")
@click.option("--display", "display_file", metavar="DISPLAY.yaml", help="Display file; with icc and cube it is FILE.")
@click.option("--mode", help="Stereo mode of the display file. Default: its only one.")
@click.option(
    "--eye", type=click.Choice(["left", "right"]), default="left", show_default=True, help="Eye whose model is used."
)
@click.option(
    "--to",
    "target",
    type=click.Choice(["code", "xyz", *_FILES]),
    required=True,
    help="Quantity to print, or kind of file to write.",
)
@click.option("--full", type=POSITIVE, default=255.0, show_default=True, help="Code of full drive.")
@click.option(
    "-o", "--output", metavar="FILE", help="File to write. Default: the display file's name with .icc or .cube."
)
@click.option(
    "--profile-kind",
    type=click.Choice(["auto", "matrix", "table"]),
    default="auto",
    show_default=True,
    help="Matrix and curves, or tables; auto takes a matrix where it is exact enough.",
)
@click.option(
    "--cube-input",
    type=click.Choice(["srgb", "light"]),
    default="srgb",
    show_default=True,
    help="What goes into a .cube: sRGB codes, or each channel's share of light.",
)
@click.option("--points", type=Whole(2, 10**9), help="Points of a table, a side. Default: as many as it needs.")
def command(
    file: str,
    display_file: str | None,
    mode: str | None,
    eye: str,
    target: str,
    full: float,
    output: str | None,
    profile_kind: str,
    cube_input: str,
    points: int | None,
) -> None:
    """Convert a table of device codes to XYZ, or back; or write a display as an ICC profile or a .cube table.

    With --to code or xyz: reads CSV from FILE or standard input, or the readings of an ArgyllCMS .ti3, and writes CSV
    to standard output: the columns red,green,blue, in 0..255 or up to --full, become X,Y,Z in cd/m², or the other way
    about. XYZ include the room's light where the display file has it. Codes are not rounded. Colours outside the gamut
    become the nearest codes channel by channel; their number is printed on the error stream.

    With --to icc or cube: FILE is the display file. The model of one mode and eye is written for other programs,
    without the room's light, and how well the file agrees with the model is printed.
    """
    from typing import cast

    if target in _FILES:
        if file != "-" and display_file is not None:
            raise click.UsageError(f"with --to {target}, name the display file once: as FILE or with --display")
        named = display_file if file == "-" else file
        if named is None:
            raise click.UsageError(f"name the display file: display convert DISPLAY.yaml --to {target}")
        _write(named, mode, cast("Eye", eye), target, output, profile_kind, cube_input, points)
        return
    if display_file is None:
        raise click.UsageError(f"--to {target} needs --display DISPLAY.yaml")
    if output is not None or points is not None:
        raise click.UsageError(f"--to {target} prints to standard output; -o and --points go with icc and cube")
    _print(file, display_file, mode, cast("Eye", eye), cast("Kind", target), full)


def _print(file: str, display_file: str, mode: str | None, eye: Eye, target: Kind, full: float) -> None:
    import sys
    from pathlib import Path

    from devices.display import read_display
    from devices.readings import convert_colours

    display = read_display(Path(display_file))
    chosen = display.only_mode() if mode is None else mode
    model = display.models(chosen).eye(eye)
    given = sys.stdin.buffer if file == "-" else file
    table = convert_colours(given, model, target, full, display.observer(chosen))
    if table.outside:
        click.echo(f"cyclopean: {table.outside} of {len(table.values)} colours lie outside the gamut", err=True)
    table.write(sys.stdout)


def _write(
    named: str,
    mode: str | None,
    eye: Eye,
    target: str,
    output: str | None,
    profile_kind: str,
    cube_input: str,
    points: int | None,
) -> None:
    from pathlib import Path
    from typing import cast

    from devices.display import read_display
    from devices.errors import DeviceError
    from devices.profiles import CubeInput, ProfileKind, write_cube, write_profile
    from devices.readings import CIE_1931_2
    from documents import Finding

    display = read_display(Path(named))
    chosen = display.only_mode() if mode is None else mode
    models = display.models(chosen)
    if display.observer(chosen) != CIE_1931_2:
        what = f"the mode '{chosen}' is for the observer {display.observer(chosen)}"
        remedy = f"ICC and .cube know {CIE_1931_2} alone: fit the readings for it, into a mode of its own"
        raise DeviceError(Finding(what, named, remedy=remedy))
    path = Path(output) if output else Path(named).with_suffix(f".{target}")
    words = f"{Path(named).stem}, {chosen}" + ("" if models.left is models.right else f", {eye} eye")
    if target == "icc":
        kind = None if profile_kind == "auto" else cast(ProfileKind, profile_kind)
        table = display.gamma_table(chosen, eye)
        made = write_profile(models.eye(eye), path, words, kind=kind, points=points, gamma_table=table)
        sentence = made.sentence()
        close = made.close
    else:
        given = cast(CubeInput, cube_input)
        sentence = write_cube(models.eye(eye), path, words, given, points=points).sentence(given)
        close = True
    click.echo(f"wrote {path}: {sentence}")
    if not close:
        click.echo("Note: people may see such differences; take more --points, up to 65, or --profile-kind auto.")
    if models.left is not models.right:
        click.echo(f"Note: it is of the {eye} eye; the other has a model of its own (--eye).")
    room_cd_m2 = float(models.eye(eye).ambient_XYZ_cd_m2[1])
    if models.eye(eye).ambient_XYZ_cd_m2.any():
        click.echo(f"Note: it is of the display alone: the room's light, {room_cd_m2:.3g} cd/m², is left out.")
    if display.crosstalk(chosen) is not None or display.gain_map(chosen) is not None:
        click.echo("Note: crosstalk and the gain map of the display file have no place in it.")
