"""`cyclopean camera spectral`: pictures of many wavelengths to XYZ, or to what a camera records."""

from __future__ import annotations

import click


@click.command(name="spectral")
@click.argument("file", metavar="FILE")
@click.option("-o", "--output", required=True, metavar="OUT.exr", help="OpenEXR file to write.")
@click.option(
    "--quantity", type=click.Choice(["radiance", "reflectance"]), help="What the values are, where FILE does not say."
)
@click.option("--illuminant", metavar="NAME|LIGHT.csv", help="Light on reflectance: A, D50, D65, E, … or a spectrum.")
@click.option(
    "--white-luminance", "white", type=float, metavar="CD_M2", help="Luminance of a perfect diffuser in that light."
)
@click.option(
    "--scale", type=float, default=1.0, show_default=True, help="Of the values or the light, for other units."
)
@click.option("--sensitivities", metavar="SENSOR.csv", help="wavelength_nm,red,green,blue: camera RGB instead of XYZ.")
@click.option(
    "--full-scale", type=float, metavar="CD_M2", help="Luminance of equal-energy light that just fills the sensor."
)
@click.option("--exposure", metavar="TIME,F,ISO", help="Exposure to keep with the camera RGB, such as 1/15,8,200.")
@click.option(
    "--negative",
    type=click.Choice(["refuse", "clip"]),
    default="refuse",
    show_default=True,
    help="XYZ below 0: refused, or set to 0 and counted.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON instead of a sentence.")
def command(
    file: str,
    output: str,
    quantity: str | None,
    illuminant: str | None,
    white: float | None,
    scale: float,
    sensitivities: str | None,
    full_scale: float | None,
    exposure: str | None,
    negative: str,
    as_json: bool,
) -> None:
    """Turn a spectral picture into XYZ, or into what a camera records.

    FILE is OpenEXR with a channel per wavelength (S0.550nm, T.550nm or 550nm) or ENVI (.hdr). Radiance is in
    W/(sr m² nm). By the CIE 1931 2° observer it becomes absolute XYZ; with --sensitivities, linear camera RGB that can
    be compared with a photograph.
    """
    import json
    from pathlib import Path
    from typing import Literal, cast

    from devices.camera.exposure import parse_exposure
    from documents import Finding, InputError
    from stimuli.develop.linear_files import write_camera_exr
    from stimuli.pictures.exr_write import write_exr
    from stimuli.pictures.stereo_image import StereoImage
    from stimuli.spectral.convert import spectral_to_camera, spectral_to_xyz
    from stimuli.spectral.light import Light
    from stimuli.spectral.picture import Quantity, read_spectral

    if (sensitivities is None) != (full_scale is None):
        raise click.UsageError("--sensitivities and --full-scale go together")
    if exposure and sensitivities is None:
        raise click.UsageError("--exposure goes with --sensitivities: XYZ has none")
    path, place = Path(file), Path(output)
    if place.suffix.lower() != ".exr":
        raise InputError(Finding("the output is no .exr file", output, remedy="name one"))
    if place.exists() and path.exists() and place.samefile(path):
        raise InputError(Finding("the spectral picture would be written over", output, remedy="name another output"))
    light = Light(illuminant, white, scale)
    picture = read_spectral(path, cast("Quantity | None", quantity))
    told = {"file": file, "output": output, "width_px": picture.width_px, "height_px": picture.height_px}
    if sensitivities is not None and full_scale is not None:
        taken = parse_exposure(exposure) if exposure else None
        image = spectral_to_camera(picture, Path(sensitivities), full_scale, light, exposure=taken)
        write_camera_exr(place, image)
        step = dict(image.steps[-1])
        said = "camera RGB, saturated R, G, B " + " ".join(f"{100 * share:.2f} %" for share in image.saturated_share)
    else:
        observed = spectral_to_xyz(picture, light, negative=cast(Literal["refuse", "clip"], negative))
        write_exr(place, StereoImage.flat(observed.xyz))
        step = dict(observed.steps[-1])
        luminance = observed.xyz[..., 1]
        told |= {
            "mean_luminance_cd_m2": float(luminance.mean(dtype=float)),
            "max_luminance_cd_m2": float(luminance.max()),
        }
        said = f"XYZ, mean {told['mean_luminance_cd_m2']:.4g} cd/m², largest {told['max_luminance_cd_m2']:.4g} cd/m²"
    told["steps"] = [step]
    if as_json:
        click.echo(json.dumps(told, indent=2, allow_nan=False, ensure_ascii=False))
        return
    bands = f"{step['bands']} bands over {step['first_nm']:g}..{step['last_nm']:g} nm"
    click.echo(f"{output}: {picture.width_px} × {picture.height_px} pixels of {bands}, {picture.quantity}; {said}.")
    for sentence in picture.said:
        click.echo(f"Note: {sentence}.")
