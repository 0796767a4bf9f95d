"""Tables that people bring: described by their columns, read by one reader.

A `Form` says what the columns are called, here and in other programs, which are needed, and what numbers may stand in
them. The reader finds the rest: commas, semicolons or tabs between columns; where it is not commas, decimal commas too;
UTF-8 or UTF-16, or the workbook of a spreadsheet; comments, which begin with ``#`` and may hold ``key: value``; units
behind a name, as in ``X (cd/m2)``. All faults of a table are told at once, each with its line and column.
"""

from __future__ import annotations

import csv
import io
import math
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any
from zipfile import ZipFile

import numpy as np

from documents.arrays import Floats
from documents.files.regular_files import read_regular
from documents.findings import Finding, InputError
from documents.text.words import did_you_mean, nearest

MOST_FINDINGS = 20
ENDINGS = (".csv", ".tsv", ".txt", ".xlsx")  # of files that are tables
WORKBOOK = b"PK\x03\x04"
_MOST_UNPACKED = 2_000_000_000  # bytes of a workbook: a million rows have some hundred million
SEPARATORS: Mapping[str, str] = {",": "commas", ";": "semicolons", "\t": "tabs"}
_ERRORS = ("#N/A", "#NA", "#NULL!", "#NUM!", "#VALUE!", "#DIV/0!", "#REF!", "#NAME?")  # as spreadsheets write them
_WITH_UNIT = re.compile(r"(.+?)\s*[(\[]\s*(.+?)\s*[)\]]")
# Each unit as we write it, and as others do, in small letters without blanks and signs of powers.
_UNITS = {"cd/m²": ("cd/m2", "cdm-2", "cd/sqm", "nit", "nits"), "s": ("s", "sec", "seconds"), "nm": ("nm",)}
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?")


@dataclass(frozen=True, slots=True)
class ColumnSpec:
    """A column of a table.

    Attributes
    ----------
    name
        What it is called.
    also
        What other programs call it. Names are compared without regard to capitals where that is not ambiguous.
    text
        Whether it holds texts; else it holds finite numbers.
    needed
        Whether a table must have it.
    least, most
        Between what its numbers lie, both included.
    empty
        The number for which an empty cell stands; None where it is a fault.
    unit
        The unit of its numbers, which may stand behind the name in brackets; no other may.
    """

    name: str
    also: tuple[str, ...] = ()
    text: bool = False
    needed: bool = True
    least: float = -math.inf
    most: float = math.inf
    empty: float | None = None
    unit: str = ""

    @property
    def wanted(self) -> str:
        """What a cell must hold, in words."""
        if math.isinf(self.least) and math.isinf(self.most):
            return "a finite number is needed"
        if math.isinf(self.most):
            return f"give a number from {self.least:g} up"
        return f"a number in {self.least:g}..{self.most:g} is needed"


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """A table as it was read: numbers and texts by column, each row in the file's order.

    Attributes
    ----------
    file
        The name that findings carry.
    said
        What the comments with a ``key: value`` say, by key in small letters: the value and its line.
    header, header_line
        The names as they were written, and where.
    places
        Which cell of a row each column is, from 0.
    lines, rows
        The line of each row, from 1, and its cells without blanks around them.
    """

    file: str
    said: Mapping[str, tuple[str, int]]
    header: tuple[str, ...]
    header_line: int
    places: Mapping[str, int]
    lines: tuple[int, ...]
    rows: Sequence[Sequence[str]]
    _numbers: Mapping[str, Floats]

    def __contains__(self, column: str) -> bool:
        return column in self.places

    def __len__(self) -> int:
        return len(self.rows)

    def numbers(self, *columns: str) -> Floats:
        """Return the numbers of one column, shape (n,), or of several, shape (n, columns)."""
        found = [self._numbers[column] for column in columns]
        return found[0] if len(found) == 1 else np.stack(found, axis=1)

    def texts(self, column: str) -> list[str]:
        """Return the texts of a column; of one that the table does not have, empty ones."""
        place = self.places.get(column)
        return [""] * len(self.rows) if place is None else [row[place] for row in self.rows]

    def comment(self, key: str, otherwise: str = "") -> str:
        """Return what the comment ``key: value`` says."""
        return self.said[key][0] if key in self.said else otherwise

    def line_of(self, key: str) -> int | None:
        """Return the line of the comment ``key: value``; None where there is none."""
        return self.said[key][1] if key in self.said else None

    def fault(self, row: int, column: str | None, what: str, remedy: str | None = None) -> Finding:
        """Return a finding with the place of a cell, or of a row."""
        place = self.places.get(column) if column is not None else None
        return Finding(what, self.file, self.lines[row], None if place is None else place + 1, remedy)


