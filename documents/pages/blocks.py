"""The contents of a page: sections of paragraphs, facts, tables and figures, all plain data; and tables as CSV.

Text is plain text; the template escapes it. Only figures contain markup, which this package draws.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar, Literal, TypeAlias

from documents.figures import Drawing
from documents.files import make_private, whole_file, write_whole
from documents.findings import Finding, InputError
from documents.tables import csv_lines
from documents.text import chance, fixed

ColumnKind = Literal["text", "number", "p", "interval", "class", "list", "swatches"]
Tone: TypeAlias = Literal["good", "bad", "open", ""]
Interval: TypeAlias = tuple[float | None, float | None]


@dataclass(frozen=True, slots=True)
class ShownAs:
    """A number, or an interval, that the page shows as ``text``, such as "≤ 0"; CSV has the number itself."""

    value: float | Interval | None
    text: str
    tone: Tone = ""


@dataclass(frozen=True, slots=True)
class Badge:
    """A word in a box, such as "passed": of a ``good`` outcome, a ``bad`` one, an ``open`` one, or of none."""

    text: str
    tone: Tone = ""


Cell: TypeAlias = str | float | int | Interval | tuple[str, ...] | ShownAs | Badge | None


@dataclass(frozen=True, slots=True)
class Column:
    """A column: its heading on the page, its key in CSV, the kind of its values, and how many digits the page shows.

    ``p`` is a p value. An ``interval`` is two numbers, and two columns of a CSV file; a ``class`` a label such as
    "3+4"; a ``list`` several texts. ``signed`` numbers above zero have a plus sign.
    """

    heading: str
    key: str
    kind: ColumnKind = "text"
    digits: int = 0
    unit: str = ""
    signed: bool = False


def cell_text(cell: Cell, column: Column) -> str:
    """Return a cell as people read it, on a page and in the terminal; a dash for none."""
    if isinstance(cell, ShownAs | Badge):
        return cell.text
    if column.kind == "interval":
        low, high = cell if isinstance(cell, tuple) else (None, None)
        return "–" if low is None and high is None else f"{_end(low, column)} to {_end(high, column)}"
    if cell is None:
        return "–"
    if isinstance(cell, tuple):
        return "; ".join(map(str, cell)) or "–"
    if isinstance(cell, str) or column.kind not in ("number", "p"):
        return str(cell)
    if column.kind == "p":
        return chance(cell)
    return fixed(cell, column.digits, signed=column.signed) + (f"\u00a0{column.unit}" if column.unit else "")


def _end(value: float | str | None, column: Column) -> str:
    return value if isinstance(value, str) else fixed(value, column.digits)


@dataclass(frozen=True, slots=True)
class Table:
    """A table; its first column heads the rows. ``name`` is that of its CSV file, ``title`` its caption.

    ``pictures`` are small pictures beside the rows' heads, as data URIs by the head's text; ``shaded`` the numbers of
    rows that stand out.
    """

    name: str
    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    folded: bool = False
    pictures: Mapping[str, str] = field(default_factory=dict)
    shaded: Collection[int] = ()
    kind: ClassVar[str] = "table"

    @classmethod
    def of_texts(
        cls, title: str, headings: Sequence[str], rows: Iterable[Sequence[str]], words: Collection[int] = (0,)
    ) -> Table:
        """Return a table for the terminal of cells in words, those of the columns ``words``, and of written numbers."""
        kinds: list[ColumnKind] = ["text" if place in words else "number" for place in range(len(headings))]
        columns = tuple(Column(head, head, kind) for head, kind in zip(headings, kinds, strict=True))
        return cls("", title, columns, tuple(map(tuple, rows)))


@dataclass(frozen=True, slots=True)
class Paragraph:
    """A paragraph of text; ``small`` for explanations. ``blanks`` are parts of it, in order, to be filled in.

    It begins with the ``mark`` if there is one.
    """

    text: str
    small: bool = False
    blanks: tuple[str, ...] = ()
    mark: Badge | None = None
    kind: ClassVar[str] = "paragraph"

    @property
    def pieces(self) -> tuple[tuple[str, bool], ...]:
        """The text in pieces, each with whether it is a blank."""
        pieces, rest = [], self.text
        for blank in self.blanks:
            before, _, rest = rest.partition(blank)
            pieces += [(before, False), (blank, True)]
        return tuple(piece for piece in [*pieces, (rest, False)] if piece[0])


@dataclass(frozen=True, slots=True)
class Heading:
    """A heading within a section."""

    text: str
    kind: ClassVar[str] = "heading"


@dataclass(frozen=True, slots=True)
class Facts:
    """Pairs of a term and its value."""

    rows: tuple[tuple[str, str], ...]
    folded: str = ""
    kind: ClassVar[str] = "facts"


@dataclass(frozen=True, slots=True)
class Figure:
    """A drawing for wide pages and one for narrow ones, if there is one; a caption, and the table behind it.

    ``name`` is that of its files.
    """

    name: str
    wide: Drawing
    narrow: Drawing | None = None
    caption: str = ""
    table: Table | None = None
    kind: ClassVar[str] = "figure"


@dataclass(frozen=True, slots=True)
class Beside:
    """Figures and tables that stand side by side where there is room."""

    blocks: tuple[Figure | Table, ...]
    kind: ClassVar[str] = "beside"


@dataclass(frozen=True, slots=True)
class Verbatim:
    """Lines as they are, such as a part of a file."""

    text: str
    kind: ClassVar[str] = "verbatim"


@dataclass(frozen=True, slots=True)
class MatrixCell:
    """A cell's text, its tooltip, its CSS colour, and whether that is dark."""

    text: str
    title: str
    tint: str
    dark: bool


