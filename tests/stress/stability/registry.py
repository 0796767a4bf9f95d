"""All routines of the table."""

from __future__ import annotations

from tests.stress.stability import colour, display, statistics
from tests.stress.stability.routine import Routine


def routines() -> tuple[Routine, ...]:
    """Return the routines, room by room, in the order of the page."""
    return (*colour.routines(), *display.routines(), *statistics.routines())