def _apart(text: str) -> tuple[dict[str, tuple[str, int]], list[tuple[int, str]]]:
    """Return the comments with a key, and the other lines that are not empty, with their numbers."""
    said: dict[str, tuple[str, int]] = {}
    kept: list[tuple[int, str]] = []
    for number, line in enumerate(text.splitlines(keepends=True), start=1):
        if is_comment(line):
            key, _, value = line.strip().lstrip("# ").partition(":")
            said[key.strip().lower()] = value.strip(), number
        elif line.strip(" \t\r\n,;"):
            kept.append((number, line))
    return said, kept


def _nothing_more(_: Cells) -> Iterable[Finding]:
    return ()


@dataclass(frozen=True, slots=True)
class Form:
    """What a kind of table holds.

    Attributes
    ----------
    columns
        Its columns.
    what
        What it is called in messages.
    error
        The error that is raised.
    most_bytes
        The largest file that is read.
    instead
        Other sets of columns; the first of which a header has all that are needed, spelt as they are, is taken.
    misspelt
        Whether a column with almost the name of one of ours is refused, rather than left alone.
    others
        What every other column with a name is, under its own name; None leaves them alone.
    """

    columns: tuple[ColumnSpec, ...]
    what: str = "table"
    error: type[InputError] = InputError
    most_bytes: int = 10_000_000
    instead: tuple[tuple[ColumnSpec, ...], ...] = ()
    misspelt: bool = False
    others: ColumnSpec | None = None

    def read(self, path: str | os.PathLike[str], more: Callable[[Cells], Iterable[Finding]] = _nothing_more) -> Cells:
        """Return the table in the file at ``path``, as `parse` does.

        Raises
        ------
        InputError
            Of the form's class, as `parse`, or if the file cannot be read.
        """
        content = read_regular(path, self.most_bytes, self.what, error=self.error)
        return self.parse(decoded(content, str(path), self.what, self.error), str(path), more)

    def parse(self, text: str, file: str, more: Callable[[Cells], Iterable[Finding]] = _nothing_more) -> Cells:
        r"""Return the table that ``text`` holds.

        Parameters
        ----------
        text
            The whole table.
        file
            The name that findings carry.
        more
            Returns what else is wrong with a table whose rows all have as many cells as the header; such findings are
            told with those of the numbers.

        Returns
        -------
        Cells
            At least one row.

        Raises
        ------
        InputError
            Of the form's class, with the first twenty faults.

        Examples
        --------
        >>> form = Form((ColumnSpec("X", unit="cd/m²"), ColumnSpec("name", text=True, needed=False)))
        >>> table = form.parse("X (cd/m2);name\n0,5;a\n12;b\n", "seen.csv")
        >>> table.numbers("X").tolist(), table.texts("name")
        ([0.5, 12.0], ['a', 'b'])
        """
        said, written = _apart(text.removeprefix("\ufeff"))
        names = (name for column in self.columns for name in (column.name, *column.also))
        separator = separator_of(written[0][1] if written else "", names)
        rows = self._split(written, separator, file)
        header_line, header = next(rows, (0, []))
        if not header:
            raise self.error(Finding(f"the {self.what} has no rows", file, remedy=self._columns_in_words(self.columns)))
        places, columns = self._places(header, file, header_line)
        findings: list[Finding] = []
        kept: list[tuple[int, list[str]]] = []
        for line, cells in rows:
            if len(cells) == len(header):
                kept.append((line, cells))
            else:
                what = f"the line has {len(cells)} fields, the header {len(header)}"
                findings.append(Finding(what, file, line, remedy="quote a text that holds the separator"))
        if not kept and not findings:
            raise self.error(Finding(f"the {self.what} has no rows", file, remedy=self._columns_in_words(columns)))
        lines = tuple(line for line, _ in kept)
        table = Cells(file, said, tuple(header), header_line, places, lines, [cells for _, cells in kept], {})
        numbers, wrong = _numbers_of(table, columns, separator)
        table = Cells(file, said, tuple(header), header_line, places, lines, table.rows, numbers)
        findings += [*wrong, *(more(table) if kept else ())]
        if findings:
            raise self.error(sorted(findings, key=lambda finding: finding.line or 0)[:MOST_FINDINGS])
        return table

    def _split(self, lines: Sequence[tuple[int, str]], separator: str, file: str) -> Iterator[tuple[int, list[str]]]:
        reader = csv.reader((line for _, line in lines), delimiter=separator, strict=True)
        before = 0
        try:
            for cells in reader:
                yield lines[before][0], [cell.strip() for cell in cells]
                before = reader.line_num
        except csv.Error as error:
            line = lines[min(before, len(lines) - 1)][0]
            raise self.error(Finding(f"the {self.what} is not CSV: {error}", file, line)) from error

    def _places(self, header: Sequence[str], file: str, line: int) -> tuple[dict[str, int], tuple[ColumnSpec, ...]]:
        """Return which cell each column is, and the columns of this table; what others are called does not matter."""
        columns = next((every for every in self.instead if _all_there(every, header)), self.columns)
        places: dict[str, int] = {}
        findings: list[Finding] = []
        for place, cell in enumerate(header):
            column, wrong = _column_of(cell, columns)
            if column is None and cell and self.others is not None:
                column = replace(self.others, name=cell)
                columns = (*columns, column)
            if wrong is None and column is not None and column.name in places:
                wrong = f"the column '{column.name}' stands twice", "keep one"
            if wrong is None and column is None and self.misspelt:
                known = [one.name for one in columns]
                if cell and nearest(cell, known, cutoff=0.75):
                    wrong = f"there is no column '{cell}'", did_you_mean(cell, known)
            if wrong is not None:
                findings.append(Finding(wrong[0], file, line, place + 1, wrong[1]))
            elif column is not None:
                places[column.name] = place
        missing = [column.name for column in columns if column.needed and column.name not in places]
        if missing and not findings:
            remedy = self._columns_in_words(columns)
            findings.append(Finding(f"the header has no {', '.join(missing)}", file, line, remedy=remedy))
        if findings:
            raise self.error(findings[:MOST_FINDINGS])
        return places, columns

    def _columns_in_words(self, columns: Sequence[ColumnSpec]) -> str:
        needed, beside = (",".join(one.name for one in columns if one.needed == asked) for asked in (True, False))
        return f"columns: {needed}" + (f"; and, if there are any, {beside}" if beside else "")


