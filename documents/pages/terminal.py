"""Sections in the terminal: the same cells as on a page, tables as wide as they are."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

from documents.figures import class_colours
from documents.pages.blocks import (
    Badge,
    Beside,
    Block,
    Cell,
    Column,
    Facts,
    Heading,
    Numbered,
    Paragraph,
    ShownAs,
    Table,
    Verbatim,
    cell_text,
)
from documents.text import clean_console

if TYPE_CHECKING:
    from rich.console import Console

_WORDS = ("text", "class", "list")
# Words are folded to so many columns of the terminal before a table is parted.
_FOLDED = 9
_TONES = {"good": "green", "bad": "red", "open": "yellow", "": ""}


def print_blocks(blocks: Iterable[Block], console: Console | None = None) -> None:
    """Print paragraphs, facts and tables; of figures, matrices and galleries their tables.

    Parameters
    ----------
    blocks
        What to print.
    console
        Where to print; standard output if None.

    Examples
    --------
    >>> from documents.pages import Column, Paragraph, Table
    >>> columns = Column("item", "item"), Column("score", "score", "number", 2)
    >>> print_blocks([Table("scores", "", columns, (("a", 0.75), ("b", -0.75))), Paragraph("Of two items.")])
     item  score
     a      0.75
     b     −0.75
    Of two items.
    """
    from rich.text import Text

    console = console or clean_console()
    for block in blocks:
        if isinstance(block, Heading):
            console.print(Text(block.text, style="bold"))
        elif isinstance(block, Paragraph):
            mark = (f"{block.mark.text}: ", _TONES[block.mark.tone]) if block.mark else ""
            console.print(Text.assemble(mark, block.text, style="dim" if block.small else ""))
        elif isinstance(block, Verbatim):
            console.print(Text(block.text))
        elif isinstance(block, Facts):
            _print_lines(block.rows, console)
        elif isinstance(block, Numbered):
            _print_lines([(f"{number}.", item) for number, item in enumerate(block.items, start=1)], console)
        elif isinstance(block, Beside):
            print_blocks(block.blocks, console)
        else:
            table = block if isinstance(block, Table) else getattr(block, "table", None)
            if table is not None and table.rows:
                _print_table(table, console)


def _print_table(table: Table, console: Console) -> None:
    """Print a table; on a terminal too narrow for its numbers, part by part, each with the rows' heads."""
    from rich.cells import cell_len
    from rich.text import Text

    if table.title:
        console.print(Text(table.title, style="bold"), soft_wrap=True)
    places = [place for place, column in enumerate(table.columns) if column.kind != "swatches"]
    texts = {place: [cell_text(row[place], table.columns[place]) for row in table.rows] for place in places}
    widths = {place: 2 + max(map(cell_len, [table.columns[place].heading, *texts[place]])) for place in places}
    for place in places:
        if table.columns[place].kind in _WORDS:
            widths[place] = min(widths[place], _FOLDED)
    head, *rest = places
    room = console.width - widths[head] if console.is_terminal else math.inf
    while True:
        part = _fitting(rest, widths, room)
        _print_columns(table, [head, *part], texts, console)
        rest = rest[len(part) :]
        if not rest:
            return


def _fitting(places: list[int], widths: dict[int, int], room: float) -> list[int]:
    """Return the first columns that there is room for, at least one."""
    count = 1
    while count < len(places) and sum(widths[place] for place in places[: count + 1]) <= room:
        count += 1
    return places[:count]


def _print_columns(table: Table, places: list[int], texts: dict[int, list[str]], console: Console) -> None:
    from rich.table import Table as Grid
    from rich.text import Text

    grid = Grid(box=None, header_style="bold", padding=(0, 1))
    for place in places:
        words = table.columns[place].kind in _WORDS
        heading = table.columns[place].heading
        grid.add_column(heading, justify="left" if words else "right", no_wrap=not words, overflow="fold")
    for number, row in enumerate(table.rows):
        cells = [Text(texts[place][number], style=_style(row[place], table.columns[place])) for place in places]
        grid.add_row(*cells, style="bold" if number in table.shaded else "")
    width = console.width
    if not console.is_terminal:
        wide = console.options.update(max_width=10_000)
        console.width = max(width, console.measure(grid, options=wide).maximum)
    console.print(grid)
    console.width = width


def _style(cell: Cell, column: Column) -> str:
    if column.kind == "class" and isinstance(cell, str):
        return class_colours(cell)[0]
    return _TONES[cell.tone] if isinstance(cell, ShownAs | Badge) else ""


def _print_lines(rows: Iterable[tuple[str, str]], console: Console) -> None:
    from rich.table import Table as Grid
    from rich.text import Text

    grid = Grid.grid(padding=(0, 2))
    for term, words in rows:
        grid.add_row(Text(term), Text(words, overflow="fold"))
    console.print(grid)
