"""`cyclopean camera develop`: photographs to linear light."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from pathlib import Path


@click.command(name="develop")
@click.argument("photos", metavar="PHOTO...", nargs=-1, required=True)
@click.option("-o", "--output", required=True, metavar="OUT.exr|FOLDER", help="OpenEXR file, or folder, to write.")
@click.option("--camera", metavar="CAMERA.yaml", help="Camera file of `camera fit`; without it: camera RGB.")
@click.option("--exposure", metavar="TIME,F,ISO", help="Such as 1/15,8,200.  [the file's own]")
@click.option(
    "--demosaic",
    type=click.Choice(["superpixel", "bilinear", "malvar", "vng", "ppg", "ahd"]),
    default="malvar",
    show_default=True,
    help="superpixel interpolates nothing, at half the size.",
)
@click.option("--black", type=float, metavar="CODE", help="Black level.  [the file's own]")
@click.option("--white", type=float, metavar="CODE", help="Full scale.  [the file's own]")
@click.option("--saturated", type=float, metavar="CODE", help="From where a photosite is full.  [white]")
@click.option("--as-stored", is_flag=True, help="Do not turn the picture upright.")
@click.option("--linear", is_flag=True, help="Take a TIFF or OpenEXR as linear camera RGB whatever it declares.")
@click.option(
    "--negative",
    type=click.Choice(["clip", "refuse"]),
    default="clip",
    show_default=True,
    help="XYZ below 0, as noise about black gives: set to 0 and counted, or refused.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON instead of a table.")
def command(
    photos: tuple[str, ...],
    output: str,
    camera: str | None,
    exposure: str | None,
    demosaic: str,
    black: float | None,
    white: float | None,
    saturated: float | None,
    as_stored: bool,
    linear: bool,
    negative: str,
    as_json: bool,
) -> None:
    """Turn photographs into pictures of linear light.

    PHOTO is a raw file of a camera with a Bayer filter, or a TIFF or OpenEXR file of linear camera RGB. Black is
    subtracted and colours are interpolated; no white balance, curve or clipping is applied. With --camera the result
    is absolute XYZ in cd/m²; without it, camera RGB in shares of full scale. The steps go into a .steps.json beside it.

    A photograph that cannot be developed is named, the others are written all the same, and the exit status is 2.
    """
    import json
    from pathlib import Path
    from typing import cast

    from devices.camera.camera_file import read_camera
    from devices.camera.exposure import parse_exposure
    from documents import Finding, InputError
    from runner.cli.progress import progress_bar
    from stimuli.develop.levels import Levels
    from stimuli.develop.photograph import Choices, develop_photograph
    from stimuli.develop.read_raw import Demosaic
    from stimuli.develop.to_xyz import Negative

    choices = Choices(
        camera=read_camera(Path(camera)) if camera else None,
        demosaic=cast(Demosaic, demosaic),
        levels=Levels(black, white, saturated),
        rotate=not as_stored,
        exposure=parse_exposure(exposure) if exposure else None,
        assume_linear=linear,
        negative=cast(Negative, negative),
    )
    places = _places([Path(photo) for photo in photos], Path(output), output.endswith("/"))
    told: list[dict[str, Any]] = []
    wrong: list[Finding] = []
    with progress_bar(as_json or len(places) == 1) as step:
        for done, (photo, place) in enumerate(places.items()):
            step("Developing", done, len(places))
            try:
                told.append(develop_photograph(photo, place, choices))
            except InputError as error:
                wrong += [one if one.file else _of(one, photo) for one in error.findings]
        step("Developing", len(places), len(places))
    if as_json:
        click.echo(json.dumps(told, indent=2, allow_nan=False, ensure_ascii=False))
    elif told:
        _tell(told)
    if wrong:
        raise InputError(wrong)


def _places(photos: list[Path], output: Path, is_folder: bool) -> dict[Path, Path]:
    """Return where each photograph goes, refusing what would be written over."""
    from documents import Finding, InputError

    if len(set(photos)) < len(photos):
        raise InputError(Finding("a photograph is named twice", remedy="name it once"))
    if not (output.is_dir() or is_folder or len(photos) > 1):
        if output.suffix.lower() != ".exr":
            raise InputError(Finding("the output is no .exr file", str(output), remedy="name one, or a folder"))
        places = {photos[0]: output}
    else:
        if output.suffix.lower() == ".exr" and not output.is_dir():
            raise InputError(
                Finding(f"{len(photos)} photographs do not go into one file", str(output), remedy="name a folder")
            )
        try:
            output.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(Finding(f"the folder cannot be made: {error.strerror}", str(output))) from error
        places = {photo: output / f"{photo.stem}.exr" for photo in photos}
    written: dict[str, Path] = {}
    for photo, place in places.items():
        if place.exists() and any(place.resolve() == other.resolve() for other in photos):
            raise InputError(Finding("the photograph would be written over", str(place), remedy="name another output"))
        twin = written.setdefault(place.name.casefold(), photo)
        if twin is not photo:
            raise InputError(
                Finding(f"it would be written to the same file as {twin}", str(photo), remedy="rename one")
            )
    return places


def _of(finding: Any, photo: Path) -> Any:
    from dataclasses import replace

    return replace(finding, file=str(photo))


def _tell(told: list[dict[str, Any]]) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    has_xyz = told[0]["holds"] == "XYZ"
    title = "Saturated pixels of R, G, B"
    if has_xyz:
        title += "; luminance in cd/m²; pixels outside the camera's safe zone; pixels below 0, set to 0"
    table = Table(title=title, title_justify="left", box=None, pad_edge=False)
    for name in ("photograph", "size", "exposure", "saturated %") + (
        ("mean", "max", "unsafe %", "< 0") if has_xyz else ()
    ):
        is_name = name == "photograph"
        table.add_column(name, justify="left" if is_name else "right", no_wrap=not is_name, overflow="fold")
    for one in told:
        cells = [
            f"{one['width_px']}×{one['height_px']}",
            _exposure(one["exposure"]),
            " ".join(f"{100 * share:.3g}" for share in one["saturated_share"]),
        ]
        if has_xyz:
            outside = (one["below_safe_pixels"] + one["above_safe_pixels"]) / (one["width_px"] * one["height_px"])
            cells += [
                f"{one['mean_luminance_cd_m2']:.4g}",
                f"{one['max_luminance_cd_m2']:.4g}",
                "–" if one["safe_luminance_cd_m2"] is None else f"{100 * outside:.3g}",
                str(one["negative_pixels_set_to_0"]),
            ]
        table.add_row(Text(one["photo"]), *cells)
    Console(highlight=False).print(table)
    for one in told:
        for sentence in one["said"]:
            click.echo(f"Note: {one['photo']}: {sentence}.")
        if one.get("exposure_was_characterised") is False:
            click.echo(f"Note: {one['photo']}: the camera file was not tried at this exposure.")


def _exposure(told: dict[str, float] | None) -> str:
    if told is None:
        return "not known"
    time = f"{told['time_s']:.3g}" if told["time_s"] >= 0.3 else f"1/{1 / told['time_s']:.4g}"
    return f"{time} f/{told['f_number']:g} {told['iso']:g}"
