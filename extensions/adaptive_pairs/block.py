"""`kind: active_pairs`: of many stimuli, after each batch of answers, the pairs that promise the most information."""

from __future__ import annotations

import random
from collections.abc import Generator, Iterator, Sequence
from functools import partial
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from documents.yaml import Natural
from extensions.adaptive_pairs.pair_choice import Gain, GroupedChooser, PairChooser, shared_out
from extensions.adaptive_pairs.pooled_choice import PooledChooser, pooled_batch
from runner.blocks import (
    SECONDS_PER_TRIAL,
    Block,
    BlockContext,
    Draft,
    Fault,
    Pair,
    PairGroups,
    Pooled,
    Steps,
    Stimuli,
    StimulusNames,
    TimedKind,
    chosen,
    group_faults,
    name_faults,
    pairs_in_groups,
)
from runner.ports import Ask, ChooseBatch, Compare, Hold, answer
from runner.views import OptionalFactor, SimultaneousView, Ties

Chooser = PairChooser | GroupedChooser | PooledChooser
Grouped = tuple[tuple[str, ...], PairGroups | None]

FIRST_SHARE = {"first": 1.0, "second": 0.0}  # of a win; any other answer prefers neither and is half a win for each


class ActivePairs(TimedKind):
    """Pairs of many stimuli, each batch of them chosen by the answers so far.

    How many is given by ``trials`` or by ``trials_per_stimulus``. A ``batch`` holds each stimulus once at most; left
    out, it is as large as that allows. ``gain`` is what pairs are chosen by: how far an answer is expected to bring
    down the ``variance`` of the scores, or the ``entropy`` of what is known of the pair. Times are in seconds.
    ``within`` is a factor of the stimuli, such as their scene: only stimuli with the same level are compared, and each
    scene's pairs are chosen by the answers to its own. With ``pool: results``, pairs are chosen by the answers of all
    observers, of all stations, that stand in the results folder.
    """

    pairs_by_answers = True
    _last = ("ties",)

    kind: Literal["active_pairs"]
    stimuli: StimulusNames = "all"
    """Which stimuli take part: all, or a list of their names."""
    within: OptionalFactor = None
    """The factor whose levels are compared each among themselves, such as scene."""
    trials: Annotated[int, Field(ge=1, le=100_000)] | None = None
    """How many trials there are."""
    trials_per_stimulus: Annotated[int, Field(ge=2, le=10_000)] | None = None
    """How many trials each stimulus takes part in."""
    batch: Natural | None = None
    """How many trials are chosen at a time; left out, half the stimuli, with pool: results a sixth, 5 at least."""
    gain: Gain = "variance"
    """What the next pairs are chosen for: least variance, or most information by entropy."""
    # Left out of what a digest is made of where it is not used: experiments from before the key keep theirs.
    pool: Annotated[Literal["none", "results"], Field(exclude_if=lambda pool: pool == "none")] = "none"
    """Whose answers the pairs are chosen by: this observer's (none), or those of all in the folder of results."""
    ties: Ties = "none"
    """Which answers other than one of the two pictures are allowed."""

    @model_validator(mode="after")
    def _how_many(self) -> ActivePairs:
        if (self.trials is None) == (self.trials_per_stimulus is None):
            raise ValueError("'active_pairs' needs either 'trials' or 'trials_per_stimulus'")
        return self

    def meet(self, setting: BlockContext) -> Block:
        """Return the block as this observer begins it.

        The first answers follow a path through all stimuli in random order; then each batch is chosen by all the
        answers that this observer gave, as `pair_choice` says, or those of all observers, as `pooled_choice`
        says. The response time is that of the choice, as in `AllPairs`.
        """
        view = SimultaneousView(
            setting.pair_layout(), setting.question, setting.style, self.ties, reference=setting.reference
        )
        trials = self._trials(_sizes(*self.grouped(setting.stimuli)))
        timed_s = self.fixation_s + (self.exposure_s or 0.0) + self.blank_s
        return Block(
            entry=self,
            steps=partial(self._steps, setting, view, trials),
            trials=trials,
            expected_s=trials * (SECONDS_PER_TRIAL + timed_s),
            keys=view.keys,
            places_px=view.layout.places_px,
            facts=self._facts(setting.stimuli, trials),
        )

    def grouped(self, stimuli: Stimuli) -> Grouped:
        """Return the stimuli that take part, and the pairs within each group; None where all pairs may be asked."""
        names = chosen(self.stimuli, stimuli)
        return names, None if self.within is None else pairs_in_groups(names, stimuli, self.within)

    def pooled(self, stimuli: Stimuli) -> Pooled | None:
        """Return the stimuli, and the pairs within their groups, if they are chosen by the answers of all observers."""
        if self.pool == "none":
            return None
        names, groups = self.grouped(stimuli)
        return names, None if groups is None else groups.sets

    def most_at_once(self, stimuli: Stimuli) -> int:
        """Return how many pairs are chosen at a time, at most, within each group."""
        sizes = _sizes(*self.grouped(stimuli))
        usual = pooled_batch(max(sizes, default=0)) if self.pool == "results" else _most_at_once(sizes)
        return self.batch or usual

    def faults(self, stimuli: Stimuli) -> Iterator[Fault]:
        """Yield wrong stimuli or groups, too few stimuli, or too few trials to link them all."""
        wrong = list(name_faults(self.stimuli, stimuli, "stimuli", at_least=2))
        names = chosen(self.stimuli, stimuli)
        groups = None
        if self.within is not None and not wrong:
            wrong = list(group_faults(names, stimuli, self.within))
            _, groups = self.grouped(stimuli)
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

    def unpractised(self) -> Iterator[Fault]:
        """Yield that answers of a practice are not pooled."""
        if self.pool != "none":
            yield Fault("a practice's answers are not pooled", ("pool",), "leave 'pool' out")

    def _facts(self, stimuli: Stimuli, trials: int) -> dict[str, Any]:
        """Return how many pairs each group has."""
        names, groups = self.grouped(stimuli)
        if groups is None:
            return {}
        members = groups.members
        wanted = shared_out(trials, [len(items) for items in members])
        levels = [groups.group_of[names[items[0]]] for items in members]
        return {f"pairs_within_{groups.factor}": dict(zip(levels, wanted, strict=True))}

    def _steps(self, setting: BlockContext, view: SimultaneousView, trials: int) -> Steps:
        """Choose a batch, ask for its pairs and record each answer, until there are enough."""
        names, groups = self.grouped(setting.stimuli)
        style, reference = setting.style, setting.reference
        chooser = self._chooser(setting, trials)
        done = batches = 0
        while done < trials:
            pairs = yield from self._next_batch(chooser, names, trials - done)
            scenes = [view.pair(names[first], names[second]) for first, second in pairs]
            for number, (first, second) in enumerate(pairs):
                yield from self.rests(style, "comparisons_done", done, trials, scenes[number])
                yield from self.before(style, first_of_all=done == 0)
                if self.exposure_s:
                    yield Hold("pair", scenes[number], self.exposure_s)
                pair = names[first], names[second]
                response = answer(
                    (
                        yield Ask(
                            view.question() if self.exposure_s else scenes[number],
                            view.keys,
                            scenes[number + 1] if number + 1 < len(scenes) else None,
                            Compare(*pair, reference),
                            view.targets,
                        )
                    )
                )
                chooser.learn(first, second, first_share=FIRST_SHARE.get(response.meaning, 0.5))
                data = {**_data(*pair, response.meaning), "batch": batches}
                data["first_position"] = view.position_names[0]
                if groups:
                    data |= groups.record(*pair)
                yield Draft("active_pairs", data, stimuli=pair, response_time_s=response.time_s)
                done += 1
            batches += 1

    def _next_batch(
        self, chooser: Chooser, names: tuple[str, ...], most: int
    ) -> Generator[ChooseBatch, Any, Sequence[Pair]]:
        if isinstance(chooser, PooledChooser):
            return chooser.take((yield ChooseBatch(names, chooser.choose)))
        return chooser.next_batch(most)

    def _chooser(self, setting: BlockContext, trials: int) -> Chooser:
        names, groups = self.grouped(setting.stimuli)
        batch, seed = self.most_at_once(setting.stimuli), setting.own_seed
        if groups is None and self.pool == "none":
            return PairChooser(len(names), batch, random.Random(seed), self.gain)
        members = groups.members if groups else (tuple(range(len(names))),)
        wanted = shared_out(trials, [len(items) for items in members])
        if self.pool == "results":
            return PooledChooser(names, members, wanted, batch, seed, self.gain)
        return GroupedChooser(members, wanted, batch, random.Random(seed), self.gain)

    def _trials(self, sizes: Sequence[int]) -> int:
        return self.trials or sum(-(-size * (self.trials_per_stimulus or 0) // 2) for size in sizes)


def _data(first: str, second: str, meaning: str) -> dict[str, Any]:
    data = {"first": first, "second": second, "answer": meaning}
    if meaning not in FIRST_SHARE:
        return data
    chosen, rejected = (first, second) if meaning == "first" else (second, first)
    return data | {"chosen": chosen, "rejected": rejected}


def _sizes(names: Sequence[str], groups: PairGroups | None) -> list[int]:
    return [len(names)] if groups is None else [len(items) for items in groups.members]


def _most_at_once(sizes: Sequence[int]) -> int:
    return max(1, max(sizes, default=0) // 2)
