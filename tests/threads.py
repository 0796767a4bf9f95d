"""What is shared among threads, tried with one and with several."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from documents import at_most_threads


def shared_and_alike(user: Callable[[], NDArray[Any]], monkeypatch: pytest.MonkeyPatch) -> None:
    """Have ``user`` compute in one thread and in three, which must start and give the same bits."""
    with at_most_threads(1):
        alone = user()
    start, started = threading.Thread.start, list[str]()

    def counted(thread: threading.Thread) -> None:
        started.append(thread.name)
        start(thread)

    monkeypatch.setattr(threading.Thread, "start", counted)
    with at_most_threads(3):
        np.testing.assert_array_equal(user(), alone)
    assert started, "it was not shared among threads"
