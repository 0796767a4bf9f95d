"""The columns of a table of comparisons, as its first line names them."""

from __future__ import annotations

from collections.abc import Sequence

from analysis.comparisons.sources import WrittenRow
from analysis.errors import ResultsError
from documents import Finding
from documents.text import did_you_mean

COLUMNS = ("winner", "loser", "count", "observer", "first", "outcome", "ties", "group")
GROUP_NAMES = ("group", "scene", "content")  # what the column of groups may be called
REQUIRED = ("winner", "loser")
OUTCOMES = ("win", "tie")
KINDS = ("all_pairs", "active_pairs")  # of trials that compare a pair
TIES = ("no_difference", "not_sure")  # their answers that prefer neither

Columns = dict[str, int]


def read_header(header: Sequence[str], line: WrittenRow, file: str) -> Columns:
    """Return the place of each column in ``header``, from 0; ``line`` is that as it was written.

    The column of groups stands under ``group``, whichever of its names it has.

    Raises
    ------
    ResultsError
        If the header is empty, a column is unknown, repeated or missing, or ties or groups are given in two ways.
    """
    names = [_known(field.strip()) for field in header]
    if not any(names):
        raise ResultsError(Finding("the table is empty", file, 1, 1, "start it with 'winner,loser'"))
    findings = []
    for field, name in enumerate(names):
        if name not in COLUMNS and name not in GROUP_NAMES:
            known = (*COLUMNS, *GROUP_NAMES[1:])
            remedy = did_you_mean(name.lower(), known, f"the columns are {', '.join(COLUMNS)}, separated by commas")
            findings.append(Finding(f"unknown column '{name}'", file, 1, line.column_of(field), remedy))
        elif name in names[:field]:
            findings.append(Finding(f"the column '{name}' stands twice", file, 1, line.column_of(field), "keep one"))
    if not findings:
        findings = [
            Finding(f"the column '{name}' is missing", file, 1, 1, f"name one of the columns '{name}'")
            for name in REQUIRED
            if name not in names
        ]
    if "outcome" in names and "ties" in names:
        place = line.column_of(names.index("ties"))
        findings.append(Finding("both 'outcome' and 'ties' give ties", file, 1, place, "keep one of the two"))
    grouping = [name for name in names if name in GROUP_NAMES]
    if len(set(grouping)) > 1:
        place, pair = line.column_of(names.index(grouping[1])), f"both '{grouping[0]}' and '{grouping[1]}'"
        remedy = "keep one of the two, or write both into one column, such as 'church, night'"
        findings.append(Finding(f"{pair} name the group", file, 1, place, remedy))
    if findings:
        raise ResultsError(findings)
    return {"group" if name in GROUP_NAMES else name: field for field, name in enumerate(names)}


def _known(name: str) -> str:
    """Return one of our names however it is capitalised, and others as they are."""
    return name.lower() if name.lower() in (*COLUMNS, *GROUP_NAMES) else name
