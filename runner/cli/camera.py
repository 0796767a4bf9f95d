"""`cyclopean camera`: characterise a camera, and develop its photographs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from devices.camera import GeometryOptions
from runner.cli.main import LazyGroup
from runner.cli.options import PATH, takes, threads
from runner.cli.output import Step, gives
from stimuli.bracket import BracketOptions
from stimuli.chart import ChartOptions
from stimuli.develop import DevelopOptions
from stimuli.spectral import SpectralOptions

COMMANDS = {
    "fit": "Fit a camera model to a photographed colour chart.",
    "develop": "Turn photographs into pictures of linear light.",
    "geometry": "Pixels per millimetre from sensor, lens and distance, and back.",
    "bracket": "Merge exposures of one scene into one picture of linear light.",
    "spectral": "Turn a spectral picture into XYZ, or into what a camera records.",
}
_photos = click.argument("photos", metavar="PHOTO...", nargs=-1, required=True, type=PATH)
_one_picture = click.option("-o", "--output", required=True, metavar="OUT.exr", help="OpenEXR file to write.")


@click.group(cls=LazyGroup, name="camera", package=__name__, commands_help=COMMANDS)
def camera_command() -> None:
    """Fit a camera to a colour chart, develop its photographs, and plan how finely it sees."""


@click.command(name="fit")
@click.argument("charts", metavar="CHART.csv|PHOTO...", nargs=-1, required=True, type=PATH)
@takes(ChartOptions)
@click.option("-o", "--output", type=PATH, metavar="CAMERA.yaml", help="Camera file to write.")
@click.option("--replace", is_flag=True, help="Overwrite an existing camera file.")
@click.option("--report", "page", type=PATH, metavar="PAGE.html", help="HTML page to write.")
@gives()
def fit_command(charts: tuple[Path, ...], options: ChartOptions, **written: Any) -> Any:
    """Fit a camera model to a photographed colour chart.

    CHART.csv holds what camera and instrument saw: R,G,B,X,Y,Z[,name]. Or give a PHOTO of a 24-patch ColorChecker, raw
    or linear TIFF or OpenEXR, with --reference (or, less exactly, --white); its patches are then found, read and, if
    the chart lies upside down, turned.

    Several PHOTOs are fitted to together: those of one chart at one exposure as repeated shots, by their mean.

    Every patch is judged by the fit to all others. Saturated patches, and those that do not belong to the rest, are
    left out and named.
    """
    from runner.reports.camera import characterise_camera

    return characterise_camera(charts, options, **written)


@click.command(name="develop")
@_photos
@click.option("-o", "--output", required=True, metavar="OUT.exr|FOLDER", help="OpenEXR file or folder to write.")
@takes(DevelopOptions)
@threads
@gives()
def develop_command(photos: tuple[Path, ...], output: str, options: DevelopOptions, step: Step) -> Any:
    """Turn photographs into pictures of linear light.

    PHOTO is a raw file of a camera with a Bayer filter, or a TIFF or OpenEXR file of linear camera RGB. Black is
    subtracted and colours are interpolated; no white balance, curve or clipping is applied. With --camera the result
    is absolute XYZ in cd/m²; without it, camera RGB in shares of full scale. The steps go into a .steps.json beside it.

    --dark and --flat are photographs without light, and of an even light, by the same camera: they are applied before
    colours are interpolated.

    A photograph that cannot be developed is reported, the others are written, and the exit status is 2.
    """
    from stimuli.develop import develop_photographs

    return develop_photographs(photos, output, options, progress=step)


@click.command(name="geometry")
@takes(GeometryOptions)
@gives()
def geometry_command(options: GeometryOptions) -> Any:
    """Pixels per millimetre from sensor, lens and distance, and back.

    Give two of --focal-mm, --distance-mm and --px-per-mm; the third follows. The camera looks straight at a plane.
    """
    from devices.camera import plan_geometry

    return plan_geometry(options)


@click.command(name="bracket")
@_photos
@_one_picture
@takes(BracketOptions, leave_out={"exposure"})
@gives()
def bracket_command(photos: tuple[Path, ...], output: str, options: BracketOptions, step: Step) -> Any:
    """Merge photographs of one scene at several exposures into one picture.

    PHOTO are raw files, or TIFF or OpenEXR files of linear camera RGB, from a camera that did not move, at one f-number
    and ISO. Each photosite is the mean of the exposures that are not full there, weighed by the sensor's noise. The
    exposures are compared with one another: other scenes, a changed light and moving objects are found.

    The result is as of `camera develop`: absolute XYZ with --camera, else camera RGB. The steps go into a .steps.json.
    """
    from stimuli.bracket import bracket_photographs

    return bracket_photographs(photos, output, options, progress=step)


@click.command(name="spectral")
@click.argument("file", metavar="FILE")
@_one_picture
@takes(SpectralOptions)
@gives()
def spectral_command(file: str, output: str, options: SpectralOptions) -> Any:
    """Turn a spectral picture into XYZ, or into what a camera records.

    FILE is OpenEXR with a channel per wavelength (S0.550nm, T.550nm or 550nm) or ENVI (.hdr). Radiance is in
    W/(sr m² nm). By the --observer's functions it becomes absolute XYZ; with --sensitivities, linear camera RGB that
    can be compared with a photograph.
    """
    from stimuli.spectral import convert_spectral

    return convert_spectral(file, output, options)
