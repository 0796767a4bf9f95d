"""`kind: active_pairs`: of many stimuli, after each batch of answers, the pairs that promise the most information."""

from __future__ import annotations

import random
from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from documents.yaml import Natural
from runner.blocks.all_pairs import fixation
from runner.blocks.block import (
    SECONDS_PER_TRIAL,
    Block,
    BlockSpec,
    Draft,
    Fault,
    Hold,
    Steps,
    StimulusNames,
    answer,
    chosen,
    name_faults,
)
from runner.blocks.field_types import OptionalFactor, Seconds, ShortSeconds
from runner.blocks.layout import PairLayout
from runner.blocks.message import page
from runner.blocks.orders import Pair
from runner.blocks.pair_choice import Gain, GroupedChooser, PairChooser, shared_out
from runner.blocks.pair_groups import PairGroups, group_faults, pair_groups
from runner.blocks.pair_views import SimultaneousView, Ties
from runner.blocks.pooled_choice import PooledChooser, pooled_batch
from runner.blocks.setting import Setting, Stimuli
from runner.blocks.style import FULL_HD_HALF, Style
from runner.blocks.tasks import Compare
from runner.ports import Ask, ChooseBatch
from runner.presenter.scene import Offset, Scene

Chooser = PairChooser | GroupedChooser | PooledChooser

FIRST_SHARE = {"first": 1.0, "second": 0.0}  # of a win; any other answer prefers neither and is half a win for each


