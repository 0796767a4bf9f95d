"""A clock for the record that nobody can set back: the time of day when it was made, and what has passed since."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime, timedelta

from documents.platform import elapsed_s


class SteadyClock:
    """Tells UTC to the millisecond; never runs back and never jumps, however the machine's clock is set meanwhile."""

    def __init__(
        self,
        wall: Callable[[], datetime] = lambda: datetime.now(UTC),
        elapsed: Callable[[], float] = elapsed_s,
    ) -> None:
        self._began = wall()
        self._elapsed = elapsed
        self._began_s = elapsed()

    def __call__(self) -> str:
        """Return the time now, such as ``2026-01-31T12:00:00.250+00:00``."""
        now = self._began + timedelta(seconds=self._elapsed() - self._began_s)
        return now.isoformat(timespec="milliseconds")