def is_comment(line: str) -> bool:
    """Return whether a line of a table is a comment: it begins with ``#``, and not with a spreadsheet's error.

    Examples
    --------
    >>> is_comment("# codes: 0..255"), is_comment("#N/A,0.5,1")
    (True, False)
    """
    bare = line.lstrip()
    return bare.startswith("#") and re.split(r"[,;\t]", bare, maxsplit=1)[0].strip() not in _ERRORS


def separator_of(header: str, names: Iterable[str] = ()) -> str:
    """Return what separates the columns of a ``header``: that by which most cells are of ``names``, else most cells.

    Examples
    --------
    >>> separator_of("red;green;blue"), separator_of("X"), separator_of("note, such as a;b", ["note"])
    (';', ',', ',')
    """
    known = {name.lower() for name in names}

    def worth(separator: str) -> tuple[int, int]:
        cells = [_bare(cell.strip().strip('"'))[0].lower() for cell in header.split(separator)]
        return sum(cell in known for cell in cells), len(cells)

    return max(SEPARATORS, key=worth)


def decoded(content: bytes, file: str, what: str = "table", error: type[InputError] = InputError) -> str:
    """Return the text of a table: UTF-8 with or without its mark, or UTF-16 with it, as spreadsheets save "Unicode".

    Of a workbook, it is the sheet as CSV with commas, a line for each of its rows.

    Raises
    ------
    InputError
        Of the class ``error``, if it is none of these, or nothing is installed that reads workbooks.

    Examples
    --------
    >>> decoded("X,Y".encode("utf-16"), "seen.csv")
    'X,Y'
    """
    if content.startswith(WORKBOOK):
        return _sheet(content, file, what, error)
    encoding = encoding_of(content)
    try:
        return content.decode(encoding)
    except UnicodeDecodeError as caught:
        raise error(not_text(encoding, file, what)) from caught


