"""What an Ask is about, in words that do not need eyes: for simulated observers, and for whoever reads a session."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias


@dataclass(frozen=True, slots=True)
class GoOn:
    """Nothing is asked: any meaning will do."""


@dataclass(frozen=True, slots=True)
class Compare:
    """Which of two is closer to ``reference`` (a stimulus; None for a physical one, or where there is none)?

    Meanings: ``first``, ``second``; where ties are allowed, ``no_difference`` and ``not_sure`` are meanings too.
    """

    first: str
    second: str
    reference: str | None = None


@dataclass(frozen=True, slots=True)
class Browse:
    """Which of a ``series`` is the closest? ``index`` is shown now, ``seen`` were shown before or are now.

    Meanings: ``previous``, ``next`` and ``choose``; ``choose`` may be missing while there are some left to see.
    """

    series: tuple[str, ...]
    index: int
    seen: frozenset[int]
    reference: str | None = None


@dataclass(frozen=True, slots=True)
class Rate:
    """What number on the scale ``name`` does ``stimulus`` deserve, from ``lowest`` to ``highest``?

    ``current`` is where the marker stands, None if nowhere yet. Meanings: the numbers as text, and ``lower``,
    ``higher``, ``accept``.
    """

    name: str
    lowest: int
    highest: int
    stimulus: str | None = None
    reference: str | None = None
    current: int | None = None


@dataclass(frozen=True, slots=True)
class Choose:
    """Which of the ``options`` (meanings)? ``correct`` is the right one where there is one.

    ``strength`` says how plain it is, in a unit that belongs to ``name``, such as arcseconds of disparity. Who sees
    nothing guesses, where the choice is ``forced``; otherwise the options are "yes" and "no", and they say no. There
    "no" is correct where there is nothing to see, and ``strength`` is None.
    """

    name: str
    options: tuple[str, ...]
    correct: str | None = None
    strength: float | None = None
    forced: bool = True


@dataclass(frozen=True, slots=True)
class Write:
    """Words or a number are typed; meanings: ``text`` of a typed character, ``erase``, ``accept``.

    ``accept`` may be missing while nothing acceptable is ``typed``; ``example`` would be acceptable.
    """

    name: str
    typed: str = ""
    number: bool = False
    example: str = "1"


NOTHING = GoOn()
Task: TypeAlias = GoOn | Compare | Browse | Rate | Choose | Write
