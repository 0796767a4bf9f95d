"""Each eye's codes where what it is shown depends on the other eye's view, or on where on the panel it stands."""

from __future__ import annotations

from dataclasses import dataclass

import moderngl
import numpy as np

from devices.display.display_file import Eye, EyeModels
from documents import Finding
from runner.presenter.code_pass import release_codes
from runner.presenter.compensated_pass import CORNER, CompensatedPass, Correction
from runner.presenter.counters import Work
from runner.presenter.decoder import EYES
from runner.presenter.depth import Bits
from runner.presenter.dithering import Dithering
from runner.presenter.errors import PresentationError
from runner.presenter.modes.mode import EyeArea, Mode
from runner.presenter.panel_places import PanelPlaces, panel_places
from runner.presenter.placing import squeezed_size
from runner.presenter.rectangle import Size
from runner.presenter.scene import Offset
from runner.presenter.uploading import Upload
from runner.presenter.view_codes import Making, PictureCodes
from stimuli.pictures.stereo_image import StereoImage


@dataclass(frozen=True, eq=False, slots=True)
class PlacedImage(StereoImage):
    """A picture whose codes are for ``offset_px``, how far from the middle of the eyes' views it will be shown."""

    offset_px: Offset = (0, 0)


class CompensatedCodes:
    """Both views to each eye's codes of ``bits``, compensated by ``correction``.

    Where the panel is evened out, a picture must be a `PlacedImage`; the areas are those of the whole panel.

    Raises
    ------
    PresentationError
        If the mode mixes both views into one picture: that mixture says what each eye sees, and nothing else can.
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
        if mode.mixture(models) is not None:
            raise PresentationError(
                Finding(
                    f"the mode '{mode.name}' mixes both views into one picture, which the pass cannot compensate",
                    remedy="compensate the pictures before they are shown",
                )
            )
        gain_map = correction.gain_map
        self._areas: tuple[EyeArea, ...] = () if gain_map is None else mode.areas(gain_map.resolution_px)
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

    def make(self, image: StereoImage, upload: Upload, band_px: int | None = None) -> Making:
        """Upload one view after the other, then transform both for each eye; a flat picture is one upload.

        It is one pass too, where nothing tells the eyes apart.
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
            places = self._places(image)
            alike = image.is_flat and self._same_passes and places["left"] == places["right"]
            for eye in EYES[:1] if alike else EYES:
                if made:
                    yield
                own, other = uploaded[eye], uploaded["right" if eye == "left" else "left"]
                made.append((yield from self._passes[eye].running(own, other, places[eye], band_px=band_px)))
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

    def _places(self, image: StereoImage) -> dict[Eye, PanelPlaces]:
        """Return where each eye's codes stand; anywhere, if it does not matter."""
        if not self._areas:
            return {"left": CORNER, "right": CORNER}
        if not isinstance(image, PlacedImage):
            raise PresentationError("an uneven panel was to be evened out for a picture that has no place on it")
        size_px: Size = squeezed_size((image.width_px, image.height_px), self._squeeze)
        return {eye: panel_places(self._areas, eye, size_px, image.offset_px) for eye in EYES}