@dataclass(frozen=True, slots=True)
class Matrix:
    """Rows and columns of the same names; None on the diagonal. ``table`` has the same as numbers."""

    title: str
    rows: tuple[tuple[str, tuple[MatrixCell | None, ...]], ...]
    table: Table
    folded: bool = False
    kind: ClassVar[str] = "matrix"


@dataclass(frozen=True, slots=True)
class PagePicture:
    """A picture's name, and its views as data URIs: a label such as "left eye", none of an only one, and the URI."""

    name: str
    views: tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class Gallery:
    """Pictures, small ones or as ``large`` as two of them fit side by side."""

    pictures: tuple[PagePicture, ...]
    folded: str = ""
    large: bool = False
    kind: ClassVar[str] = "gallery"


@dataclass(frozen=True, slots=True)
class Numbered:
    """A numbered list, from 1."""

    items: tuple[str, ...]
    kind: ClassVar[str] = "numbered"


Block: TypeAlias = Table | Heading | Paragraph | Facts | Figure | Beside | Matrix | Gallery | Numbered | Verbatim


@dataclass(frozen=True, slots=True)
class Section:
    """A part of the page; ``key`` is its anchor, ``subject`` what it is of, beside its title."""

    key: str
    title: str
    blocks: tuple[Block, ...]
    subject: str = ""

    def tables(self) -> tuple[Table, ...]:
        """Return all tables in it, also those of figures and matrices."""
        tables = []
        for block in self._all():
            table = block if isinstance(block, Table) else getattr(block, "table", None)
            if isinstance(table, Table):
                tables.append(table)
        return tuple(tables)

    def figures(self) -> tuple[Figure, ...]:
        """Return all figures in it."""
        return tuple(block for block in self._all() if isinstance(block, Figure))

    def _all(self) -> tuple[Block, ...]:
        return tuple(one for block in self.blocks for one in (block.blocks if isinstance(block, Beside) else (block,)))


def write_figure_files(figures: Sequence[Figure], folder: Path, *, replace: bool = False) -> tuple[Path, ...]:
    """Write each figure to ``folder`` as ``NAME.svg``, as on wide pages, and as ``NAME.pdf``; return the files.

    Each file is written whole or not at all.

    Raises
    ------
    InputError
        If a file is there already, unless ``replace`` asks for others in its place; then nothing is written.
    OSError
        If the folder or a file cannot be written.
    """
    drawings = [figure.wide for figure in figures]
    names = file_names(figure.name for figure in figures)
    files = [folder / f"{name}.{kind}" for name in names for kind in ("svg", "pdf")]
    there = [file for file in files if file.exists() or file.is_symlink()]
    if there and not replace:
        what = f"{len(there)} of the figures are there already, such as {there[0].name}"
        remedy = "give --replace to write new ones, or name another folder"
        raise InputError(Finding(what, str(folder), remedy=remedy))
    contents = [content for drawing in drawings for content in (drawing.svg_file().encode(), drawing.pdf())]
    for file, content in zip(files, contents, strict=True):
        with whole_file(file, private=True) as draft:
            draft.write_bytes(content)
    return tuple(files)


# Characters that begin a formula in a spreadsheet, or that it skips before a formula.
FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r", "\n", "\uff1d", "\uff0b", "\uff0d", "\uff20")


def write_csv_files(tables: Iterable[Table], folder: Path) -> tuple[Path, ...]:
    """Write each table to ``folder`` as ``NAME.csv`` and return the files. Each file is written whole or not at all.

    Raises
    ------
    OSError
        If the folder or a file cannot be written.
    """
    make_private(folder)
    all_tables = tuple(tables)
    files = tuple(folder / f"{name}.csv" for name in file_names(table.name for table in all_tables))
    for table, file in zip(all_tables, files, strict=True):
        write_whole(file, csv_text(table), private=True)
    return files


def file_names(names: Iterable[str]) -> tuple[str, ...]:
    """Return names of tables or figures, which may contain the name of a scale, as names of files.

    Names that would be one file, also where capitals do not count, are numbered: ``a``, ``a_2``.
    """
    given: dict[str, str] = {}
    for name in names:
        safe = re.sub(r"[^A-Za-z0-9_-]+", "_", name)[:80]
        number, free = 1, safe
        while free.casefold() in given:
            number += 1
            free = f"{safe}_{number}"
        given[free.casefold()] = free
    return tuple(given.values())


def csv_text(table: Table) -> str:
    """Return the table as CSV (RFC 4180): numbers in full, an empty field for none.

    Text that a spreadsheet would read as a formula is preceded by an apostrophe.
    """
    head = [key for column in table.columns for key in _keys(column)]
    rows = (
        [field for column, cell in zip(table.columns, row, strict=True) for field in _fields(column, cell)]
        for row in table.rows
    )
    return csv_lines([head, *rows], "\r\n")


def _keys(column: Column) -> list[str]:
    names = [f"{column.key}_low", f"{column.key}_high"] if column.kind == "interval" else [column.key]
    return [inert(name) for name in names]


def _fields(column: Column, cell: Cell) -> list[str]:
    cell = cell.value if isinstance(cell, ShownAs) else cell.text if isinstance(cell, Badge) else cell
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
    return "" if math.isnan(value) else str(value)


def inert(text: str) -> str:
    """Return ``text`` so that no spreadsheet reads it as a formula."""
    return f"'{text}" if text.lstrip(" ").startswith(FORMULA_STARTS) else text
