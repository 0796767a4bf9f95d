"""`kind: pictures`: stimuli from OpenEXR files and from ordinary pictures, such as PNG and JPEG."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from documents import Finding
from documents.yaml import FileModel, NotNegative, Positive
from stimuli.errors import StimulusError
from stimuli.pictures.exr_read import ColourSpace, Decoding, Negative
from stimuli.pictures.own_files import decoders
from stimuli.pictures.packing import Packing
from stimuli.pictures.picture_header import is_ordinary
from stimuli.recipes.files_recipe import FilesRecipe, FileStimulusSpec
from stimuli.recipes.recipe_kind import RecipeFault
from stimuli.recipes.values import MAX_STIMULI, InsideFile, View

if TYPE_CHECKING:
    from stimuli.recipes.view_sources import ViewSource


class LightSpec(FileModel):
    """How numbers in files become light: for all stimuli of a recipe, or for one.

    ``white_luminance_cd_m2`` is the luminance of the value 1, or of the highest code; partly transparent pictures lie
    on a grey of ``alpha_background_cd_m2``.
    """

    colour_space: ColourSpace = "declared"
    """The colour space of the pictures: srgb, display-p3, adobe-rgb, rec2020, icc, declared and so on."""
    white_luminance_cd_m2: Positive | None = None
    """The luminance of 1, or of the highest code, in cd/m²; left out, what an OpenEXR file states, or 1."""
    alpha_background_cd_m2: NotNegative | None = None
    """The luminance of the grey that partly transparent pictures lie on, in cd/m²."""


class PictureSpec(FileStimulusSpec, LightSpec):
    """One picture: ``file``, of one view or both (see ``packing``), or a file for each eye, ``left`` and ``right``.

    ``view`` flat takes the centre view, or ``flat_eye`` where there is none; without ``view`` the picture is shown as
    it is stored.
    """

    file: InsideFile | None = None
    """The picture file, in the recipe's folder or below it."""
    left: InsideFile | None = None
    """The left eye's file."""
    right: InsideFile | None = None
    """The right eye's file."""
    packing: Packing | None = None
    """How one file holds both eyes' views, such as side-by-side."""
    view: View | None = None
    """Whether the picture is shown in stereo or flat."""
    negative: Negative = "refuse"
    """What becomes of negative light: clipped, or refused."""

    @model_validator(mode="after")
    def _has_files(self) -> Self:
        eyes = (self.left is not None, self.right is not None)
        if any(eyes) == (self.file is not None) or any(eyes) != all(eyes):
            raise ValueError("name 'file', or a file for each eye: 'left' and 'right'")
        if len({is_ordinary(Path(file)) for file in self.files.values()}) > 1:
            raise ValueError("'left' and 'right' are of different kinds: both OpenEXR, or neither")
        if self.packing is not None and not (self.file and self.is_ordinary):
            raise ValueError("'packing' says how both eyes lie in one PNG, JPEG, TIFF or WebP; leave it out here")
        return self

    @property
    def files(self) -> dict[str, str]:
        """The files by the key that names them."""
        named = {"file": self.file, "left": self.left, "right": self.right}
        return {key: file for key, file in named.items() if file is not None}

    @property
    def is_ordinary(self) -> bool:
        """Whether it is a PNG, JPEG or the like, whose codes become light; else OpenEXR."""
        return is_ordinary(Path(next(iter(self.files.values()))))

    def stored_view(self) -> View | None:
        """Return the view that the stimulus names itself, or that its files make."""
        return self.view or ("stereo" if self.left else None)


