"""Read a table of comparisons: CSV with the columns ``winner,loser[,count,observer,first,group][,outcome|ties]``.

Lines are read in blocks, and like answers are counted together as they come, so that a table of any length takes the
memory of its kinds of answers: winner, loser, observer, group, which was first, and whether it was a tie. What a block
of lines means is computed column by column; only a block with a fault in it is read line by line, to name the place.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import BinaryIO

from analysis.comparisons.columns import OUTCOMES, REQUIRED, Columns, column_of, read_header
from analysis.comparisons.comparisons import Comparisons
from analysis.comparisons.tally import Tally
from analysis.errors import ResultsError
from documents import Finding
from documents.files import open_regular, unreadable

BLOCK_ROWS = 1 << 15
MOST_FINDINGS = 20


class _Lines:
    """Passes lines on to the CSV reader and keeps those of the block at hand, so that a finding can name the place."""

    def __init__(self, lines: Iterable[str]) -> None:
        self._lines = iter(lines)
        self.kept: list[str] = []

    def __iter__(self) -> Iterator[str]:
        return self

    def __next__(self) -> str:
        line = next(self._lines)
        self.kept.append(line)
        return line


def read_table(path: str | Path) -> Comparisons:
    """Read the comparisons in the CSV file at ``path`` (UTF-8, with or without a byte-order mark).

    Parameters
    ----------
    path
        A CSV table with the columns ``winner`` and ``loser`` and, if there are any, ``count``, ``observer``, ``first``,
        and ``outcome`` or ``ties``.

    Returns
    -------
    Comparisons
        Who was preferred over whom, by which observer.

    Raises
    ------
    ResultsError
        As `parse_table`, or if the file cannot be read.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "table.csv")
    ...     _ = file.write_text("winner,loser,count\\na,b,3\\nb,a,1\\n")
    ...     read_table(file).wins.tolist()
    [[0.0, 3.0], [1.0, 0.0]]
    """
    path = Path(path)
    if path.is_dir():
        remedy = f"for a folder of sessions: cyclopean report {path}"
        raise ResultsError(Finding("the table cannot be read: it is a folder", str(path), remedy=remedy))
    try:
        with open_regular(path, "table", error=ResultsError) as stream:
            return read_stream(stream, str(path))
    except OSError as error:
        raise ResultsError(unreadable(error, path, "table")) from error


def read_stream(stream: BinaryIO, file: str) -> Comparisons:
    """Read the comparisons in a binary stream of CSV, such as standard input; ``file`` is its name in findings.

    Parameters
    ----------
    stream
        CSV in UTF-8, with or without a byte-order mark; it is read to its end and left open.
    file
        Name of the stream in findings.

    Returns
    -------
    Comparisons
        Who was preferred over whom, by which observer.

    Raises
    ------
    ResultsError
        As `parse_table`, or if the stream is not UTF-8.

    Examples
    --------
    >>> read_stream(io.BytesIO(b"winner,loser,count\\na,b,3\\nb,a,1\\n"), "standard input").wins.tolist()
    [[0.0, 3.0], [1.0, 0.0]]
    """
    text = io.TextIOWrapper(stream, encoding="utf-8-sig", newline="")
    try:
        return parse_table(text, file)
    except UnicodeDecodeError as error:
        raise ResultsError(Finding("the table is not UTF-8 text", file, remedy="save it as UTF-8")) from error
    finally:
        text.detach()


def parse_table(lines: Iterable[str], file: str) -> Comparisons:
    """Read the comparisons in ``lines`` of CSV; ``file`` is the name that findings carry.

    ``count`` is 1 where it is not given; it may be a fraction. ``first`` is the item shown first. A line whose
    ``outcome`` is ``tie`` prefers neither item; or ``ties`` says how many answers preferred neither, beside the
    ``count`` that preferred the winner. ``group``, also called ``scene`` or ``content``, is what a pair was compared
    within, such as the scene that all its pictures show. Blanks around a field do not belong to it; empty lines are
    passed over.

    Parameters
    ----------
    lines
        Lines of CSV, the heading first.
    file
        Name of the table in findings.

    Returns
    -------
    Comparisons
        Who was preferred over whom, by which observer.

    Raises
    ------
    ResultsError
        With the first twenty faults: an unknown, repeated or missing column, a line too long or too short, an
        empty name or group, an item against itself, a count that is no finite number above or at zero, a ``first``
        that was not in the pair, or no comparison at all; or more items than fit into memory.

    Examples
    --------
    >>> parse_table(["winner,loser,count", "a,b,3", "b,a,1"], "table.csv").wins.tolist()
    [[0.0, 3.0], [1.0, 0.0]]
    """
    source = _Lines(lines)
    reader = csv.reader(source, strict=True)
    findings: list[Finding] = []
    tally: Tally | None = None
    try:
        columns = read_header(next(reader, []), "".join(source.kept), file)
        tally = Tally(columns)
        while len(findings) < MOST_FINDINGS:
            begin, source.kept = reader.line_num, []
            rows: list[list[str]] = []
            try:
                rows.extend(islice(reader, BLOCK_ROWS))
            finally:
                if rows and not tally.add(rows):
                    findings += _find_faults(source.kept, columns, file, begin, len(rows))
            if not rows:
                break
    except csv.Error as error:
        place = max(reader.line_num, 1)
        findings.append(Finding(f"this is not valid CSV: {error}", file, place, 1, "check the quotes"))
    if findings:
        raise ResultsError(findings[:MOST_FINDINGS])
    comparisons = tally.comparisons() if tally else None
    if comparisons is None:
        remedy = "add one line for each comparison, such as 'a,b'"
        raise ResultsError(Finding("the table has no comparison", file, max(reader.line_num, 1), 1, remedy))
    return comparisons


def _find_faults(lines: Sequence[str], columns: Columns, file: str, begin: int, rows: int) -> list[Finding]:
    """Return a finding for each faulty line, up to twenty.

    Parameters
    ----------
    lines
        Lines of the file, of which the first ``rows`` rows of CSV are read.
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
            f"the header has {len(columns)}; quote a name with a comma",
        )
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
        if name in value and not _is_count(value[name]):
            return columns[name], f"{what} '{value[name]}'", "write a finite number, zero or above"
    first = value.get("first")
    if first and first not in (winner, loser):
        return columns["first"], f"'{first}' was first but is not in the pair", f"write '{winner}' or '{loser}'"
    outcome = value.get("outcome")
    if outcome and outcome not in OUTCOMES:
        return columns["outcome"], f"the outcome is '{outcome}'", f"write one of: {', '.join(OUTCOMES)}"
    return None


def _is_count(text: str) -> bool:
    """Say whether ``text`` is a finite number, zero or above."""
    try:
        count = float(text)
    except ValueError:
        return False
    return math.isfinite(count) and count >= 0 and "_" not in text
