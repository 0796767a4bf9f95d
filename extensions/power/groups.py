"""How many observers an experiment of pairs within groups needs: enough for the pairs that matter in every group."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from documents.text import JsonResult
from extensions.power.results import Needed, answer_words, doubt_words


@dataclass(frozen=True, slots=True, eq=False)
class GroupsNeeded(JsonResult):
    """The fewest observers with which the pairs that matter separate often enough in every group.

    The same observers answer in all groups; each group has a scale, tests and a simulation of its own. Whether all
    groups succeed in one study is not computed.

    Attributes
    ----------
    groups
        The name of each group and what it needs, all with the same numbers of observers.
    """

    groups: tuple[tuple[str, Needed], ...]
    json_keys: ClassVar = Needed.json_keys
    json_names: ClassVar = Needed.json_names

    @property
    def target(self) -> float:
        """The power (0 to 1) that each pair should reach."""
        return self.groups[0][1].target

    @property
    def sizes(self) -> tuple[int, ...]:
        """The numbers of observers tried, ascending."""
        return self.groups[0][1].power.observers

    @property
    def observers(self) -> int | None:
        """The fewest observers that are enough in every group; None if there is no such number."""
        each = [needed.observers for _, needed in self.groups]
        enough = [number for number in each if number is not None]
        return max(enough) if len(enough) == len(each) else None

    @property
    def sentence(self) -> str:
        """The answer in words."""
        size = len(self.sizes) - 1 if self.observers is None else self.sizes.index(self.observers)
        reach = of = 0
        hardest = []
        for name, needed in self.groups:
            chances = needed.power.separates[size, needed.pairs]
            reach, of = reach + int((chances >= self.target).sum()), of + len(chances)
            hardest.append((float(chances.min()), name, needed, int(needed.pairs[chances.argmin()])))
        chance, group, needed, pair = min(hardest, key=lambda one: one[0])
        first, second = needed.power.pair_names[pair]
        pairs = f"the {of} pairs named" if needed.named else f"all {of} pairs that should differ"
        where = f"in {len(self.groups)} groups" if len(self.groups) > 1 else f"in {group}"
        which = f"{pairs} {where}" if of > 1 else f"{first} and {second}"
        return answer_words(
            self.sizes[size],
            enough=self.observers is not None,
            fewest=size == 0,
            target=self.target,
            which=which,
            hardest=f"{first} and {second} in {group}",
            reach=(reach, of),
            chance=chance,
            error=float(needed.power.separates_error[size, pair]),
        )

    @property
    def doubt(self) -> str | None:
        """Which numbers two standard errors of the simulation leave open, or None."""
        each = [needed.limits for _, needed in self.groups]
        perhaps, surely = zip(*each, strict=True)
        return doubt_words(self.sizes, _last(perhaps), _last(surely))

    @property
    def needs(self) -> list[dict[str, Any]]:
        """The number of observers of each pair that matters, with its group."""
        return [{"group": name, **pair} for name, needed in self.groups for pair in needed.needs]

    @property
    def details(self) -> dict[str, Any]:
        """Each group with its own answer and every value."""
        return {"groups": [{"name": name, "needed": own, **own.details.to_json()} for name, own in self.groups]}


def _last(indices: tuple[int | None, ...]) -> int | None:
    known = [index for index in indices if index is not None]
    return max(known) if len(known) == len(indices) else None


def parts_of(needed: Needed | GroupsNeeded) -> tuple[tuple[str, Needed], ...]:
    """Return each group's name and what it needs; a single one without a name where there are no groups."""
    return needed.groups if isinstance(needed, GroupsNeeded) else (("", needed),)
