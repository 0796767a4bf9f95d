"""The types of options that are numbers: each has a range, and none takes NaN, infinity or what nobody means."""

from __future__ import annotations

import math
from typing import Any

import click

# Beyond what anything measures: said to whoever passes it, and left out of the help.
_MOST = 1e12
_MOST_WHOLE = 10**9
_MOST_SEED = 10**40


class Within(click.FloatRange):
    """A number between limits."""

    name = "float"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number; fails for what is none, and beyond the limits."""
        number = float(click.FLOAT.convert(value, param, ctx))
        if not math.isfinite(number) or abs(number) > _MOST:
            self.fail(f"{value!r} is no number of at most {_MOST:g}.", param, ctx)
        return super().convert(number, param, ctx)

    def _describe_range(self) -> str:
        return _near(self, super()._describe_range())


class Whole(click.IntRange):
    """A whole number between limits."""

    name = "integer"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Return the number; fails for what is none, and beyond the limits."""
        number = int(click.INT.convert(value, param, ctx))
        if self.max is not None and number > self.max >= _MOST_WHOLE:
            self.fail(f"a number of at most {self.max:g} is wanted.", param, ctx)
        return super().convert(number, param, ctx)

    def _describe_range(self) -> str:
        return _near(self, super()._describe_range())


def _near(kind: Within | Whole, described: str) -> str:
    """Return click's words on a range without limits that are far."""
    low, high = kind.min, kind.max
    if low is not None and abs(low) >= _MOST_WHOLE:
        return ""
    if high is not None and high >= _MOST_WHOLE:
        return f"x{'>' if kind.min_open else '>='}{low}"
    return described


NUMBER = Within(-_MOST, _MOST)
NOT_NEGATIVE = Within(0, _MOST)
POSITIVE = Within(0, _MOST, min_open=True)
COUNT = Whole(0, _MOST_WHOLE)
NATURAL = Whole(1, _MOST_WHOLE)
SEED = Whole(0, _MOST_SEED)


def several(text: str, between: str) -> tuple[float, ...]:
    """Return the numbers in ``text`` with ``between`` them; ValueError if one is none that anybody means."""
    numbers = tuple(float(part) for part in text.split(between))
    if not all(abs(number) <= _MOST for number in numbers):  # nor NaN
        raise ValueError(text)
    return numbers
