"""`cyclopean compare`: is the rendering the photograph? In numbers, and as the eye resolves it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from runner.cli.options import NUMBER, POSITIVE, several
from runner.cli.options import threads as threads_option

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from stimuli.comparison import CompareOptions
    from stimuli.measures import ViewingConditions

_MOST_PX = 1e9
_HOLDS = click.Choice(["xyz", "rec709", "camera-rgb", "spectral"])


@click.command(name="compare", short_help="Compare a rendering with a photograph, and report whether it is validated.")
@click.argument("photo", metavar="PHOTO")
@click.argument("rendering", metavar="RENDERING")
@click.option(
    "--regions",
    required=True,
    metavar="R.yaml",
    help="File of the regions to compare (chart, plates, areas) and the limits.",
)
@click.option(
    "--camera", metavar="C.yaml", help="Camera file written by `camera fit`, for raw photographs and camera RGB."
)
@click.option(
    "--exposure", metavar="TIME,F,ISO", help="Exposure of camera RGB whose file has none, such as 1/15,8,200."
)
@click.option("--linear", is_flag=True, help="Read a TIFF or OpenEXR file as linear camera RGB, whatever it declares.")
@click.option("--photo-holds", type=_HOLDS, help="Quantity of the values in PHOTO, if the file does not state it.")
@click.option(
    "--rendering-holds", type=_HOLDS, help="Quantity of the values in RENDERING, if the file does not state it."
)
@click.option(
    "--colour-space",
    type=click.Choice(["declared", "srgb", "display-p3", "adobe-rgb", "rec2020", "icc"]),
    help="Colour space of pictures such as PNG and JPEG, or what each declares.",
)
@click.option("--picture-white", type=NUMBER, metavar="CD_M2", help="Luminance of the white of such pictures.")
@click.option(
    "--sensitivities", metavar="S.csv", help="Sensor table (wavelength_nm,red,green,blue) for a spectral rendering."
)
@click.option(
    "--full-scale",
    type=NUMBER,
    metavar="CD_M2",
    help="Luminance of equal-energy light that just saturates that sensor.",
)
@click.option("--quantity", type=click.Choice(["radiance", "reflectance"]), help="Quantity of spectral values.")
@click.option("--illuminant", metavar="NAME|LIGHT.csv", help="Illuminant of a spectral rendering of reflectance.")
@click.option(
    "--illuminant-luminance", type=NUMBER, metavar="CD_M2", help="Luminance of a perfect diffuser in that light."
)
@click.option("--observer", metavar="NAME", help="Observer for XYZ of spectral pictures. Default: CIE 1931 2.")
@click.option("--display", metavar="D.yaml", help="Display on which the pictures are seen, pixel for pixel.")
@click.option("--rig", metavar="RIG.yaml", help="Rig that gives display and viewing distance, also for --experiment.")
@click.option("--distance-mm", type=NUMBER, help="Viewing distance. Default: the rig's.")
@click.option(
    "--white", type=click.Choice(["icc-d50", "d50", "d65", "a", "e"]), help="White point of CIELAB. Default: icc-d50."
)
@click.option(
    "--white-luminance",
    type=NUMBER,
    metavar="CD_M2",
    help="Luminance of that white. Default: that of the chart's white, or of the display.",
)
@click.option(
    "--luminance",
    type=click.Choice(["absolute", "mean_ratio", "least_squares"]),
    help="Compare luminances as they are, or times one factor for all. Default: absolute.",
)
@click.option(
    "--register",
    "registering",
    type=click.Choice(["auto", "none", "corners"]),
    default="auto",
    show_default=True,
    help="Registration: find shift and rotation, keep the pixels, or match four corners.",
)
@click.option("--photo-corners", nargs=4, metavar="X,Y X,Y X,Y X,Y", help="Four corners in PHOTO, in pixels.")
@click.option(
    "--rendering-corners", nargs=4, metavar="X,Y X,Y X,Y X,Y", help="The same four corners in RENDERING, in pixels."
)
@click.option(
    "--limit",
    type=POSITIVE,
    metavar="ΔE00",
    help="Largest ΔE00 that counts as equal. Default: 1.4.",
)
@click.option(
    "--measures",
    multiple=True,
    metavar="NAMES",
    help="Measures to report beside the verdict, such as flip,pu-ssim, or all; docs/measures.md lists them.",
)
@click.option("-o", "--output", metavar="OUT.html", help="HTML page to write.")
@click.option(
    "--experiment",
    "experiment_name",
    metavar="NAME",
    help="Also write experiments/NAME.yaml, an experiment that asks observers.",
)
@threads_option
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
@click.pass_context
def command(context: click.Context, /, photo: str, rendering: str, as_json: bool, **options: Any) -> None:
    """Compare a rendering with a photograph, and report whether it is validated.

    PHOTO and RENDERING are OpenEXR or TIFF of XYZ or of camera RGB, raw photographs, spectral pictures, or, with
    --colour-space and --picture-white, pictures such as PNG and JPEG. They are brought to one grid, and compared by
    regions, pixel by pixel, as the eye resolves them at the viewing distance, and by their sparkles.

    Exit status: 0 validated, 1 not validated or undecided, 2 the input was wrong, and nothing was written.
    """
    import json
    import sys
    import tempfile
    from pathlib import Path

    from documents import WorkError
    from documents.files import writing
    from runner.cli.output import progress_bar, work_done
    from runner.reports.comparison.report import report_comparison

    if options["experiment_name"] is not None and not options["rig"]:
        raise click.UsageError("--experiment needs --rig RIG.yaml: an experiment is run on one")
    compare_options = _compare_options(options)
    temporary, elsewhere = Path(tempfile.gettempdir()), "name another folder in the environment variable TMPDIR"
    with writing(temporary, "temporary files", WorkError, elsewhere=elsewhere), progress_bar(as_json) as step:
        report = report_comparison(
            Path(photo),
            Path(rendering),
            Path(options["regions"]),
            compare_options,
            page=Path(options["output"]) if options["output"] else None,
            experiment=options["experiment_name"],
            rig=Path(options["rig"]) if options["rig"] else None,
            progress=step,
            settings={key: value for key, value in options.items() if value not in (None, False, ())},
        )
    if as_json:
        click.echo(json.dumps(report.to_json() | work_done(), indent=2, allow_nan=False))
    else:
        click.echo("\n".join(report.lines()))
    sys.stdout.flush()
    context.exit(0 if report.validated else 1)


def _corners(
    photo: tuple[str, ...], rendering: tuple[str, ...], registering: str
) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    import numpy as np

    if bool(photo) != bool(rendering):
        raise click.UsageError("--photo-corners and --rendering-corners go together")
    if photo and registering != "corners":
        raise click.UsageError("corners go with --register corners")
    if not photo:
        return None
    return np.array([_pair(text) for text in photo]), np.array([_pair(text) for text in rendering])


def _pair(text: str) -> tuple[float, float]:
    try:
        x, y = several(text, ",")
        if not (abs(x) <= _MOST_PX and abs(y) <= _MOST_PX):  # nor NaN
            raise ValueError(text)
    except ValueError:
        raise click.UsageError(f"a corner is '{text}'; write four as 120,90 620,130 590,455 95,410") from None
    return x, y


def _compare_options(options: dict[str, Any]) -> CompareOptions:
    """Return the options of the comparison, of camera, rig and display files that are read for it."""
    from pathlib import Path

    from devices.camera import parse_exposure, read_camera
    from devices.colour_matching import DEFAULT_OBSERVER
    from stimuli.comparison import CompareOptions, ReadOptions
    from stimuli.pictures import Decoding
    from stimuli.spectral import Illumination

    corners_px = _corners(options["photo_corners"], options["rendering_corners"], options["registering"])
    viewing = _viewing(options)
    if (options["sensitivities"] is None) != (options["full_scale"] is None):
        raise click.UsageError("--sensitivities and --full-scale go together")
    if (options["colour_space"] is None) != (options["picture_white"] is None):
        raise click.UsageError("--colour-space and --picture-white go together, such as srgb and 100")
    reading = ReadOptions(
        camera=read_camera(Path(options["camera"])) if options["camera"] else None,
        exposure=parse_exposure(options["exposure"]) if options["exposure"] else None,
        assume_linear=options["linear"],
        sensitivities=Path(options["sensitivities"]) if options["sensitivities"] else None,
        full_scale_cd_m2=options["full_scale"],
        light=Illumination(options["illuminant"], options["illuminant_luminance"]),
        quantity=options["quantity"],
        observer=options["observer"] or DEFAULT_OBSERVER,
        decoding=(
            None
            if options["colour_space"] is None
            else Decoding(options["colour_space"], options["picture_white"], negative="clip")
        ),
    )
    return CompareOptions(
        reading=reading,
        photo_holds=options["photo_holds"],
        rendering_holds=options["rendering_holds"],
        viewing=viewing,
        register=options["registering"],
        corners_px=corners_px,
        white=options["white"],
        white_luminance_cd_m2=options["white_luminance"],
        luminance=options["luminance"],
        delta_e_limit=options["limit"],
        measures=options["measures"],
    )


def _viewing(options: dict[str, Any]) -> ViewingConditions | None:
    from pathlib import Path

    from runner.presenter.surfaces.screens import primary_monitor
    from stimuli.measures import ViewingConditions

    display, rig, distance_mm = options["display"], options["rig"], options["distance_mm"]
    if display and rig:
        raise click.UsageError("--rig names a display already; give one of --display and --rig")
    if display and distance_mm is None:
        raise click.UsageError("--display needs --distance-mm")
    if distance_mm is not None and not (display or rig):
        raise click.UsageError("--distance-mm needs --display or --rig: how large is a pixel?")
    if rig:
        return ViewingConditions.on_rig(Path(rig), distance_mm, primary_monitor)
    return ViewingConditions.on_display(Path(display), distance_mm) if display else None
