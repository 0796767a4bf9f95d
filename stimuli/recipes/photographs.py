"""`kind: photographs`: files of each view, the camera that took them, and the steps until they are shown."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from devices.camera import ExposureSpec
from documents import Finding, InputError
from documents.files import tidy
from documents.tables import ENDINGS
from documents.yaml import Path_
from stimuli.errors import StimulusError
from stimuli.recipes.build_context import BuildContext
from stimuli.recipes.files_recipe import FilesRecipe, FileStimulusSpec
from stimuli.recipes.recipe_kind import RecipeFault
from stimuli.recipes.values import MAX_STIMULI, DevelopSpec, InsideFile, SpectralSpec, View, relative_path

if TYPE_CHECKING:
    from devices.camera import CameraModel
    from stimuli.recipes.view_sources import ViewReader, ViewSource

VIEW_KEYS = ("left", "right", "center")


class CameraExposureSpec(ExposureSpec):
    """The exposure of a photograph, in place of that in its file."""


class PhotographSpec(FileStimulusSpec):
    """One stimulus: a file for each view, or ``file``, an OpenEXR file of several views in XYZ.

    ``exposure`` takes the place of the files' metadata.
    """

    left: InsideFile | None = None
    """The left eye's file."""
    right: InsideFile | None = None
    """The right eye's file."""
    center: InsideFile | None = None
    """The file of the view in the middle."""
    file: InsideFile | None = None
    """The picture file, in the recipe's folder or below it."""
    exposure: CameraExposureSpec | None = None
    """The exposure, where the file does not hold it."""

    @model_validator(mode="after")
    def _has_files(self) -> Self:
        views = [key for key in VIEW_KEYS if getattr(self, key) is not None]
        if bool(views) == (self.file is not None):
            raise ValueError("give a file for each view (left, right, center), or 'file', one of several views")
        if self.file is not None and self.exposure is not None:
            raise ValueError("'file' holds XYZ, which has no exposure")
        return self

    @property
    def files(self) -> dict[str, str]:
        """The files by the key that names them."""
        named = {key: getattr(self, key) for key in (*VIEW_KEYS, "file")}
        return {key: file for key, file in named.items() if file is not None}

    def stored_view(self) -> View | None:
        """Return stereo where left and right are named; of ``file`` it is not known before it is read."""
        if self.file is not None:
            return None
        return "stereo" if self.left and self.right else "flat"

    def missing(self, view: View | None) -> str | None:
        """Return the key of a file that ``view`` needs and that is not named; 'flat_eye' where an eye must be."""
        if self.file is not None:
            return None
        if view == "flat":
            if self.center is not None:
                return None
            return "flat_eye" if self.flat_eye is None else (None if getattr(self, self.flat_eye) else self.flat_eye)
        if view is None and self.center is not None and not (self.left or self.right):
            return None
        return next((eye for eye in ("left", "right") if getattr(self, eye) is None), None)


