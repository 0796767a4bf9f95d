"""What the presenter did, counted: counts are exact where clocks are noisy."""

from __future__ import annotations

from dataclasses import dataclass, fields


@dataclass(frozen=True, slots=True)
class Counters:
    """Work done since the presenter was made.

    ``frames_drawn`` counts scenes put on the screen, ``frames_redrawn`` the same scene drawn again because the window
    system had lost it, and ``scenes_skipped`` scenes equal to what was already shown. Where the eyes are shown in turn,
    ``frames_alternated`` counts the same scene drawn for the next eye, and ``frames_missed`` the refreshes that no new
    frame was ready for. ``pointers_drawn`` counts the same scene drawn because a mouse was moved. ``uploads``,
    ``bytes_uploaded``, ``colour_passes`` and ``pixels_shaded`` are about pictures; ``decodes`` are calls for a
    picture's data; ``texts_rasterised`` and ``evictions`` are what they say.
    """

    frames_drawn: int = 0
    frames_redrawn: int = 0
    scenes_skipped: int = 0
    frames_alternated: int = 0
    frames_missed: int = 0
    pointers_drawn: int = 0
    decodes: int = 0
    uploads: int = 0
    bytes_uploaded: int = 0
    colour_passes: int = 0
    pixels_shaded: int = 0
    texts_rasterised: int = 0
    evictions: int = 0


class Work:
    """The running count that the presenter and its caches share."""

    def __init__(self) -> None:
        self._totals = {field.name: 0 for field in fields(Counters)}

    @property
    def counters(self) -> Counters:
        """The work done so far."""
        return Counters(**self._totals)

    def add(self, **increments: int) -> None:
        """Add ``increments`` to the counters of those names."""
        for name, amount in increments.items():
            self._totals[name] += amount

    def total(self, name: str) -> int:
        """Return one counter, as often as a frame is drawn."""
        return self._totals[name]
