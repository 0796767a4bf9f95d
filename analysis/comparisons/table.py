"""Read a table of comparisons: CSV with the columns ``winner,loser[,count,observer,first,group][,outcome|ties]``.

Lines are read in blocks, and like answers are counted together as they come, so that a table of any length takes the
memory of its kinds of answers: winner, loser, observer, group, which was first, and whether it was a tie. What a block
of lines means is computed column by column; only a block with a fault or a missing value in it is read line by line, to
name the place.
"""

from __future__ import annotations

import csv
import io
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple, cast

from analysis.comparisons.comparisons import Comparisons
from analysis.comparisons.layouts import PLAIN, LayoutReading, find_layout
from analysis.comparisons.mat_table import read_mat_table
from analysis.comparisons.missing import KEEP, WORDS, Missing
from analysis.comparisons.sources import (
    MOST_LETTERS,
    Coded,
    CodedTable,
    ColumnBlock,
    ColumnSource,
    LineSource,
    NumberedRow,
    Row,
    RowBlock,
    TableSource,
    Texts,
    plain,
)
from analysis.comparisons.tally import Tally
from analysis.errors import ResultsError
from documents import Finding
from documents.files import open_regular, unreadable
from documents.tables import WORKBOOK, decoded, encoding_of, not_text

MOST_FINDINGS = 20


@dataclass(frozen=True, slots=True, eq=False)
class TableRead:
    """A table as it was read.

    Attributes
    ----------
    comparisons
        Who was preferred over whom, by which observer.
    layout
        Name of the kind of table that it was taken for.
    notes
        What to bear in mind of how it was read, such as columns that were not, in sentences.
    warnings
        Which lines were left out because a value is missing, in sentences.
    left_out
        How many those are, and the first of them, as plain values for JSON; empty where there are none.
    """

    comparisons: Comparisons
    layout: str
    notes: tuple[str, ...]
    warnings: tuple[str, ...] = ()
    left_out: Mapping[str, Any] = field(default_factory=dict)

    @property
    def lines(self) -> tuple[str, ...]:
        """How the table was read, as lines of plain text; the plain layout is not named."""
        how = () if self.layout == PLAIN else (f"the table's layout: {self.layout}",)
        return (*how, *self.notes, *self.warnings)

    def to_json(self) -> dict[str, Any]:
        """Return the same under the key ``table``; nothing for the plain layout where nothing is to be said."""
        if not self.lines:
            return {}
        beside = {"left_out": dict(self.left_out)} if self.left_out else {}
        notes = [*self.notes, *self.warnings]
        return {"table": {"layout": self.layout, "notes": notes, **beside}}

    def warned(self) -> Comparisons:
        """Return the comparisons, with a Python warning of which lines were left out."""
        if self.warnings:
            warnings.warn("\n".join(self.warnings), stacklevel=3)
        return self.comparisons


class _Asked(NamedTuple):
    """How a table is to be read."""

    layout: str | None = None
    codes: Sequence[str] = ()
    keep_na: bool = False


