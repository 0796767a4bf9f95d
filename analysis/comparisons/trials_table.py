"""The table of trials that `cyclopean.read_results` gives, as a table of comparisons: its paired choices."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from analysis.comparisons.columns import KINDS, TIES, Columns
from analysis.comparisons.plain_lines import Fault, PlainReading

_NEEDED = ("experiment", "kind", "first", "second", "answer", "chosen", "rejected")
# Columns of the plain layout, and the column of trials that each is taken from.
_TAKEN = {"winner": "chosen", "loser": "rejected", "observer": "observer", "first": "first", "group": "group"}
_EMPTY = "the trials hold no paired comparison", "read results of a block of pairs"


@dataclass(frozen=True, slots=True)
class Trials:
    """The layout: one line for each trial of any kind; those that compare no pair, and catch trials, are left out."""

    name: str = "trials"
    wanted: str = ", ".join(_NEEDED)

    def recognises(self, names: Sequence[str]) -> bool:
        """Say whether a header of these ``names`` is that of trials."""
        return "winner" not in names and set(_NEEDED) <= set(names)

    def reading(self, header: Sequence[str], line: str, file: str, codes: Sequence[str]) -> TrialsReading:
        """Return what reads the lines below ``header``."""
        return TrialsReading({name.strip().lower(): place for place, name in enumerate(header)}, len(header))


@dataclass(slots=True)
class TrialsReading:
    """Reads lines of trials, whose columns stand at ``places``."""

    places: dict[str, int]
    width: int
    notes: tuple[str, ...] = ("each line is a trial; those that compare no pair, and catch trials, are left out",)
    columns: Columns = field(init=False)
    experiments: set[str] = field(default_factory=set)
    simulated: set[str] = field(default_factory=set)
    found: int = 0

    @property
    def needed(self) -> Mapping[int, str]:
        """No column: names are those of the logs, and what no pair has is empty."""
        return {}

    @property
    def unknown(self) -> Collection[int]:
        """The columns in which a missing value is read as an empty field: other programs write a word there."""
        return [self.places[name] for name in ("catch", "group") if name in self.places]

    def __post_init__(self) -> None:
        taken = [name for name, source in _TAKEN.items() if source in self.places]
        self.columns = {name: place for place, name in enumerate([*taken, "outcome"])}

    def translate(self, rows: Sequence[Sequence[str]]) -> Sequence[Sequence[str]] | None:
        """Return the comparisons among ``rows`` in the plain layout; None if a line has a fault."""
        if any(len(row) != self.width for row in rows if any(map(str.strip, row))):
            return None
        told = list(self._compared(rows))
        self.found += len(told)
        return told

    def fault(self, row: Sequence[str]) -> Fault | None:
        """Return the field that is wrong, what is wrong with it, and the remedy; None if nothing is."""
        if len(row) != self.width:
            where = self.width if len(row) > self.width else max(len(row) - 1, 0)
            return where, f"the line has {len(row)} fields", f"the header has {self.width}; quote a name with a comma"
        for told in self._compared([row]):
            if fault := PlainReading(self.columns).fault(told):
                name = list(self.columns)[fault[0]]
                return self.places[_TAKEN.get(name, "answer")], *fault[1:]
        return None

    def end(self) -> tuple[str, str] | None:
        """Return what is wrong with the whole: several experiments, people beside simulated ones, nothing."""
        if len(self.experiments) > 1:
            names = sorted(self.experiments)
            what = f"the trials are of {len(names)} experiments: {', '.join(names)}"
            return what, f"keep one: trials[trials['experiment'] == '{names[0]}']"
        if len(self.simulated) > 1:
            what = "the trials are of people and of simulated observers"
            return what, "keep one: trials[~trials['simulated']]; or drop the column to count both"
        return None if self.found else _EMPTY

    def _compared(self, rows: Sequence[Sequence[str]]) -> Iterator[list[str]]:
        for row in rows:
            value = {name: row[place].strip() for name, place in self.places.items()} if any(row) else {}
            if value:
                self.experiments.add(value["experiment"])
            if value.get("kind") not in KINDS or value.get("catch"):
                continue
            self.simulated.add(value.get("simulated", "").casefold())
            tie = value["answer"] in TIES
            if tie:
                value |= {"chosen": value["first"], "rejected": value["second"]}
            yield [*(value[_TAKEN[name]] for name in self.columns if name in _TAKEN), "tie" if tie else "win"]
