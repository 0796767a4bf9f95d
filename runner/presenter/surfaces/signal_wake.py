"""Waking a program that sleeps in the event queue when a signal such as Ctrl-C arrives.

The sleep is inside the window library, where Python's own handlers cannot run. Python writes a byte to a socket for
each signal; a thread that sleeps on the other end posts an empty event, the sleep ends, and the handler runs.

A Ctrl-C that comes while the library calls back would be lost: ctypes tells of what a callback raises and drops it. So
Ctrl-C during `SignalWake.heard` is kept until the library has returned.
"""

from __future__ import annotations

import signal
import socket
import threading
from collections.abc import Callable
from types import FrameType
from typing import ParamSpec

P = ParamSpec("P")


class SignalWake:
    """Calls ``wake`` from a thread for each signal until it is closed; does nothing outside the main thread."""

    def __init__(self, wake: Callable[[], object]) -> None:
        self._before: int | None = None
        self._inside = self._interrupted = False
        if threading.current_thread() is not threading.main_thread():
            return
        self._reading, self._writing = socket.socketpair()
        self._writing.setblocking(False)
        self._before = signal.set_wakeup_fd(self._writing.fileno(), warn_on_full_buffer=False)
        self._thread = threading.Thread(target=self._listen, args=(wake,), daemon=True, name="signal wake")
        self._thread.start()
        self._on_interrupt = signal.getsignal(signal.SIGINT)
        if callable(self._on_interrupt):
            signal.signal(signal.SIGINT, self._interrupt)

    def heard(self, call: Callable[P, object], *args: P.args, **kwargs: P.kwargs) -> None:
        """Call into the window library, which may call back; Ctrl-C meanwhile is heard once it has returned."""
        self._inside = True
        try:
            call(*args, **kwargs)
        finally:
            self._inside = False
        if self._interrupted:
            self._interrupted = False
            signal.raise_signal(signal.SIGINT)

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        if self._inside:
            self._interrupted = True
        elif callable(self._on_interrupt):
            self._on_interrupt(number, frame)

    def _listen(self, wake: Callable[[], object]) -> None:
        # An empty read is the other end's closing.
        while self._reading.recv(64):
            wake()

    def close(self) -> None:
        """Put back what was there before and end the thread."""
        if self._before is None:
            return
        if callable(self._on_interrupt):
            signal.signal(signal.SIGINT, self._on_interrupt)
        signal.set_wakeup_fd(self._before)
        self._before = None
        self._writing.close()
        self._thread.join()
        self._reading.close()
