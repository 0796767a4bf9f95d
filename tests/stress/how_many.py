"""How much a sweep tries: in `make stress`, or in `make stress WHOLE=1`, by which the pages' figures were measured."""

from __future__ import annotations

import os


def how_many(usual: int, whole: int) -> int:
    """Return how many of something to try: ``usual``, or ``whole`` where whole sweeps are asked for."""
    return whole if os.environ.get("STRESS_WHOLE") else usual
