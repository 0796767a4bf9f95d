"""`cyclopean camera develop`: photographs to linear light."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from runner.cli.camera.options import developing_options
from runner.cli.threads_option import threads_option

if TYPE_CHECKING:
    from devices.camera import Exposure
    from stimuli.develop import DevelopedPhotograph


@click.command(name="develop")
@click.argument("photos", metavar="PHOTO...", nargs=-1, required=True)
@click.option("-o", "--output", required=True, metavar="OUT.exr|FOLDER", help="OpenEXR file or folder to write.")
@click.option("--camera", metavar="CAMERA.yaml", help="Camera file written by `camera fit`. Default: keep camera RGB.")
@click.option("--exposure", metavar="TIME,F,ISO", help="Exposure, such as 1/15,8,200. Default: the file's own.")
@developing_options
@threads_option
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    photos: tuple[str, ...],
    output: str,
    camera: str | None,
    exposure: str | None,
    demosaic: str,
    black: float | None,
    white: float | None,
    saturated: float | None,
    dark: tuple[str, ...],
    flat: tuple[str, ...],
    as_stored: bool,
    linear: bool,
    negative: str,
    as_json: bool,
) -> None:
    """Turn photographs into pictures of linear light.

    PHOTO is a raw file of a camera with a Bayer filter, or a TIFF or OpenEXR file of linear camera RGB. Black is
    subtracted and colours are interpolated; no white balance, curve or clipping is applied. With --camera the result
    is absolute XYZ in cd/m²; without it, camera RGB in shares of full scale. The steps go into a .steps.json beside it.

    --dark and --flat are photographs without light, and of an even light, by the same camera: they are applied before
    colours are interpolated.

    A photograph that cannot be developed is reported, the others are written, and the exit status is 2.
    """
    import json
    from pathlib import Path
    from typing import cast

    from devices.camera import parse_exposure, read_camera
    from documents import InputError
    from runner.cli.progress import progress_bar
    from stimuli.develop import Demosaic, DevelopOptions, Levels, Negative, develop_photographs

    options = DevelopOptions(
        camera=read_camera(Path(camera)) if camera else None,
        demosaic=cast(Demosaic, demosaic),
        levels=Levels(black, white, saturated),
        rotate=not as_stored,
        exposure=parse_exposure(exposure) if exposure else None,
        assume_linear=linear,
        negative=cast(Negative, negative),
        dark=tuple(Path(frame) for frame in dark),
        flat=tuple(Path(frame) for frame in flat),
    )
    with progress_bar(as_json or len(photos) == 1) as step:
        report = develop_photographs(
            [Path(photo) for photo in photos],
            Path(output),
            options,
            into_folder=output.endswith("/"),
            progress=lambda done, total: step("Developing", done, total),
        )
    if as_json:
        facts = [photograph.to_json() for photograph in report.photographs]
        click.echo(json.dumps(facts, indent=2, allow_nan=False))
    elif report.photographs:
        _print(report.photographs)
    if report.findings:
        raise InputError(report.findings)


def _print(photographs: tuple[DevelopedPhotograph, ...]) -> None:
    from documents.pages import Table, print_blocks

    title = "Saturated pixels of R, G, B"
    has_xyz = photographs[0].luminance is not None
    if has_xyz:
        title += "; luminance in cd/m²; pixels outside the camera's safe zone; pixels below 0, set to 0"
    headings = ("photograph", "size", "exposure", "saturated %", *(("mean", "max", "unsafe %", "< 0") * has_xyz))
    rows = []
    for photograph in photographs:
        cells = [
            photograph.photo,
            f"{photograph.width_px}×{photograph.height_px}",
            _exposure(photograph.exposure),
            " ".join(f"{100 * share:.3g}" for share in photograph.saturated_share),
        ]
        if light := photograph.luminance:
            unsafe = light.below_safe_pixels + light.above_safe_pixels
            percent = 100 * unsafe / (photograph.width_px * photograph.height_px)
            cells += [
                f"{light.mean_cd_m2:.4g}",
                f"{light.max_cd_m2:.4g}",
                "–" if light.safe_cd_m2 is None else f"{percent:.3g}",
                str(light.negative_pixels),
            ]
        rows.append(cells)
    print_blocks([Table.of_texts(title, headings, rows)])
    for photograph in photographs:
        for note in photograph.notes:
            click.echo(f"Note: {photograph.photo}: {note}.")
        if photograph.luminance and photograph.luminance.exposure_was_characterised is False:
            click.echo(f"Note: {photograph.photo}: the camera file was not tested at this exposure.")


def _exposure(exposure: Exposure | None) -> str:
    if exposure is None:
        return "not known"
    time = f"{exposure.time_s:.3g}" if exposure.time_s >= 0.3 else f"1/{1 / exposure.time_s:.4g}"
    return f"{time} f/{exposure.f_number:g} {exposure.iso:g}"
