"""Decoding pictures in a thread of its own, while a person looks at others."""

from __future__ import annotations

from collections.abc import Callable, Collection
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from devices.display.display_file import Eye
from documents import Finding
from documents.text.words import counted
from runner.presenter.errors import PresentationError
from runner.presenter.uploading import as_uploaded
from stimuli.pictures.stereo_image import StereoImage

EYES: tuple[Eye, Eye] = ("left", "right")


class Decoder:
    """Loads pictures by name, checks them and makes them ready to upload, one after another in one thread.

    ``take`` waits for the one it needs. ``load`` and the rest run in that thread, and what they raise is raised again
    by ``take``. ``finished`` is called after each picture, from whichever thread. At most the pictures of the last
    ``start`` wait, beside one that was under way.
    """

    def __init__(
        self, load: Callable[[str], StereoImage], largest_px: int, finished: Callable[[], None] = lambda: None
    ) -> None:
        self._load = load
        self._largest_px = largest_px
        self._finished = finished
        self._thread: ThreadPoolExecutor | None = None
        self._pending: dict[str, Future[StereoImage]] = {}

    def start(self, stimuli: Collection[str]) -> None:
        """Begin to decode ``stimuli``; what was begun before and is not among them is given up."""
        for name in [name for name in self._pending if name not in stimuli]:
            self._pending.pop(name).cancel()
        for name in stimuli:
            if name not in self._pending:
                if self._thread is None:
                    self._thread = ThreadPoolExecutor(1, thread_name_prefix="decode")
                self._pending[name] = self._thread.submit(self._decode, name)
                self._pending[name].add_done_callback(self._tell)

    def ready(self) -> str | None:
        """Return the name of a picture that can be taken without waiting, None if there is none."""
        done = (name for name, one in self._pending.items() if one.done() and not one.exception())
        return next(done, None)

    def take(self, stimulus: str) -> StereoImage:
        """Return the picture, decoded here and now if its turn had not come.

        Raises
        ------
        InputError
            Of the stimulus's source; PresentationError if a view holds NaN or infinity or is larger than a texture.
        """
        pending = self._pending.pop(stimulus, None)
        return self._decode(stimulus) if pending is None or pending.cancel() else pending.result()

    def close(self) -> None:
        """Give up what waits, and wait for what is under way."""
        if self._thread is not None:
            self._thread.shutdown(wait=True, cancel_futures=True)
        self._pending.clear()

    def _tell(self, done: Future[StereoImage]) -> None:
        if not done.cancelled():
            self._finished()

    def _decode(self, stimulus: str) -> StereoImage:
        image = self._load(stimulus)
        if max(image.width_px, image.height_px) > self._largest_px:
            size = f"{image.width_px} × {image.height_px} px"
            raise PresentationError(
                Finding(
                    f"'{stimulus}' is {size}; this driver's textures end at {self._largest_px}",
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
                        f"'{stimulus}', {eye} view: {counted(bad, 'pixel is', 'pixels are')} NaN or infinite",
                        remedy="build it again",
                    )
                )
        return image


def _as_uploaded(image: StereoImage) -> StereoImage:
    """Return ``image`` with its views as their textures hold them, itself where they are so already."""
    left = as_uploaded(image.left)
    right = left if image.is_flat else as_uploaded(image.right)
    return image if left is image.left and right is image.right else replace(image, left=left, right=right)
