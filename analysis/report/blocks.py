"""What a page is made of: sections of paragraphs, facts, tables and figures, all plain data.

Text is plain text; the template escapes it. Only figures hold markup, which this package draws itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal, TypeAlias

ColumnKind = Literal["text", "number", "p", "interval", "class", "list"]
Interval: TypeAlias = tuple[float | None, float | None]
Cell: TypeAlias = str | float | int | Interval | tuple[str, ...] | None


@dataclass(frozen=True, slots=True)
class Column:
    """A column: its heading on the page, its key in CSV, what it holds, and how many digits the page shows.

    ``p`` is a number that is a chance. An ``interval`` holds two numbers, and makes two columns of a CSV file; a
    ``class`` a label such as "3+4"; a ``list`` several texts.
    """

    heading: str
    key: str
    kind: ColumnKind = "text"
    digits: int = 0
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Table:
    """A table; its first column heads the rows. ``name`` is that of its CSV file, ``title`` its caption."""

    name: str
    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    folded: bool = False
    kind: ClassVar[str] = "table"


@dataclass(frozen=True, slots=True)
class Paragraph:
    """Words; ``small`` for explanations."""

    text: str
    small: bool = False
    kind: ClassVar[str] = "paragraph"


@dataclass(frozen=True, slots=True)
class Facts:
    """Words with what they stand for."""

    rows: tuple[tuple[str, str], ...]
    folded: str = ""
    kind: ClassVar[str] = "facts"


@dataclass(frozen=True, slots=True)
class Figure:
    """An ``<svg>`` for wide pages and one for narrow ones, a caption, and the table behind it."""

    wide: str
    narrow: str
    caption: str
    table: Table | None = None
    kind: ClassVar[str] = "figure"


@dataclass(frozen=True, slots=True)
class MatrixCell:
    """A cell's words, what it says when pointed at, its CSS colour, and whether that is dark."""

    text: str
    title: str
    tint: str
    dark: bool


@dataclass(frozen=True, slots=True)
class Matrix:
    """Rows and columns of the same names; None on the diagonal. ``table`` holds the same as numbers."""

    title: str
    rows: tuple[tuple[str, tuple[MatrixCell | None, ...]], ...]
    table: Table
    folded: bool = False
    kind: ClassVar[str] = "matrix"


@dataclass(frozen=True, slots=True)
class Picture:
    """A stimulus's name and its pictures as data URIs: words such as "left eye", and the URI."""

    name: str
    views: tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class Gallery:
    """Small pictures of the stimuli."""

    pictures: tuple[Picture, ...]
    folded: str = ""
    kind: ClassVar[str] = "gallery"


@dataclass(frozen=True, slots=True)
class Numbered:
    """A numbered list, from 1."""

    items: tuple[str, ...]
    kind: ClassVar[str] = "numbered"


Block: TypeAlias = Table | Paragraph | Facts | Figure | Matrix | Gallery | Numbered


@dataclass(frozen=True, slots=True)
class Section:
    """A part of the page; ``key`` is its anchor."""

    key: str
    title: str
    blocks: tuple[Block, ...]

    def tables(self) -> tuple[Table, ...]:
        """Return every table in it, those behind figures and matrices too."""
        found = []
        for block in self.blocks:
            table = block if isinstance(block, Table) else getattr(block, "table", None)
            if isinstance(table, Table):
                found.append(table)
        return tuple(found)