def read_any(
    source: str | Path | BinaryIO | Iterable[str] | CodedTable,
    file: str = "",
    *,
    layout: str | None = None,
    choice_codes: Sequence[str] = (),
    keep_na: bool = False,
) -> TableRead:
    """Read a table of comparisons of any layout that is known, and say which it was.

    Lines in which a needed name or choice is a word for a missing value, such as ``NA``, are left out and named in
    ``warnings``; in ``first`` such a word means unknown.

    Parameters
    ----------
    source
        Path of a CSV table or of a MAT-file with a matrix of counts; a binary stream of CSV; its lines; or its columns.
    file
        Name of a stream, of lines or of columns in findings.
    layout
        ``winner-loser``, ``pwcmp``, ``items``, ``options``, ``matrix`` or ``trials``, as `analysis.comparisons.layouts`
        has them; None to recognise it by its header.
    choice_codes
        For layouts with a column of choices: what stands there for the first option, the second and so on, and then for
        neither. Without, a choice is an item's name, or the end of a column's, such as ``a``.
    keep_na
        Whether words for missing values, such as ``NA`` and ``None``, are names like others.

    Returns
    -------
    TableRead
        The comparisons, and how they were read.

    Raises
    ------
    ResultsError
        As `parse_table`, or if the table is not of the layout that was asked for.

    Examples
    --------
    >>> lines = ["observer,condition_A,condition_B,is_A_selected", "01,a,b,1", "01,b,a,1", "02,a,b,1"]
    >>> table = read_any(lines, "table.csv")
    >>> table.layout, table.comparisons.wins.tolist()
    ('pwcmp', [[0.0, 2.0], [1.0, 0.0]])
    """
    asked = _Asked(layout, choice_codes, keep_na)
    if isinstance(source, str | Path):
        return _read_path(Path(source), asked)
    if isinstance(source, CodedTable):
        return _read(ColumnSource(source), file, asked)
    if isinstance(source, io.BufferedIOBase):
        return _read_stream(cast(BinaryIO, source), file, asked)
    return _read_lines(cast(Iterable[str], source), file, asked)


def read_table(path: str | Path) -> Comparisons:
    """Read the comparisons in the CSV file at ``path``.

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
    return read_any(path).warned()


def parse_table(lines: Iterable[str], file: str) -> Comparisons:
    """Read the comparisons in ``lines`` of CSV; ``file`` is the name that findings carry.

    ``count`` is 1 where it is not given; it may be a fraction. ``first`` is the item shown first. A line whose
    ``outcome`` is ``tie`` prefers neither item; or ``ties`` says how many answers preferred neither, beside the
    ``count`` that preferred the winner. ``group``, also called ``scene`` or ``content``, is what a pair was compared
    within, such as the scene that all its pictures show. Blanks around a field do not belong to it; empty lines are
    passed over. Lines in which a value is missing (``NA`` and the like) are left out, with a Python warning.

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
    return _read_lines(lines, file, _Asked()).warned()


def _read_path(path: Path, asked: _Asked) -> TableRead:
    if path.is_dir():
        remedy = f"for a folder of sessions: cyclopean report {path}"
        raise ResultsError(Finding("the table cannot be read: it is a folder", str(path), remedy=remedy))
    try:
        with open_regular(path, "table", error=ResultsError) as stream:
            if path.suffix.lower() == ".mat":
                return _with_named_items(TableRead(*read_mat_table(stream, str(path))), str(path), asked)
            return _read_stream(stream, str(path), asked)
    except OSError as error:
        raise ResultsError(unreadable(error, path, "table")) from error


def _read_stream(stream: BinaryIO, file: str, asked: _Asked) -> TableRead:
    stream = stream if isinstance(stream, io.BufferedReader) else io.BufferedReader(cast(io.RawIOBase, stream))
    start = stream.peek(4)[:4]
    if start == WORKBOOK:
        return _read_lines(io.StringIO(decoded(stream.read(), file, error=ResultsError)), file, asked)
    encoding = encoding_of(start)
    text = io.TextIOWrapper(stream, encoding=encoding, newline="")
    try:
        lines = iter(lambda: text.readline(MOST_LETTERS + 1), "")
        return _read_lines(lines, file, asked)
    except UnicodeDecodeError as error:
        raise ResultsError(not_text(encoding, file)) from error
    finally:
        text.detach()


def _read_lines(lines: Iterable[str], file: str, asked: _Asked) -> TableRead:
    return _read(LineSource(lines, file), file, asked)


