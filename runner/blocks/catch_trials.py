"""Catch trials: pairs with an obvious answer, and pairs of one stimulus with itself, mixed in among the others.

The trials are cut into as many stretches as there are catch trials, and each stretch gets one, after one of its
trials: so none comes first, no two come one after the other, and they are spread over the whole block. Where a
stretch has a place at which a catch trial shares no stimulus with its neighbours, it is put there.
"""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from documents.yaml import Count, FileModel, Natural
from runner.blocks.block import Fault, name_faults
from runner.blocks.context import Stimuli

Catch = Literal["obvious", "identical"]


@dataclass(frozen=True, slots=True)
class PlacedPair:
    """Two stimuli in their places; in a catch trial also which sort it is, and which of the two is ``better``."""

    first: str
    second: str
    catch: Catch | None = None
    better: str | None = None

    @property
    def stimuli(self) -> tuple[str, ...]:
        """The stimuli shown, each once."""
        return tuple(dict.fromkeys((self.first, self.second)))

    def record(self, meaning: str, first_position: str) -> dict[str, Any]:
        """Return what is recorded of an answer: nothing is chosen in a tie, nor where a stimulus meets itself."""
        data: dict[str, Any] = {"first": self.first, "second": self.second, "answer": meaning}
        chosen: str | None = None
        if meaning in ("first", "second") and self.catch != "identical":
            chosen, rejected = (self.first, self.second) if meaning == "first" else (self.second, self.first)
            data |= {"chosen": chosen, "rejected": rejected}
        data["first_position"] = first_position
        if self.catch:
            data["catch"] = self.catch
        if self.catch == "obvious":
            data["correct"] = chosen == self.better
        return data


Pair = Annotated[list[str], Field(min_length=2, max_length=2)]


class CatchTrials(FileModel):
    """``pairs`` of stimuli (better, worse) with an obvious answer, and how many trials show one stimulus twice.

    One catch trial comes for ``every`` so many others, or for a ``share`` of them; ``identical`` of these show a
    stimulus of the block twice, the rest go through ``pairs``. Without ``every`` and ``share``, each pair comes once.
    """

    every: Annotated[Natural, Field(le=100_000)] | None = None
    """One catch trial in so many trials."""
    share: Annotated[float, Field(gt=0, le=0.5)] | None = None
    """The share of trials that are catch trials."""
    pairs: tuple[Pair, ...] = ()
    """Pairs with a known answer: the better picture first."""
    identical: Annotated[Count, Field(le=100_000)] = 0
    """How many catch trials show the same picture twice."""

    @model_validator(mode="after")
    def _one_number(self) -> CatchTrials:
        if self.every and self.share:
            raise ValueError("give 'every' or 'share', not both")
        return self

    def count(self, trials: int) -> int:
        """Return how many catch trials there are among so many others."""
        if self.every:
            return trials // self.every
        if self.share:
            return max(1, round(self.share * trials))
        return len(self.pairs) + self.identical

    def faults(self, stimuli: Stimuli, trials: int) -> Iterator[Fault]:
        """Yield unknown names, catch trials without anything to show, and more of them than fit."""
        for index, pair in enumerate(self.pairs):
            yield from name_faults(pair, stimuli, "catch", "pairs", index)
        if not self.pairs and not self.identical:
            yield Fault(
                "catch trials need something to show", ("catch",), "name pairs [better, worse], or give 'identical'"
            )
            return
        count = self.count(trials)
        if count == 0:
            yield Fault(
                f"{trials} trials have no catch trial every {self.every}", ("catch", "every"), f"at most {trials}"
            )
        elif count > trials:
            yield Fault(f"{count} catch trials are too many among {trials}", ("catch",), f"at most {trials}")
        elif self.identical > count:
            yield Fault(
                f"{self.identical} of {count} catch trials cannot be identical", ("catch", "identical"), "give fewer"
            )
        elif count > self.identical and not self.pairs:
            yield Fault(
                f"{count - self.identical} of {count} catch trials have no pair to show",
                ("catch",),
                "name pairs [better, worse], or leave out 'every' and 'share'",
            )


def mix_in(
    trials: Sequence[PlacedPair],
    catch: CatchTrials,
    count: int,
    stimuli: Sequence[str],
    side_seed: str,
    order_seed: str,
    *,
    flip: bool = False,
) -> list[PlacedPair]:
    """Return ``trials`` in their order with ``count`` catch trials among them; identical pairs are of ``stimuli``.

    The seeds and ``flip`` are those of `runner.blocks.orders.pair_order`. The better stimulus stands first in half
    of the obvious pairs, one more or less, and on the other side for the neighbouring observer.
    """
    rng = random.Random(f"{order_seed}/catch")
    waiting = [
        *_obvious(catch, count, random.Random(f"{side_seed}/catch"), flip=flip),
        *_identical(catch, stimuli, rng),
    ]
    rng.shuffle(waiting)
    kinds = Counter(waiting)
    mixed: list[PlacedPair] = []
    for number in range(count):
        start, end = (len(trials) * edge // count for edge in (number, number + 1))
        gap, chosen = _placed(trials, waiting, kinds, start, end, rng)
        item = waiting.pop(chosen)
        kinds[item] -= 1
        mixed += [*trials[start:gap], item, *trials[gap:end]]
    return mixed


def _obvious(catch: CatchTrials, count: int, rng: random.Random, *, flip: bool) -> Iterator[PlacedPair]:
    pairs = list(catch.pairs)
    rng.shuffle(pairs)
    turn = (rng.random() < 0.5) != flip
    for number in range(count - catch.identical):
        times, index = divmod(number, len(pairs))
        better, worse = pairs[index]
        first, second = (better, worse) if bool((times + index) % 2) == turn else (worse, better)
        yield PlacedPair(first, second, "obvious", better)


def _identical(catch: CatchTrials, stimuli: Sequence[str], rng: random.Random) -> Iterator[PlacedPair]:
    names = list(stimuli)
    rng.shuffle(names)
    for number in range(catch.identical):
        name = names[number % len(names)]
        yield PlacedPair(name, name, "identical")


def _placed(
    trials: Sequence[PlacedPair],
    waiting: Sequence[PlacedPair],
    kinds: Counter[PlacedPair],
    start: int,
    end: int,
    rng: random.Random,
) -> tuple[int, int]:
    """Return after which trial of the stretch which of ``waiting`` comes: the first that fits, of a random order.

    ``kinds`` counts those that are equal: once one of each was tried in vain, none will fit.
    """
    gaps = list(range(start + 1, end + 1))
    rng.shuffle(gaps)
    besides = [(gap, {name for trial in trials[gap - 1 : gap + 1] for name in trial.stimuli}) for gap in gaps]
    left = sum(count > 0 for count in kinds.values())
    tried: set[PlacedPair] = set()
    for index, item in enumerate(waiting):
        if item in tried:
            continue
        tried.add(item)
        for gap, beside in besides:
            if beside.isdisjoint(item.stimuli):
                return gap, index
        if len(tried) == left:
            break
    return gaps[0], 0
