"""Pictures as framebuffers of device codes: decoded, uploaded and transformed once, and kept within a budget."""

from __future__ import annotations

from collections.abc import Callable, Collection
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from typing import NamedTuple, TypeAlias

import moderngl
import numpy as np

from devices.display import EYES
from documents import Finding
from documents.text import counted
from runner.presenter.bands import BAND_PX, as_uploaded, to_the_end, upload
from runner.presenter.counters import Work
from runner.presenter.errors import PresentationError
from runner.presenter.texture_cache import LruCache
from runner.presenter.view_codes import Making, PictureCodes, ViewCodes
from runner.scene import Offset
from stimuli.pictures import StereoImage


class PictureKey(NamedTuple):
    """Which picture it is, and for which place in the eyes' views, where its codes depend on that."""

    stimulus: str
    offset_px: Offset = (0, 0)


# Changes a picture for the place at which it is shown, an offset from the middle of the eyes' views.
Prepare: TypeAlias = Callable[[StereoImage, Offset], StereoImage]


class Pictures:
    """Pictures by their keys: as ``load`` gives them by name, changed for their place by ``prepare`` if it is given.

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
        *,
        prepare: Prepare | None = None,
        decoded: Callable[[], None] = lambda: None,
    ) -> None:
        self._context = context
        self._work = work
        self._decoder = Decoder(load, int(context.info["GL_MAX_TEXTURE_SIZE"]), decoded, prepare=prepare)
        self._views = views
        self._held: LruCache[PictureKey, PictureCodes] = LruCache(budget_bytes, lambda: work.add(evictions=1))
        self._making: tuple[PictureKey, Making] | None = None

    @property
    def is_decoding(self) -> bool:
        """Whether a picture is being decoded, or waits for that."""
        return self._decoder.is_busy

    def codes(self, key: PictureKey, keep: Collection[PictureKey] = ()) -> PictureCodes:
        """Return the codes of ``key``, made if they are not held; those in ``keep`` are not released for it.

        Raises
        ------
        PresentationError
            If a view holds NaN or infinity, or is larger than the driver's largest texture.
        """
        codes = self._held.get(key, lambda: self._finish(key))
        self._held.trim({key, *keep})
        return codes

    def start(self, keys: Collection[PictureKey]) -> None:
        """Begin to decode those of ``keys`` that are not held."""
        making = self._making[0] if self._making else None
        self._decoder.start([key for key in keys if key not in self._held and key != making])

    def step(self, keep: Collection[PictureKey] = ()) -> bool:
        """Upload or transform one band of a picture that is decoded; return whether there is more to do.

        The step ends when the graphics card is done with the band. Drivers put work off: without that, all the bands
        would be paid for by the next frame.
        """
        if self._making is None:
            key = self._decoder.ready()
            if key is None:
                return False
            self._making = key, self._make(key, BAND_PX)
        key, making = self._making
        try:
            next(making)
        except StopIteration as made:
            self._making = None
            codes: PictureCodes = made.value
            self._held.get(key, lambda: codes)
            self._held.trim({key, *keep})
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

    def _finish(self, key: PictureKey) -> PictureCodes:
        """Finish the codes of ``key``, from the band that is reached."""
        if self._making is not None and self._making[0] == key:
            making = self._making[1]
            self._making = None
        else:
            making = self._make(key)
        return to_the_end(making)

    def _make(self, key: PictureKey, band_px: int | None = None) -> Making:
        image = self._decoder.take(key)
        self._work.add(decodes=1)
        uploading = partial(upload, self._context, self._work, band_px=band_px)
        return self._views.make(image, uploading, key.offset_px, band_px)


class Decoder:
    """Loads pictures by name, checks them and makes them ready to upload, one after another in one thread.

    ``take`` waits for the picture it needs. ``load``, ``prepare`` and the rest run in that thread, and what they raise
    is raised again by ``take``. ``finished`` is called after each picture, from whichever thread. At most the pictures
    of the last ``start`` wait, beside one that was under way.
    """

    def __init__(
        self,
        load: Callable[[str], StereoImage],
        largest_px: int,
        finished: Callable[[], None] = lambda: None,
        *,
        prepare: Prepare | None = None,
    ) -> None:
        self._load = load
        self._prepare = prepare
        self._largest_px = largest_px
        self._finished = finished
        self._thread: ThreadPoolExecutor | None = None
        self._pending: dict[PictureKey, Future[StereoImage]] = {}

    def start(self, keys: Collection[PictureKey]) -> None:
        """Begin to decode ``keys``; what was begun before and is not among them is cancelled."""
        for key in [key for key in self._pending if key not in keys]:
            self._pending.pop(key).cancel()
        for key in keys:
            if key not in self._pending:
                if self._thread is None:
                    self._thread = ThreadPoolExecutor(1, thread_name_prefix="decode")
                self._pending[key] = self._thread.submit(self._decode, key)
                self._pending[key].add_done_callback(self._report)

    @property
    def is_busy(self) -> bool:
        """Whether a picture is being decoded, or waits for that."""
        return any(not future.done() for future in self._pending.values())

    def ready(self) -> PictureKey | None:
        """Return the key of a picture that can be taken without waiting, None if there is none."""
        done = (key for key, future in self._pending.items() if future.done() and not future.exception())
        return next(done, None)

    def take(self, key: PictureKey) -> StereoImage:
        """Return the picture; it is decoded now if its turn had not come.

        Raises
        ------
        InputError
            Of the stimulus's source; PresentationError if a view holds NaN or infinity or is larger than a texture.
        """
        pending = self._pending.pop(key, None)
        return self._decode(key) if pending is None or pending.cancel() else pending.result()

    def close(self) -> None:
        """Cancel what waits, and wait for the decoding in progress."""
        if self._thread is not None:
            self._thread.shutdown(wait=True, cancel_futures=True)
        self._pending.clear()

    def _report(self, done: Future[StereoImage]) -> None:
        if not done.cancelled():
            self._finished()

    def _decode(self, key: PictureKey) -> StereoImage:
        image = self._load(key.stimulus)
        if self._prepare is not None:
            image = self._prepare(image, key.offset_px)
        if max(image.width_px, image.height_px) > self._largest_px:
            size = f"{image.width_px} × {image.height_px} px"
            raise PresentationError(
                Finding(
                    f"'{key.stimulus}' is {size}; this driver's textures end at {self._largest_px}",
                    remedy="crop the picture to what the display can show",
                )
            )
        image = _as_uploaded(image)
        for eye in EYES[:1] if image.is_flat else EYES:
            finite = np.isfinite(image.eye(eye))
            if not finite.all():
                bad = int(np.count_nonzero(~finite.all(axis=2)))
                raise PresentationError(
                    Finding(
                        f"'{key.stimulus}', {eye} view: {counted(bad, 'pixel is', 'pixels are')} NaN or infinite",
                        remedy="build it again",
                    )
                )
        return image


def _as_uploaded(image: StereoImage) -> StereoImage:
    """Return ``image`` with its views as their textures hold them, itself where they are so already."""
    left = as_uploaded(image.left)
    right = left if image.is_flat else as_uploaded(image.right)
    return image if left is image.left and right is image.right else replace(image, left=left, right=right)
