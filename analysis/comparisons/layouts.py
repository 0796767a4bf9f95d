"""Layouts of tables of comparisons: what their columns are called, and what a line of each says.

Each kind has a name, recognises its header, and gives a reading: it translates lines into those of the plain layout,
``winner,loser,...``, or says what is wrong with a line.

- ``winner-loser``: our own, as `analysis.comparisons.columns` has it.
- ``pwcmp``: ``condition_A, condition_B, is_A_selected`` (or ``selected_A``), 1 or 0 [Pwcmp].
- ``items``: two columns of items, such as ``item_a, item_b``, and ``choice``.
- ``options``: three columns or more, one for each option shown, such as ``option_1, option_2, option_3``, and
  ``choice``: what was chosen won against each other option.
- ``matrix``: names in the header and in the first column, and how often the item of the line was preferred over that of
  the column.
- ``trials``: the trials of results, as `cyclopean.read_results` gives them (`analysis.comparisons.trials_table`).
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from analysis.comparisons.columns import COLUMNS, GROUP_NAMES
from analysis.comparisons.comparisons import MOST_ITEMS
from analysis.comparisons.missing import WORDS
from analysis.comparisons.plain_lines import Fault, PlainReading, is_count, of_another_length
from analysis.comparisons.sources import Coded, Texts, WrittenRow, coded, joined, plain
from analysis.comparisons.trials_table import Trials
from analysis.errors import ResultsError
from documents import Finding
from documents.arrays import Indices
from documents.text import did_you_mean

Row = Sequence[str]
PLAIN = "winner-loser"
OBSERVER_NAMES = ("observer", "participant", "subject")
CHOICE_NAMES = ("choice", "chosen", "selection", "selected", "response", "answer", "preferred")
SELECTED_NAMES = ("is_a_selected", "selected_a")
CORNER_NAMES = ("", "item", "name", "condition", "row")
TIE_WORDS = ("tie", "equal", "neither", "no_difference")
_OPTION = re.compile(r"(option|item|condition|stimulus|image|picture|alternative)[ _]?([a-z]|[0-9]{1,3})")


class LayoutReading(Protocol):
    """Reads the lines below one header."""

    @property
    def width(self) -> int:
        """How many fields a line has."""
        ...

    @property
    def needed(self) -> Mapping[int, str]:
        """The columns without which a line says nothing, and what each holds."""
        ...

    @property
    def unknown(self) -> Collection[int]:
        """The columns in which a missing value is read as an empty field."""
        ...

    @property
    def counts(self) -> Collection[int]:
        """The columns of numbers of answers."""
        ...

    @property
    def notes(self) -> tuple[str, ...]:
        """What to bear in mind of how the table was read, in sentences."""
        ...

    def translate(self, columns: Sequence[Texts]) -> Mapping[str, Texts] | None:
        """Return rows by their ``columns`` as columns of the plain layout; None if a row has a fault or is empty."""
        ...

    def fault(self, row: Row) -> Fault | None:
        """Return the field that is wrong, what is wrong with it, and the remedy; None if nothing is."""
        ...

    def end(self) -> tuple[str, str] | None:
        """Return what is wrong with the table as a whole, now that all lines are read, and the remedy."""
        ...


class Layout(Protocol):
    """A kind of table."""

    @property
    def name(self) -> str:
        """What ``--layout`` calls it."""
        ...

    @property
    def wanted(self) -> str:
        """The columns that it has, in words."""
        ...

    def recognises(self, names: Sequence[str]) -> bool:
        """Say whether a header of these ``names``, in small letters, is of this kind."""
        ...

    def reading(self, header: Row, line: WrittenRow, file: str, codes: Sequence[str]) -> LayoutReading:
        """Return what reads the lines below ``header``; ``codes`` say what stands for each option, then for a tie."""
        ...


@dataclass(frozen=True, slots=True)
class _Plain:
    name: str = PLAIN
    wanted: str = "winner, loser"

    def recognises(self, names: Sequence[str]) -> bool:
        return "winner" in names or "loser" in names

    def reading(self, header: Row, line: WrittenRow, file: str, codes: Sequence[str]) -> LayoutReading:
        return PlainReading.of_header(header, line, file)


@dataclass(frozen=True, slots=True)
class _Choice:
    """Lines that name what was shown and what was chosen of it."""

    name: str
    wanted: str
    fewest: int
    most: int
    selected: bool = False

    def recognises(self, names: Sequence[str]) -> bool:
        ways = SELECTED_NAMES if self.selected else CHOICE_NAMES
        return self.fewest <= len(_options(names)) <= self.most and any(name in names for name in ways)

    def reading(self, header: Row, line: WrittenRow, file: str, codes: Sequence[str]) -> LayoutReading:
        names = [cell.strip().lower() for cell in header]
        _refuse_twice(names, line, file)
        options = _options(names)
        ways = SELECTED_NAMES if self.selected else CHOICE_NAMES
        roles: dict[str, list[int]] = {
            role: [place for place, name in enumerate(names) if name in known]
            for role, known in (("choice", ways), ("observer", OBSERVER_NAMES), ("group", GROUP_NAMES))
        }
        for role, places in roles.items():
            if len(places) > 1:
                both = " and ".join(f"'{header[place].strip()}'" for place in places)
                where = line.column_of(places[1])
                raise ResultsError(Finding(f"{both} both name the {role}", file, 1, where, "keep one of them"))
        if codes and not len(options) <= len(codes) <= len(options) + 1:
            what = f"{len(codes)} texts for the choice among {len(options)}"
            raise ResultsError(Finding(what, file, 1, 1, "give one for each option, and one more for a tie"))
        meaning = _SELECTED if self.selected and not codes else _meaning(names, options, codes)
        read = {*options, *(place for places in roles.values() for place in places)}
        unread = [cell.strip() for place, cell in enumerate(header) if place not in read]
        notes = [f"columns that were not read: {', '.join(unread)}"] if unread else []
        if len(options) > 2:
            notes.append("what was chosen counts as preferred over each other option of its line")
        place_of = {role: found[0] for role, found in roles.items() if found}
        by_name = not codes and not self.selected
        return _ChoiceReading(len(header), options, place_of, meaning, by_name, tuple(notes))


_SELECTED = {"1": 0, "true": 0, "0": 1, "false": 1}
TIE, UNCLEAR = -1, -2


def _options(names: Sequence[str]) -> list[int]:
    """Return the places of the columns that name what was shown: those of the first word that has two or more."""
    if "left" in names and "right" in names:
        return [names.index("left"), names.index("right")]
    stems: dict[str, list[int]] = {}
    for place, name in enumerate(names):
        if found := _OPTION.fullmatch(name):
            stems.setdefault(found[1], []).append(place)
    places = next((places for places in stems.values() if len(places) > 1), [])
    return sorted(places, key=lambda place: (len(names[place]), names[place]))


def _meaning(names: Sequence[str], options: Sequence[int], codes: Sequence[str]) -> dict[str, int]:
    """Return which option a text stands for: as ``codes`` say, else a column by its name or the end of it."""
    if codes:
        return {code.lower(): TIE if place == len(options) else place for place, code in enumerate(codes)}
    meaning = dict.fromkeys(TIE_WORDS, TIE)
    for place, column in enumerate(options):
        meaning[names[column]] = place
        if found := _OPTION.fullmatch(names[column]):
            meaning[found[2]] = place
    return meaning


@dataclass(frozen=True, slots=True)
class _ChoiceReading:
    width: int
    options: Sequence[int]
    places: Mapping[str, int]
    meaning: Mapping[str, int]
    by_name: bool
    notes: tuple[str, ...]
    counts: Collection[int] = ()

    @property
    def needed(self) -> Mapping[int, str]:
        items = dict.fromkeys(self.options, "item") if len(self.options) == 2 else {}
        return items | {place: role for role, place in self.places.items()}

    @property
    def unknown(self) -> Collection[int]:
        return self.options if len(self.options) > 2 else ()

    def translate(self, columns: Sequence[Texts]) -> Mapping[str, Texts] | None:
        items, numbers = joined([coded(columns[place]) for place in self.options])
        shown, choice = np.stack(numbers, axis=1), coded(columns[self.places["choice"]])
        if (np.sum(shown >= 0, axis=1) < 2).any() or _repeated(shown) or self._without_group(columns):
            return None
        chosen = self._chosen(shown, {item: number for number, item in enumerate(items)}, choice)
        each, tie = np.arange(len(shown)), chosen == TIE
        many = np.sum(shown >= 0, axis=1) > 2
        winner = np.where(tie, np.argmax(shown >= 0, axis=1), chosen)
        if (chosen == UNCLEAR).any() or (tie & many).any() or (shown[each, winner] < 0).any():
            return None
        others = shown >= 0
        others[each, winner] = False
        row, place = np.nonzero(others)
        told: dict[str, Texts] = {
            "winner": Coded(items, shown[row, winner[row]]),
            "loser": Coded(items, shown[row, place]),
            "outcome": Coded(["win", "tie"], tie[row].astype(np.intp)),
        }
        beside = {role: coded(columns[place]) for role, place in self.places.items() if role != "choice"}
        return told | {role: Coded(column.texts, column.code[row]) for role, column in beside.items()}

    def fault(self, row: Row) -> Fault | None:
        if ragged := of_another_length(row, self.width):
            return ragged
        shown = self._shown(row)
        if len(shown) < 2:
            return self.options[0], "fewer than two items are named", "name what was shown"
        seen: dict[str, int] = {}
        for place, item in shown.items():
            if item in seen:
                return self.options[place], f"'{item}' is compared with itself", "compare two different items"
            seen[item] = place
        if "group" in self.places and not row[self.places["group"]].strip():
            return self.places["group"], "the group is empty", "name the group, or leave the column out"
        where = self.places["choice"]
        text = row[where].strip()
        named, coded = seen.get(text) if self.by_name else None, self.meaning.get(text.lower())
        if named is not None and coded is not None and named != coded:
            what = f"the choice '{text}' is the name of one item and the column of another"
            return where, what, "say which is meant: --choice-codes a,b"
        chosen = named if named is not None else coded
        if chosen is None or (chosen != TIE and chosen not in shown):
            return where, f"the choice is '{text}'", self._remedy(list(seen))
        if chosen == TIE and len(shown) > 2:
            return where, f"the choice among {len(shown)} is a tie", "leave the line out: it compares no two items"
        return None

    def end(self) -> tuple[str, str] | None:
        return None

    def _shown(self, row: Row) -> dict[int, str]:
        """Return what was shown, by its place among the options; an empty field showed nothing."""
        texts = ((place, row[column].strip()) for place, column in enumerate(self.options))
        return {place: text for place, text in texts if text}

    def _chosen(self, shown: Indices, items: Mapping[str, int], choice: Coded) -> Indices:
        """Return the place of what was chosen among the options of each row; TIE, or UNCLEAR where that is a fault."""
        texts = [text.strip() for text in choice.texts]
        meant = np.array([self.meaning.get(text.lower(), UNCLEAR) for text in texts], dtype=np.intp)[choice.code]
        if not self.by_name:
            return meant
        item = np.array([items.get(text, UNCLEAR) for text in texts], dtype=np.intp)[choice.code]
        same = shown == item[:, None]
        named = np.where(same.any(axis=1), same.argmax(axis=1), UNCLEAR)
        torn = (named != UNCLEAR) & (meant != UNCLEAR) & (named != meant)
        return np.where(torn, UNCLEAR, np.where(named == UNCLEAR, meant, named))

    def _without_group(self, columns: Sequence[Texts]) -> bool:
        """Say whether a row names no group although there is a column for it."""
        if "group" not in self.places:
            return False
        (groups,) = joined([coded(columns[self.places["group"]])])[1]
        return bool((groups < 0).any())

    def _remedy(self, items: Sequence[str]) -> str:
        if not self.by_name:
            return "write one of: " + ", ".join(self.meaning)
        names = " or ".join(f"'{item}'" for item in items[:3])
        return f"write {names}, or say what it stands for, first option first and a tie last: --choice-codes 1,2,0"


def _repeated(shown: Indices) -> bool:
    """Say whether a row has an item twice."""
    ordered = np.sort(shown, axis=1)
    return bool(((ordered[:, 1:] == ordered[:, :-1]) & (ordered[:, 1:] >= 0)).any())


@dataclass(frozen=True, slots=True)
class _Matrix:
    name: str = "matrix"
    wanted: str = "names in the header and in the first column"

    def recognises(self, names: Sequence[str]) -> bool:
        return len(names) > 2 and names[0] in CORNER_NAMES and not any(name in COLUMNS for name in names[1:])

    def reading(self, header: Row, line: WrittenRow, file: str, codes: Sequence[str]) -> LayoutReading:
        names = [cell.strip() for cell in header]
        _refuse_twice(names, line, file)
        if "" in names[1:]:
            place = names.index("", 1)
            raise ResultsError(Finding("an item has no name", file, 1, line.column_of(place), "name the item"))
        if not 2 <= len(names) - 1 <= MOST_ITEMS:
            what = f"there are {len(names) - 1} items"
            raise ResultsError(Finding(what, file, 1, 1, f"compare 2 to {MOST_ITEMS} items"))
        return _MatrixReading(tuple(names[1:]))


@dataclass(slots=True)
class _MatrixReading:
    items: tuple[str, ...]
    notes: tuple[str, ...] = ("the item of a line was preferred over that of a column as often as the number says",)
    met: list[str] = field(default_factory=list)
    needed: Mapping[int, str] = field(default_factory=dict)
    unknown: Collection[int] = ()

    @property
    def counts(self) -> Collection[int]:
        return range(1, self.width)

    @property
    def width(self) -> int:
        return len(self.items) + 1

    def translate(self, columns: Sequence[Texts]) -> Mapping[str, Texts] | None:
        told: list[Row] = []
        for row in zip(*map(plain, columns), strict=True):
            if not any(map(str.strip, row)):
                continue
            if self.fault(row):
                return None
            if not self.met:  # items stand in the order of the header, whatever that of the lines
                told += [[self.items[0], item, "0"] for item in self.items[1:]]
            name = row[0].strip()
            self.met.append(name)
            cells = zip(self.items, row[1:], strict=True)
            told += [[name, item, cell] for item, cell in cells if item != name]
        return dict(zip(("winner", "loser", "count"), zip(*told, strict=True), strict=True)) if told else {}

    def fault(self, row: Row) -> Fault | None:
        width = len(self.items) + 1
        if len(row) != width:
            where = width if len(row) > width else max(len(row) - 1, 0)
            return where, f"the line has {len(row)} fields", f"the header has {width}; the matrix must be square"
        name = row[0].strip()
        if name not in self.items:
            remedy = did_you_mean(name, self.items, "name the items as the header does")
            return 0, f"'{name}' is not in the header", remedy
        for place, (item, cell) in enumerate(zip(self.items, row[1:], strict=True), start=1):
            text = cell.strip()
            if item == name:
                if text and text not in WORDS and (not is_count(text) or float(text) != 0):
                    return place, f"'{name}' was preferred over itself '{text}' times", "write 0"
            elif not is_count(text):
                remedy = "write a finite number, zero or above; 0 where none was compared"
                return place, f"the count is '{text}'", remedy
        return None

    def end(self) -> tuple[str, str] | None:
        met = set(self.met)
        if len(met) < len(self.met):
            twice = next(name for place, name in enumerate(self.met) if name in self.met[:place])
            return f"'{twice}' has two lines", "keep one line for each item"
        missing = [name for name in self.items if name not in met]
        if missing:
            return f"'{missing[0]}' has no line", "give each item of the header a line: the matrix must be square"
        return None


LAYOUTS: dict[str, Layout] = {
    layout.name: layout
    for layout in (
        _Plain(),
        _Choice("pwcmp", "condition_A, condition_B, is_A_selected", 2, 2, selected=True),
        _Choice("items", "item_a, item_b, choice", 2, 2),
        _Choice("options", "option_1, option_2, option_3, ..., choice", 3, 1000),
        _Matrix(),
        Trials(),
    )
}


def find_layout(header: Row, file: str, asked: str | None) -> Layout:
    """Return the kind that ``header`` is of, or the one that was ``asked`` for.

    A header of no kind is read as the plain one, which says what is wrong with it.

    Raises
    ------
    ResultsError
        If there is no such kind, the header is of two kinds, or it is not of the one that was asked for.
    """
    names = [cell.strip().lower() for cell in header]
    if asked is not None:
        if asked not in LAYOUTS:
            remedy = did_you_mean(asked, LAYOUTS, "the layouts are " + ", ".join(LAYOUTS))
            raise ResultsError(Finding(f"there is no layout '{asked}'", remedy=remedy))
        layout = LAYOUTS[asked]
        if asked != PLAIN and not layout.recognises(names):
            what = f"the header is not one of the layout '{asked}'"
            raise ResultsError(Finding(what, file, 1, 1, f"its columns are {layout.wanted}"))
        return layout
    found = [layout for layout in LAYOUTS.values() if layout.recognises(names)]
    if len(found) > 1:
        both = " and ".join(f"'{layout.name}'" for layout in found[:2])
        remedy = f"say which is meant: --layout {found[0].name}"
        raise ResultsError(Finding(f"the header is one of {both}", file, 1, 1, remedy))
    return found[0] if found else LAYOUTS[PLAIN]


def _refuse_twice(names: Sequence[str], line: WrittenRow, file: str) -> None:
    for place, name in enumerate(names):
        if name and name in names[:place]:
            where = line.column_of(place)
            raise ResultsError(Finding(f"the column '{name}' stands twice", file, 1, where, "keep one"))
