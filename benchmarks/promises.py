"""What a benchmark promises, as values: the figure that was measured, what it may be, and whether it is kept.

A script returns its promises beside its rows; `run_all` gathers those of all scripts in one page.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

Kind = Literal["count", "error", "share", "ratio", "seconds"]
Direction = Literal["at most", "at least", "exactly"]
State = Literal["kept", "NOT KEPT", "not judged", "not measured", "followed"]

EXACT: tuple[Kind, ...] = ("count", "error")
"""What has the same figure on every machine and at every time, so that a small run may judge it too."""


@dataclass(frozen=True, slots=True)
class Promise:
    """One promise of a benchmark.

    Attributes
    ----------
    name
        What is promised, in words, without the number.
    figure
        What was measured; None where it was not, which ``missing`` then explains.
    limit
        What ``figure`` may be; None where the figure is only compared with that of the last release.
    kind
        ``count``: work, equal in every run. ``error``: how far a result is off. ``share``: of simulated studies, which
        needs many of them. ``ratio``: of two times taken in the same run, in turn. ``seconds``: an absolute time, which
        depends on the machine: it is followed, and its limit is a goal that decides nothing.
    direction
        On which side of ``limit`` the figure must be; of a ratio or a count without a limit, which side is good.
    unit
        Written behind the numbers, such as ``×`` or ``ΔE00``.
    missing
        Why there is no figure, such as a peer that is not installed.
    """

    name: str
    figure: float | None
    limit: float | None
    kind: Kind
    direction: Direction = "at most"
    unit: str = ""
    missing: str = ""

    def __post_init__(self) -> None:
        if (self.figure is None) != bool(self.missing):
            raise ValueError(f"{self.name}: say either a figure or, in `missing`, why there is none")

    @property
    def kept(self) -> bool | None:
        """Whether the figure is within the limit; None without a figure or a limit. NaN is not."""
        if self.figure is None or self.limit is None:
            return None
        if self.direction == "exactly":
            return self.figure == self.limit
        return self.figure <= self.limit if self.direction == "at most" else self.figure >= self.limit

    def state(self, *, quick: bool = False) -> State:
        """Return what the page says; a quick run judges only what is exact (`EXACT`)."""
        if self.figure is None:
            return "not measured"
        if self.kept is None or self.kind == "seconds":
            return "followed"
        if quick and self.kind not in EXACT:
            return "not judged"
        return "kept" if self.kept else "NOT KEPT"

    def to_json(self, *, quick: bool = False) -> dict[str, Any]:
        """Return plain values; a figure that is no finite number becomes text."""
        found = asdict(self) | {"state": self.state(quick=quick)}
        if self.figure is not None and not math.isfinite(self.figure):
            found["figure"] = str(self.figure)
        return found

    @classmethod
    def from_json(cls, values: Mapping[str, Any]) -> Promise:
        """Return what `to_json` wrote."""
        fields = {name: values[name] for name in cls.__slots__}
        return cls(**fields | {"figure": None if values["figure"] is None else float(values["figure"])})

    def words(self, *, quick: bool = False) -> str:
        """Return one line: the promise, its figure, its limit and its state."""
        return f"{self.name}: {self.measured()}; promised {self.promised()}: {self.state(quick=quick)}"

    def measured(self) -> str:
        """Return the figure with its unit, or why there is none."""
        return self.missing if self.figure is None else _number(self.figure, self.unit)

    def promised(self) -> str:
        """Return the limit with its direction and unit."""
        if self.limit is None:
            return "–" if self.kind in ("seconds", "share") else "as in the last release"
        direction = "goal:" if self.kind == "seconds" else self.direction
        return f"{direction} {_number(self.limit, self.unit)}"


def worst(rows: Iterable[Mapping[str, Any]], key: str = "error", **has: str) -> float:
    """Return the largest ``key`` of the rows whose texts contain what ``has`` says, such as ``series="ours"``.

    NaN and None in such a row give NaN, which keeps no promise. Raises LookupError where no row is meant.
    """
    found = [row[key] for row in rows if all(words in str(row[column]) for column, words in has.items())]
    if not found:
        raise LookupError(f"no row has {has}: did its name change?")
    return math.nan if any(value is None or math.isnan(value) for value in found) else float(max(found))


def times_as_fast(rows: Sequence[Mapping[str, Any]], ours: str, theirs: str) -> float:
    """Return how many times as long the series ``theirs`` takes as ``ours``: the least over the parameters of both.

    Raises LookupError where no parameter has both.
    """
    taken = {(row["series"], row["parameter"]): row["seconds"] for row in rows}
    both = [parameter for series, parameter in taken if series == ours and (theirs, parameter) in taken]
    if not both:
        raise LookupError(f"no parameter has both {ours!r} and {theirs!r}: did a name change?")
    return min(float(taken[theirs, parameter] / taken[ours, parameter]) for parameter in both)


def _number(value: float, unit: str) -> str:
    text = f"{value:.0f}" if value == round(value) and abs(value) < 1e9 else f"{value:.3g}"
    return f"{text} {unit}".rstrip()
