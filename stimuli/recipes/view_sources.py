"""Where views come from: an OpenEXR file of several views, or a file for each, photographed, spectral or in XYZ."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from devices.camera import CameraModel, Exposure
from devices.colour_matching import DEFAULT_OBSERVER
from documents import Finding, InputError
from documents.tables import ENDINGS
from stimuli.errors import StimulusError
from stimuli.pictures.coded import CodedPicture
from stimuli.pictures.exr_read import Decoding, read_exr_counted, refuse_other_observer
from stimuli.pictures.ordinary import read_ordinary
from stimuli.pictures.packing import Packing
from stimuli.pictures.picture_header import is_ordinary
from stimuli.pictures.stereo_image import Eye, StereoImage, XYZImage
from stimuli.recipes.values import DevelopSpec, SpectralSpec, Step
from stimuli.recipes.values import View as Shown

if TYPE_CHECKING:
    from stimuli.recipes.banded_picture import BandedPicture

DECLARED = Decoding("declared")


@dataclass(frozen=True, eq=False, slots=True)
class StoredPicture:
    """A picture as it was read; ``centre`` is true if there is a centre view; a flat picture is then that view.

    It is held in XYZ, or as the codes of its file where these are all of it; ``exact`` is true if its single precision
    is to be kept where no step changes it.
    """

    held: StereoImage | CodedPicture
    steps: tuple[Step, ...]
    centre: bool
    exact: bool = False

    @property
    def image(self) -> StereoImage:
        """The picture in XYZ; of codes it is made at each call."""
        return self.held.image() if isinstance(self.held, CodedPicture) else self.held


class ViewSource(Protocol):
    """A reader of a stimulus's views."""

    def stored(self) -> StoredPicture:
        """Read the picture as it is stored."""

    def stereo(self) -> StoredPicture:
        """Read left and right."""

    def flat(self) -> StoredPicture:
        """Read the centre view, or the eye that stands for it."""


@dataclass(frozen=True, slots=True)
class MultiViewFile:
    """An OpenEXR file of one view or several, in XYZ or any RGB that it declares."""

    path: Path
    name: str
    decoding: Decoding
    flat_eye: Eye | None = None
    observer: str = DEFAULT_OBSERVER

    def stored(self) -> StoredPicture:
        """Read the picture as it is stored."""
        return self._read(flat=False)

    def stereo(self) -> StoredPicture:
        """Read left and right."""
        read = self._read(flat=False)
        if read.image.is_flat:
            raise StimulusError.at(self.path, "the picture has one view", "stereo needs the views left and right")
        return read

    def flat(self) -> StoredPicture:
        """Read the centre view, or the eye that stands for it."""
        return self._read(flat=True)

    def banded(self, view: Shown | None) -> tuple[BandedPicture, Step] | None:
        """Return the picture to be read and written some rows at a time, and the step; None if it is to be read whole.

        ``view`` is stereo, flat, or as it is stored.
        """
        from stimuli.recipes.banded_picture import BandedPicture

        picture = BandedPicture.of(
            self.path, self.decoding, flat=view == "flat", flat_eye=self.flat_eye, observer=self.observer
        )
        if picture is None or (view == "stereo" and picture.is_flat):
            return None
        return picture, self._step(tuple(view.name for view in picture.views), 0)

    def _read(self, *, flat: bool) -> StoredPicture:
        reading = read_exr_counted(self.path, self.decoding, flat=flat, flat_eye=self.flat_eye)
        refuse_other_observer(self.path, reading.observer, self.observer)
        step = self._step(reading.views, reading.clipped_pixels)
        return StoredPicture(reading.image, (step,), reading.centre, exact=reading.exact)

    def _step(self, views: tuple[str, ...], clipped_pixels: int) -> Step:
        step = {
            "step": "read",
            "file": self.name,
            "flat_eye": self.flat_eye,
            "colour_space": self.decoding.colour_space,
            "white_luminance_cd_m2": self.decoding.white_luminance_cd_m2,
            "negative": self.decoding.negative,
            "views": list(views),
            "clipped_pixels": clipped_pixels,
        }
        return step if self.observer == DEFAULT_OBSERVER else {**step, "observer": self.observer}


@dataclass(frozen=True, slots=True)
class OrdinaryFiles:
    """A PNG, JPEG, TIFF, WebP, MPO or JPS, or one for each eye; ``names`` are those that the recipe gives them."""

    paths: tuple[Path, ...]
    names: Mapping[str, str]
    decoding: Decoding
    packing: Packing | None = None
    flat_eye: Eye | None = None

    def stored(self) -> StoredPicture:
        """Read the picture as it is stored."""
        return self._read(flat=False)

    def stereo(self) -> StoredPicture:
        """Read left and right."""
        read = self._read(flat=False)
        if read.held.is_flat:
            raise one_view(self.paths[0])
        return read

    def flat(self) -> StoredPicture:
        """Read the picture of both eyes, or of the eye that stands for it."""
        return self._read(flat=True)

    def _read(self, *, flat: bool) -> StoredPicture:
        read = read_ordinary(self.paths, self.decoding, self.packing, flat=flat, flat_eye=self.flat_eye)
        step = {
            "step": "read",
            **self.names,
            "flat_eye": self.flat_eye,
            "colour_space": read.colour_space,
            "white_luminance_cd_m2": read.white_luminance_cd_m2,
            "bits": read.bits,
            "packing": read.packing,
            "alpha_background_cd_m2": self.decoding.alpha_background_cd_m2,
            "negative": self.decoding.negative,
            "views": list(read.views),
            "clipped_pixels": read.clipped_pixels,
        }
        return StoredPicture(read.held, (step,), read.views == ("center",), exact=True)


