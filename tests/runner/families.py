"""Modes of each family: the others of a family go the same way, and are tried by `make nightly`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from tests.choice import nightly

FAMILIES = ("flat", "side-by-side-half", "row-interleaved", "anaglyph-red-cyan", "frame-sequential", "dual-window")


def by_family(modes: Iterable[str]) -> list[Any]:
    """Return the cases of a test that is parametrised by ``modes``."""
    return [case for mode in modes for case in ([mode] if mode in FAMILIES else nightly(mode))]
