"""`cyclopean compare`: is the rendering the photograph? In numbers, and as the eye resolves it."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from stimuli.comparison.pictures import Reading
    from stimuli.comparison.reason import Outcome
    from stimuli.comparison.regions_file import RegionsFile
    from stimuli.comparison.results import Comparison

_MOST_PX = 1e9
_HOLDS = click.Choice(["xyz", "rec709", "camera-rgb", "spectral"])


@click.command(name="compare", short_help="Say whether a rendering is validated by a photograph, or why not.")
@click.argument("photo", metavar="PHOTO")
@click.argument("rendering", metavar="RENDERING")
@click.option("--regions", required=True, metavar="R.yaml", help="What to compare: a chart, plates, areas; and limits.")
@click.option("--camera", metavar="C.yaml", help="Camera file of `camera fit`, for raw photographs and camera RGB.")
@click.option("--exposure", metavar="TIME,F,ISO", help="Of camera RGB that does not tell its own, such as 1/15,8,200.")
@click.option("--linear", is_flag=True, help="Take a TIFF or OpenEXR as linear camera RGB whatever it declares.")
@click.option("--photo-holds", type=_HOLDS, help="What the numbers of PHOTO are, where the file does not say.")
@click.option("--rendering-holds", type=_HOLDS, help="What those of RENDERING are.")
@click.option(
    "--sensitivities", metavar="S.csv", help="wavelength_nm,red,green,blue: take a spectral rendering by this sensor."
)
@click.option(
    "--full-scale", type=float, metavar="CD_M2", help="Luminance of equal-energy light that just fills that sensor."
)
@click.option("--quantity", type=click.Choice(["radiance", "reflectance"]), help="What spectral values are.")
@click.option("--illuminant", metavar="NAME|LIGHT.csv", help="Light on a spectral rendering of reflectance.")
@click.option(
    "--illuminant-luminance", type=float, metavar="CD_M2", help="Luminance of a perfect diffuser in that light."
)
@click.option("--display", metavar="D.yaml", help="Display the pictures are seen on, pixel for pixel.")
@click.option("--rig", metavar="RIG.yaml", help="Display and viewing distance; what --experiment is run on.")
@click.option("--distance-mm", type=float, help="Viewing distance.  [the rig's]")
@click.option("--white", type=click.Choice(["icc-d50", "d50", "d65", "a", "e"]), help="White of CIELAB.  [icc-d50]")
@click.option(
    "--white-luminance", type=float, metavar="CD_M2", help="Its luminance.  [the chart's white, or the display's]"
)
@click.option(
    "--luminance",
    type=click.Choice(["absolute", "mean_ratio", "least_squares"]),
    help="Compare luminances as they are, or times a factor for all.  [absolute]",
)
@click.option(
    "--register",
    "registering",
    type=click.Choice(["auto", "none", "corners"]),
    default="auto",
    show_default=True,
    help="Find shift and turn; take the pixels as they are; or bring four corners together.",
)
@click.option("--photo-corners", nargs=4, metavar="X,Y X,Y X,Y X,Y", help="Four places in PHOTO, in pixels.")
@click.option("--rendering-corners", nargs=4, metavar="X,Y X,Y X,Y X,Y", help="The same four in RENDERING.")
@click.option("--limit", type=click.FloatRange(min=0, min_open=True), metavar="ΔE00", help="Of what is seen.  [1.4]")
@click.option("-o", "--output", metavar="OUT.html", help="HTML page to write.")
@click.option("--experiment", "experiment_name", metavar="NAME", help="Write experiments/NAME.yaml, which asks people.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON instead of the verdict.")
@click.pass_context
def command(context: click.Context, /, photo: str, rendering: str, as_json: bool, **options: Any) -> None:
    """Say whether a rendering is validated by a photograph, or why not.

    PHOTO and RENDERING are OpenEXR or TIFF of XYZ or of camera RGB, raw photographs, or spectral pictures. They are
    brought to one grid, and compared by regions, pixel by pixel, as the eye resolves them at the viewing distance, and
    by their sparkles.

    Exit status: 0 validated, 1 not validated or not to be said, 2 the input was wrong, and nothing was written.
    """
    import json
    import sys
    from pathlib import Path

    from runner.cli.main import WorkError
    from runner.cli.progress import progress_bar
    from runner.reports.comparison.experiment import checked_name, write_experiment
    from runner.reports.comparison.page import write_page
    from stimuli.comparison.compare import compare
    from stimuli.comparison.pictures import read_picture
    from stimuli.comparison.results import Wishes

    corners = _corners(options["photo_corners"], options["rendering_corners"], options["registering"])
    name = options["experiment_name"]
    if name is not None and not options["rig"]:
        raise click.UsageError("--experiment needs --rig RIG.yaml: an experiment is run on one")
    output = Path(options["output"]) if options["output"] else None
    files = [Path(photo), Path(rendering)]
    if output is not None:
        _refuse_output(output, [*files, Path(options["regions"])])
    if name is not None:
        checked_name(name, Path())
    per_degree, white, told = _seen(options)
    regions = _regions(options)
    reading = _reading(options)
    wishes = Wishes(options["registering"], corners, per_degree, white, draw=output is not None)
    settings = {**told, **{key: value for key, value in options.items() if value not in (None, False, ())}}
    try:
        with progress_bar(as_json or not sys.stderr.isatty()) as step:
            pictures = [
                read_picture(
                    file,
                    reading,
                    options[f"{key}_holds"],
                    what,
                    partial(step, f"Reading the {what}"),
                )
                for file, key, what in zip(files, ("photo", "rendering"), ("photograph", "rendering"), strict=True)
            ]
            found = compare(pictures[0], pictures[1], regions, wishes, step, settings)
    except OSError as error:
        raise WorkError(f"no room for temporary files, or a file cannot be read: {error.strerror or error}") from error
    written: dict[str, Any] = {}
    try:
        if name is not None:
            written["experiment"] = [str(one) for one in write_experiment(found, name, Path(options["rig"]), Path())]
        if output is not None:
            write_page(found, output)
            written["page"] = str(output)
    except OSError as error:
        raise WorkError(f"{error.filename or output} cannot be written: {error.strerror}") from error
    if as_json:
        click.echo(json.dumps(found.to_json() | {"written": written}, indent=2, allow_nan=False, ensure_ascii=False))
    else:
        _tell(found, written)
    sys.stdout.flush()
    context.exit(0 if found.verdict.decision == "validated" else 1)


def _corners(photo: tuple[str, ...], rendering: tuple[str, ...], registering: str) -> Any:
    import numpy as np

    if bool(photo) != bool(rendering):
        raise click.UsageError("--photo-corners and --rendering-corners go together")
    if photo and registering != "corners":
        raise click.UsageError("corners go with --register corners")
    if not photo:
        return None
    return tuple(np.array([_pair(text) for text in one]) for one in (photo, rendering))


def _pair(text: str) -> tuple[float, float]:
    try:
        x, y = (float(part) for part in text.split(","))
        if not (abs(x) <= _MOST_PX and abs(y) <= _MOST_PX):  # nor NaN
            raise ValueError(text)
    except ValueError:
        raise click.UsageError(f"a corner is '{text}'; write four as 120,90 620,130 590,455 95,410") from None
    return x, y


def _refuse_output(output: Any, inputs: list[Any]) -> None:
    from documents import Finding, InputError

    if output.suffix.lower() not in (".html", ".htm"):
        raise InputError(Finding("the page is no .html file", str(output), remedy="name one"))
    try:
        is_folder = output.is_dir()
        above = next(folder for folder in output.absolute().parents if folder.exists())
    except OSError as error:
        raise InputError(Finding(f"the page cannot be written: {error.strerror}", str(output))) from error
    if is_folder:
        raise InputError(Finding("the page would take a folder's place", str(output), remedy="name a file"))
    if not above.is_dir():
        raise InputError(Finding(f"{above} is no folder", str(output), remedy="name another place"))
    if output.exists() and any(one.exists() and output.samefile(one) for one in inputs):
        raise InputError(Finding("an input would be written over", str(output), remedy="name another output"))


def _seen(options: dict[str, Any]) -> tuple[float | None, NDArray[np.float64] | None, dict[str, Any]]:
    """Return pixels per degree and the display's white, XYZ (3,), None where not known, and where they come from."""
    from pathlib import Path

    from devices.display.display_file import read_display
    from devices.display.rig_file import read_rig
    from devices.display.viewing import pixels_per_degree

    display_file, distance = options["display"], options["distance_mm"]
    if display_file and options["rig"]:
        raise click.UsageError("--rig names a display already; give one of --display and --rig")
    if display_file and distance is None:
        raise click.UsageError("--display needs --distance-mm")
    if distance is not None and not (display_file or options["rig"]):
        raise click.UsageError("--distance-mm needs --display or --rig: how large is a pixel?")
    if options["rig"]:
        rig = read_rig(Path(options["rig"]))
        pitch, distance = rig.display.panel.pixel_pitch_mm, distance if distance is not None else rig.distance_mm
        modes = [rig.models]
    elif display_file:
        display = read_display(Path(display_file))
        pitch, modes = display.panel.pixel_pitch_mm, list(display.modes.values())
    else:
        return None, None, {}
    # Of several modes, none is said to be the one that the pictures are seen in.
    whites = [model.white_XYZ_cd_m2 for model in (modes[0].left, modes[0].right)] if len(modes) == 1 else []
    told = {"pixel_pitch_mm": pitch, "distance_mm": distance}
    return pixels_per_degree(pitch, distance), max(whites, key=lambda white: float(white[1]), default=None), told


