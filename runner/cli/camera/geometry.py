"""`cyclopean camera geometry`: pixels per millimetre from sensor, lens and distance, and back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import click

from runner.cli.number_types import NUMBER, several

if TYPE_CHECKING:
    from devices.camera import CameraGeometry


@click.command(name="geometry")
@click.option("--sensor-mm", required=True, metavar="WxH", help="Width and height of the sensor, such as 36x24.")
@click.option("--pixels", required=True, metavar="WxH", help="Columns and rows of its picture, such as 7360x4912.")
@click.option("--focal-mm", type=NUMBER, help="Focal length of the lens.")
@click.option("--distance-mm", type=NUMBER, help="Distance from the plane that is photographed to the lens.")
@click.option("--px-per-mm", type=NUMBER, help="Pixels that a millimetre of the plane is to have.")
@click.option(
    "--distance-from",
    "origin",
    type=click.Choice(["lens", "sensor"]),
    default="lens",
    show_default=True,
    help="Where the distance ends: at the lens, or at the sensor, where cameras have the mark ⊖.",
)
@click.option(
    "--lens",
    type=click.Choice(["thin", "pinhole"]),
    default="thin",
    show_default=True,
    help="thin: focused on the plane. pinhole: as if focused at infinity, as the thesis calculates.",
)
@click.option("--size-mm", metavar="WxH", help="Size of a sample, such as 150x100; its pixels are printed as well.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    sensor_mm: str,
    pixels: str,
    focal_mm: float | None,
    distance_mm: float | None,
    px_per_mm: float | None,
    origin: Literal["lens", "sensor"],
    lens: Literal["thin", "pinhole"],
    size_mm: str | None,
    as_json: bool,
) -> None:
    """Pixels per millimetre from sensor, lens and distance, and back.

    Give two of --focal-mm, --distance-mm and --px-per-mm; the third follows. The camera looks straight at a plane.
    """
    import json

    from devices.camera import CameraGeometry

    if sum(value is not None for value in (focal_mm, distance_mm, px_per_mm)) != 2:
        raise click.UsageError("give two of --focal-mm, --distance-mm and --px-per-mm; the third follows")
    sensor = _size(sensor_mm, "--sensor-mm", "36x24")
    columns, rows = _size(pixels, "--pixels", "7360x4912")
    if columns != int(columns) or rows != int(rows):
        raise click.UsageError(f"--pixels is '{pixels}'; pixels are whole, such as 7360x4912")
    grid = (int(columns), int(rows))
    sample = _size(size_mm, "--size-mm", "150x100") if size_mm else None
    if px_per_mm is not None:
        found = CameraGeometry.at_resolution(
            sensor, grid, px_per_mm, focal_mm=focal_mm, distance_mm=distance_mm, origin=origin, lens=lens
        )
    else:
        assert focal_mm is not None
        assert distance_mm is not None
        found = CameraGeometry(sensor, grid, focal_mm, distance_mm, origin, lens)
    in_px = found.size_in_px(sample) if sample else None
    if as_json:
        extra = {"sample_mm": list(sample), "sample_px": list(in_px)} if sample and in_px else {}
        click.echo(json.dumps(found.to_json() | extra, indent=2, allow_nan=False))
        return
    _print(found)
    if sample and in_px:
        click.echo(f"A sample of {sample[0]:g} × {sample[1]:g} mm: {in_px[0]:.0f} × {in_px[1]:.0f} pixels")


def _print(found: CameraGeometry) -> None:
    across, down = found.pixels_per_mm
    width, height = found.field_mm
    angles = found.field_of_view_deg
    rows = (
        ("Resolution", f"{across:.4g} pixels per mm across, {down:.4g} down"),
        ("One pixel", f"{found.pixel_um[0]:.1f} × {found.pixel_um[1]:.1f} µm of the plane"),
        ("Picture", f"{width:.1f} × {height:.1f} mm of the plane"),
        ("Field of view", f"{angles[0]:.1f}° × {angles[1]:.1f}°, {angles[2]:.1f}° along the diagonal"),
        ("Lens", f"{found.focal_mm:.4g} mm, {found.lens_distance_mm:.1f} mm from the plane"),
        ("Plane to sensor", f"{found.lens_distance_mm + found.image_distance_mm:.1f} mm"),
        ("Magnification", f"{found.magnification:.4g}"),
        ("As seen from the lens", f"{found.pixels_per_degree:.1f} pixels per degree"),
    )
    for name, words in rows:
        click.echo(f"{name}: {words}")


def _size(text: str, option: str, example: str) -> tuple[float, float]:
    try:
        width, height = several(text.lower().replace("×", "x"), "x")
    except ValueError:
        raise click.UsageError(f"{option} is '{text}'; write width and height as {example}") from None
    return width, height
