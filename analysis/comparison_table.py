"""Read a table of comparisons: CSV with the columns ``winner,loser[,count,observer,first]``."""

from __future__ import annotations

import csv
import difflib
import io
import math
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.errors import ResultsError
from documents import Finding

COLUMNS = ("winner", "loser", "count", "observer", "first")
REQUIRED = ("winner", "loser")
MOST_FINDINGS = 20


class _Lines:
    """Passes lines on to the CSV reader and remembers the last, so that a finding can name the column."""

    def __init__(self, lines: Iterable[str]) -> None:
        self._lines = iter(lines)
        self.last = ""

    def __iter__(self) -> Iterator[str]:
        return self

    def __next__(self) -> str:
        self.last = next(self._lines)
        return self.last

    def column(self, field: int) -> int:
        """Return where ``field`` (from 0) starts in the last line, counted from 1; 1 if it cannot be found."""
        quoted, passed = False, 0
        if field == 0:
            return 1
        for position, character in enumerate(self.last, start=1):
            if character == '"':
                quoted = not quoted
            elif character == "," and not quoted:
                passed += 1
                if passed == field:
                    return position + 1
        return 1


def read_table(path: Path) -> Comparisons:
    """Read the comparisons in the CSV file at ``path`` (UTF-8, with or without a byte-order mark).

    Raises
    ------
    ResultsError
        As `parse_table`, or if the file cannot be read.
    """
    try:
        with path.open("rb") as stream:
            return read_stream(stream, str(path))
    except FileNotFoundError as error:
        raise ResultsError(Finding("there is no such file", str(path), remedy="check the path")) from error
    except OSError as error:
        raise ResultsError(Finding(f"the table cannot be read: {error.strerror}", str(path))) from error


def read_stream(stream: BinaryIO, file: str) -> Comparisons:
    """Read the comparisons in a binary stream of CSV, such as standard input; ``file`` is its name in findings.

    Raises
    ------
    ResultsError
        As `parse_table`, or if the stream is not UTF-8.
    """
    text = io.TextIOWrapper(stream, encoding="utf-8-sig", newline="")
    try:
        return parse_table(text, file)
    except UnicodeDecodeError as error:
        raise ResultsError(Finding("the table is not UTF-8 text", file, remedy="save it as UTF-8")) from error
    finally:
        text.detach()


def parse_table(lines: Iterable[str], file: str) -> Comparisons:
    """Read the comparisons in ``lines`` of CSV, one at a time; ``file`` is the name that findings carry.

    ``count`` is 1 where it is not given; it may be a fraction. ``first`` is the item shown first. Blanks around
    a field do not belong to it; empty lines are passed over.

    Raises
    ------
    ResultsError
        With the first twenty faults: an unknown, repeated or missing column, a line too long or too short, an
        empty name, an item against itself, a count that is no finite number above or at zero, a ``first`` that
        was not in the pair, or no comparison at all.
    """
    source = _Lines(lines)
    reader = csv.reader(source, strict=True)
    answers: list[Answer] = []
    findings: list[Finding] = []
    try:
        columns = _columns(next(reader, []), source, file)
        for row in reader:
            if not any(field.strip() for field in row):
                continue
            found = _answer(row, columns)
            if isinstance(found, Answer):
                answers.append(found)
                continue
            field, message, remedy = found
            findings.append(Finding(message, file, reader.line_num, source.column(field), remedy))
            if len(findings) == MOST_FINDINGS:
                break
    except csv.Error as error:
        findings.append(
            Finding(f"this is not valid CSV: {error}", file, max(reader.line_num, 1), 1, "check the quotes")
        )
    if findings:
        raise ResultsError(findings)
    if not any(answer.count > 0 for answer in answers):
        remedy = "add one line for each comparison, such as 'a,b'"
        raise ResultsError(Finding("the table holds no comparison", file, max(reader.line_num, 1), 1, remedy))
    return from_answers(answers)


def _columns(header: Sequence[str], source: _Lines, file: str) -> dict[str, int]:
    names = [field.strip() for field in header]
    if not any(names):
        raise ResultsError(Finding("the table is empty", file, 1, 1, "start it with 'winner,loser'"))
    findings = []
    for field, name in enumerate(names):
        if name not in COLUMNS:
            near = difflib.get_close_matches(name.lower(), COLUMNS, n=1)
            remedy = f"did you mean '{near[0]}'?" if near else f"the columns are {', '.join(COLUMNS)}, parted by commas"
            findings.append(Finding(f"unknown column '{name}'", file, 1, source.column(field), remedy))
        elif name in names[:field]:
            findings.append(Finding(f"the column '{name}' stands twice", file, 1, source.column(field), "keep one"))
    if not findings:
        findings = [
            Finding(f"the column '{name}' is missing", file, 1, 1, f"name one of the columns '{name}'")
            for name in REQUIRED
            if name not in names
        ]
    if findings:
        raise ResultsError(findings)
    return {name: field for field, name in enumerate(names)}


def _answer(row: Sequence[str], columns: dict[str, int]) -> Answer | tuple[int, str, str]:
    """Return the answer on a line, or the field that is wrong, what is wrong with it, and the remedy."""
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
    count = _count(value.get("count", "1"))
    if count is None:
        shown = value["count"]
        return columns["count"], f"the count is '{shown}'", "write a finite number, zero or above"
    first = value.get("first") or None
    if first is not None and first not in (winner, loser):
        return columns["first"], f"'{first}' was first but is not in the pair", f"write '{winner}' or '{loser}'"
    return Answer(winner, loser, count, value.get("observer", ""), first)


def _count(text: str) -> float | None:
    try:
        count = float(text)
    except ValueError:
        return None
    return count if math.isfinite(count) and count >= 0 and "_" not in text else None
