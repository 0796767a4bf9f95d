"""Write the table of docs/stability.md: python -m tests.stress.stability.page, from the root of the repository."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

from tests.stress.stability.registry import routines
from tests.stress.stability.routine import Routine

PAGE = Path(__file__).parents[3] / "docs/stability.md"
HEAD = "| routine | stressed over | condition | largest error | at most | beyond |"
RULE = "|---|---|---:|---:|---:|---|"


@dataclass(frozen=True, slots=True)
class Row:
    """A line of the table: what was measured, as it is printed."""

    name: str
    range: str
    condition: float
    error: float
    limit: float
    unit: str
    outside: str


def up(value: float) -> float:
    """Return a number with one digit, never below ``value``."""
    if value == 0.0:
        return 0.0
    place = 10.0 ** math.floor(math.log10(value))
    return float(f"{math.ceil(value / place * (1.0 - 1e-12)) * place:.1g}")


def measured(routine: Routine) -> Row:
    """Return the row of a routine: errors and conditions rounded up to one digit."""
    return Row(
        routine.name,
        routine.range,
        up(routine.condition()),
        up(routine.error()),
        routine.limit,
        routine.unit,
        routine.outside,
    )


def line(row: Row) -> str:
    """Return the row as Markdown."""
    numbers = f"{row.condition:.1g} | {row.error:.1g} {row.unit} | {row.limit:g} {row.unit}"
    return f"| {row.name} | {row.range} | {numbers} | {row.outside} |"


def read_rows(text: str) -> dict[str, Row]:
    """Return the page's rows by routine."""
    rows = {}
    for cells in re.findall(r"^\| (.+) \|$", text.split(RULE, 1)[1], re.MULTILINE):
        name, stressed, condition, error, limit, outside = cells.split(" | ")
        unit = error.split(" ", 1)[1]
        numbers = float(condition), float(error.split()[0]), float(limit.split()[0])
        rows[name] = Row(name, stressed, *numbers, unit, outside)
    return rows


def write() -> None:
    """Measure all routines and write them into the page; the text around the table stays."""
    text = PAGE.read_text(encoding="utf-8")
    lines = [HEAD, RULE, *(line(measured(routine)) for routine in routines())]
    before, after = text.split(HEAD, 1)
    rest = after.lstrip("\n").split("\n\n", 1)[1]
    PAGE.write_text(before + "\n".join(lines) + "\n\n" + rest, encoding="utf-8")


if __name__ == "__main__":
    write()
