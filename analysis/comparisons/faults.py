"""What is wrong with lines of a table of comparisons, and where."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Sequence

from analysis.comparisons.columns import OUTCOMES, REQUIRED, Columns, column_of
from documents import Finding

MOST_FINDINGS = 20


def find_faults(lines: Sequence[str], columns: Columns, file: str, begin: int, rows: int) -> list[Finding]:
    """Return a finding for each faulty line, up to twenty.

    Parameters
    ----------
    lines
        Lines of the file, of which the first ``rows`` rows of CSV are gone through.
    begin
        How many lines of the file stand before them.
    """
    findings: list[Finding] = []
    last = ""

    def remembered() -> Iterator[str]:
        nonlocal last
        for line in lines:
            last = line
            yield line

    reader = csv.reader(remembered(), strict=True)
    for _ in range(rows):
        row = next(reader)
        if not any(field.strip() for field in row):
            continue
        fault = _fault(row, columns)
        if fault:
            field, message, remedy = fault
            findings.append(Finding(message, file, begin + reader.line_num, column_of(field, last), remedy))
            if len(findings) == MOST_FINDINGS:
                break
    return findings


def _fault(row: Sequence[str], columns: Columns) -> tuple[int, str, str] | None:
    """Return the field that is wrong, what is wrong with it, and the remedy; None if nothing is."""
    if len(row) != len(columns):
        field = min(len(row), len(columns)) if len(row) > len(columns) else max(len(row) - 1, 0)
        return (
            field,
            f"the line has {len(row)} fields",
            f"the header has {len(columns)}; quote a name that holds a comma",
        )
    value = {name: row[field].strip() for name, field in columns.items()}
    for name in REQUIRED:
        if not value[name]:
            return columns[name], f"the {name} is empty", "name the item"
    winner, loser = value["winner"], value["loser"]
    if winner == loser:
        return columns["loser"], f"'{winner}' is compared with itself", "compare two different items"
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


def is_count(text: str) -> bool:
    """Say whether ``text`` is a finite number, zero or above."""
    try:
        count = float(text)
    except ValueError:
        return False
    return math.isfinite(count) and count >= 0 and "_" not in text
