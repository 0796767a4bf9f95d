"""Compiled loops in tests: for pictures of any size, and whether they did the work."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from types import ModuleType
from unittest.mock import patch

import pytest

from documents import compiled


@contextmanager
def compiled_if_there(from_pixels: int = 1) -> Iterator[None]:
    """Let compiled loops do pictures of so many pixels, where Numba is installed."""
    with patch.object(compiled, "_WORTH_PIXELS", from_pixels):
        yield


@contextmanager
def not_in_numpy(module: str, from_pixels: int = 1) -> Iterator[None]:
    """Fail if the body did not ask for a module of compiled loops, or did not get it; skip where Numba is missing."""
    pytest.importorskip("numba")
    given: list[str] = []

    def seen(name: str) -> ModuleType:
        given.append(name)
        return import_module(name)

    with compiled_if_there(from_pixels), patch.object(compiled, "import_module", seen):
        yield
    assert module in given
