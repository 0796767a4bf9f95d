"""The record of a trial as flat columns."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from analysis.kinds import KINDS, Trial
from extensions.bids.text import escape

Place = tuple[str, ...]

_DEEPEST = 6
OTHERS = "others"


@cache
def _name_no_stimulus(kinds: tuple[str, ...]) -> frozenset[str]:
    return frozenset(name for kind in kinds for name in KINDS[kind].no_stimulus)


def roles(data: Mapping[str, Any], stimuli: Collection[str]) -> dict[str, str]:
    """Return, for each stimulus that the trial names, the first key that does so (``first``, ``chosen``, ...)."""
    by_name: dict[str, str] = {}
    other = _name_no_stimulus(tuple(KINDS))
    for key, value in data.items():
        if isinstance(value, str) and value in stimuli and key not in other:
            by_name.setdefault(value, key)
    return by_name


def flatten(
    data: Mapping[str, Any], stimuli: Collection[str] = (), whole: Collection[str] = ()
) -> list[tuple[Place, Any]]:
    """Return each value of ``data`` with the keys that lead to it; sequences and empty mappings are values.

    In a mapping whose keys are all stimuli (``stimuli`` are the session's), the role that a stimulus has in the trial
    replaces its name, so that the number of columns does not grow with the stimuli; those without a role are one value
    together. Keys in ``whole`` are not flattened.
    """
    by_role = roles(data, stimuli)
    shown = frozenset(stimuli)
    values: list[tuple[Place, Any]] = []

    def descend(place: Place, inside: Mapping[str, Any]) -> None:
        if inside.keys() <= shown:
            others = {name: value for name, value in inside.items() if name not in by_role}
            inside = {by_role[name]: value for name, value in inside.items() if name in by_role}
        else:
            others = {}
        for key, value in inside.items():
            if value and isinstance(value, dict) and len(place) + 1 < _DEEPEST:
                descend((*place, key), value)
            else:
                values.append(((*place, key), value))
        if others:
            values.append(((*place, OTHERS), others))

    for key, value in data.items():
        if value and isinstance(value, dict) and key not in whole:
            descend((key,), value)
        else:
            values.append(((key,), value))
    return values


# A key that with more places than this is one column of JSON: a mapping by name, not a record.
_MOST_PLACES = 256
_LONGEST_NAME = 64
_MOST_LEVELS = 64
_LONGEST_LEVEL = 32
FIXED = ("onset", "block", "trial", "attempt", "trial_type", "response_time", "utc", "events", "simulated")
# Names that BIDS defines.
_RESERVED = frozenset({*FIXED, "duration", "stim_file", "hed", "channel"})


@dataclass(frozen=True, slots=True)
class BidsColumn:
    """A column: the place of its values in the records, the kinds of trials that have it, and the kind of values.

    ``format`` is a BIDS format (``number``, ``integer``, ``boolean``, ``string``); ``holds_json`` says that some values
    are mappings or sequences. ``values`` are the different texts, as cells; None where they are too many or too long
    to be levels.
    """

    name: str
    place: Place
    format: str
    holds_json: bool
    kinds: tuple[str, ...]
    values: tuple[str, ...] | None


_FORMATS = {bool: "boolean", int: "integer", float: "number", str: "string"}


@dataclass(slots=True)
class _Seen:
    formats: set[str] = field(default_factory=set)
    kinds: dict[str, None] = field(default_factory=dict)
    values: dict[str, None] = field(default_factory=dict)
    has_levels: bool = True

    def add(self, kind: str, value: Any) -> None:
        self.kinds.setdefault(kind)
        if value is None:
            return
        self.formats.add(_FORMATS.get(type(value), "json"))
        if not isinstance(value, str) or not self.has_levels:
            return
        if len(value) > _LONGEST_LEVEL or len(self.values) == _MOST_LEVELS:
            self.has_levels = False
            self.values.clear()
        else:
            self.values.setdefault(escape(value))


@dataclass(slots=True)
class ColumnCollector:
    """Collects the columns of a task from its trials; memory grows with the columns, not with the trials."""

    kinds: dict[str, None] = field(default_factory=dict)
    _seen: dict[Place, _Seen] = field(default_factory=dict)

    def add(self, trial: Trial, stimuli: Collection[str]) -> None:
        """Add a trial of a session that shows ``stimuli``."""
        self.kinds.setdefault(trial.kind)
        for place, value in flatten(trial.details(), stimuli):
            self._seen.setdefault(place, _Seen()).add(trial.kind, value)

    @property
    def whole(self) -> frozenset[str]:
        """The keys that are one column each, with any content."""
        count: dict[str, int] = {}
        for place in self._seen:
            count[place[0]] = count.get(place[0], 0) + 1
        return frozenset(key for key, places in count.items() if places > _MOST_PLACES)

    def columns(self) -> tuple[BidsColumn, ...]:
        """Return the columns beside the fixed ones, in the order in which they first occur."""
        whole = self.whole
        gathered: dict[Place, _Seen] = {}
        for place, seen in self._seen.items():
            if place[0] in whole:
                merged = gathered.setdefault(place[:1], _Seen({"json"}))
                merged.kinds |= seen.kinds
            else:
                gathered[place] = seen
        taken = set(_RESERVED)
        return tuple(_column(_name(place, taken), place, seen) for place, seen in gathered.items())


def _column(name: str, place: Place, seen: _Seen) -> BidsColumn:
    if len(seen.formats) == 1:
        (form,) = seen.formats
    else:
        form = "number" if seen.formats == {"integer", "number"} else "string"
    values = tuple(seen.values) if seen.has_levels and seen.formats == {"string"} else None
    return BidsColumn(
        name, place, "string" if form == "json" else form, "json" in seen.formats, tuple(seen.kinds), values
    )


def _name(place: Iterable[str], taken: set[str]) -> str:
    words = (re.sub(r"[^0-9A-Za-z]+", "_", part).strip("_").lower() for part in place)
    name = "_".join(word for word in words if word)[:_LONGEST_NAME] or "value"
    if name in _RESERVED:
        name = f"data_{name}"
    unique, number = name, 1
    while unique in taken:
        number += 1
        unique = f"{name}_{number}"
    taken.add(unique)
    return unique
