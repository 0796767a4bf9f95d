"""Who was preferred over whom, how often, by which observer: what every scaling method starts from.

Answers that prefer neither of two items are kept apart from the others: models without ties leave them out. Where pairs
were compared within groups, such as the scenes of an image-quality study, each answer says in which group.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.errors import ResultsError
from documents import Finding

MOST_NUMBERS = 250_000_000  # of 8 bytes
MOST_ITEMS = 5000
NO_GROUP = -1
MOST_REFITS = 30
PARTS = 20  # of the observers, where they are more than are left out one by one
NOBODY = "nobody"


@dataclass(frozen=True, slots=True, eq=False)
class TiedAnswers:
    """Answers that prefer neither item: ``k`` kinds, each with how often it was given.

    Attributes
    ----------
    item_a, item_b, observer
        Shape (k,): indices into the items and the observers.
    count
        Shape (k,): how often, above zero.
    a_was_first
        Shape (k,): 1 where item a was shown first, 0 where item b was, -1 where the source does not say.
    group
        Shape (k,): as in `Comparisons`.
    """

    item_a: NDArray[np.intp]
    item_b: NDArray[np.intp]
    observer: NDArray[np.intp]
    count: NDArray[np.float64]
    a_was_first: NDArray[np.int8]
    group: NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False)
class Comparisons:
    """Paired comparisons of ``n`` items, as a list of answers and as counts.

    Attributes
    ----------
    items
        Names of the items, in the order of the rows of ``wins``.
    observers
        Names of the observers; one empty name where the source names none.
    winner, loser, observer
        Shape (m,): indices into ``items`` and ``observers``, one per answer, or per kind of answer.
    count
        Shape (m,): how often that answer counts, above zero; a weight if it is a fraction.
    winner_was_first
        Shape (m,): 1 where the winner was shown first, 0 where the loser was, -1 where the source does not say.
    tied
        The answers that prefer neither item; they are in none of the counts above.
    group
        Shape (m,): index into ``groups``; -1 where an answer belongs to none of them; 0 where there are no groups.
    groups
        Names of the groups within which pairs were compared; empty where the source names none. An item may occur in
        several groups.
    """

    items: tuple[str, ...]
    observers: tuple[str, ...]
    winner: NDArray[np.intp]
    loser: NDArray[np.intp]
    observer: NDArray[np.intp]
    count: NDArray[np.float64]
    winner_was_first: NDArray[np.int8]
    tied: TiedAnswers
    group: NDArray[np.intp]
    groups: tuple[str, ...] = ()

    @property
    def ties(self) -> float:
        """How many answers prefer neither item: a whole number where they all count whole."""
        total = float(self.tied.count.sum())
        return int(total) if total.is_integer() else total

    @property
    def wins(self) -> NDArray[np.float64]:
        """Shape (n, n): how often item i (row) was preferred over item j (column); made at each call."""
        n = len(self.items)
        counts = np.bincount(self.winner * n + self.loser, weights=self.count, minlength=n * n)
        return counts.astype(np.float64).reshape(n, n)

    @property
    def won(self) -> NDArray[np.float64]:
        """Shape (n,): how often each item was preferred."""
        return self._by_item(self.winner, self.count)

    @property
    def compared(self) -> NDArray[np.float64]:
        """Shape (n,): how often each item was compared with a result that prefers one of the two."""
        return self._by_item(self.winner, self.count) + self._by_item(self.loser, self.count)

    @property
    def tied_with(self) -> NDArray[np.float64]:
        """Shape (n,): how often each item was tied with another."""
        tied = self.tied
        return self._by_item(tied.item_a, tied.count) + self._by_item(tied.item_b, tied.count)

    def _by_item(self, item: NDArray[np.intp], count: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.bincount(item, weights=count, minlength=len(self.items)).astype(np.float64)

    @property
    def tie_counts(self) -> NDArray[np.float64]:
        """Shape (n, n), symmetric: how often the two items of each pair were tied."""
        n, tied = len(self.items), self.tied
        counts = np.bincount(tied.item_a * n + tied.item_b, weights=tied.count, minlength=n * n).reshape(n, n)
        return np.asarray(counts + counts.T, dtype=np.float64)

    @property
    def totals(self) -> NDArray[np.float64]:
        """Shape (n, n): how often one of the two items of each pair was preferred over the other."""
        wins = self.wins
        total: NDArray[np.float64] = wins + wins.T
        return total

    def wins_by_observer(self, rows: slice = slice(None)) -> NDArray[np.float64]:
        """Return the counts of each observer of ``rows``, shape (observers, n, n); those of all sum to ``wins``.

        Raises
        ------
        ResultsError
            Where that takes more than 2 GB.
        """
        n, (start, stop, _) = len(self.items), rows.indices(len(self.observers))
        if (stop - start) * n * n > MOST_NUMBERS:
            size = f"{8e-9 * (stop - start) * n * n:.1f} GB"
            what = f"draws of {stop - start} observers of {n} items need {size} of memory"
            remedy = "with so many, standard errors by observers say the same: ask for no draws; or leave out items"
            raise ResultsError(Finding(what, remedy=remedy))
        own = (self.observer >= start) & (self.observer < stop)
        flat = ((self.observer[own] - start) * n + self.winner[own]) * n + self.loser[own]
        counts = np.bincount(flat, weights=self.count[own], minlength=(stop - start) * n * n)
        return counts.astype(np.float64, copy=False).reshape(stop - start, n, n)

    def first_share(self) -> float | None:
        """Return the share of answers (0 to 1) that went to the item shown first; None where nobody noted it."""
        known = self.winner_was_first >= 0
        total = float(self.count[known].sum())
        return float(self.count[known] @ self.winner_was_first[known]) / total if total else None


@dataclass(frozen=True, slots=True)
class Answer:
    """One line of a source: ``winner`` was preferred over ``loser`` ``count`` times; ``first`` was shown first.

    With ``tie`` neither was preferred, and it does not matter which of the two is called the winner. ``group`` is the
    scene or content within which they were compared, empty where there is none.
    """

    winner: str
    loser: str
    count: float = 1.0
    observer: str = ""
    first: str | None = None
    tie: bool = False
    group: str = ""


def from_answers(answers: Sequence[Answer], items: Sequence[str] = (), groups: Sequence[str] = ()) -> Comparisons:
    """Build comparisons from answers.

    The items are those that occur in the answers: first the ones in ``items``, in that order, then others in the
    order in which they are met. Answers that count zero times name their items and say nothing else.

    Parameters
    ----------
    answers
        Who was preferred over whom, how often, by which observer; or which two were tied.
    items
        Names of items in the order wanted; names that no answer has are left out.
    groups
        Names of groups, likewise.

    Returns
    -------
    Comparisons
        The answers as columns, and the counts of each pair of the n items.

    Raises
    ------
    ResultsError
        If there are more than 5000 items, whose counts would not fit into memory.

    Examples
    --------
    >>> comparisons = from_answers([Answer("a", "b", 3), Answer("b", "a"), Answer("a", "b", tie=True)])
    >>> comparisons.items, comparisons.wins.tolist(), comparisons.ties
    (('a', 'b'), [[0.0, 3.0], [1.0, 0.0]], 1)
    """
    met = dict.fromkeys(name for answer in answers for name in (answer.winner, answer.loser))
    names = tuple(dict.fromkeys([name for name in items if name in met] + list(met)))
    index = {name: number for number, name in enumerate(names)}
    counted = [answer for answer in answers if answer.count > 0]
    observers = tuple(dict.fromkeys(answer.observer for answer in counted))
    people = {name: number for number, name in enumerate(observers)}
    within = dict.fromkeys(answer.group for answer in counted if answer.group)
    named = tuple(dict.fromkeys([name for name in groups if name in within] + list(within)))
    place = {"": NO_GROUP if named else 0} | {name: number for number, name in enumerate(named)}
    return from_arrays(
        names,
        observers,
        winner=np.array([index[answer.winner] for answer in counted], dtype=np.intp),
        loser=np.array([index[answer.loser] for answer in counted], dtype=np.intp),
        observer=np.array([people[answer.observer] for answer in counted], dtype=np.intp),
        count=np.array([answer.count for answer in counted], dtype=np.float64),
        winner_was_first=np.array(
            [-1 if answer.first is None else int(answer.first == answer.winner) for answer in counted], dtype=np.int8
        ),
        tie=np.array([answer.tie for answer in counted], dtype=np.bool_),
        group=np.array([place[answer.group] for answer in counted], dtype=np.intp),
        groups=named,
    )


def from_arrays(
    items: tuple[str, ...],
    observers: tuple[str, ...],
    *,
    winner: NDArray[np.intp],
    loser: NDArray[np.intp],
    observer: NDArray[np.intp],
    count: NDArray[np.float64],
    winner_was_first: NDArray[np.int8],
    tie: NDArray[np.bool_],
    group: NDArray[np.intp] | None = None,
    groups: tuple[str, ...] = (),
) -> Comparisons:
    """Build comparisons from columns, each of shape (m,), as `Comparisons` describes them; ``tie`` marks the ties.

    Raises
    ------
    ResultsError
        If there are more than 5000 items, whose counts would not fit into memory.
    """
    n = len(items)
    if n > MOST_ITEMS:
        raise ResultsError(Finding(f"there are {n} items, more than {MOST_ITEMS}", remedy="scale fewer at once"))
    if group is None:
        group = np.zeros(len(winner), dtype=np.intp)
    tied = TiedAnswers(winner[tie], loser[tie], observer[tie], count[tie], winner_was_first[tie], group[tie])
    if tie.any():
        won = ~tie
        winner, loser, observer = winner[won], loser[won], observer[won]
        count, winner_was_first, group = count[won], winner_was_first[won], group[won]
    return Comparisons(items, observers, winner, loser, observer, count, winner_was_first, tied, group, groups)


def without_groups(comparisons: Comparisons) -> Comparisons:
    """Return all the answers as if they had been given without groups."""
    tied = replace(comparisons.tied, group=np.zeros_like(comparisons.tied.group))
    return replace(comparisons, tied=tied, group=np.zeros_like(comparisons.group), groups=())


def rename_items(comparisons: Comparisons, names: Mapping[str, str]) -> Comparisons:
    """Return the same answers with every item under its name in ``names``; items of one name become one.

    No two items of one name may be compared with each other.
    """
    places = {name: place for place, name in enumerate(dict.fromkeys(names[item] for item in comparisons.items))}
    place = np.array([places[names[item]] for item in comparisons.items], dtype=np.intp)
    tied = comparisons.tied
    return replace(
        comparisons,
        items=tuple(places),
        winner=place[comparisons.winner],
        loser=place[comparisons.loser],
        tied=replace(tied, item_a=place[tied.item_a], item_b=place[tied.item_b]),
    )


def split_groups(comparisons: Comparisons, *, all_observers: bool = False) -> tuple[tuple[str, Comparisons], ...]:
    """Return the answers of each group by themselves.

    Parameters
    ----------
    comparisons
        Answers within groups. Answers that belong to no group are left out.
    all_observers
        Keep those observers too who have no answer in a group, so that their indices are those of the whole.

    Returns
    -------
    tuple[tuple[str, Comparisons], ...]
        The name of each group with its answers, in the order of ``comparisons.groups``: without groups of their own,
        and with the items and observers that occur in them, in the order of the whole. Empty without groups.

    Examples
    --------
    >>> answers = [Answer("a", "b", 3, group="church"), Answer("b", "c", group="beach")]
    >>> [(name, part.items) for name, part in split_groups(from_answers(answers))]
    [('church', ('a', 'b')), ('beach', ('b', 'c'))]
    """
    tied = comparisons.tied
    ends = np.arange(len(comparisons.groups) + 1)
    order, tied_order = (np.argsort(group, kind="stable") for group in (comparisons.group, tied.group))
    starts, tied_starts = (
        np.searchsorted(group[rows], ends) for group, rows in ((comparisons.group, order), (tied.group, tied_order))
    )
    return tuple(
        (
            name,
            select_answers(
                comparisons,
                order[starts[number] : starts[number + 1]],
                tied_order[tied_starts[number] : tied_starts[number + 1]],
                all_observers=all_observers,
            ),
        )
        for number, name in enumerate(comparisons.groups)
    )


def without_observers(whole: Comparisons, left_out: NDArray[np.bool_]) -> Comparisons:
    """Return the answers, in their groups, of all observers but those for whom ``left_out`` (observers,) is true."""
    rows, tied_rows = (np.flatnonzero(~left_out[observer]) for observer in (whole.observer, whole.tied.observer))
    part = select_answers(whole, rows, tied_rows)
    tied = replace(part.tied, group=whole.tied.group[tied_rows])
    return replace(part, group=whole.group[rows], tied=tied, groups=whole.groups)


def observer_parts(observers: tuple[str, ...], most: int = MOST_REFITS) -> tuple[NDArray[np.intp], tuple[str, ...]]:
    """Return each observer's part, and what each row of the batch leaves out; row 0 leaves out nobody.

    Each observer is a part, or above ``most`` observers each of 20 parts has some.
    """
    people = len(observers)
    if people <= most:
        return np.arange(people), (NOBODY, *(f"observer {name}" if name else "observer" for name in observers))
    order = sorted(range(people), key=lambda index: observers[index])
    part = np.empty(people, dtype=np.intp)
    part[order] = np.arange(people) % PARTS
    return part, (NOBODY, *(f"part {number + 1} of {PARTS} of the observers" for number in range(PARTS)))


def without_each(comparisons: Comparisons) -> Iterator[Comparisons]:
    """Yield the answers without each observer; above 30 observers, without each of 20 parts of them."""
    part, names = observer_parts(comparisons.observers)
    for number in range(len(names) - 1):
        yield without_observers(comparisons, part == number)


def split_scales(comparisons: Comparisons) -> tuple[tuple[str, Comparisons], ...]:
    """Return the answers scale by scale, each with its name and all observers: those of each group.

    Without groups, and where some answers belong to no group and link them, there is one scale.
    """
    across = (comparisons.group < 0).any() or (comparisons.tied.group < 0).any()
    if not comparisons.groups or across:
        return (("", comparisons),)
    return split_groups(comparisons, all_observers=True)


def select_answers(
    whole: Comparisons, rows: NDArray[np.intp], tied_rows: NDArray[np.intp], *, all_observers: bool = False
) -> Comparisons:
    """Return some of the answers, by their places, without groups: with the items and observers that occur in them."""
    tied = whole.tied
    winner, loser, observer = whole.winner[rows], whole.loser[rows], whole.observer[rows]
    item_a, item_b, tied_observer = tied.item_a[tied_rows], tied.item_b[tied_rows], tied.observer[tied_rows]
    items, item = _numbered(len(whole.items), winner, loser, item_a, item_b)
    everyone = np.arange(len(whole.observers))
    people, person = _numbered(len(everyone), everyone if all_observers else observer, tied_observer)
    return Comparisons(
        tuple(whole.items[number] for number in items),
        tuple(whole.observers[number] for number in people),
        item[winner],
        item[loser],
        person[observer],
        whole.count[rows],
        whole.winner_was_first[rows],
        TiedAnswers(
            item[item_a],
            item[item_b],
            person[tied_observer],
            tied.count[tied_rows],
            tied.a_was_first[tied_rows],
            np.zeros(len(tied_rows), dtype=np.intp),
        ),
        np.zeros(len(rows), dtype=np.intp),
    )


def _numbered(size: int, *places: NDArray[np.intp]) -> tuple[list[int], NDArray[np.intp]]:
    """Return which of ``size`` numbers occur in ``places``, and for each number its place among those that do."""
    occurs = np.zeros(size, dtype=np.bool_)
    for place in places:
        occurs[place] = True
    return np.flatnonzero(occurs).tolist(), np.cumsum(occurs) - 1
