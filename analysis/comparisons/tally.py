"""Count like answers of a table of comparisons together, block by block."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from analysis.comparisons.columns import Columns
from analysis.comparisons.comparisons import MOST_ITEMS, Comparisons, from_arrays
from analysis.errors import ResultsError
from documents import Finding

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

NO_ITEM = UNKNOWN = -1
MOST_GROUPS = 5000
MOST_PENDING = 1 << 20
SIDES = 3  # unknown, loser first, winner first


class _Names(dict[str, int]):
    """Numbers names in the order in which they are met; the same name with blanks around it is no other."""

    def __init__(self) -> None:
        super().__init__()
        self.list: list[str] = []

    def __missing__(self, text: str) -> int:
        name = text.strip()
        if name != text:
            number = self[name]
        else:
            number = len(self.list)
            self.list.append(name)
        self[text] = number
        return number


class Tally:
    """The answers so far: for each kind of answer how often it was given.

    A kind is a whole number: observer, group, winner, loser, which was first, tie or not. Kinds are kept sorted;
    those of new blocks wait until there are about as many as are sorted already.
    """

    def __init__(self, columns: Columns) -> None:
        self._columns = columns
        self._items, self._people, self._groups = _Names(), _Names(), _Names()
        self._items[""] = NO_ITEM
        self._kinds, self._counts = np.empty(0, np.int64), np.empty(0)
        self._pending: list[tuple[Indices, Floats]] = []
        self._waiting = 0

    def add(self, rows: Sequence[Sequence[str]]) -> bool:
        """Count ``rows``, and say True; or say False if one of them has a fault, and count none."""
        width = len(self._columns)
        if any(len(row) != width for row in rows):
            return self._add_without_blanks(rows)
        texts = list(zip(*rows, strict=True))
        column = {name: texts[field] for name, field in self._columns.items()}
        number = self._items.__getitem__
        pairs = np.fromiter(map(number, chain.from_iterable(zip(column["winner"], column["loser"], strict=True))), int)
        winner, loser = pairs[::2], pairs[1::2]
        if len(self._items.list) > MOST_ITEMS:
            raise ResultsError(Finding(f"there are more than {MOST_ITEMS} items", remedy="scale fewer at once"))
        if (winner == loser).any() or (pairs == NO_ITEM).any():
            return self._add_without_blanks(rows)
        counts, ties = _numbers(column.get("count"), len(rows), 1.0), _numbers(column.get("ties"), len(rows), 0.0)
        side, tie = self._sides(column.get("first"), winner, loser), _ties(column.get("outcome"), len(rows))
        if counts is None or ties is None or side is None or tie is None:
            return False
        if not all(map(str.strip, column.get("group", ()))):
            return False
        counted = (counts > 0) | (ties > 0)
        group = _numbered(self._groups, column.get("group"), counted)
        if len(self._groups.list) > MOST_GROUPS:
            raise ResultsError(Finding(f"there are more than {MOST_GROUPS} groups", remedy="scale fewer at once"))
        observer = _numbered(self._people, column.get("observer"), counted) * MOST_GROUPS + group
        kind = ((observer * MOST_ITEMS + winner) * MOST_ITEMS + loser) * SIDES + side + 1
        self._gather(kind * 2 + tie, counts)
        if "ties" in column:
            self._gather(kind * 2 + 1, ties)
        return True

    def comparisons(self) -> Comparisons | None:
        """Return what was counted; None if that is nothing."""
        self._merge()
        if not len(self._kinds):
            return None
        rest, tie = np.divmod(self._kinds, 2)
        rest, side = np.divmod(rest, SIDES)
        rest, loser = np.divmod(rest, MOST_ITEMS)
        rest, winner = np.divmod(rest, MOST_ITEMS)
        observer, group = np.divmod(rest, MOST_GROUPS)
        return from_arrays(
            tuple(self._items.list),
            tuple(self._people.list) or ("",),
            winner=winner,
            loser=loser,
            observer=observer,
            count=self._counts,
            winner_was_first=(side - 1).astype(np.int8),
            tie=tie.astype(np.bool_),
            group=group,
            groups=tuple(self._groups.list),
        )

    def _add_without_blanks(self, rows: Sequence[Sequence[str]]) -> bool:
        kept = [row for row in rows if any(field.strip() for field in row)]
        return len(kept) < len(rows) and (not kept or self.add(kept))

    def _sides(self, texts: Sequence[str] | None, winner: Indices, loser: Indices) -> Indices | None:
        """Return 1 where the winner was first, 0 where the loser was, -1 where nobody says; None if another was."""
        if texts is None:
            return np.full(len(winner), UNKNOWN)
        numbers = list(map(self._items.get, texts))
        if None in numbers:
            numbers = [self._items.get(text.strip(), len(self._items)) for text in texts]
        first = np.array(numbers, dtype=np.int64)
        side = np.where(first == winner, 1, np.where(first == loser, 0, UNKNOWN))
        return None if ((side == UNKNOWN) & (first != UNKNOWN)).any() else side

    def _gather(self, kinds: Indices, counts: Floats) -> None:
        kept = counts > 0
        kinds, counts = _summed(kinds[kept], counts[kept])
        self._pending.append((kinds, counts))
        self._waiting += len(kinds)
        if self._waiting > max(MOST_PENDING, len(self._kinds)):
            self._merge()

    def _merge(self) -> None:
        if self._pending:
            kinds = np.concatenate([self._kinds, *(kinds for kinds, _ in self._pending)])
            counts = np.concatenate([self._counts, *(counts for _, counts in self._pending)])
            self._pending, self._waiting = [], 0
            self._kinds, self._counts = _summed(kinds, counts)


def _numbered(names: _Names, texts: Sequence[str] | None, counted: NDArray[np.bool_]) -> Indices:
    """Return the number of each line's name; one that is in no line that counts is not numbered."""
    if texts is None:
        return np.zeros(len(counted), dtype=np.int64)
    if counted.all():
        return np.fromiter(map(names.__getitem__, texts), int)
    return np.array([names[text] if yes else 0 for text, yes in zip(texts, counted, strict=True)])


def _summed(kinds: Indices, counts: Floats) -> tuple[Indices, Floats]:
    """Return each kind once, sorted, with the sum of its counts."""
    order = np.argsort(kinds, kind="stable")
    kinds, counts = kinds[order], counts[order]
    starts = np.flatnonzero(np.diff(kinds, prepend=-1))
    return kinds[starts], np.add.reduceat(counts, starts) if len(starts) else counts


def _numbers(texts: Sequence[str] | None, rows: int, otherwise: float) -> Floats | None:
    """Return the column as numbers; None if one of them is no finite number, zero or above."""
    if texts is None:
        return np.full(rows, otherwise)
    try:
        numbers = np.fromiter(map(float, texts), np.float64, rows)
    except ValueError:
        return None
    sound = bool((np.isfinite(numbers) & (numbers >= 0)).all()) and not any("_" in text for text in texts)
    return numbers if sound else None


def _ties(texts: Sequence[str] | None, rows: int) -> Indices | None:
    """Return 1 for a tie and 0 for a win; None if there is another outcome."""
    if texts is None:
        return np.zeros(rows, dtype=np.int64)
    meaning = {"": 0, "win": 0, "tie": 1}
    outcomes = np.array([meaning.get(text.strip(), -1) for text in texts])
    return None if (outcomes < 0).any() else outcomes
