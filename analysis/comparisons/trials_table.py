"""The table of trials that `cyclopean.read_results` gives, as a table of comparisons: its paired choices."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from analysis.comparisons.columns import KINDS, TIES, Columns
from analysis.comparisons.plain_lines import Fault, PlainReading, of_another_length
from analysis.comparisons.sources import Coded, Texts, WrittenRow, coded, plain

_NEEDED = ("experiment", "kind", "first", "second", "answer", "chosen", "rejected")
# Columns of the plain layout, and the column of trials that each is taken from.
_TAKEN = {"winner": "chosen", "loser": "rejected", "observer": "observer", "first": "first", "group": "group"}
_EMPTY = "the trials hold no paired comparison", "read results of a block of pairs"


@dataclass(frozen=True, slots=True)
class Trials:
    """The layout: one line for each trial of any kind; those that compare no pair, and catch trials, are left out."""

    name: str = "trials"
    wanted: str = ", ".join(_NEEDED)

    def recognises(self, names: Sequence[str]) -> bool:
        """Say whether a header of these ``names`` is that of trials."""
        return "winner" not in names and set(_NEEDED) <= set(names)

    def reading(self, header: Sequence[str], line: WrittenRow, file: str, codes: Sequence[str]) -> TrialsReading:
        """Return what reads the lines below ``header``."""
        return TrialsReading({name.strip().lower(): place for place, name in enumerate(header)}, len(header))


@dataclass(slots=True)
class TrialsReading:
    """Reads lines of trials, whose columns stand at ``places``."""

    places: dict[str, int]
    width: int
    notes: tuple[str, ...] = ("each line is a trial; those that compare no pair, and catch trials, are left out",)
    columns: Columns = field(init=False)
    experiments: set[str] = field(default_factory=set)
    simulated: set[str] = field(default_factory=set)
    found: int = 0
    counts: Collection[int] = ()

    @property
    def needed(self) -> Mapping[int, str]:
        """No column: names are those of the logs, and what no pair has is empty."""
        return {}

    @property
    def unknown(self) -> Collection[int]:
        """The columns in which a missing value is read as an empty field: other programs write a word there."""
        return [self.places[name] for name in ("catch", "group") if name in self.places]

    def __post_init__(self) -> None:
        taken = [name for name, source in _TAKEN.items() if source in self.places]
        self.columns = {name: place for place, name in enumerate([*taken, "outcome"])}

    def translate(self, columns: Sequence[Texts]) -> Mapping[str, Texts]:
        """Return the comparisons among trials in the columns of the plain layout; none if there are none."""
        column = {name: coded(columns[place]) for name, place in self.places.items()}
        self.experiments |= _met(column["experiment"].part(_filled(column["experiment"], columns)), str.strip)
        compared = _where(column["kind"], lambda text: text.strip() in KINDS)
        if "catch" in column:
            compared &= _where(column["catch"], lambda text: not text.strip())
        if not compared.any():
            return {}
        column = {name: part.part(compared) for name, part in column.items()}
        self.found += int(compared.sum())
        simulated = column.get("simulated", Coded([""], np.zeros(1, dtype=np.intp)))
        self.simulated |= _met(simulated, lambda text: text.strip().casefold())
        tie = _where(column["answer"], lambda text: text.strip() in TIES)
        for name, shown in (("chosen", "first"), ("rejected", "second")):
            texts = [*column[name].texts, *column[shown].texts]
            code = np.where(tie, column[shown].code + len(column[name].texts), column[name].code)
            column[name] = Coded(texts, code)
        told: dict[str, Texts] = {name: column[_TAKEN[name]] for name in self.columns if name in _TAKEN}
        return told | {"outcome": Coded(["win", "tie"], tie.astype(np.intp))}

    def fault(self, row: Sequence[str]) -> Fault | None:
        """Return the field that is wrong, what is wrong with it, and the remedy; None if nothing is."""
        if ragged := of_another_length(row, self.width):
            return ragged
        told = self.translate([[text] for text in row])
        line = [plain(told[name])[0].strip() for name in self.columns] if told else None
        if line and (fault := PlainReading(self.columns).fault(line)):
            name = list(self.columns)[fault[0]]
            return self.places[_TAKEN.get(name, "answer")], *fault[1:]
        return None

    def end(self) -> tuple[str, str] | None:
        """Return what is wrong with the whole: several experiments, people beside simulated ones, nothing."""
        if len(self.experiments) > 1:
            names = sorted(self.experiments)
            what = f"the trials are of {len(names)} experiments: {', '.join(names)}"
            return what, f"keep one: trials[trials['experiment'] == '{names[0]}']"
        if len(self.simulated) > 1:
            what = "the trials are of people and of simulated observers"
            return what, "keep one: trials[~trials['simulated']]; or drop the column to count both"
        return None if self.found else _EMPTY


def _where(column: Coded, what: Callable[[str], bool]) -> NDArray[np.bool_]:
    """Return of which rows ``what`` is true."""
    return np.array([what(text) for text in column.texts], dtype=np.bool_)[column.code]


def _filled(column: Coded, beside: Sequence[Texts]) -> NDArray[np.bool_]:
    """Return which rows have a text in ``column``, or at least in one ``beside``."""
    filled = _where(column, bool)
    for place in np.flatnonzero(~filled).tolist():
        filled[place] = any(
            texts.texts[texts.code[place]] if isinstance(texts, Coded) else texts[place] for texts in beside
        )
    return filled


def _met(column: Coded, what: Callable[[str], str]) -> set[str]:
    """Return what each text that occurs means."""
    return {what(column.texts[code]) for code in np.unique(column.code).tolist()}
