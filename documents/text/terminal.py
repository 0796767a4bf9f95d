"""Tables on a terminal, whose cells stay whole in a file or a pipe."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table


def plain_table(texts: Sequence[str], numbers: Sequence[str] = ()) -> Table:
    """Return an empty table without lines: columns of text, aligned left, then columns of numbers, aligned right.

    Rows are added with `rich.table.Table.add_row`, as `rich.text.Text` where brackets are no markup.

    Parameters
    ----------
    texts
        Headings of the columns of text.
    numbers
        Headings of the columns of numbers.

    Returns
    -------
    rich.table.Table
        The table, without rows.

    Examples
    --------
    >>> table = plain_table(["stimulus"], ["score"])
    >>> [(column.header, column.justify) for column in table.columns]
    [('stimulus', 'left'), ('score', 'right')]
    """
    from rich.table import Table

    table = Table(box=None, header_style="bold", padding=(0, 1))
    for heading in texts:
        table.add_column(heading, overflow="fold")
    for heading in numbers:
        table.add_column(heading, justify="right")
    return table


def print_table(table: Table, console: Console | None = None) -> None:
    """Print the table as wide as the terminal; into a file or a pipe, as wide as it is.

    Parameters
    ----------
    table
        What to print.
    console
        Where to print; standard output if None.

    Examples
    --------
    >>> table = plain_table(["stimulus"], ["score"])
    >>> table.add_row("a", "0.75")
    >>> print_table(table)
     stimulus  score
     a          0.75
    """
    from rich.console import Console

    console = console or Console(highlight=False)
    if not console.is_terminal:
        wide = console.options.update(max_width=10_000)
        console.width = max(console.width, console.measure(table, options=wide).maximum)
    console.print(table)
