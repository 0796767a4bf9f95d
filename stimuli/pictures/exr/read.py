"""From an OpenEXR file to a picture for two eyes."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from documents import Finding
from stimuli.errors import StimulusError
from stimuli.pictures.exr.region import Region
from stimuli.pictures.exr.to_xyz import ColourSpace, Negative, view_to_xyz
from stimuli.pictures.exr.views import read_views
from stimuli.pictures.stereo_image import Eye, StereoImage


@dataclass(frozen=True, slots=True)
class Reading:
    """A picture, the views it was made of (left then right, or one), and how many pixels were clipped at 0.

    ``centre`` says whether the file has a view that is neither eye's, used or not.
    """

    image: StereoImage
    views: tuple[str, ...]
    clipped_pixels: int
    centre: bool


def read_exr(
    path: Path,
    colour_space: ColourSpace | None = None,
    *,
    flat: bool = False,
    flat_eye: Eye | None = None,
    white_luminance_cd_m2: float | None = None,
    negative: Negative = "refuse",
    region: Region | None = None,
) -> StereoImage:
    """Return the picture in the OpenEXR file at ``path``, in absolute XYZ (cd/m²).

    With a left and a right view it is a stereo picture; with only a centre or unnamed view, a flat one. With
    ``flat`` it is the flat version: the centre view, or the view of ``flat_eye`` where the file has no centre.
    ``colour_space``, ``white_luminance_cd_m2`` and ``negative``: see `stimuli.pictures.exr.to_xyz.view_to_xyz`.
    With ``region``, only that part of the picture is read, checked and returned.

    Raises
    ------
    StimulusError
        If the file cannot be read, lacks a view, or holds what must not reach an eye: each names file and view.
    """
    return read_exr_counted(
        path,
        colour_space,
        flat=flat,
        flat_eye=flat_eye,
        white_luminance_cd_m2=white_luminance_cd_m2,
        negative=negative,
        region=region,
    ).image


def read_exr_counted(
    path: Path,
    colour_space: ColourSpace | None = None,
    *,
    flat: bool = False,
    flat_eye: Eye | None = None,
    white_luminance_cd_m2: float | None = None,
    negative: Negative = "refuse",
    region: Region | None = None,
) -> Reading:
    """Return what `read_exr` returns, with the views used and the pixels clipped."""
    path = Path(path)
    views = read_views(path, region)
    names = _chosen(tuple(views), path, flat, flat_eye)
    windows = {name: views[name].data_window_px for name in names}
    if len({window[2:] for window in windows.values()}) > 1 or len({views[name].size_px for name in names}) > 1:
        sizes = ", ".join(f"'{name}' is {width} × {height}" for name, (_, _, width, height) in windows.items())
        raise StimulusError(Finding(f"the views differ in size: {sizes}", str(path), remedy="crop them alike"))
    converted = [
        view_to_xyz(
            views[name],
            str(path),
            colour_space,
            white_luminance_cd_m2=white_luminance_cd_m2,
            negative=negative,
        )
        for name in names
    ]
    images = [xyz for xyz, _ in converted]
    clipped = sum(pixels for _, pixels in converted)
    return Reading(StereoImage(images[0], images[-1]), names, clipped, _middle(views) is not None)


def _middle(names: Collection[str]) -> str | None:
    """Return the view that is neither eye's."""
    return next((name for name in ("center", "") if name in names), None)


def _chosen(names: tuple[str, ...], path: Path, flat: bool, flat_eye: Eye | None) -> tuple[str, ...]:
    """Return the view names to show: left and right, or one for a flat picture."""
    middle = _middle(names)
    eyes = [eye for eye in ("left", "right") if eye in names]
    if not flat and len(eyes) == 2:
        return "left", "right"
    if not flat and len(eyes) == 1:
        missing = "right" if eyes == ["left"] else "left"
        raise StimulusError(
            Finding(f"the view '{eyes[0]}' has no '{missing}' beside it", str(path), remedy="add it, or ask for flat")
        )
    if middle is not None:
        return (middle,)
    if flat and flat_eye in eyes:
        return (str(flat_eye),)
    found = ", ".join(f"'{name}'" for name in names)
    if flat and eyes:
        raise StimulusError(
            Finding(f"there is no centre view for the flat version, only {found}", str(path), remedy="name an eye")
        )
    raise StimulusError(
        Finding(f"there are only the views {found}", str(path), remedy="expected left and right, or center")
    )