def _read(source: TableSource, file: str, asked: _Asked) -> TableRead:
    findings: list[Finding] = []
    try:
        source.start()
        layout = find_layout(source.header, file, asked.layout)
        reading = layout.reading(source.header, source.written, file, asked.codes)
        codes = {code.lower() for code in asked.codes}
        words = frozenset() if asked.keep_na else frozenset(word for word in WORDS if word.lower() not in codes)
        missing = Missing(file, reading.needed, reading.unknown, words)
        tally, source.counts = Tally(), reading.counts
        for block in source.blocks():
            findings += _take_in(block, tally, reading, missing)
            if len(findings) >= MOST_FINDINGS:
                break
    except csv.Error as error:
        place = max(source.line, 1)
        findings.append(Finding(f"this is not valid CSV: {error}", file, place, 1, "check the quotes"))
    if findings:
        raise ResultsError(findings[:MOST_FINDINGS])
    comparisons = tally.comparisons()
    if comparisons is None and missing.lines:
        raise ResultsError(missing.everything())
    if wrong := reading.end():
        raise ResultsError(Finding(wrong[0], file, max(source.line, 1), 1, wrong[1]))
    if comparisons is None:
        remedy = "add one line for each comparison, such as 'a,b'"
        raise ResultsError(Finding("the table has no comparison", file, max(source.line, 1), 1, remedy))
    table = TableRead(comparisons, layout.name, reading.notes, missing.sentences, missing.to_json())
    return _with_named_items(table, file, asked)


def _take_in(block: RowBlock, tally: Tally, reading: LayoutReading, missing: Missing) -> list[Finding]:
    """Count the rows of ``block`` in which nothing is missing, or return their faults."""
    if isinstance(block, ColumnBlock):
        kept = missing.without_rows(block)
        if _counted(tally, reading, kept.columns):
            return []
        rows = kept.rows
    else:
        rows = block.rows
        if missing.occurs(rows):
            rows = missing.without(block.numbered())
    if not rows or _added(tally, reading, rows):
        return []
    return _find_faults(block.numbered(), reading, missing)


def _with_named_items(table: TableRead, file: str, asked: _Asked) -> TableRead:
    """Return ``table``, with a note where some answers name no observer.

    Raises
    ------
    ResultsError
        If an item of a matrix is called as a missing value is.
    """
    told = table.comparisons
    unnamed = [item for item in told.items if item in WORDS]
    if table.layout == "matrix" and unnamed and not asked.keep_na:
        remedy = f"name the item; or, if the word is its name: {KEEP}"
        raise ResultsError(Finding(f"an item has '{unnamed[0]}' for its name", file, 1, 1, remedy))
    if "" in told.observers and len(told.observers) > 1:
        what = "lines that name no observer count as those of one observer without a name"
        return replace(table, notes=(*table.notes, what))
    return table


def _added(tally: Tally, reading: LayoutReading, rows: Sequence[Row]) -> bool:
    """Count ``rows`` and say True, or say False if one of them has a fault."""
    if all(len(row) == reading.width for row in rows) and _counted(tally, reading, list(zip(*rows, strict=True))):
        return True
    kept = [row for row in rows if any(field.strip() for field in row)]
    return len(kept) < len(rows) and (not kept or _added(tally, reading, kept))


def _counted(tally: Tally, reading: LayoutReading, columns: Sequence[Texts]) -> bool:
    """Count rows by their ``columns`` and say True, or say False if one of them has a fault."""
    told = reading.translate(columns)
    if told is not None and not isinstance(columns[0], Coded):  # whose distinct texts differ from block to block
        told = {name: plain(texts) for name, texts in told.items()}
    return told is not None and (not told or tally.add_columns(told))


def _find_faults(rows: Iterable[NumberedRow], reading: LayoutReading, missing: Missing) -> list[Finding]:
    """Return a finding for each faulty line, up to twenty."""
    findings: list[Finding] = []
    for row, number, line in rows:
        fault = None if missing.left_out(row) else reading.fault(missing.cleaned(row))
        if fault:
            place, message, remedy = fault
            findings.append(Finding(message, missing.file, number, line.column_of(place), remedy))
            if len(findings) == MOST_FINDINGS:
                break
    return findings