def encoding_of(start: bytes) -> str:
    """Return the encoding of a table by how it begins: UTF-16 with its mark, else UTF-8 with or without."""
    return "utf-16" if start.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8-sig"


def _sheet(content: bytes, file: str, what: str, error: type[InputError]) -> str:
    """Return the only sheet of a workbook that holds anything as CSV."""
    try:
        from openpyxl import load_workbook
    except ImportError:
        remedy = "to read workbooks: pip install openpyxl; or save the sheet as CSV, any separator will do"
        fault = Finding(f"the {what} is the workbook of a spreadsheet", file, remedy=remedy, code="workbook")
        raise error(fault) from None
    try:
        with ZipFile(io.BytesIO(content)) as parts:
            if sum(part.file_size for part in parts.infolist()) > _MOST_UNPACKED:
                raise ValueError(f"it unpacks to more than {_MOST_UNPACKED / 1e9:g} GB")
        sheets = {sheet.title: _cells(sheet) for sheet in load_workbook(io.BytesIO(content), True, data_only=True)}
    except Exception as caught:  # openpyxl has no error of its own for what is damaged
        fault = Finding(f"the workbook cannot be read: {caught}", file, remedy="save the sheet as CSV", code="workbook")
        raise error(fault) from caught
    held = {name: rows for name, rows in sheets.items() if any(rows)}
    if len(held) != 1:
        names = f"{len(held)} sheets hold something: {', '.join(held)}" if held else "no sheet holds anything"
        remedy = f"keep one, with the {what}, or save it as CSV"
        raise error(Finding(f"of the workbook {names}", file, remedy=remedy, code="workbook"))
    (rows,) = held.values()
    # A comment that was split at its commas makes no columns.
    comments = [bool(row) and is_comment(row[0]) for row in rows]
    width = max((len(row) for row, comment in zip(rows, comments, strict=True) if not comment), default=0)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    for row, comment in zip(rows, comments, strict=True):
        if comment:
            text.write(",".join(row) + "\n")
        else:
            writer.writerow(row + [""] * (width - len(row)))
    return text.getvalue()


def _cells(sheet: Any) -> list[list[str]]:
    """Return the rows of a sheet as texts, without empty cells behind; what is no table, such as a chart, has none."""
    texts: list[list[str]] = []
    if not hasattr(sheet, "reset_dimensions"):
        return texts
    sheet.reset_dimensions()  # which programs are known to write wrong
    for row in sheet.iter_rows(values_only=True):
        cells = ["" if cell is None else " ".join(str(cell).split()) for cell in row]
        while cells and not cells[-1]:
            cells.pop()
        texts.append(cells)
    return texts


def csv_lines(rows: Iterable[Iterable[object]], line_end: str = "\n") -> str:
    """Return ``rows`` as CSV, with commas, quoted where need be.

    Examples
    --------
    >>> csv_lines([("name", "X"), ("a,b", 0.5)])
    'name,X\\n"a,b",0.5\\n'
    """
    made: list[str] = []
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\r\n")  # whatever ends lines: only what is in it is quoted in a cell
    for row in rows:
        writer.writerow(row)
        made.append(text.getvalue()[:-2] + line_end)
        text.seek(0)
        text.truncate()
    return "".join(made)


