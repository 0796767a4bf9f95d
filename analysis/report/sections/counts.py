"""Who was preferred over whom."""

from __future__ import annotations

from analysis.report.blocks import Cell, Column, Matrix, MatrixCell, Paragraph, Section, Table
from analysis.report.matrix import matrix_rows
from analysis.report.summary import Summary

MOST_DRAWN = 40  # stimuli of which every pair still fits a page


def counts_section(summary: Summary) -> Section:
    """Return the comparison matrix."""
    rows = matrix_rows(summary.scores)
    names = [name for name, _ in rows]
    drawn = tuple(
        (
            name,
            tuple(
                None
                if cell is None
                else MatrixCell(
                    f"{cell.wins:g}" if cell.total else "–",
                    f"{name} over {names[place]}: {cell.wins:g} of {cell.total:g}" if cell.total else "never compared",
                    cell.tint,
                    cell.dark,
                )
                for place, cell in enumerate(cells)
            ),
        )
        for name, cells in rows
    )
    numbers: tuple[tuple[Cell, ...], ...] = tuple(
        (name, *(None if cell is None else cell.wins for cell in cells)) for name, cells in rows
    )
    columns = (Column("Preferred", "preferred"), *(Column(name, f"over {name}", "number") for name in names))
    table = Table("comparisons", "Who was preferred over whom", columns, numbers)
    words = Paragraph(
        "Each cell counts how often the stimulus of its row was preferred over that of its column; the darker, the "
        "larger its share of the pair's comparisons.",
        small=True,
    )
    matrix = Matrix("Who was preferred over whom", drawn, table, folded=len(names) > MOST_DRAWN)
    return Section("comparisons", "Who was preferred over whom", (matrix, words))