class PhotographsRecipe(FilesRecipe):
    """Photographs developed to XYZ.

    With ``camera`` the files are raw, or linear camera RGB; with ``spectral`` they are spectral pictures; without
    either, OpenEXR pictures of one view that declare their colours. With ``series`` each stimulus is made in each.
    """

    kind: Literal["photographs"]
    """Which kind of entry this is; it decides which other keys there are."""
    camera: Annotated[str, AfterValidator(relative_path)] | None = None
    """The camera file, relative to the recipe."""
    develop: DevelopSpec | None = None
    """How raw files become linear camera RGB."""
    spectral: SpectralSpec | None = None
    """What spectral pictures hold, and their light."""
    stimuli: Annotated[tuple[PhotographSpec, ...], Field(min_length=1, max_length=MAX_STIMULI)]
    """The photographs."""

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if self.camera is not None and self.spectral is not None:
            raise ValueError("'camera' and 'spectral' do not go together: spectra need no camera")
        if self.develop is not None and self.camera is None:
            raise ValueError("'develop' needs a 'camera' file, which makes XYZ of what is developed")
        if self.camera is None and any(stimulus.exposure is not None for stimulus in self.stimuli):
            raise ValueError("an 'exposure' needs a 'camera' file, whose XYZ it scales")
        return self

    def specs(self) -> Sequence[PhotographSpec]:
        """Return the stimuli as the recipe lists them."""
        return self.stimuli

    def shared_files(self) -> dict[str, Path_]:
        """Return the camera file and the illuminant's, with their places in the recipe."""
        files: dict[str, Path_] = {}
        if self.camera is not None:
            files[self.camera] = ("camera",)
        if self.spectral is not None and (self.spectral.illuminant or "").lower().endswith(ENDINGS):
            files[str(self.spectral.illuminant)] = ("spectral", "illuminant")
        return files

    def may_lie_outside(self) -> frozenset[str]:
        """Return the camera file."""
        return frozenset() if self.camera is None else frozenset({self.camera})

    def shared_key(self, context: BuildContext) -> dict[str, Any]:
        """Return the values that all pictures depend on: those for reading the files included."""
        develop = self.model_dump(mode="json", include={"kind", "develop", "spectral"})
        files = [context.file_hashes[file] for file in self.shared_files()]
        return {**super().shared_key(context), **develop, "files": files}

    def faults(self) -> Iterator[RecipeFault]:
        """Yield names and views that stand twice or meet, and stimuli without a view that they are shown in."""
        yield from super().faults()
        for index, spec in enumerate(self.stimuli):
            place = ("stimuli", index, "name")
            missing = [key for view in self.views or (None,) if (key := spec.missing(view))]
            for key in missing:
                if key == "flat_eye":
                    yield RecipeFault(
                        place,
                        f"there is no centre view for the flat version of '{spec.name}'",
                        "name an eye as flat_eye, or the file of the view center",
                    )
                else:
                    other = "right" if key == "left" else "left"
                    remedy = f"name its file, or show the stimulus flat: views: [flat], flat_eye: {other}"
                    yield RecipeFault(place, f"'{spec.name}' has no view '{key}'", remedy)
            steps = spec.steps_over(self)
            eye = spec.missing("stereo")
            if (steps.align or steps.toe_in) and eye and not missing:
                message = f"'{spec.name}' is to be aligned, and has no view '{eye}'"
                yield RecipeFault(place, message, "name left and right: one view alone is not aligned")

    def source(self, stimulus: int, folder: Path) -> ViewSource:
        """Return the reader of a stimulus's views."""
        from stimuli.recipes.view_sources import DECLARED, FilePerView, MultiViewFile

        spec = self.stimuli[stimulus]
        if spec.file is not None:
            return MultiViewFile(folder / spec.file, spec.file, DECLARED, spec.flat_eye, str(self.observer))
        paths = {view: folder / file for view, file in spec.files.items()}
        return FilePerView(paths, self._reader(spec, folder), spec.flat_eye)

    def file_findings(self, folder: Path) -> list[Finding]:
        """Return what is wrong with the camera file: one for another observer than the recipe's, for one."""
        if self.camera is None:
            return []
        try:
            self._camera_of(folder)
        except InputError as error:
            return list(error.findings)
        return []

    def _camera_of(self, folder: Path) -> CameraModel:
        """Return the camera; InputError if its file is wrong or for another observer than the recipe's pictures."""
        from devices.camera import read_camera

        file = tidy(folder / str(self.camera))
        camera = read_camera(file)
        if camera.observer != self.observer:
            what = (
                f"the camera file is for the observer {camera.observer}, and the recipe's pictures for {self.observer}"
            )
            remedy = f"write observer: {camera.observer} in the recipe, or fit the camera to XYZ for {self.observer}"
            raise StimulusError.at(file, what, remedy)
        return camera

    def _reader(self, spec: PhotographSpec, folder: Path) -> ViewReader:
        from stimuli.recipes.view_sources import DECLARED, exr_reader, photograph_reader, spectral_reader

        if self.camera is not None:
            exposure = None if spec.exposure is None else spec.exposure.exposure()
            return photograph_reader(self._camera_of(folder), self.develop or DevelopSpec(), exposure)
        if self.spectral is None:
            return exr_reader(str(self.observer), DECLARED)
        return spectral_reader(self.spectral, folder, str(self.observer))
