"""An instrument that a person reads off and types in."""

from __future__ import annotations

import math
import re
from collections.abc import Callable

from devices.instruments.errors import LostError, RangeError
from devices.instruments.instrument import Reading, Showing

_SKIP = ("skip", "s")


class Manual:
    """Asks for X, Y and Z in cd/m² with ``ask``, which shows a prompt and returns what is typed; None at its end.

    ``tell`` says what is wrong with what was typed.
    """

    name = "typed by hand"

    def __init__(self, ask: Callable[[str], str | None], tell: Callable[[str], None]) -> None:
        self._ask = ask
        self._tell = tell

    def read(self, showing: Showing) -> Reading:
        """Ask until three numbers are typed; ``skip`` leaves the patch for later."""
        while True:
            typed = self._ask(f"{showing.label}: X Y Z in cd/m², or skip: ")
            if typed is None:
                raise LostError("nobody types any more; go on with --resume")
            if typed.strip().lower() in _SKIP:
                raise RangeError("skipped")
            numbers = _numbers(typed)
            if numbers is not None:
                return Reading(numbers)
            self._tell("three numbers are needed, such as 12.3 13.4 14.5, none below 0")

    def close(self) -> None:
        """Do nothing."""


def _numbers(typed: str) -> tuple[float, float, float] | None:
    try:
        numbers = [float(word) for word in re.split(r"[\s,;]+", typed.strip())]
    except ValueError:
        return None
    if len(numbers) != 3 or not all(math.isfinite(number) and number >= 0 for number in numbers):
        return None
    return numbers[0], numbers[1], numbers[2]
