"""How far a characterisation was from readings that it was not fitted to, as a display file's ``source`` says it."""

from __future__ import annotations

import re
from dataclasses import dataclass

_WRITTEN = re.compile(
    r"held-out ΔE00 mean (?P<mean>\d+\.\d+), 95th percentile (?P<p95>\d+\.\d+), largest (?P<max>\d+\.\d+)"
)


@dataclass(frozen=True, slots=True)
class HeldOut:
    """Mean, 95th percentile and largest ΔE00 of held-out readings.

    Parameters
    ----------
    mean, p95, max
        ΔE00, at least 0.

    Examples
    --------
    >>> HeldOut(0.31, 0.8, 1.2).words
    'held-out ΔE00 mean 0.31, 95th percentile 0.80, largest 1.20'
    >>> HeldOut.stated_in("gog fitted to 120 readings; " + HeldOut(0.31, 0.8, 1.2).words)
    HeldOut(mean=0.31, p95=0.8, max=1.2)
    """

    mean: float
    p95: float
    max: float

    @property
    def words(self) -> str:
        """Return it as `display fit` writes it into a display file's source."""
        return f"held-out ΔE00 mean {self.mean:.2f}, 95th percentile {self.p95:.2f}, largest {self.max:.2f}"

    @classmethod
    def stated_in(cls, source: str) -> HeldOut | None:
        """Return what ``source`` states, None if it does not."""
        found = _WRITTEN.search(source)
        return None if found is None else cls(*(float(number) for number in found.groups()))
