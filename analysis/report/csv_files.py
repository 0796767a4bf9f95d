"""The tables of a report as CSV files, safe to open in a spreadsheet."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterable
from pathlib import Path

from analysis.report.blocks import Cell, Column, Table
from documents.files.whole_file import write_whole

# What a spreadsheet takes for the beginning of a formula, or skips before looking for one.
FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r", "\n", "\uff1d", "\uff0b", "\uff0d", "\uff20")


def write_csv_files(tables: Iterable[Table], folder: Path) -> tuple[Path, ...]:
    """Write each table to ``folder`` as ``NAME.csv`` and return the files; each is written whole or not at all.

    Raises
    ------
    OSError
        If the folder or a file cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    files: list[Path] = []
    for table in tables:
        file = folder / f"{_safe(table.name)}.csv"
        write_whole(file, csv_text(table))
        files.append(file)
    return tuple(files)


def _safe(name: str) -> str:
    """Return a name of a table, which may hold what people called a scale, as one of a file."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", name)[:80]


def csv_text(table: Table) -> str:
    """Return the table as CSV (RFC 4180): numbers in full, an empty field for none.

    Text that a spreadsheet would take for a formula has an apostrophe put before it.
    """
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n")
    writer.writerow([key for column in table.columns for key in _keys(column)])
    for row in table.rows:
        writer.writerow(
            [field for column, cell in zip(table.columns, row, strict=True) for field in _fields(column, cell)]
        )
    return out.getvalue()


def _keys(column: Column) -> list[str]:
    names = [f"{column.key}_low", f"{column.key}_high"] if column.kind == "interval" else [column.key]
    return [inert(name) for name in names]


def _fields(column: Column, cell: Cell) -> list[str]:
    if column.kind == "interval":
        ends = cell if isinstance(cell, tuple) else (None, None)
        return [_field(end) for end in ends]
    if isinstance(cell, tuple):
        return [inert("; ".join(str(part) for part in cell))]
    return [_field(cell)]


def _field(value: str | float | int | None) -> str:
    if value is None:
        return ""
    if isinstance(value, str):
        return inert(value)
    return "" if math.isnan(value) else repr(value)


def inert(text: str) -> str:
    """Return ``text`` so that no spreadsheet takes it for a formula."""
    return f"'{text}" if text.lstrip(" ").startswith(FORMULA_STARTS) else text
