"""Pictures as framebuffers of device codes: decoded, uploaded and transformed once, and kept within a budget."""

from __future__ import annotations

from collections.abc import Callable, Collection

import moderngl
import numpy as np

from runner.presenter.counters import Work
from runner.presenter.decoder import Decoder
from runner.presenter.least_recent import LeastRecent
from runner.presenter.view_codes import Making, PictureCodes, ViewCodes
from stimuli.stereo_image import StereoImage, XYZImage


class Pictures:
    """Pictures by the name that ``load`` knows them by.

    They are decoded in a thread of their own once ``start`` has named them, which calls ``decoded`` after each;
    uploading and the colour pass belong to the context's thread, one view at each ``step``.
    """

    def __init__(
        self,
        context: moderngl.Context,
        views: ViewCodes,
        load: Callable[[str], StereoImage],
        work: Work,
        budget_bytes: int,
        decoded: Callable[[], None] = lambda: None,
    ) -> None:
        self._context = context
        self._work = work
        self._decoder = Decoder(load, int(context.info["GL_MAX_TEXTURE_SIZE"]), decoded)
        self._views = views
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
        self._views.release()

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
        self._work.add(decodes=1)
        return self._views.make(image, self._upload)

    def _upload(self, view: XYZImage) -> moderngl.Texture:
        half = view.dtype == np.float16
        data = np.ascontiguousarray(view, dtype=np.float16 if half else np.float32)
        height, width, _ = data.shape
        texture = self._context.texture((width, height), 3, data, alignment=1, dtype="f2" if half else "f4")
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._work.add(uploads=1, bytes_uploaded=data.nbytes)
        return texture
