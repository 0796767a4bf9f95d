"""A code that stands for some milliseconds, and goes back to 0 by itself."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Generic, TypeVar

from documents.platform import serial_errors

_LEAVING_S = 1.0


Word = TypeVar("Word")


class Pulse(Generic[Word]):
    """Writes codes with ``write``, and ``off`` once the latest has stood for ``pulse_s``, from a thread of its own.

    A code that comes before that is written at once, and stands for ``pulse_s`` in its turn.
    """

    def __init__(self, write: Callable[[Word], object], pulse_s: float, off: Word) -> None:
        self._off = off
        self._write = write
        self._pulse_s = pulse_s
        self._turn = threading.Condition()
        self._due_s: float | None = None
        self._over = False
        self._thread = threading.Thread(target=self._run, name="timing marks", daemon=True)
        self._thread.start()

    def send(self, code: Word) -> None:
        """Write ``code`` now."""
        with self._turn:
            self._write(code)
            self._due_s = time.monotonic() + self._pulse_s
            self._turn.notify()

    def close(self) -> None:
        """End the pulse that stands."""
        with self._turn:
            self._over = True
            self._turn.notify()
        self._thread.join(timeout=_LEAVING_S)

    def _run(self) -> None:
        with self._turn:
            while True:
                if self._due_s is not None and (self._over or time.monotonic() >= self._due_s):
                    self._due_s = None
                    with suppress(*serial_errors()):  # the next mark finds out, and says so
                        self._write(self._off)
                if self._over:
                    return
                self._turn.wait(None if self._due_s is None else max(0.0, self._due_s - time.monotonic()))
