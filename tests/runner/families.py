"""Modes of each family, and kinds of blocks in one way: the others go the same way, and are tried by `make nightly`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from tests.choice import nightly

FAMILIES = ("flat", "side-by-side-half", "row-interleaved", "anaglyph-red-cyan", "frame-sequential", "dual-window")


def by_family(modes: Iterable[str]) -> list[Any]:
    """Return the cases of a test that is parametrised by ``modes``."""
    return [case for mode in modes for case in ([mode] if mode in FAMILIES else nightly(mode))]


def by_first_way(variants: Iterable[tuple[str, int]]) -> list[Any]:
    """Return the cases of a test of every kind of block in each way in which it is written."""
    return [case for one in variants for case in (nightly(one) if one[1] else [one])]