@dataclass(frozen=True, slots=True)
class ActivePairs(Block):
    """``trials_wanted`` pairs, chosen in batches of at most ``batch`` by their expected information.

    The first answers follow a path through all stimuli in random order; then each batch is chosen by all the answers
    that this observer gave, as `runner.blocks.pair_choice` says. Times are those of `AllPairs`, and so is the response
    time. The record has the number of the ``batch`` too. With ``groups``, such as scenes, pairs are chosen within each
    by the answers to its own pairs, at most ``batch`` at a time, and those of all groups are mixed. With ``pooled``,
    batches are chosen by the answers of all observers, as `runner.blocks.pooled_choice` says.
    """

    stimuli: tuple[str, ...]
    question: str
    layout: PairLayout
    seed: str
    trials_wanted: int
    batch: int
    gain: Gain = "variance"
    break_every: int | None = None
    fixation_s: float = 0.0
    exposure_s: float | None = None
    blank_s: float = 0.0
    style: Style = FULL_HD_HALF
    reference: str | None = None
    ties: Ties = "none"
    groups: PairGroups | None = None
    pooled: bool = False

    @property
    def trials(self) -> int:
        """As many as are wanted."""
        return self.trials_wanted

    @property
    def facts(self) -> dict[str, Any]:
        """How many pairs each group has."""
        if self.groups is None:
            return {}
        members = self.groups.members
        wanted = shared_out(self.trials_wanted, [len(items) for items in members])
        names = [self.groups.group_of[self.stimuli[items[0]]] for items in members]
        return {f"pairs_within_{self.groups.factor}": dict(zip(names, wanted, strict=True))}

    @property
    def expected_s(self) -> float:
        """A few seconds for each answer, and the timed scenes."""
        return self.trials * (SECONDS_PER_TRIAL + self.fixation_s + (self.exposure_s or 0.0) + self.blank_s)

    @property
    def keys(self) -> dict[str, str]:
        """What chooses."""
        return self.view.keys

    @property
    def view(self) -> SimultaneousView:
        """How the two are shown."""
        return SimultaneousView(self.layout, self.question, self.style, self.ties, self.reference)

    @property
    def places_px(self) -> tuple[Offset, ...]:
        """Where the pictures stand."""
        return self.layout.places_px

    def steps(self) -> Steps:
        """Choose a batch, ask for its pairs and record each answer, until there are enough."""
        chooser = self._chooser()
        view = self.view
        done = batches = 0
        while done < self.trials_wanted:
            pairs = yield from self._next_batch(chooser, self.trials_wanted - done)
            scenes = [view.pair(self.stimuli[first], self.stimuli[second]) for first, second in pairs]
            for number, (first, second) in enumerate(pairs):
                if self.break_every and done and done % self.break_every == 0:
                    words = self.style.say("comparisons_done", done=done, all=self.trials_wanted)
                    yield replace(page(words, self.style), upcoming=scenes[number])
                yield from self._before(scenes[number], first_of_all=done == 0)
                names = self.stimuli[first], self.stimuli[second]
                response = answer(
                    (
                        yield Ask(
                            view.question() if self.exposure_s else scenes[number],
                            view.keys,
                            scenes[number + 1] if number + 1 < len(scenes) else None,
                            Compare(*names, self.reference),
                            view.targets,
                        )
                    )
                )
                chooser.learn(first, second, first_share=FIRST_SHARE.get(response.meaning, 0.5))
                data = {**_data(*names, response.meaning), "batch": batches}
                data["first_position"] = view.position_names[0]
                if self.groups:
                    data |= self.groups.record(*names)
                yield Draft("active_pairs", data, stimuli=names, response_time_s=response.time_s)
                done += 1
            batches += 1

    def _next_batch(self, chooser: Chooser, most: int) -> Generator[ChooseBatch, Any, Sequence[Pair]]:
        if isinstance(chooser, PooledChooser):
            return chooser.take((yield ChooseBatch(self.stimuli, chooser.choose)))
        return chooser.next_batch(most)

    def _chooser(self) -> Chooser:
        rng = random.Random(self.seed)
        if self.groups is None and not self.pooled:
            return PairChooser(len(self.stimuli), self.batch, rng, self.gain)
        members = self.groups.members if self.groups else (tuple(range(len(self.stimuli))),)
        wanted = shared_out(self.trials_wanted, [len(items) for items in members])
        if self.pooled:
            return PooledChooser(self.stimuli, members, wanted, self.batch, self.seed, self.gain)
        return GroupedChooser(members, wanted, self.batch, rng, self.gain)

    def _before(self, pair: Scene, *, first_of_all: bool) -> Iterator[Hold]:
        if self.blank_s and not first_of_all:
            yield Hold("blank", Scene(), self.blank_s)
        if self.fixation_s:
            yield Hold("fixation", fixation(self.style), self.fixation_s)
        if self.exposure_s:
            yield Hold("pair", pair, self.exposure_s)


def _data(first: str, second: str, meaning: str) -> dict[str, Any]:
    data = {"first": first, "second": second, "answer": meaning}
    if meaning not in FIRST_SHARE:
        return data
    chosen, rejected = (first, second) if meaning == "first" else (second, first)
    return data | {"chosen": chosen, "rejected": rejected}


