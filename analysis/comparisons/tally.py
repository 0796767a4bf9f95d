"""Count like answers of a table of comparisons together, block by block."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import chain
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from analysis.comparisons.comparisons import MOST_ITEMS, Comparisons, from_arrays
from analysis.comparisons.sources import Coded, Texts
from analysis.errors import ResultsError
from documents import Finding
from documents.arrays import Floats

Indices = NDArray[np.int64]
Number = TypeVar("Number", bound=np.generic)

NO_ITEM = UNKNOWN = -1
UNMET = -2
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

    def __init__(self) -> None:
        self._items, self._people, self._groups = _Names(), _Names(), _Names()
        self._items[""] = NO_ITEM
        self._kinds, self._counts = np.empty(0, np.int64), np.empty(0)
        self._pending: list[tuple[Indices, Floats]] = []
        self._waiting = 0
        self._numbers_of: dict[str, Indices] = {}

    def add_columns(self, column: Mapping[str, Texts]) -> bool:
        """Count rows by the texts of their columns, and say True; or say False if one has a fault, and count none."""
        pairs = self._pairs(column["winner"], column["loser"])
        winner, loser = pairs[::2], pairs[1::2]
        if len(self._items.list) > MOST_ITEMS:
            raise ResultsError(Finding(f"there are more than {MOST_ITEMS} items", remedy="scale fewer at once"))
        if (winner == loser).any() or (pairs == NO_ITEM).any():
            return False
        rows = len(winner)
        counts, ties = _numbers(column.get("count"), rows, 1.0), _numbers(column.get("ties"), rows, 0.0)
        side, tie = self._sides(column.get("first"), winner, loser), _ties(column.get("outcome"), rows)
        if counts is None or ties is None or side is None or tie is None:
            return False
        if "group" in column and not _each(column["group"], lambda text: bool(text.strip()), np.bool_).all():
            return False
        counted = (counts > 0) | (ties > 0)
        group = self._numbered("group", self._groups, column, counted)
        if len(self._groups.list) > MOST_GROUPS:
            raise ResultsError(Finding(f"there are more than {MOST_GROUPS} groups", remedy="scale fewer at once"))
        observer = self._numbered("observer", self._people, column, counted) * MOST_GROUPS + group
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

    def _pairs(self, winner: Texts, loser: Texts) -> Indices:
        """Return the numbers of the items, winner and loser in turn, numbered in the order of the lines."""
        if isinstance(winner, Coded) and isinstance(loser, Coded):
            code = np.stack([winner.code, loser.code + len(winner.texts)], axis=1).ravel()
            return self._looked_up("pairs", self._items, Coded([*winner.texts, *loser.texts], code))
        texts = chain.from_iterable(zip(_texts(winner), _texts(loser), strict=True))
        return np.fromiter(map(self._items.__getitem__, texts), int)

    def _sides(self, texts: Texts | None, winner: Indices, loser: Indices) -> Indices | None:
        """Return 1 where the winner was first, 0 where the loser was, -1 where nobody says; None if another was."""
        if texts is None:
            return np.full(len(winner), UNKNOWN)
        known, other = self._items, len(self._items)
        first = _each(texts, lambda text: known.get(text, other), np.int64)
        if (first == other).any():
            first = _each(texts, lambda text: known.get(text.strip(), other), np.int64)
        side = np.where(first == winner, 1, np.where(first == loser, 0, UNKNOWN))
        return None if ((side == UNKNOWN) & (first != UNKNOWN)).any() else side

    def _numbered(self, name: str, names: _Names, column: Mapping[str, Texts], counted: NDArray[np.bool_]) -> Indices:
        """Return the number of each line's name; one that is in no line that counts is not numbered."""
        texts = column.get(name)
        if texts is None:
            return np.zeros(len(counted), dtype=np.int64)
        if isinstance(texts, Coded):
            numbers = np.zeros(len(counted), dtype=np.int64)
            numbers[counted] = self._looked_up(name, names, texts.part(counted))
            return numbers
        if counted.all():
            return np.fromiter(map(names.__getitem__, texts), int)
        return np.array([names[text] if yes else 0 for text, yes in zip(texts, counted, strict=True)])

    def _looked_up(self, name: str, names: _Names, column: Coded) -> Indices:
        """Return the number of each line's name; the column ``name`` has the same distinct texts in all blocks."""
        numbers = self._numbers_of.setdefault(name, np.full(len(column.texts), UNMET))
        found = numbers[column.code]
        if unmet := dict.fromkeys(column.code[found == UNMET].tolist()):
            for code in unmet:
                numbers[code] = names[column.texts[code]]
            found = numbers[column.code]
        return found

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


def _summed(kinds: Indices, counts: Floats) -> tuple[Indices, Floats]:
    """Return each kind once, sorted, with the sum of its counts."""
    order = np.argsort(kinds, kind="stable")
    kinds, counts = kinds[order], counts[order]
    starts = np.flatnonzero(np.diff(kinds, prepend=-1))
    return kinds[starts], np.add.reduceat(counts, starts) if len(starts) else counts


def _numbers(texts: Texts | None, rows: int, otherwise: float) -> Floats | None:
    """Return the column as numbers; None if one of them is no finite number, zero or above."""
    if texts is None:
        return np.full(rows, otherwise)
    try:
        numbers = _each(texts, float, np.float64)
    except ValueError:
        return None
    sound = bool((np.isfinite(numbers) & (numbers >= 0)).all()) and not any("_" in text for text in _texts(texts))
    return numbers if sound else None


def _ties(texts: Texts | None, rows: int) -> Indices | None:
    """Return 1 for a tie and 0 for a win; None if there is another outcome."""
    if texts is None:
        return np.zeros(rows, dtype=np.int64)
    meaning = {"": 0, "win": 0, "tie": 1}
    outcomes = _each(texts, lambda text: meaning.get(text.strip(), -1), np.int64)
    return None if (outcomes < 0).any() else outcomes


def _each(texts: Texts, what: Callable[[str], Any], kind: type[Number]) -> NDArray[Number]:
    """Return what each text means."""
    if not isinstance(texts, Coded):
        return np.fromiter(map(what, texts), kind, len(texts))
    distinct, code = np.unique(texts.code, return_inverse=True)
    return np.fromiter((what(texts.texts[number]) for number in distinct.tolist()), kind, len(distinct))[code]


def _texts(texts: Texts) -> Sequence[str]:
    """Return the texts of a column; of a frame those that occur, once each."""
    return [texts.texts[number] for number in np.unique(texts.code).tolist()] if isinstance(texts, Coded) else texts