def _regions(options: dict[str, Any]) -> RegionsFile:
    """Return the regions file, with what the command line says in place of what it says."""
    from dataclasses import replace
    from pathlib import Path

    from stimuli.comparison.regions_file import read_regions

    regions = read_regions(Path(options["regions"]))
    told = {"white": "white", "white_luminance": "white_luminance_cd_m2", "luminance": "luminance"}
    given = {key: options[name] for name, key in told.items() if options[name] is not None}
    limits = regions.limits if options["limit"] is None else replace(regions.limits, delta_e=options["limit"])
    return replace(regions, spec=regions.spec.model_copy(update=given), limits=limits)


def _reading(options: dict[str, Any]) -> Reading:
    from pathlib import Path

    from devices.camera.camera_file import read_camera
    from devices.camera.exposure import parse_exposure
    from stimuli.comparison.pictures import Reading
    from stimuli.spectral.light import Light

    if (options["sensitivities"] is None) != (options["full_scale"] is None):
        raise click.UsageError("--sensitivities and --full-scale go together")
    return Reading(
        camera=read_camera(Path(options["camera"])) if options["camera"] else None,
        exposure=parse_exposure(options["exposure"]) if options["exposure"] else None,
        assume_linear=options["linear"],
        sensitivities=Path(options["sensitivities"]) if options["sensitivities"] else None,
        full_scale_cd_m2=options["full_scale"],
        light=Light(options["illuminant"], options["illuminant_luminance"]),
        quantity=options["quantity"],
    )


def _tell(found: Comparison, written: dict[str, Any]) -> None:
    from runner.reports.comparison.words import decision_sentence, kept, kept_heading, told

    click.echo(decision_sentence(found.verdict))
    marks: tuple[tuple[Outcome, str], ...] = (("fails", "✗"), ("cannot say", "?"), ("noted", "·"))
    for outcome, mark in marks:
        for line in told(found.verdict, outcome):
            click.echo(f"  {mark} {line}")
    lines = kept(found.verdict)
    if lines:
        click.echo(kept_heading(found.verdict))
    for line in lines:
        click.echo(f"  ✓ {line}")
    remarks: dict[str, list[str]] = {}
    for eye, one in found.eyes.items():
        for said in one.said:
            remarks.setdefault(said, []).append("" if eye == "both" else f"{eye} eye: ")
    for said, eyes in remarks.items():
        click.echo(f"Note: {eyes[0] if len(eyes) == 1 else ''}{said}.")
    for picture in (found.photo, found.rendering):
        for said in picture.said:
            click.echo(f"Note: {picture.file}: {said}.")
    for what, where in written.items():
        click.echo(f"{what.capitalize()}: {where if isinstance(where, str) else ', '.join(where)}")
