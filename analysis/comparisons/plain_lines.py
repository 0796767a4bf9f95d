"""Lines of the plain layout: what can be wrong with one."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from analysis.comparisons.columns import OUTCOMES, REQUIRED, Columns, read_header
from analysis.comparisons.sources import Texts, WrittenRow

Fault = tuple[int, str, str]
NEEDED = (*REQUIRED, "outcome", "observer", "group")


@dataclass(frozen=True, slots=True)
class PlainReading:
    """Reads lines with ``columns`` as they are."""

    columns: Columns
    notes: tuple[str, ...] = ()

    @classmethod
    def of_header(cls, header: Sequence[str], line: WrittenRow, file: str) -> PlainReading:
        """Return what reads the lines below ``header``, as `read_header` has it."""
        return cls(read_header(header, line, file))

    @property
    def needed(self) -> Mapping[int, str]:
        """The columns without which a line says nothing, and what each holds."""
        return {self.columns[name]: name for name in NEEDED if name in self.columns}

    @property
    def unknown(self) -> Collection[int]:
        """The columns in which a missing value is read as an empty field: nobody knows which item was first."""
        return [self.columns["first"]] if "first" in self.columns else []

    @property
    def counts(self) -> Collection[int]:
        """The columns of numbers of answers."""
        return [self.columns[name] for name in ("count", "ties") if name in self.columns]

    @property
    def width(self) -> int:
        """How many fields a line has."""
        return len(self.columns)

    def translate(self, columns: Sequence[Texts]) -> Mapping[str, Texts]:
        """Return the ``columns`` by name; their faults are found when they are counted."""
        return {name: columns[place] for name, place in self.columns.items()}

    def end(self) -> None:
        """Return None: nothing can be wrong with the table as a whole."""

    def fault(self, row: Sequence[str]) -> Fault | None:
        """Return the field that is wrong, what is wrong with it, and the remedy; None if nothing is."""
        columns = self.columns
        if ragged := of_another_length(row, len(columns)):
            return ragged
        value = {name: row[field].strip() for name, field in columns.items()}
        for name in REQUIRED:
            if not value[name]:
                return columns[name], f"the {name} is empty", "name the item"
        winner, loser = value["winner"], value["loser"]
        if winner == loser:
            return columns["loser"], f"'{winner}' is compared with itself", "compare two different items"
        if "group" in value and not value["group"]:
            return columns["group"], "the group is empty", "name the group, or leave the column out"
        for name, what in (("count", "the count is"), ("ties", "the number of ties is")):
            if name in value and not is_count(value[name]):
                return columns[name], f"{what} '{value[name]}'", "write a finite number, zero or above"
        first = value.get("first")
        if first and first not in (winner, loser):
            return columns["first"], f"'{first}' was first but is not in the pair", f"write '{winner}' or '{loser}'"
        outcome = value.get("outcome")
        if outcome and outcome not in OUTCOMES:
            return columns["outcome"], f"the outcome is '{outcome}'", f"write one of: {', '.join(OUTCOMES)}"
        return None


def of_another_length(row: Sequence[str], width: int) -> Fault | None:
    """Return what is wrong with a line that has not as many fields as the header, ``width``."""
    where = width if len(row) > width else max(len(row) - 1, 0)
    remedy = f"the header has {width}; quote a name with a comma"
    return None if len(row) == width else (where, f"the line has {len(row)} fields", remedy)


def is_count(text: str) -> bool:
    """Say whether ``text`` is a finite number, zero or above."""
    try:
        count = float(text)
    except ValueError:
        return False
    return math.isfinite(count) and count >= 0 and "_" not in text
