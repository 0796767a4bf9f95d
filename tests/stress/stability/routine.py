"""A numeric routine on the bench: what it is compared with, over what range, and what it does outside."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Any

import numpy as np

from documents.arrays import Floats
from tests.stress.stability.sixty_digits import exact

Answer = Callable[[Floats], Any]
Reference = Callable[[list[Decimal]], Sequence[Decimal]]
_NUDGE = Decimal(10) ** -25
_NUDGED_ROWS = 40
ULP = "ulp"


@dataclass(frozen=True, slots=True)
class Routine:
    """One line of the table.

    ``of`` takes float64 inputs, (n, k), and gives (n,) or (n, m); ``exactly`` the same of one row in sixty digits.
    ``unit`` is that of the error: `ULP` is the last place of the largest number of a result, all else is absolute.
    The error is at most ``limit``. ``outside`` says in words what happens beyond ``range``, and ``check_outside``
    tries it.
    """

    name: str
    of: Answer
    exactly: Reference
    inputs: Floats
    range: str
    unit: str
    limit: float
    outside: str
    check_outside: Callable[[], None]

    @classmethod
    def of_row(
        cls, row: str, of: Answer, exactly: Reference, inputs: Floats, check_outside: Callable[[], None]
    ) -> Routine:
        """Return what a ``row`` of words says: name, range, limit with its unit, and what happens beyond."""
        name, stressed, most, outside = row.split(" | ")
        limit, unit = most.split(" ", 1)
        return cls(name, of, exactly, inputs, stressed, unit, float(limit), outside, check_outside)

    def error(self) -> float:
        """Return the largest error over the inputs."""
        found = np.asarray(self.of(self.inputs), dtype=np.float64).reshape(len(self.inputs), -1)
        assert np.isfinite(found).all(), self.name
        worst = 0.0
        for row, shown in zip(self.inputs, found, strict=True):
            wanted = self.exactly(exact(row))
            off = max(abs(Decimal(float(a)) - b) for a, b in zip(shown, wanted, strict=True))
            place = float(np.spacing(float(max(abs(b) for b in wanted)))) if self.unit == ULP else 1.0
            worst = max(worst, float(off) / place)
        return worst

    def condition(self) -> float:
        """Return by how much relative errors of the inputs can grow: the largest over some of the inputs.

        Σ over the inputs x of |x ∂f/∂x|, in the largest number of a result, over that number; in sixty digits.
        """
        worst = 0.0
        for row in self.inputs[:: max(1, len(self.inputs) // _NUDGED_ROWS)]:
            inputs = exact(row)
            plain = self.exactly(inputs)
            size = max(abs(value) for value in plain)
            if size == 0:
                continue
            grown = Decimal(0)
            for at, value in enumerate(inputs):
                moved = self.exactly([*inputs[:at], value * (1 + _NUDGE), *inputs[at + 1 :]])
                grown += max(abs(a - b) for a, b in zip(moved, plain, strict=True))
            worst = max(worst, float(grown / size / _NUDGE))
        return worst


def refuses(error: type[Exception], call: Callable[[], object]) -> Callable[[], None]:
    """Return a check that ``call`` raises ``error``."""

    def check() -> None:
        try:
            call()
        except error:
            return
        raise AssertionError(f"no {error.__name__}")

    return check


def gives(call: Callable[[], Any], expected: Any) -> Callable[[], None]:
    """Return a check that ``call`` returns ``expected``, NaN for NaN."""

    def check() -> None:
        np.testing.assert_array_equal(np.asarray(call(), dtype=np.float64), np.asarray(expected, dtype=np.float64))

    return check
