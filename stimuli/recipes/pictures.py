"""`kind: pictures`: stimuli from OpenEXR files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, PositiveFloat

from stimuli.pictures.exr_read import ColourSpace, Negative
from stimuli.pictures.stereo_image import View
from stimuli.recipes.from_files import FilesRecipe, FileStimulusSpec
from stimuli.recipes.recipe_kind import Fault
from stimuli.recipes.values import MAX_STIMULI, InsideFile

if TYPE_CHECKING:
    from stimuli.recipes.view_sources import Source


class PictureSpec(FileStimulusSpec):
    """One picture from an OpenEXR file.

    ``view`` flat takes the centre view, or ``flat_eye`` where there is none; without ``view`` the picture is shown as
    it is stored.
    """

    file: InsideFile
    view: View | None = None
    colour_space: ColourSpace = "declared"
    white_luminance_cd_m2: PositiveFloat | None = None
    negative: Negative = "refuse"

    @property
    def files(self) -> dict[str, str]:
        """The files by the key that names them."""
        return {"file": self.file}

    def stored_view(self) -> View | None:
        """Return the view that the stimulus names itself."""
        return self.view


class PicturesRecipe(FilesRecipe):
    """Pictures from OpenEXR files; with ``views``, each in each of them, and with ``series``, each in each."""

    kind: Literal["pictures"]
    stimuli: Annotated[tuple[PictureSpec, ...], Field(min_length=1, max_length=MAX_STIMULI)]

    def specs(self) -> Sequence[PictureSpec]:
        """Return the stimuli as the recipe says them."""
        return self.stimuli

    def faults(self) -> Iterator[Fault]:
        """Yield names and views that stand twice or meet, too many pictures, and a view that is said twice."""
        yield from super().faults()
        for index, picture in enumerate(self.stimuli):
            if self.views and picture.view:
                message = "'views' already says how each picture is shown"
                yield Fault(("stimuli", index, "view"), message, "keep one of the two")

    def source(self, stimulus: int, folder: Path) -> Source:
        """Return what reads the views of a stimulus."""
        from stimuli.recipes.view_sources import OneFile

        spec = self.stimuli[stimulus]
        return OneFile(
            folder / spec.file, spec.file, spec.flat_eye, spec.colour_space, spec.white_luminance_cd_m2, spec.negative
        )
