"""The results in the terminal: what was asked, a table, and sentences on each measure."""

from __future__ import annotations

from typing import TYPE_CHECKING

from analysis.agreement import words
from analysis.agreement.result import Agreement, GroupResult
from analysis.report.words import chance, fixed
from documents.text import clean_console

if TYPE_CHECKING:
    from rich.console import Console


def print_agreement(agreement: Agreement, console: Console | None = None) -> None:
    """Print a table of the measures by group, and in sentences what was found and how sure it is.

    Parameters
    ----------
    agreement
        The results, as `agree` returns them.
    console
        Where to print; standard output if None.

    Examples
    --------
    >>> from io import StringIO
    >>> import numpy as np
    >>> from rich.console import Console
    >>> from analysis.agreement import ObservedGroup, Predicted, agree
    >>> group = ObservedGroup("", "ratings", "points", tuple("abcd"), np.arange(4.0), np.eye(4) < 1, 1, None)
    >>> out = StringIO()
    >>> print_agreement(
    ...     agree([group], ["photo"], [Predicted("noise", "Noise", "", "lower", (np.arange(4.0)[::-1],))]),
    ...     Console(file=out, width=120),
    ... )
    >>> "Noise agrees with observers" in out.getvalue()
    True
    """
    from rich.table import Table
    from rich.text import Text

    console = console or clean_console()
    console.print(Text(words.asked(agreement)))
    table = Table(box=None, pad_edge=False, header_style="bold")
    several = len(agreement.groups) > 1
    table.add_column("measure")
    if several:
        table.add_column("group")
    for heading in ("ρ (95 %)", "p", "r", "τ", "pairs right"):
        table.add_column(heading, justify="right", no_wrap=True)
    for result in agreement.measures:
        names = [words.group_name(group.name) for group in agreement.groups]
        rows = list(zip(names, result.groups, strict=True)) if several else []
        for number, (name, found) in enumerate([*rows, ("all groups", result.whole)]):
            head = [Text(result.predicted.title if not number else "")] + ([Text(name)] if several else [])
            table.add_row(*head, *(Text(cell) for cell in _cells(found)))
    console.print(table)
    for result in agreement.measures:
        one = result.predicted
        console.print(Text(words.verdict(result, agreement), style="bold"))
        console.print(Text(f"  {words.pairs_words(result.whole.accuracy)}"))
        if result.whole.calibration is not None:
            for sentence in words.limit_words(result.whole.calibration, one.unit, higher=one.better == "higher"):
                console.print(Text(f"  {sentence}"))
    remarks = [f"{one.predicted.title}: {remark}." for one in agreement.measures for remark in one.predicted.remarks]
    for note in [*agreement.notes, *remarks]:
        console.print(Text(f"Note: {note}", style="yellow"))


def _cells(found: GroupResult) -> list[str]:
    accuracy = found.accuracy
    pairs = "–" if accuracy.share is None else f"{accuracy.right:g} of {accuracy.of}"
    rho = found.correlations["spearman"]
    others = [fixed(found.correlations[kind].value, 2) for kind in ("pearson", "kendall")]
    return [fixed(rho.value, 2) + words.ends(rho), chance(rho.p), *others, pairs]