class PicturesRecipe(FilesRecipe, LightSpec):
    """Pictures from files; with ``views``, each in each of them, and with ``series``, each in each."""

    kind: Literal["pictures"]
    """Which kind of entry this is; it decides which other keys there are."""
    stimuli: Annotated[tuple[PictureSpec, ...], Field(min_length=1, max_length=MAX_STIMULI)]
    """The pictures."""

    def specs(self) -> Sequence[PictureSpec]:
        """Return the stimuli as the recipe lists them."""
        return self.stimuli

    def light(self, spec: PictureSpec) -> LightSpec:
        """Return how a stimulus's numbers become light: as it says, else as the recipe does."""
        keys = LightSpec.model_fields
        return LightSpec(**{key: getattr(spec if key in spec.model_fields_set else self, key) for key in keys})

    def own_key(self, spec: FileStimulusSpec) -> dict[str, Any]:
        """Return the values of one stimulus that its pictures depend on."""
        assert isinstance(spec, PictureSpec)
        used = {"decoders": decoders()} if spec.is_ordinary else {}
        return super().own_key(spec) | self.light(spec).model_dump(mode="json") | used

    def decoder_facts(self) -> dict[str, Any]:
        """Return the versions of the libraries that decode its ordinary pictures, if it has any."""
        return {"decoders": decoders()} if any(spec.is_ordinary for spec in self.stimuli) else {}

    def faults(self) -> Iterator[RecipeFault]:
        """Yield names and views that stand twice or meet, too many pictures, and a view that is given twice."""
        yield from super().faults()
        for index, picture in enumerate(self.stimuli):
            if self.views and picture.view:
                message = "'views' already says how each picture is shown"
                yield RecipeFault(("stimuli", index, "view"), message, "keep one of the two")
            flat = "flat" in (self.views or (picture.view,))
            if picture.left and flat and picture.flat_eye is None:
                message = f"there is no centre view for the flat version of '{picture.name}'"
                yield RecipeFault(("stimuli", index, "name"), message, "name an eye as flat_eye: left, or right")
        bright = [spec.name for spec in self.stimuli if spec.is_ordinary and not self._has_white(spec)]
        if bright:
            others = f" and {len(bright) - 1} more" if len(bright) > 1 else ""
            message = f"the luminance of the white of '{bright[0]}'{others} is not given"
            remedy = "write white_luminance_cd_m2: 100 above 'stimuli', or that of your display's white"
            yield RecipeFault(("stimuli",), message, remedy)

    def _has_white(self, spec: PictureSpec) -> bool:
        light = self.light(spec)
        return light.white_luminance_cd_m2 is not None or light.colour_space in ("xyz", "rec709")

    def file_findings(self, folder: Path) -> list[Finding]:
        """Return what the headers of ordinary pictures show to be wrong, without decoding them."""
        from stimuli.pictures.ordinary import check_ordinary
        from stimuli.recipes.view_sources import one_view

        findings: dict[Finding, None] = {}
        for spec in self.stimuli:
            if not spec.is_ordinary:
                continue
            paths = [folder / file for file in spec.files.values()]
            for view in self.views or (spec.view,):
                try:
                    plan = check_ordinary(
                        paths, self._decoding(spec), spec.packing, flat=view == "flat", flat_eye=spec.flat_eye
                    )
                    if view == "stereo" and not plan.is_pair:
                        raise one_view(paths[0])
                except StimulusError as error:
                    findings |= dict.fromkeys(error.findings)
        return list(findings)

    def _decoding(self, spec: PictureSpec) -> Decoding:
        return Decoding(**self.light(spec).model_dump(), negative=spec.negative)

    def source(self, stimulus: int, folder: Path) -> ViewSource:
        """Return the reader of a stimulus's views."""
        from stimuli.recipes.view_sources import FilePerView, MultiViewFile, OrdinaryFiles, exr_reader

        spec = self.stimuli[stimulus]
        decoding = self._decoding(spec)
        if spec.is_ordinary:
            paths = tuple(folder / file for file in spec.files.values())
            return OrdinaryFiles(paths, spec.files, decoding, spec.packing, spec.flat_eye)
        if spec.file is None:
            reader = exr_reader(str(self.observer), decoding)
            return FilePerView({eye: folder / file for eye, file in spec.files.items()}, reader, spec.flat_eye)
        return MultiViewFile(folder / spec.file, spec.file, decoding, spec.flat_eye, str(self.observer))