def not_text(encoding: str, file: str, what: str = "table") -> Finding:
    """Return what is wrong with a table that is not in the encoding that its first bytes have."""
    kind = encoding.upper().removesuffix("-SIG")
    return Finding(f"the {what} is not {kind} text", file, remedy="save it as UTF-8")


def number_in(text: str, decimal_comma: bool = False) -> float:
    """Return the finite number that a cell holds, NaN if it holds none; ``1_000`` is none.

    Examples
    --------
    >>> number_in("0.5"), number_in("0,5", decimal_comma=True), number_in("1_0"), number_in("inf")
    (0.5, 0.5, nan, nan)
    """
    try:
        value = float(text.replace(",", ".") if decimal_comma else text)
    except ValueError:
        return math.nan
    return value if math.isfinite(value) and "_" not in text else math.nan


def _numbers_of(table: Cells, every: Sequence[ColumnSpec], separator: str) -> tuple[dict[str, Floats], list[Finding]]:
    """Return the numbers of each column, NaN where a cell holds none that may stand there, and findings of these.

    A comma is a decimal one only where it does not separate: between commas, "1,500" may be a thousand and a half.
    """
    columns = [column for column in every if not column.text and column.name in table]
    cells = {column.name: table.texts(column.name) for column in columns}
    commas = separator != "," and any(
        _DECIMAL_COMMA.fullmatch(cell) for texts in cells.values() for cell in texts if "," in cell
    )
    numbers: dict[str, Floats] = {}
    findings: list[Finding] = []
    for column in columns:
        texts = cells[column.name]
        values = np.array([_value(cell, column, commas) for cell in texts], dtype=np.float64)
        numbers[column.name] = values
        with np.errstate(invalid="ignore"):
            sound = (values >= column.least) & (values <= column.most)
        for row in np.flatnonzero(~sound)[:MOST_FINDINGS].tolist():
            mixed = commas and math.isfinite(number_in(texts[row])) and "." in texts[row]
            remedy = "write all numbers with a decimal comma, or all with a point" if mixed else column.wanted
            findings.append(table.fault(row, column.name, f"{column.name} is '{texts[row]}'", remedy))
    return numbers, findings


def _value(cell: str, column: ColumnSpec, commas: bool) -> float:
    if not cell and column.empty is not None:
        return column.empty
    if commas and "." in cell:  # 1.500 is one number with decimal commas and another with points
        return math.nan
    return number_in(cell, commas)


def _bare(cell: str) -> tuple[str, str]:
    """Return a name and the unit in brackets behind it."""
    found = _WITH_UNIT.fullmatch(cell)
    return (found[1], found[2]) if found else (cell, "")


def _column_of(cell: str, columns: Sequence[ColumnSpec]) -> tuple[ColumnSpec | None, tuple[str, str] | None]:
    """Return the column that a cell of the header names, and what is wrong with its unit."""
    name, unit = _bare(cell)
    named = [column for column in columns if name in (column.name, *column.also)]
    alike = [column for column in columns if name.lower() in (known.lower() for known in (column.name, *column.also))]
    column = next(iter(named or alike), None)
    if column is None or not unit:
        return column, None
    plain = unit.lower().replace("²", "2").replace("⁻", "-").translate(str.maketrans("", "", " ^·*"))
    if column.unit and plain in (column.unit, *_UNITS.get(column.unit, ())):
        return column, None
    if not column.unit:
        return None, None
    return column, (f"{column.name} is in {unit}", f"give it in {column.unit}")


def _all_there(columns: Sequence[ColumnSpec], header: Sequence[str]) -> bool:
    names = {_bare(cell)[0] for cell in header}
    return all(names & {column.name, *column.also} for column in columns if column.needed)
