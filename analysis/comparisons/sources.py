"""Where the rows of a table of comparisons come from: lines of CSV, or the columns of a data frame.

Both come block by block. A block has its rows as texts, and says of each at which line of CSV it stands, so that a
finding names the same place whichever way a table comes. The columns of a frame come as their distinct texts, so that
most of what is asked of a text is asked once.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain, islice
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from analysis.errors import ResultsError
from documents import Finding
from documents.tables import csv_lines, separator_of

BLOCK_ROWS = 1 << 15
MOST_LETTERS = 4_000_000  # of a line
_BREAK = re.compile(r"\r\n|[\r\n]")

Row = Sequence[str]


@dataclass(frozen=True, slots=True)
class WrittenRow:
    """A row as it stands in a file: its ``text``, in which ``separator`` stands between cells."""

    text: str
    separator: str = ","

    def column_of(self, field: int) -> int:
        """Return where ``field`` (from 0) starts, counted from 1; 1 if there is no such field."""
        quoted, passed = False, 0
        if field == 0:
            return 1
        for position, character in enumerate(self.text, start=1):
            if character == '"':
                quoted = not quoted
            elif character == self.separator and not quoted:
                passed += 1
                if passed == field:
                    return position + 1
        return 1


NumberedRow = tuple[Row, int, WrittenRow]


@dataclass(frozen=True, slots=True)
class Coded:
    """A column of texts: the distinct ones ``texts``, and for each row which of them, ``code`` of shape (rows,)."""

    texts: Sequence[str]
    code: NDArray[np.intp]

    def part(self, rows: slice | NDArray[np.bool_]) -> Coded:
        """Return some of the rows."""
        return Coded(self.texts, self.code[rows])


Texts = Sequence[str] | Coded


def coded(texts: Texts) -> Coded:
    """Return a column of texts as its distinct ones, in the order in which they are met."""
    if isinstance(texts, Coded):
        return texts
    number = {text: place for place, text in enumerate(dict.fromkeys(texts))}
    return Coded(list(number), np.fromiter(map(number.__getitem__, texts), np.intp, len(texts)))


def plain(texts: Texts) -> Sequence[str]:
    """Return the text of each row."""
    return [texts.texts[code] for code in texts.code.tolist()] if isinstance(texts, Coded) else texts


def joined(columns: Sequence[Coded]) -> tuple[list[str], list[NDArray[np.intp]]]:
    """Return the texts of some columns, without the blanks around them, and which of them each row has; -1: none."""
    number = {"": -1}
    codes = []
    for column in columns:
        texts = [text.strip() for text in column.texts]
        for text in texts:
            number.setdefault(text, len(number) - 1)
        codes.append(np.array([number[text] for text in texts], dtype=np.intp)[column.code])
    del number[""]
    return list(number), codes


@dataclass(frozen=True, slots=True)
class CodedTable:
    """A table as columns of texts, all of one length, with their ``names``."""

    names: Sequence[str]
    columns: Sequence[Coded]


class RowBlock(Protocol):
    """Some rows of a table."""

    @property
    def rows(self) -> Sequence[Row]:
        """Each row's texts."""
        ...

    def numbered(self) -> Iterator[NumberedRow]:
        """Yield the rows, each with the number and the text of its last line; empty rows are passed over."""
        ...


class TableSource(Protocol):
    """A table: ``header`` is its first row once it was started, ``written`` the lines that this stands in."""

    header: Row
    written: WrittenRow
    counts: Collection[int]
    """The columns of numbers of answers, once they are known."""

    def start(self) -> None:
        """Read the header; csv.Error if it is no CSV."""
        ...

    @property
    def line(self) -> int:
        """The number of the line that was read last."""
        ...

    def blocks(self) -> Iterator[RowBlock]:
        """Yield the rows below the header; csv.Error comes after the rows before it."""
        ...


class _Lines:
    """Passes lines on to the CSV reader and keeps those of the block at hand, so that a finding can name the place."""

    def __init__(self, lines: Iterable[str], file: str) -> None:
        self._lines, self._file, self._met = iter(lines), file, 0
        self.kept: list[str] = []

    def __iter__(self) -> Iterator[str]:
        return self

    def __next__(self) -> str:
        line = next(self._lines)
        if len(line) > MOST_LETTERS:
            what = f"a line has more than {MOST_LETTERS / 1e6:g} million letters"
            raise ResultsError(Finding(what, self._file, self._met + 1, 1, "check that it is a table with line ends"))
        self._met += 1
        self.kept.append(line)
        return line


@dataclass(frozen=True, slots=True)
class LineBlock:
    """The ``rows`` that ``lines`` of CSV hold; ``begin`` lines of the file stand before them."""

    rows: Sequence[Row]
    lines: Sequence[str]
    begin: int
    separator: str = ","
    pointed: Collection[int] = ()
    """The columns in which a comma is a decimal one."""

    def numbered(self) -> Iterator[NumberedRow]:
        """As `RowBlock`."""
        last = ""

        def remembered() -> Iterator[str]:
            nonlocal last
            for line in self.lines:
                last = line
                yield line

        reader = csv.reader(remembered(), strict=True, delimiter=self.separator)
        for row in islice(reader, len(self.rows)):
            if any(cell.strip() for cell in row):
                yield with_points(row, self.pointed), self.begin + reader.line_num, WrittenRow(last, self.separator)


