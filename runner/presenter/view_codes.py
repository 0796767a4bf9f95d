"""From a picture's views to the codes that each eye is shown, a band of rows at a step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, TypeAlias

import moderngl

from devices.display.display_file import Eye, EyeModels
from runner.presenter.bands import InBands
from runner.presenter.code_pass import release_codes
from runner.presenter.colour_pass import ColourPass
from runner.presenter.counters import Work
from runner.presenter.decoder import EYES
from runner.presenter.depth import Bits
from runner.presenter.dithering import Dithering
from runner.presenter.mixed_pass import MixedPass
from runner.presenter.modes.mixture import Mixture
from runner.presenter.uploading import Upload
from stimuli.pictures.stereo_image import StereoImage, XYZImage

BYTES_PER_PIXEL = 4  # RGBA8 or RGB10_A2


@dataclass(frozen=True, slots=True)
class PictureCodes:
    """Each eye's codes of one picture; the same framebuffer where the codes are the same."""

    left: moderngl.Framebuffer
    right: moderngl.Framebuffer

    def eye(self, eye: Eye) -> moderngl.Framebuffer:
        """Return ``eye``'s framebuffer, bottom row first."""
        return self.left if eye == "left" else self.right

    @property
    def framebuffers(self) -> tuple[moderngl.Framebuffer, ...]:
        """The framebuffers, each once."""
        return (self.left,) if self.left is self.right else (self.left, self.right)

    @property
    def size_bytes(self) -> int:
        """Bytes held on the graphics card."""
        return sum(BYTES_PER_PIXEL * codes.width * codes.height for codes in self.framebuffers)

    def release(self) -> None:
        """Free the framebuffers."""
        for codes in self.framebuffers:
            release_codes(codes)


Making: TypeAlias = InBands[PictureCodes]


class ViewCodes(Protocol):
    """A way to make the codes of a picture."""

    def make(self, image: StereoImage, upload: Upload, band_px: int | None = None) -> Making:
        """Upload and transform the views, pausing after each band of about ``band_px`` pixels and each view."""

    def release(self) -> None:
        """Free the programs."""


class CodesPerEye:
    """Each eye's view through the display model of that eye, as codes of ``bits``."""

    def __init__(
        self,
        context: moderngl.Context,
        models: EyeModels,
        squeeze: tuple[int, int],
        work: Work,
        dithering: Dithering | None = None,
        bits: Bits = 8,
    ) -> None:
        left = ColourPass(context, models.left, squeeze, dithering, "left", bits)
        same = models.right is models.left and not (dithering is not None and dithering.differs_by_eye)
        right = left if same else ColourPass(context, models.right, squeeze, dithering, "right", bits)
        self._passes = {"left": left, "right": right}
        self._work = work

    def make(self, image: StereoImage, upload: Upload, band_px: int | None = None) -> Making:
        """Upload and transform one view after the other; a flat picture is one upload."""
        made: dict[tuple[int, int], moderngl.Framebuffer] = {}
        try:
            for number, view in enumerate([image.left] if image.is_flat else [image.left, image.right]):
                if number:
                    yield
                yield from self._add(view, image, upload, band_px, made)
        except BaseException:
            for codes in made.values():
                release_codes(codes)
            raise
        left, right = (made[id(image.eye(eye)), id(self._passes[eye])] for eye in EYES)
        return PictureCodes(left, right)

    def release(self) -> None:
        """Free the programs."""
        for colour_pass in set(self._passes.values()):
            colour_pass.release()

    def _add(
        self,
        view: XYZImage,
        image: StereoImage,
        upload: Upload,
        band_px: int | None,
        made: dict[tuple[int, int], moderngl.Framebuffer],
    ) -> InBands[None]:
        """Upload ``view`` and add its codes for each eye that sees it to ``made``, by view and colour pass."""
        uploaded = yield from upload(view)
        try:
            for eye in EYES:
                key = id(view), id(self._passes[eye])
                if image.eye(eye) is view and key not in made:
                    yield
                    made[key] = yield from self._passes[eye].running(uploaded, band_px=band_px)
                    self._work.add(colour_passes=1, pixels_shaded=uploaded.width * uploaded.height)
        finally:
            uploaded.release()


class MixedCodes:
    """Both views in one picture of codes of ``bits``."""

    def __init__(
        self,
        context: moderngl.Context,
        mixture: Mixture,
        work: Work,
        dithering: Dithering | None = None,
        bits: Bits = 8,
    ) -> None:
        self._pass = MixedPass(context, mixture, dithering, bits)
        self._work = work

    def make(self, image: StereoImage, upload: Upload, band_px: int | None = None) -> Making:
        """Upload one view after the other, then transform both."""
        left = yield from upload(image.left)
        right = left
        try:
            yield
            if not image.is_flat:
                right = yield from upload(image.right)
                yield
            codes = yield from self._pass.running(left, right, band_px=band_px)
            self._work.add(colour_passes=1, pixels_shaded=left.width * left.height)
        finally:
            left.release()
            if right is not left:
                right.release()
        return PictureCodes(codes, codes)

    def release(self) -> None:
        """Free the program."""
        self._pass.release()
