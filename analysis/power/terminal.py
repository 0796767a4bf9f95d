"""A power simulation as a table for the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from analysis.power.needed import Needed
from analysis.power.rows import size_rows

if TYPE_CHECKING:
    from rich.console import Console


def print_power(needed: Needed, console: Console | None = None) -> None:
    """Print a line per number of observers, then the answer; on standard output if ``console`` is None."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    console = console or Console()
    table = Table(box=None, header_style="bold", padding=(0, 1))
    reached = f"reach {100 * needed.target:g} %"
    for heading in ("observers", "hardest pair", reached, "pairs right", "all right", "width"):
        table.add_column(heading, justify="right")
    for row in size_rows(needed):
        cells = (str(row.observers), row.hardest, row.reached, row.alike, row.recovery, row.width)
        style = "bold" if row.observers == needed.observers else ""
        table.add_row(*(Text(cell) for cell in cells), style=style)
    console.print(table)
    legend = (
        "Right: pairs that share a class, or do not, as they should. Width: mean of the intervals of log10 score. "
        "±: standard error of the simulation."
    )
    console.print(Text(legend, style="dim"))
    console.print(Text(needed.sentence))
    if needed.doubt:
        console.print(Text(needed.doubt, style="dim"))
