"""From a picture's views to the codes that each eye is shown, a band of rows at a step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, TypeAlias

import moderngl
import numpy as np

from devices.compensation import Correction, Mixture, PixelGrid, squeezed_size
from devices.display import EYES, Eye, EyeModels
from runner.presenter.bands import InBands, Upload
from runner.presenter.code_pass import release_codes
from runner.presenter.colour_pass import ColourPass, MixedPass
from runner.presenter.compensated_pass import CORNER, CompensatedPass
from runner.presenter.counters import Work
from runner.presenter.depth import Bits
from runner.presenter.dithering import Dithering
from runner.presenter.modes.mode import Mode
from runner.scene import Offset
from stimuli.pictures import StereoImage, XYZImage

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

    def make(
        self, image: StereoImage, upload: Upload, offset_px: Offset = (0, 0), band_px: int | None = None
    ) -> Making:
        """Upload and transform the views, pausing after each band of about ``band_px`` pixels and each view.

        ``offset_px`` is how far from the middle of the eyes' views the picture will be shown.
        """

    def release(self) -> None:
        """Free the programs."""


def view_codes(
    context: moderngl.Context,
    mode: Mode,
    models: EyeModels,
    mixture: Mixture | None,
    correction: Correction | None,
    work: Work,
    dithering: Dithering | None,
    bits: Bits,
) -> ViewCodes:
    """Return how ``mode`` makes codes: of both views mixed, per eye with ``correction``, or plainly per eye."""
    if mixture is not None:
        return MixedCodes(context, mixture, work, dithering, bits)
    if correction is not None:
        return CompensatedCodes(context, models, mode, correction, work, dithering, bits)
    return CodesPerEye(context, models, mode.areas((2, 2))[0].squeeze, work, dithering, bits)


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

    def make(
        self, image: StereoImage, upload: Upload, offset_px: Offset = (0, 0), band_px: int | None = None
    ) -> Making:
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

    def make(
        self, image: StereoImage, upload: Upload, offset_px: Offset = (0, 0), band_px: int | None = None
    ) -> Making:
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


class CompensatedCodes:
    """Both views to each eye's codes of ``bits``, corrected for where on the panel they are shown.

    The mode gives each eye pixels of its own; the areas are those of the whole panel.
    """

    def __init__(
        self,
        context: moderngl.Context,
        models: EyeModels,
        mode: Mode,
        correction: Correction,
        work: Work,
        dithering: Dithering | None = None,
        bits: Bits = 8,
    ) -> None:
        gain_map = correction.gain_map
        self._views = None if gain_map is None else mode.views(gain_map.resolution_px)
        self._squeeze = mode.areas((2, 2))[0].squeeze
        self._passes = {
            eye: CompensatedPass(context, models, correction, eye, self._squeeze, dithering, bits) for eye in EYES
        }
        leaks = correction.crosstalk
        self._same_passes = (
            models.left is models.right
            and (leaks is None or np.array_equal(leaks.left, leaks.right))
            and not (dithering is not None and dithering.differs_by_eye)
        )
        self._work = work

    def make(
        self, image: StereoImage, upload: Upload, offset_px: Offset = (0, 0), band_px: int | None = None
    ) -> Making:
        """Upload one view after the other, then transform both for each eye; a flat picture is one upload.

        It is one pass too, where nothing differs between the eyes.
        """
        uploaded: dict[Eye, moderngl.Texture] = {}
        made: list[moderngl.Framebuffer] = []
        try:
            uploaded["left"] = yield from upload(image.left)
            yield
            if image.is_flat:
                uploaded["right"] = uploaded["left"]
            else:
                uploaded["right"] = yield from upload(image.right)
                yield
            grids = self._grids(image, offset_px)
            alike = image.is_flat and self._same_passes and grids["left"] == grids["right"]
            for eye in EYES[:1] if alike else EYES:
                if made:
                    yield
                own, other = uploaded[eye], uploaded["right" if eye == "left" else "left"]
                made.append((yield from self._passes[eye].running(own, other, grids[eye], band_px=band_px)))
                self._work.add(colour_passes=1, pixels_shaded=own.width * own.height)
        except BaseException:
            for codes in made:
                release_codes(codes)
            raise
        finally:
            for texture in set(uploaded.values()):
                texture.release()
        return PictureCodes(made[0], made[-1])

    def release(self) -> None:
        """Free the programs."""
        for compensated_pass in self._passes.values():
            compensated_pass.release()

    def _grids(self, image: StereoImage, offset_px: Offset) -> dict[Eye, PixelGrid]:
        """Return where each eye's codes stand; anywhere, if it does not matter."""
        if self._views is None:
            return {"left": CORNER, "right": CORNER}
        size_px = squeezed_size((image.width_px, image.height_px), self._squeeze)
        return {eye: view.code_grid(size_px, offset_px) for eye, view in self._views.items()}
