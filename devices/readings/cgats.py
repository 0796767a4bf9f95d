"""The tables of a CGATS file as text, with the place of everything in it: keywords, the names of fields, rows."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from devices.errors import DeviceError
from documents import Finding

_TOKEN = re.compile(r'"((?:[^"]|"")*)"|(\S+)')
_MOST_FINDINGS = 20
MOST_FIELDS = 5000


@dataclass(frozen=True, slots=True)
class Cell:
    """A word of the file and where it stands, counted from 1."""

    text: str
    line: int
    column: int


@dataclass(slots=True)
class CgatsTable:
    """A table of a file; ``end`` is where something that lacks would have to stand, ``kind`` the table's first word."""

    file: str
    kind: str = ""
    keywords: dict[str, Cell] = field(default_factory=dict)
    fields: list[Cell] = field(default_factory=list)
    rows: list[list[Cell]] = field(default_factory=list)
    end: Cell = field(default_factory=lambda: Cell("", 1, 1))

    def names(self) -> list[str]:
        """Return the names of the fields."""
        return [cell.text for cell in self.fields]

    def finding(self, message: str, at: Cell, remedy: str) -> Finding:
        """Return what is wrong ``at`` a place."""
        return Finding(message, self.file, at.line, at.column, remedy)


def read_table(lines: Sequence[str], file: str, after: int = 0) -> CgatsTable:
    """Read the first table in ``lines`` after line number ``after``; ``file`` is the name that findings carry.

    Raises
    ------
    DeviceError
        With line and column: if a quote is left open, a field stands twice, there is no format or no data, the table
        is cut off, or a row, or the table, has not as many entries as the file says.
    """
    table = CgatsTable(file)
    findings: list[Finding] = []
    inside, opened, done = "", table.end, False
    for number, line in enumerate(lines[after:], start=after + 1):
        cells = [
            Cell(m[1].replace('""', '"') if m[1] is not None else m[2], number, m.start() + 1)
            for m in _TOKEN.finditer(line)
        ]
        if not cells or cells[0].text.startswith("#"):
            continue
        findings += [
            table.finding("a quotation mark is not closed", cell, "close it in the same line")
            for cell, m in zip(cells, _TOKEN.finditer(line), strict=True)
            if m[2] and m[2].startswith('"')
        ]
        first = cells[0]
        if first.text.startswith("BEGIN_"):
            inside, opened = first.text.removeprefix("BEGIN_"), first
        elif first.text.startswith("END_"):
            inside, done = "", first.text == "END_DATA"
        elif inside == "DATA_FORMAT":
            table.fields += cells
        elif inside == "DATA":
            table.rows.append(cells)
        elif len(cells) > 1:
            table.keywords[first.text] = cells[1]
        elif not table.kind:
            table.kind = first.text
        table.end = first
        if done:
            break
    names = table.names()
    if len(names) > MOST_FIELDS:
        raise DeviceError(
            table.finding(f"the table has {len(names)} fields", table.fields[0], f"{MOST_FIELDS} at most")
        )
    findings += [
        table.finding(f"the field {cell.text} stands twice", cell, "give each field a name of its own")
        for place, cell in enumerate(table.fields)
        if cell.text in names[:place]
    ]
    if not table.fields:
        findings.append(table.finding("the file names no fields", table.end, "BEGIN_DATA_FORMAT and their names"))
    elif not done:
        at = opened if inside else table.end
        findings.append(table.finding("the table is not closed by END_DATA", at, "was the file cut off?"))
    elif not table.rows:
        findings.append(table.finding("the table holds no measurements", table.end, "was the file cut off?"))
    findings += [finding for row in table.rows if (finding := _length(table, row)) is not None]
    for keyword, what, count in (
        ("NUMBER_OF_FIELDS", "fields", len(names)),
        ("NUMBER_OF_SETS", "rows", len(table.rows)),
    ):
        declared = table.keywords.get(keyword)
        if declared is not None and declared.text.strip() != str(count):
            said = f"{keyword} is {declared.text}, and there are {count} {what}"
            findings.append(table.finding(said, declared, "was the file cut off, or changed by hand?"))
    if findings:
        raise DeviceError(findings[:_MOST_FINDINGS])
    return table


def later_table(lines: Sequence[str], first: CgatsTable, kind: str) -> CgatsTable | None:
    """Return the table that stands after ``first`` under the line ``kind``, or None; errors as `read_table`."""
    for number in range(first.end.line, len(lines)):
        if lines[number].strip() == kind:
            return read_table(lines, first.file, number)
    return None


def _length(table: CgatsTable, row: list[Cell]) -> Finding | None:
    wanted = len(table.fields)
    if len(row) == wanted or not wanted:
        return None
    last = row[min(len(row), wanted + 1) - 1]
    at = last if len(row) > wanted else Cell("", last.line, last.column + len(last.text) + 1)
    return table.finding(f"the line has {len(row)} fields, the format {wanted}", at, "a value for each field")
