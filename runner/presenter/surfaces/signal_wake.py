"""Waking a program that sleeps in the event queue when a signal such as Ctrl-C arrives.

The sleep is inside the window library, where Python's own handlers cannot run. Python writes a byte to a socket for
each signal; a thread that sleeps on the other end posts an empty event, the sleep ends, and the handler runs.
"""

from __future__ import annotations

import signal
import socket
import threading
from collections.abc import Callable


class SignalWake:
    """Calls ``wake`` from a thread for each signal until it is closed; does nothing outside the main thread."""

    def __init__(self, wake: Callable[[], object]) -> None:
        self._before: int | None = None
        if threading.current_thread() is not threading.main_thread():
            return
        self._reading, self._writing = socket.socketpair()
        self._writing.setblocking(False)
        self._before = signal.set_wakeup_fd(self._writing.fileno(), warn_on_full_buffer=False)
        self._thread = threading.Thread(target=self._listen, args=(wake,), daemon=True, name="signal wake")
        self._thread.start()

    def _listen(self, wake: Callable[[], object]) -> None:
        # An empty read is the other end's closing.
        while self._reading.recv(64):
            wake()

    def close(self) -> None:
        """Put back what was there before and end the thread."""
        if self._before is None:
            return
        signal.set_wakeup_fd(self._before)
        self._before = None
        self._writing.close()
        self._thread.join()
        self._reading.close()
