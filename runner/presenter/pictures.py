"""Pictures as framebuffers of device codes: decoded, uploaded and transformed once, and kept within a budget."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np

from devices.display_file import Eye, EyeModels
from documents import Finding
from runner.presenter.colour_pass import ColourPass, release_codes
from runner.presenter.counters import Work
from runner.presenter.errors import PresentationError
from runner.presenter.least_recent import LeastRecent
from stimuli.stereo_image import StereoImage

EYES: tuple[Eye, Eye] = ("left", "right")
BYTES_PER_PIXEL = 4  # 8-bit codes, four components


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


class Pictures:
    """Pictures by the name that ``load`` knows them by."""

    def __init__(
        self,
        context: moderngl.Context,
        models: EyeModels,
        load: Callable[[str], StereoImage],
        work: Work,
        budget_bytes: int,
        squeeze: tuple[int, int] = (1, 1),
    ) -> None:
        self._context = context
        self._load = load
        self._work = work
        left = ColourPass(context, models.left, squeeze)
        self._passes: Mapping[Eye, ColourPass] = {
            "left": left,
            "right": left if models.right is models.left else ColourPass(context, models.right, squeeze),
        }
        self._held: LeastRecent[str, PictureCodes] = LeastRecent(budget_bytes, lambda: work.add(evictions=1))

    def codes(self, stimulus: str, keep: Collection[str] = ()) -> PictureCodes:
        """Return the codes of ``stimulus``, made if they are not held; those in ``keep`` are not let go for it.

        Raises
        ------
        PresentationError
            If a view holds NaN or infinity, or is larger than the driver's largest texture.
        """
        codes = self._held.get(stimulus, lambda: self._make(stimulus))
        self._held.trim({stimulus, *keep})
        return codes

    def release(self) -> None:
        """Free everything."""
        self._held.clear()
        for colour_pass in set(self._passes.values()):
            colour_pass.release()

    def _make(self, stimulus: str) -> PictureCodes:
        image = self._load(stimulus)
        self._work.add(decodes=1)
        self._check(stimulus, image)
        made: dict[tuple[int, int], moderngl.Framebuffer] = {}
        for view in [image.left] if image.is_flat else [image.left, image.right]:
            uploaded = self._upload(view)
            try:
                for eye in EYES:
                    key = id(view), id(self._passes[eye])
                    if image.eye(eye) is view and key not in made:
                        made[key] = self._passes[eye].run(uploaded)
                        self._work.add(colour_passes=1, pixels_shaded=uploaded.width * uploaded.height)
            finally:
                uploaded.release()
        left, right = (made[id(image.eye(eye)), id(self._passes[eye])] for eye in EYES)
        return PictureCodes(left, right)

    def _upload(self, view: np.ndarray[Any, np.dtype[Any]]) -> moderngl.Texture:
        half = view.dtype == np.float16
        data = np.ascontiguousarray(view, dtype=np.float16 if half else np.float32)
        height, width, _ = data.shape
        texture = self._context.texture((width, height), 3, data, alignment=1, dtype="f2" if half else "f4")
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._work.add(uploads=1, bytes_uploaded=data.nbytes)
        return texture

    def _check(self, stimulus: str, image: StereoImage) -> None:
        limit = int(self._context.info["GL_MAX_TEXTURE_SIZE"])
        if max(image.width_px, image.height_px) > limit:
            raise PresentationError(
                Finding(
                    f"'{stimulus}' is {image.width_px} × {image.height_px} px; this driver's textures end at {limit}",
                    remedy="crop the picture to what the display can show",
                )
            )
        for eye in EYES:
            bad = int(np.count_nonzero(~np.isfinite(image.eye(eye)).all(axis=2)))
            if bad:
                raise PresentationError(
                    Finding(f"'{stimulus}', {eye} view: {bad} pixels are NaN or infinite", remedy="build it again")
                )
            if image.is_flat:
                break