def one_view(path: Path) -> StimulusError:
    """Return the error that a picture of one view is to be shown in stereo."""
    message = "the picture has one view, and stereo needs the views left and right"
    remedy = "name a file for each eye (left:, right:), or say how both lie in it: packing: side-by-side"
    return StimulusError.at(path, message, remedy)


class ViewReader(Protocol):
    """A reader of one view's file, which returns XYZ and the steps."""

    def __call__(self, path: Path) -> tuple[XYZImage, tuple[Step, ...]]:
        """Return XYZ in cd/m², float32 (height, width, 3), and the steps that led to it."""


def photograph_reader(camera: CameraModel, develop: DevelopSpec, exposure: Exposure | None) -> ViewReader:
    """Return the reader of a photograph: raw, or linear camera RGB."""
    return partial(_photograph, camera=camera, develop=develop, exposure=exposure)


def spectral_reader(spectral: SpectralSpec, folder: Path, observer: str) -> ViewReader:
    """Return the reader of a spectral picture; a CSV of the illuminant lies in or below ``folder``."""
    return partial(_spectral, spectral=spectral, folder=folder, observer=observer)


def _photograph(
    path: Path, *, camera: CameraModel, develop: DevelopSpec, exposure: Exposure | None
) -> tuple[XYZImage, tuple[Step, ...]]:
    from stimuli.develop.camera_to_xyz import to_xyz
    from stimuli.develop.levels import Levels
    from stimuli.develop.read import read_camera_image

    image = read_camera_image(
        path,
        demosaic=develop.demosaic,
        levels=Levels(develop.black, develop.white, develop.saturated),
        rotate=develop.rotate,
        exposure=exposure,
        assume_linear=develop.assume_linear,
    )
    developed = to_xyz(image, camera, negative=develop.negative)
    return developed.xyz, developed.steps


def _spectral(path: Path, *, spectral: SpectralSpec, folder: Path, observer: str) -> tuple[XYZImage, tuple[Step, ...]]:
    from stimuli.spectral.bands import read_spectral
    from stimuli.spectral.convert import spectral_to_xyz
    from stimuli.spectral.light import Illumination

    illuminant = spectral.illuminant
    if illuminant is not None and illuminant.lower().endswith(ENDINGS):
        illuminant = str(folder / illuminant)
    light = Illumination(illuminant, spectral.white_luminance_cd_m2, spectral.scale)
    read = read_spectral(path, spectral.quantity)
    observed = spectral_to_xyz(read, light, negative=spectral.negative, observer=observer)
    # The recipe's own name of the file, not an absolute path.
    steps = tuple(
        {**step, "illuminant": spectral.illuminant} if "illuminant" in step else step for step in observed.steps
    )
    return observed.xyz, steps


def exr_reader(observer: str, decoding: Decoding) -> ViewReader:
    """Return the reader of an OpenEXR picture of one view."""
    return partial(_exr, observer=observer, decoding=decoding)


def _exr(path: Path, *, observer: str, decoding: Decoding) -> tuple[XYZImage, tuple[Step, ...]]:
    if is_ordinary(path):
        message = "this is a developed picture, whose camera is not known, and photographs are raw or spectral"
        remedy = "write kind: pictures in the recipe, with colour_space: srgb and white_luminance_cd_m2: 100"
        raise StimulusError.at(path, message, remedy)
    if path.suffix.lower() != ".exr":
        message = "this is no OpenEXR picture, and the recipe names no camera"
        remedy = "name the file that `cyclopean camera fit` wrote as 'camera:' in the recipe"
        raise StimulusError.at(path, message, remedy)
    read = MultiViewFile(path, path.name, decoding, None, observer).flat()
    return read.image.left, read.steps


@dataclass(frozen=True, slots=True)
class FilePerView:
    """A file for each view: ``paths`` by view, left, right or center."""

    paths: Mapping[str, Path]
    reader: ViewReader
    flat_eye: Eye | None = None

    def stored(self) -> StoredPicture:
        """Read left and right where both are there, else the flat view."""
        return self.stereo() if {"left", "right"} <= self.paths.keys() else self.flat()

    def stereo(self) -> StoredPicture:
        """Read left and right."""
        left, left_steps = self._view("left")
        right, right_steps = self._view("right")
        if left.shape != right.shape:
            sizes = [f"{picture.shape[1]} × {picture.shape[0]}" for picture in (left, right)]
            raise StimulusError(
                Finding(
                    f"the views differ in size: 'left' is {sizes[0]}, 'right' is {sizes[1]}",
                    str(self.paths["right"]),
                    remedy="crop them alike",
                )
            )
        steps = [
            *({**step, "view": "left"} for step in left_steps),
            *({**step, "view": "right"} for step in right_steps),
        ]
        return StoredPicture(StereoImage(left, right), tuple(steps), "center" in self.paths)

    def flat(self) -> StoredPicture:
        """Read the centre view, or the eye that stands for it."""
        view = "center" if "center" in self.paths else str(self.flat_eye)
        xyz, steps = self._view(view)
        return StoredPicture(StereoImage.flat(xyz), tuple({**step, "view": view} for step in steps), view == "center")

    def _view(self, view: str) -> tuple[XYZImage, tuple[Step, ...]]:
        path = self.paths[view]
        try:
            return self.reader(path)
        except InputError as error:
            # Some findings come from a camera model, which knows no photograph.
            raise StimulusError([_of(finding, path) for finding in error.findings]) from error


def _of(finding: Finding, path: Path) -> Finding:
    if finding.file is not None:
        return finding
    return Finding(finding.message, str(path), finding.line, finding.column, finding.remedy)
