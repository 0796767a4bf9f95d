"""Matrices of counts from MAT-files, as pwcmp takes them, through the bounded parser of `devices.readings`."""

from __future__ import annotations

from typing import BinaryIO

import numpy as np

from analysis.comparisons.comparisons import MOST_ITEMS, Comparisons, from_arrays
from analysis.errors import ResultsError
from devices.readings import MatFileError, read_mat
from documents import Finding
from documents.arrays import Floats

COUNTS, BY_OBSERVER, NAMES = ("D", "M", "counts", "wins"), ("MM",), ("C", "names", "items", "conditions")
MOST_BYTES = 100_000_000
NOTES = ("the item of a row was preferred over that of a column as often as the number says",)


def read_mat_table(stream: BinaryIO, file: str) -> tuple[Comparisons, str, tuple[str, ...]]:
    """Return the comparisons of a MAT-file, the name of their layout, and what to bear in mind.

    The variable ``D``, ``M``, ``counts`` or ``wins`` is a square matrix; ``MM`` has a row for each observer: such a
    matrix column by column. ``C``, ``names``, ``items`` or ``conditions`` is a cell array of the items' names; without,
    they are called 1, 2 and so on.

    Raises
    ------
    ResultsError
        If the file is larger than 100 MB, no MAT-file of version 5, or has no such matrix.
    """
    data = stream.read(MOST_BYTES + 1)
    if len(data) > MOST_BYTES:
        what = f"the file is larger than {MOST_BYTES / 1e6:g} MB"
        raise ResultsError(Finding(what, file, remedy="save the matrix of counts alone"))
    try:
        read = read_mat(data, *COUNTS, *BY_OBSERVER, *NAMES)
    except MatFileError as error:
        remedy = "save it in MATLAB by save('table.mat', 'D', 'names', '-v7'), or as CSV"
        raise ResultsError(Finding(f"the table cannot be read: {error}", file, remedy=remedy)) from error
    found = [name for name in (*COUNTS, *BY_OBSERVER) if name in read]
    if len(found) != 1:
        what = f"there are two matrices: {found[0]} and {found[1]}" if found else "there is no matrix of counts"
        remedy = f"save one of {', '.join((*COUNTS, *BY_OBSERVER))}, and the names as {NAMES[0]}"
        raise ResultsError(Finding(what, file, remedy=remedy))
    (name,) = found
    counts = _by_observer(read[name], name, file)
    items = _names([read[own] for own in NAMES if own in read], counts.shape[1], file)
    _check(counts, items, name, file)
    person, winner, loser = np.nonzero(counts)
    alone = len(counts) == 1
    people = ("",) if alone else tuple(str(number + 1) for number in range(len(counts)))
    told = from_arrays(
        items,
        people,
        winner=winner,
        loser=loser,
        observer=person,
        count=counts[person, winner, loser],
        winner_was_first=np.full(len(winner), -1, np.int8),
        tie=np.zeros(len(winner), np.bool_),
    )
    if not len(winner):
        raise ResultsError(Finding(f"the matrix {name} has no comparison", file, remedy="count again"))
    return told, "matrix", NOTES


def _by_observer(value: object, name: str, file: str) -> Floats:
    """Return each observer's counts, shape (S, n, n)."""
    if not isinstance(value, np.ndarray) or value.ndim != 2:
        raise ResultsError(Finding(f"{name} is no matrix of numbers", file, remedy="save a matrix of counts"))
    rows, columns = value.shape
    n = columns if name in COUNTS else round(columns**0.5)
    if (n != rows if name in COUNTS else n * n != columns) or not 2 <= n <= MOST_ITEMS:
        shape = f"{rows} by {columns}"
        expected = "a square matrix" if name in COUNTS else "n² columns for n items"
        raise ResultsError(Finding(f"{name} is {shape}", file, remedy=f"give {expected} of 2 to {MOST_ITEMS} items"))
    return value[None] if name in COUNTS else value.reshape(rows, n, n).transpose(0, 2, 1)


def _names(found: list[object], n: int, file: str) -> tuple[str, ...]:
    if not found:
        return tuple(str(number + 1) for number in range(n))
    cells = found[0] if isinstance(found[0], list) else []
    names = tuple(cell.strip() for cell in cells if isinstance(cell, str) and cell.strip())
    if len(names) != n or len(set(names)) != n:
        what = f"there are {len(set(names))} different names of {n} items"
        raise ResultsError(Finding(what, file, remedy="save a cell array with a text for each item"))
    return names


def _check(counts: Floats, items: tuple[str, ...], name: str, file: str) -> None:
    wrong = np.argwhere(~(np.isfinite(counts) & (counts >= 0)))
    if not len(wrong):
        wrong = np.argwhere((counts != 0) & np.eye(len(items), dtype=np.bool_))
    if len(wrong):
        person, winner, loser = wrong[0].tolist()
        where = f"{name}, row {winner + 1}, column {loser + 1}" + (
            f", observer {person + 1}" if len(counts) > 1 else ""
        )
        remedy = "write 0" if winner == loser else "write a finite number, zero or above"
        raise ResultsError(Finding(f"{where}: the count is {counts[person, winner, loser]:g}", file, remedy=remedy))