class ActivePairsSpec(BlockSpec):
    """Pairs of many stimuli, each batch of them chosen by the answers so far.

    How many is given by ``trials`` or by ``trials_per_stimulus``. A ``batch`` holds each stimulus once at most; left
    out, it is as large as that allows. ``gain`` is what pairs are chosen by: how far an answer is expected to bring
    down the ``variance`` of the scores, or the ``entropy`` of what is known of the pair. Times are in seconds.
    ``within`` is a factor of the stimuli, such as their scene: only stimuli with the same level are compared, and each
    scene's pairs are chosen by the answers to its own. With ``pool: results``, pairs are chosen by the answers of all
    observers, of all stations, that stand in the results folder.
    """

    kind: Literal["active_pairs"]
    """Which kind of entry this is; it decides which other keys there are."""
    stimuli: StimulusNames = "all"
    """Which stimuli take part: all, or a list of their names."""
    within: OptionalFactor = None
    """The factor whose levels are compared each among themselves, such as scene."""
    trials: Annotated[int, Field(ge=1, le=100_000)] | None = None
    """How many trials there are."""
    trials_per_stimulus: Annotated[int, Field(ge=2, le=10_000)] | None = None
    """How many trials each stimulus takes part in."""
    batch: Natural | None = None
    """How many trials are chosen at a time from the answers so far."""
    gain: Gain = "variance"
    """What the next pairs are chosen for: least variance, or most information by entropy."""
    # Left out of what a digest is made of where it is not used: experiments from before the key keep theirs.
    pool: Annotated[Literal["none", "results"], Field(exclude_if=lambda pool: pool == "none")] = "none"
    """Whose answers the pairs are chosen by: this observer's (none), or those of all in the folder of results."""
    break_every: Natural | None = None
    """After how many trials there is a page to rest; left out, there is none."""
    fixation_s: ShortSeconds = 0.0
    """Seconds of a fixation mark before each trial."""
    exposure_s: Seconds | None = None
    """Seconds that the pictures are shown; left out, until the answer."""
    blank_s: ShortSeconds = 0.0
    """Seconds of an empty screen between trials."""
    ties: Ties = "none"
    """Which answers other than one of the two pictures are allowed."""

    @model_validator(mode="after")
    def _how_many(self) -> ActivePairsSpec:
        if (self.trials is None) == (self.trials_per_stimulus is None):
            raise ValueError("'active_pairs' needs either 'trials' or 'trials_per_stimulus'")
        return self

    def make(self, setting: Setting) -> ActivePairs:
        """Return the block as this observer begins it."""
        names = chosen(self.stimuli, setting.stimuli)
        groups = None if self.within is None else pair_groups(names, setting.stimuli, self.within)
        sizes = _sizes(names, groups)
        return ActivePairs(
            names,
            setting.question,
            setting.pair_layout(),
            setting.own_seed,
            self._trials(sizes),
            self.batch or (pooled_batch(max(sizes, default=0)) if self.pool == "results" else _most_at_once(sizes)),
            gain=self.gain,
            break_every=self.break_every,
            fixation_s=self.fixation_s,
            exposure_s=self.exposure_s,
            blank_s=self.blank_s,
            style=setting.style,
            reference=setting.reference,
            ties=self.ties,
            groups=groups,
            pooled=self.pool == "results",
        )

    def faults(self, stimuli: Stimuli) -> Iterator[Fault]:
        """Yield wrong stimuli or groups, too few stimuli, or too few trials to link them all."""
        wrong = list(name_faults(self.stimuli, stimuli, "stimuli", at_least=2))
        names = chosen(self.stimuli, stimuli)
        groups = None
        if self.within is not None and not wrong:
            wrong = list(group_faults(names, stimuli, self.within))
            groups = pair_groups(names, stimuli, self.within)
        yield from wrong
        if wrong and groups is not None:
            return
        sizes = _sizes(names, groups)
        fewest = sum(size - 1 for size in sizes)
        if self._trials(sizes) < fewest:
            where = "" if groups is None else f" within each {self.within}"
            what = f"{self.trials} trials cannot link {len(names)} stimuli{where}"
            yield Fault(what, ("trials",), f"ask for {fewest} or more, better ten for each stimulus")
        most = _most_at_once(sizes)
        if self.batch is not None and self.batch > most:
            what = f"a batch of {self.batch} pairs cannot hold each of {max(sizes)} stimuli once at most"
            yield Fault(what, ("batch",), f"make it {most} or less, or leave it out")

    def _trials(self, sizes: Sequence[int]) -> int:
        return self.trials or sum(-(-size * (self.trials_per_stimulus or 0) // 2) for size in sizes)


def _sizes(names: Sequence[str], groups: PairGroups | None) -> list[int]:
    return [len(names)] if groups is None else [len(items) for items in groups.members]


def _most_at_once(sizes: Sequence[int]) -> int:
    return max(1, max(sizes, default=0) // 2)
