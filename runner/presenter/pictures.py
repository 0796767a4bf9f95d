"""Pictures as framebuffers of device codes: decoded, uploaded and transformed once, and kept within a budget."""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import moderngl
import numpy as np

from devices.display_file import Eye, EyeModels
from runner.presenter.colour_pass import ColourPass, release_codes
from runner.presenter.counters import Work
from runner.presenter.decoder import EYES, Decoder
from runner.presenter.least_recent import LeastRecent
from stimuli.stereo_image import StereoImage

Making: TypeAlias = Generator[None, None, "PictureCodes"]
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
    """Pictures by the name that ``load`` knows them by.

    They are decoded in a thread of their own once ``start`` has named them, which calls ``decoded`` after each;
    uploading and the colour pass belong to the context's thread, one view at each ``step``.
    """

    def __init__(
        self,
        context: moderngl.Context,
        models: EyeModels,
        load: Callable[[str], StereoImage],
        work: Work,
        budget_bytes: int,
        squeeze: tuple[int, int] = (1, 1),
        decoded: Callable[[], None] = lambda: None,
    ) -> None:
        self._context = context
        self._work = work
        self._decoder = Decoder(load, int(context.info["GL_MAX_TEXTURE_SIZE"]), decoded)
        left = ColourPass(context, models.left, squeeze)
        self._passes: Mapping[Eye, ColourPass] = {
            "left": left,
            "right": left if models.right is models.left else ColourPass(context, models.right, squeeze),
        }
        self._held: LeastRecent[str, PictureCodes] = LeastRecent(budget_bytes, lambda: work.add(evictions=1))
        self._making: tuple[str, Making] | None = None

    def codes(self, stimulus: str, keep: Collection[str] = ()) -> PictureCodes:
        """Return the codes of ``stimulus``, made if they are not held; those in ``keep`` are not let go for it.

        Raises
        ------
        PresentationError
            If a view holds NaN or infinity, or is larger than the driver's largest texture.
        """
        codes = self._held.get(stimulus, lambda: self._finish(stimulus))
        self._held.trim({stimulus, *keep})
        return codes

    def start(self, stimuli: Collection[str]) -> None:
        """Begin to decode those of ``stimuli`` that are not held."""
        making = self._making[0] if self._making else None
        self._decoder.start([name for name in stimuli if name not in self._held and name != making])

    def step(self, keep: Collection[str] = ()) -> bool:
        """Upload and transform one view of a picture that is decoded; return whether there is more to do."""
        if self._making is None:
            name = self._decoder.ready()
            if name is None:
                return False
            self._making = name, self._make(self._decoder.take(name))
        name, making = self._making
        try:
            next(making)
        except StopIteration as made:
            self._making = None
            codes: PictureCodes = made.value
            self._held.get(name, lambda: codes)
            self._held.trim({name, *keep})
        except BaseException:
            self._making = None
            raise
        return self._making is not None or self._decoder.ready() is not None

    def release(self) -> None:
        """Free everything, once the thread has ended."""
        self._decoder.close()
        if self._making is not None:
            self._making[1].close()
            self._making = None
        self._held.clear()
        for colour_pass in set(self._passes.values()):
            colour_pass.release()

    def _finish(self, stimulus: str) -> PictureCodes:
        """Make the codes of ``stimulus`` to the end, from wherever they are."""
        if self._making is not None and self._making[0] == stimulus:
            making = self._making[1]
            self._making = None
        else:
            making = self._make(self._decoder.take(stimulus))
        while True:
            try:
                next(making)
            except StopIteration as made:
                return made.value  # type: ignore[no-any-return]

    def _make(self, image: StereoImage) -> Making:
        """Upload and transform a view at each step."""
        self._work.add(decodes=1)
        made: dict[tuple[int, int], moderngl.Framebuffer] = {}
        try:
            for number, view in enumerate([image.left] if image.is_flat else [image.left, image.right]):
                if number:
                    yield
                self._add_view(view, image, made)
        except BaseException:
            for codes in made.values():
                release_codes(codes)
            raise
        left, right = (made[id(image.eye(eye)), id(self._passes[eye])] for eye in EYES)
        return PictureCodes(left, right)

    def _add_view(
        self,
        view: np.ndarray[Any, np.dtype[Any]],
        image: StereoImage,
        made: dict[tuple[int, int], moderngl.Framebuffer],
    ) -> None:
        """Upload ``view`` and add its codes for each eye that sees it to ``made``, by view and colour pass."""
        uploaded = self._upload(view)
        try:
            for eye in EYES:
                key = id(view), id(self._passes[eye])
                if image.eye(eye) is view and key not in made:
                    made[key] = self._passes[eye].run(uploaded)
                    self._work.add(colour_passes=1, pixels_shaded=uploaded.width * uploaded.height)
        finally:
            uploaded.release()

    def _upload(self, view: np.ndarray[Any, np.dtype[Any]]) -> moderngl.Texture:
        half = view.dtype == np.float16
        data = np.ascontiguousarray(view, dtype=np.float16 if half else np.float32)
        height, width, _ = data.shape
        texture = self._context.texture((width, height), 3, data, alignment=1, dtype="f2" if half else "f4")
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._work.add(uploads=1, bytes_uploaded=data.nbytes)
        return texture
