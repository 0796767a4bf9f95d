"""Pictures as framebuffers of device codes: decoded, uploaded and transformed once, and kept within a budget."""

from __future__ import annotations

from collections.abc import Callable, Collection
from functools import partial

import moderngl

from runner.presenter.bands import BAND_PX, to_the_end
from runner.presenter.counters import Work
from runner.presenter.decoder import Decoder
from runner.presenter.least_recent import LeastRecent
from runner.presenter.uploading import upload
from runner.presenter.view_codes import Making, PictureCodes, ViewCodes
from stimuli.pictures.stereo_image import StereoImage


class Pictures:
    """Pictures by the name that ``load`` knows them by.

    They are decoded in a thread of their own once ``start`` has named them, which calls ``decoded`` after each;
    uploading and the colour pass belong to the context's thread, one band of rows of a view at each ``step``.
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
        """Upload or transform one band of a picture that is decoded; return whether there is more to do.

        The step ends when the graphics card is done with the band. Drivers put work off: without that, all the bands
        would be paid for by the next frame.
        """
        if self._making is None:
            name = self._decoder.ready()
            if name is None:
                return False
            self._making = name, self._make(self._decoder.take(name), BAND_PX)
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
        self._context.finish()
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
        return to_the_end(making)

    def _make(self, image: StereoImage, band_px: int | None = None) -> Making:
        self._work.add(decodes=1)
        return self._views.make(image, partial(upload, self._context, self._work, band_px=band_px), band_px)
