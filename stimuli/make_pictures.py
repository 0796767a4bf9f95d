"""Stimuli from OpenEXR files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stimuli.exr.read import read_exr_counted
from stimuli.names import stimulus_name
from stimuli.stereo_image import StereoImage

if TYPE_CHECKING:
    from collections.abc import Callable

    from stimuli.recipe import PicturesRecipe


@dataclass(frozen=True, eq=False, slots=True)
class Made:
    """A stimulus as made: its picture, its factors, and the steps that led to it, for the manifest."""

    name: str
    image: StereoImage
    factors: Mapping[str, str | float]
    steps: tuple[Mapping[str, Any], ...]


def make_pictures(recipe: PicturesRecipe, folder: Path, report: Callable[[str, int, int], None]) -> Iterator[Made]:
    """Yield the recipe's stimuli; the files' paths are relative to ``folder``.

    Raises
    ------
    StimulusError
        If a file cannot be read or holds what must not reach an eye.
    """
    wanted = [(picture, view) for picture in recipe.stimuli for view in recipe.views or (picture.view,)]
    for done, (picture, view) in enumerate(wanted):
        report(f"reading {picture.file}", done, len(wanted))
        reading = read_exr_counted(
            folder / picture.file,
            picture.colour_space,
            flat=view == "flat",
            flat_eye=picture.flat_eye,
            white_luminance_cd_m2=picture.white_luminance_cd_m2,
            negative=picture.negative,
        )
        shown = "flat" if reading.image.is_flat else "stereo"
        name = stimulus_name(picture.name, view if recipe.views else None)
        step = {
            "step": "read",
            **picture.model_dump(mode="json", exclude={"name", "view", "factors"}),
            "views": list(reading.views),
            "clipped_pixels": reading.clipped_pixels,
        }
        yield Made(name, reading.image, {"image": picture.name, "view": shown, **picture.factors}, (step,))
    report("done", len(wanted), len(wanted))