def with_points(row: Row, places: Collection[int]) -> Row:
    """Return ``row`` with decimal points for the commas in its cells at ``places``."""
    return [cell.replace(",", ".") if place in places else cell for place, cell in enumerate(row)] if places else row


class LineSource:
    """Lines of CSV; ResultsError if one is too long."""

    def __init__(self, lines: Iterable[str], file: str) -> None:
        self._lines = _Lines(lines, file)
        self._reader = csv.reader(self._lines, strict=True)
        self.header: Row = ()
        self.written = WrittenRow("")
        self.counts: Collection[int] = ()
        self._file, self._marks = file, set[str]()

    @property
    def line(self) -> int:
        """As `TableSource`."""
        return self._reader.line_num

    def start(self) -> None:
        """As `TableSource`."""
        first = next(self._lines, "")
        separator = separator_of(first)
        self._reader = csv.reader(chain([first], self._lines), strict=True, delimiter=separator)
        self.header = next(self._reader, [])
        self.written = WrittenRow("".join(self._lines.kept), separator)

    def blocks(self) -> Iterator[LineBlock]:
        """As `TableSource`."""
        while True:
            begin, self._lines.kept = self._reader.line_num, []
            rows: list[list[str]] = []
            wrong = None
            try:
                rows.extend(islice(self._reader, BLOCK_ROWS))
            except csv.Error as error:
                wrong = error
            if rows:
                block = LineBlock(rows, self._lines.kept, begin, self.written.separator)
                yield block if block.separator == "," else self._with_points(block, rows)
            if wrong:
                raise wrong
            if not rows:
                return

    def _with_points(self, block: LineBlock, rows: list[list[str]]) -> LineBlock:
        """Return ``block`` with points for decimal commas; ResultsError where both are met, at the first other one."""
        met = {place: {row[place] for row in rows if place < len(row)} for place in self.counts}
        marks = {mark for mark in ",." for cells in met.values() if any(mark in cell for cell in cells)}
        if len(self._marks | marks) > 1:
            each = ((place, *row) for row in block.numbered() for place in self.counts if place < len(row[0]))
            for place, row, number, line in each:
                self._marks |= {*row[place]} & {",", "."}
                if len(self._marks) > 1:
                    remedy = "write all numbers with a decimal comma, or all with a point"
                    what = f"the count is '{row[place].strip()}'"
                    raise ResultsError(Finding(what, self._file, number, line.column_of(place), remedy))
        self._marks |= marks
        if "," not in marks:
            return block
        for place, cells in met.items():
            pointed = {cell: cell.replace(",", ".") for cell in cells}
            for own in rows:
                if place < len(own):
                    own[place] = pointed[own[place]]
        return replace(block, pointed=self.counts)


@dataclass(frozen=True)
class ColumnBlock:
    """Rows of a frame: its ``columns``, and at which line of CSV each row would end, ``number`` of shape (rows,)."""

    columns: Sequence[Coded]
    number: NDArray[np.intp]

    @cached_property
    def rows(self) -> Sequence[Row]:
        """Each row's texts."""
        texts = (map(column.texts.__getitem__, column.code.tolist()) for column in self.columns)
        return list(zip(*texts, strict=True))

    def numbered(self) -> Iterator[NumberedRow]:
        """As `RowBlock`."""
        for row, number in zip(self.rows, self.number.tolist(), strict=True):
            if any(cell.strip() for cell in row):
                yield row, number, WrittenRow(_BREAK.split(_as_line(row))[-1])

    def part(self, rows: slice | NDArray[np.bool_]) -> ColumnBlock:
        """Return some of the rows."""
        return ColumnBlock([column.part(rows) for column in self.columns], self.number[rows])


class ColumnSource:
    """Columns of texts, read as the CSV that they would be written as is read."""

    def __init__(self, table: CodedTable) -> None:
        self.header: Row = table.names
        self.counts: Collection[int] = ()
        self.written = WrittenRow(_as_line(table.names))
        rows = len(table.columns[0].code) if table.columns else 0
        ends = np.ones(rows, dtype=np.intp)
        for column in table.columns:
            breaks = np.array([_breaks(text) for text in column.texts], dtype=np.intp)
            if breaks.any():
                ends += breaks[column.code]
        start = 1 + _breaks(self.written.text)
        self._whole = ColumnBlock(table.columns, start + np.cumsum(ends))
        self.line = start

    def start(self) -> None:
        """As `TableSource`: the header is there."""

    def blocks(self) -> Iterator[ColumnBlock]:
        """As `TableSource`."""
        for start in range(0, len(self._whole.number), BLOCK_ROWS):
            block = self._whole.part(slice(start, start + BLOCK_ROWS))
            self.line = int(block.number[-1])
            yield block


def _breaks(text: str) -> int:
    return len(_BREAK.findall(text)) if "\n" in text or "\r" in text else 0


def _as_line(row: Row) -> str:
    """Return a row of texts as CSV, without its line end; fields that hold one are quoted."""
    return csv_lines([row], "")
