"""One thing that a verdict rests on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Outcome = Literal["passes", "fails", "cannot say", "noted"]


@dataclass(frozen=True, slots=True)
class Reason:
    """One thing that was judged: ``value`` against ``limit`` (None where there is none), and a sentence."""

    subject: str
    measure: str
    outcome: Outcome
    said: str
    value: float | None = None
    limit: float | None = None
    unit: str = ""


def decimals(value: float, count: int) -> str:
    """Return a number with ``count`` decimals; nought has no sign."""
    text = f"{value:.{count}f}"
    return text.lstrip("-") if float(text) == 0 else text
