"""`cyclopean camera bracket`: exposures of one scene to one picture of linear light."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from runner.cli.camera.options import developing_options
from runner.cli.number_types import several

if TYPE_CHECKING:
    from stimuli.bracket import BracketReport, NoiseModel


@click.command(name="bracket")
@click.argument("photos", metavar="PHOTO...", nargs=-1, required=True)
@click.option("-o", "--output", required=True, metavar="OUT.exr", help="OpenEXR file to write.")
@click.option("--camera", metavar="CAMERA.yaml", help="Camera file written by `camera fit`. Default: keep camera RGB.")
@click.option(
    "--exposure",
    "exposures",
    multiple=True,
    metavar="TIME,F,ISO",
    help="Exposure, such as 1/15,8,200: once for each photograph, in their order. Default: the files' own.",
)
@click.option(
    "--ratios",
    type=click.Choice(["measured", "stated"]),
    default="measured",
    show_default=True,
    help="Ratios of the exposures: as the photographs show them, or as their times say.",
)
@click.option(
    "--reference",
    metavar="PHOTO",
    help="Photograph whose exposure sets the level. Default: one at the camera file's exposure, else the middle one.",
)
@click.option(
    "--ghosts",
    type=click.Choice(["refuse", "keep-reference"]),
    default="refuse",
    show_default=True,
    help="Where something moved: refuse the bracket, or use the reference photograph alone there.",
)
@click.option(
    "--noise",
    metavar="FULL,READ",
    help="Electrons at full scale and of read noise, such as 45000,3. Default: estimated from the photographs.",
)
@developing_options
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    photos: tuple[str, ...],
    output: str,
    camera: str | None,
    exposures: tuple[str, ...],
    ratios: str,
    reference: str | None,
    ghosts: str,
    noise: str | None,
    dark: tuple[str, ...],
    flat: tuple[str, ...],
    demosaic: str,
    black: float | None,
    white: float | None,
    saturated: float | None,
    as_stored: bool,
    linear: bool,
    negative: str,
    as_json: bool,
) -> None:
    """Merge photographs of one scene at several exposures into one picture.

    PHOTO are raw files, or TIFF or OpenEXR files of linear camera RGB, from a camera that did not move, at one f-number
    and ISO. Each photosite is the mean of the exposures that are not full there, weighed by the sensor's noise. The
    exposures are compared with one another: other scenes, a changed light and moving objects are found.

    The result is as of `camera develop`: absolute XYZ with --camera, else camera RGB. The steps go into a .steps.json.
    """
    import json
    from pathlib import Path
    from typing import cast

    from devices.camera import parse_exposure, read_camera
    from runner.cli.progress import progress_bar
    from stimuli.bracket import BracketOptions, bracket_photographs
    from stimuli.develop import Demosaic, DevelopOptions, Levels, Negative

    options = BracketOptions(
        develop=DevelopOptions(
            camera=read_camera(Path(camera)) if camera else None,
            demosaic=cast(Demosaic, demosaic),
            levels=Levels(black, white, saturated),
            rotate=not as_stored,
            assume_linear=linear,
            negative=cast(Negative, negative),
            dark=tuple(Path(frame) for frame in dark),
            flat=tuple(Path(frame) for frame in flat),
        ),
        exposures=tuple(parse_exposure(exposure) for exposure in exposures),
        noise=_noise(noise) if noise is not None else None,
        ghosts="keep-reference" if ghosts == "keep-reference" else "refuse",
        reference=Path(reference) if reference else None,
        ratios="stated" if ratios == "stated" else "measured",
    )
    with progress_bar(as_json) as step:
        report = bracket_photographs(
            [Path(photo) for photo in photos],
            Path(output),
            options,
            progress=lambda done, total: step("Reading", done, total),
        )
    if as_json:
        click.echo(json.dumps(report.to_json(), indent=2, allow_nan=False))
    else:
        _print(report)


def _noise(text: str) -> NoiseModel:
    from stimuli.bracket import NoiseModel

    try:
        full, read = several(text, ",")
    except ValueError:
        raise click.UsageError(
            f"--noise is '{text}'; write electrons at full scale and of read noise: 45000,3"
        ) from None
    return NoiseModel.of_electrons(full, read)


def _print(report: BracketReport) -> None:
    from documents.pages import Table, print_blocks

    rows = []
    for photograph in report.merge["photographs"]:
        time_s, error = photograph["exposure"]["time_s"], photograph["standard_error"]
        measured = f"{photograph['measured_relative_exposure']:.4g}"
        time = f"{time_s:.3g} s" if time_s >= 0.3 else f"1/{1 / time_s:.4g} s"
        told = "unchecked" if error is None else f"{measured} ± {error:.1g}" if error else measured
        rows.append((photograph["file"], time, f"{photograph['stated_relative_exposure']:.4g}", told))
    headings = ("photograph", "time", "stated", "measured")
    print_blocks([Table.of_texts("Exposures beside the shortest", headings, rows)])
    for colour in ("red", "green", "blue"):
        noise, error = report.merge["noise"][colour], report.merge["relative_standard_error"][colour]
        if noise and noise["full_scale_electrons"] and error:
            click.echo(
                f"Noise in {colour}: {noise['full_scale_electrons']:.0f} electrons at full scale, "
                f"{noise['read_noise_electrons']:.2g} of read noise; standard error {100 * error['median']:.2g} % "
                f"(median), {100 * error['p95']:.2g} % (95th percentile)"
            )
    if light := report.developed.luminance:
        click.echo(f"Luminance: mean {light.mean_cd_m2:.4g}, max {light.max_cd_m2:.4g} cd/m²")
    for note in report.notes:
        click.echo(f"Note: {note}.")
    click.echo(f"Written: {report.developed.output}, {report.developed.width_px}×{report.developed.height_px}")
