"""The results of a power simulation as rows: for the page, the terminal and CSV."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

from documents.files import whole_file
from documents.pages import Block, Column, Heading, Paragraph, ShownAs, Table
from documents.tables import csv_lines
from extensions.power.groups import GroupsNeeded, parts_of
from extensions.power.results import Needed

COLUMNS = ("observers", "quantity", "item", "other", "value", "standard_error")


def size_table(needed: Needed) -> Table:
    """Return a row for each number of observers, chances in per cent with their Monte-Carlo standard errors.

    The hardest pair is the same in all: that of `Needed.weakest`. The row of the number that is needed is shaded.
    """
    power = needed.power
    _, hardest = needed.weakest
    columns = (
        Column("Observers", "observers", "number"),
        Column("Hardest pair", "hardest_pair", "number"),
        Column(f"Pairs at {100 * needed.target:g}\u00a0%", "pairs_reached", "number"),
        Column("Pairs as they should be", "pairs_alike", "number"),
        Column("All classes right", "class_recovery", "number"),
        Column("Width (log₁₀)", "log10_width", "number"),
    )
    rows = tuple(
        (
            observers,
            _percent(power.separates[index, hardest], power.separates_error[index, hardest]),
            f"{int((power.separates[index, needed.pairs] >= needed.target).sum())} of {len(needed.pairs)}",
            _percent(power.alike[index], power.alike_error[index]),
            _percent(power.recovery[index], power.recovery_error[index]),
            _width(power.mean_width[index], power.mean_width_error[index]),
        )
        for index, observers in enumerate(power.observers)
    )
    found = [place for place, observers in enumerate(power.observers) if observers == needed.observers]
    return Table("sizes", "", columns, rows, shaded=found)


def _width(value: float, error: float) -> ShownAs:
    return ShownAs(value, f"{value:.3f}" if error < 0.0005 else f"{value:.3f} ± {error:.3f}")


def _percent(share: float, error: float) -> ShownAs:
    return ShownAs(share, percent(share, error))


def percent(share: float, error: float) -> str:
    """Return a share as per cent, with its standard error."""
    return f"{100 * share:.1f} ± {100 * error:.1f} %"


def csv_rows(needed: Needed) -> Iterator[tuple[int, str, str, str, float, float]]:
    """Yield a row for each value and its Monte-Carlo standard error, in the order of `COLUMNS`."""
    power = needed.power
    for index, observers in enumerate(power.observers):
        yield observers, "class_recovery", "", "", float(power.recovery[index]), float(power.recovery_error[index])
        yield observers, "pairs_alike", "", "", float(power.alike[index]), float(power.alike_error[index])
        for place, item in enumerate(power.plan.items):
            width, error = float(power.width[index, place]), float(power.width_error[index, place])
            yield observers, "log10_width", item, "", width, error
        for place, (item, other) in enumerate(power.pair_names):
            chance, error = float(power.separates[index, place]), float(power.separates_error[index, place])
            yield observers, "separates", item, other, chance, error


def write_csv(needed: Needed | GroupsNeeded, file: TextIO | Path) -> None:
    """Write every value as CSV with a heading, numbers in full; with groups, the first column names the group.

    Parameters
    ----------
    needed
        The number of observers needed, with the power that it follows from; or that of an experiment with groups.
    file
        An open text stream, or the path of a file, which is written whole or not at all.

    Examples
    --------
    >>> import io
    >>> import numpy as np
    >>> from extensions.power import observers_needed, simulate_power
    >>> from analysis.simulation import Plan
    >>> plan = Plan(("a", "b"), np.array([1.0, -1.0]), times=np.array([1]), differs=np.array([True]))
    >>> needed = observers_needed(simulate_power(plan, [2, 100], replicates=50, workers=1))
    >>> stream = io.StringIO()
    >>> write_csv(needed, stream)
    >>> stream.getvalue().splitlines()[0]
    'observers,quantity,item,other,value,standard_error'
    """
    if isinstance(file, Path):
        with whole_file(file) as draft, draft.open("w", encoding="utf-8", newline="") as opened:
            write_csv(needed, opened)
        return
    if isinstance(needed, Needed):
        rows: list[tuple[object, ...]] = [COLUMNS, *csv_rows(needed)]
    else:
        rows = [("group", *COLUMNS), *((name, *row) for name, own in needed.groups for row in csv_rows(own))]
    file.write(csv_lines(rows, "\r\n"))


def power_blocks(needed: Needed | GroupsNeeded) -> tuple[Block, ...]:
    """Return a line for each number of observers, then the answer.

    Parameters
    ----------
    needed
        The number of observers needed, with the power that it follows from; or that of an experiment with groups.

    Examples
    --------
    >>> import numpy as np
    >>> from extensions.power import observers_needed, simulate_power
    >>> from analysis.simulation import Plan
    >>> plan = Plan(("a", "b"), np.array([1.0, -1.0]), times=np.array([1]), differs=np.array([True]))
    >>> needed = observers_needed(simulate_power(plan, [2, 100], replicates=50, workers=1))
    >>> table, legend, sentence = power_blocks(needed)
    >>> len(table.rows)
    2
    """
    blocks: list[Block] = []
    for name, own in parts_of(needed):
        blocks += [Heading(name)] if name else []
        blocks.append(size_table(own))
    legend = (
        "Right: pairs that share a class, or do not, as they should. Width: mean of the intervals of log10 score. "
        "±: standard error of the simulation."
    )
    doubt = [Paragraph(needed.doubt, small=True)] if needed.doubt else []
    return (*blocks, Paragraph(legend, small=True), Paragraph(needed.sentence), *doubt)
