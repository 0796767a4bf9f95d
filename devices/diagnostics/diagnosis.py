"""What comes of a check: a verdict, the number it rests on, the limit, and what is needed to draw it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from documents.options import Typed
from documents.text import JsonResult

if TYPE_CHECKING:
    from devices.readings import Measurements

Colour = Literal["red", "green", "blue", "grey", "ink", "soft", "accent"]
Style = Literal["points", "line", "dashed", "outline"]
Cell = str | float | None


@dataclass(frozen=True, slots=True)
class Trace:
    """One series of a figure; ``x`` and ``y`` are equally long, and an ``outline`` is closed."""

    name: str
    x: tuple[float, ...]
    y: tuple[float, ...]
    colour: Colour = "ink"
    style: Style = "points"


@dataclass(frozen=True, slots=True)
class PlotAxes:
    """One pair of axes.

    ``levels`` are limits, drawn as horizontal lines; ``equal`` gives both axes one scale; ``x_names``, where given,
    stand at x = 1, 2, ... in place of numbers.
    """

    title: str
    x_label: str
    y_label: str
    lines: tuple[Trace, ...]
    levels: tuple[float, ...] = ()
    equal: bool = False
    x_names: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Readout:
    """Numbers behind a verdict; each row has a cell for each heading."""

    header: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]


@dataclass(frozen=True, slots=True)
class Diagnosis(JsonResult):
    """One check of one set of measurements.

    Attributes
    ----------
    name, title
        The check's key, and its name for people.
    passed
        None where it could not be judged; ``words`` then say why.
    value, limit, unit
        The number judged and what it is judged by, in ``unit``; None where there is none.
    at_least
        True where the value has to reach the limit, False where it must not exceed it.
    source
        Where the limit comes from.
    words
        The result in sentences.
    series, table
        The figure's panels and the numbers behind them.
    output
        A part of a display file, as YAML, that the readings give.
    subject
        Which readings were judged, where there are several sets.
    """

    name: str
    title: str
    passed: bool | None
    value: float | None
    limit: float | None
    unit: str
    source: str
    words: str
    at_least: bool = False
    series: tuple[PlotAxes, ...] = ()
    table: Readout | None = None
    output: str = ""
    subject: str = ""

    @property
    def verdict(self) -> Literal["passed", "failed", "no_limit", "open"]:
        """The outcome: ``no_limit`` is a number without a limit, ``open`` a check that could not be made."""
        if self.passed is not None:
            return "passed" if self.passed else "failed"
        return "no_limit" if self.value is not None else "open"


@dataclass(frozen=True, slots=True)
class Verdicts(JsonResult):
    """A display judged: the title, the checks, and in ``notes`` what was assumed in reading the files."""

    title: str
    diagnoses: tuple[Diagnosis, ...]
    notes: tuple[str, ...] = ()
    json_also: ClassVar = ("passed", "failed")

    @property
    def passed(self) -> int:
        """How many checks passed."""
        return sum(diagnosis.passed is True for diagnosis in self.diagnoses)

    @property
    def failed(self) -> int:
        """How many checks failed."""
        return sum(diagnosis.passed is False for diagnosis in self.diagnoses)

    @property
    def sentence(self) -> str:
        """The outcome, in a sentence."""
        judged = self.passed + self.failed
        if not judged:
            return "Nothing could be judged by these readings."
        unjudged = sum(diagnosis.verdict == "open" for diagnosis in self.diagnoses)
        rest = f" {unjudged} could not be judged." if unjudged else ""
        if not self.failed:
            return f"All {judged} checks that could be made passed.{rest}"
        return f"{self.failed} of {judged} checks failed.{rest}"


@dataclass(frozen=True, slots=True)
class JudgeOptions:
    """What a display's readings are judged with.

    Attributes
    ----------
    display
        Display file to compare the readings with.
    mode
        Stereo mode in it. Default: that of the readings, or the only one.
    without_glasses
        Readings of the same patches without glasses.
    codes
        Range of the codes in the files: 0..1, 0..255 or 0..1023.
    white_cd_m2
        Luminance of the white, of ICC profiles that do not say it.
    """

    display: Path | None = None
    mode: str | None = None
    without_glasses: Path | None = None
    codes: Annotated[str | None, Typed(metavar="RANGE")] = None
    white_cd_m2: Annotated[float | None, Typed(metavar="CD_M2", least=0, above=True)] = None


@dataclass(frozen=True, slots=True)
class Check:
    """What a check judges by, whatever the readings."""

    name: str
    title: str
    limit: float | None
    unit: str
    source: str
    at_least: bool = False

    def unjudged(self, why: str, **more: Any) -> Diagnosis:
        """Return that the check could not be made, and why."""
        return Diagnosis(
            self.name, self.title, None, None, self.limit, self.unit, self.source, why, self.at_least, **more
        )

    def judged(self, value: float, words: str, *, sound: bool = True, **more: Any) -> Diagnosis:
        """Return the verdict on ``value``; never passed where the readings are not ``sound``."""
        limit = more.pop("limit", self.limit)
        kept = limit is None or (value >= limit if self.at_least else value <= limit)
        number = float(value) if math.isfinite(value) else None
        passed = bool(kept and sound and number is not None)
        return Diagnosis(
            self.name, self.title, passed, number, limit, self.unit, self.source, words, self.at_least, **more
        )

    def described(self, value: float, words: str, **more: Any) -> Diagnosis:
        """Return ``value`` without a verdict."""
        return Diagnosis(
            self.name, self.title, None, float(value), None, self.unit, self.source, words, self.at_least, **more
        )


@dataclass(frozen=True, slots=True)
class DisplayCheck:
    """A check of a display's readings that a package adds to ours.

    Attributes
    ----------
    judge
        Judges readings, or says in a sentence why it cannot. Its diagnosis has the name that the check is offered by.
    after
        The name of the check after which it stands; without it, it stands after ours of the same readings.
    of_primaries
        Whether the colours of the set ``cable`` serve too, where they alone hold the primaries.
    """

    judge: Callable[[Measurements], Diagnosis]
    after: str = ""
    of_primaries: bool = False


def numbers(values: Any) -> tuple[float, ...]:
    """Return an array (n,) as plain numbers.

    Parameters
    ----------
    values
        Numbers, shape (n,), in any unit.

    Returns
    -------
    tuple of float
        The n numbers in the same order and unit.

    Examples
    --------
    >>> import numpy as np
    >>> numbers(np.array([0.5, 1.0]))
    (0.5, 1.0)
    """
    return tuple(float(value) for value in values)
