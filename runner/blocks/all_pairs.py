"""`kind: all_pairs`: every two stimuli, at once or in sequence; which is closer to the reference?

The thesis's second experiment (Section 4.5.2): all pairs, one answer each, a break now and then.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import replace
from functools import partial
from itertools import combinations
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from documents.yaml import Natural
from runner.blocks.block import SECONDS_PER_TRIAL, Block, Draft, Fault, Named, Steps, StimulusNames, chosen, name_faults
from runner.blocks.catch_trials import CatchTrials, PlacedPair, mix_in
from runner.blocks.context import BlockContext, Stimuli
from runner.blocks.incomplete_pairs import designs, fewest_pairs, observers_pairs, place_of
from runner.blocks.message import TimedKind
from runner.blocks.orders import Pair, grouped_order, pair_order
from runner.blocks.pair_groups import PairGroups, group_faults, pairs_in_groups
from runner.blocks.scale import RatedScene, Scale, ends_of, rate, scale_faults, scales_named
from runner.ports import Ask, Compare, Response, answer
from runner.scene import Picture
from runner.views.field_types import OptionalFactor, ShortSeconds
from runner.views.layout import SingleLayout
from runner.views.pair_views import SequenceView, SimultaneousView, Ties, gap_s, present, sequence_page

_SECONDS_PER_RATING = 4.0


class PairScale(Scale):
    """A scale that follows each choice: about the stimulus chosen, or about both."""

    of: Literal["chosen", "both"] = "chosen"
    """Which of the two pictures is rated: the chosen one, or both."""


class AllPairs(TimedKind):
    """Every two of the stimuli together, one answer each.

    ``within`` is a factor of the stimuli, such as their scene: only stimuli with the same level are compared. With
    ``across``, another factor, stimuli of different groups are compared too if they have the same level of it. With
    ``per_observer``, observers share the pairs, each linking all stimuli that all pairs link.

    Times are in seconds, to the nearest frame: a fixation cross before each pair, a limited exposure of the pair (it
    stays until answered if left out), black between trials. In a ``sequence``, ``exposure_s`` is each interval's and
    ``blank_between_s`` lies between the two. ``ties`` are answers that prefer neither, ``ratings`` scales that follow
    each choice.
    """

    _last = ("ties", "catch", "ratings")

    kind: Literal["all_pairs"]
    stimuli: StimulusNames = "all"
    """Which stimuli take part: all, or a list of their names."""
    within: OptionalFactor = None
    """The factor whose levels are compared each among themselves, such as scene."""
    across: OptionalFactor = None
    """The factor that links the groups of within, by pairs of equal level."""
    per_observer: Annotated[Natural | None, Field(exclude_if=lambda value: value is None)] = None
    """How many of the pairs each observer compares; left out, all of them."""
    balance: Annotated[Literal["pairs"] | None, Field(exclude_if=lambda value: value is None)] = None
    """What per_observer balances over observers: pairs, each compared as often as the others."""
    presentation: Literal["simultaneous", "sequence"] = "simultaneous"
    """Whether two pictures are shown at once, or one after the other."""
    sides: Literal["counterbalanced"] = "counterbalanced"
    """How sides are given to pictures: counterbalanced over trials and observers."""
    repeats: Annotated[Natural, Field(le=100_000)] = 1
    """How many times each one is asked."""
    blank_between_s: ShortSeconds | None = None
    """Seconds of an empty screen between the two intervals of a sequence; 0.5 if left out."""
    ties: Ties = "none"
    """Which answers other than one of the two pictures are allowed."""
    catch: CatchTrials | None = None
    """Trials with a known answer, which show whether an observer attends."""
    ratings: Annotated[tuple[PairScale, ...], Field(max_length=10)] = ()
    """Scales that are asked beside the choice."""

    @model_validator(mode="after")
    def _intervals(self) -> AllPairs:
        if self.presentation == "sequence" and self.exposure_s is None:
            raise ValueError("'presentation: sequence' needs 'exposure_s', the time of each interval")
        if self.presentation == "simultaneous" and self.blank_between_s is not None:
            raise ValueError("'blank_between_s' belongs to 'presentation: sequence'; 'blank_s' lies between trials")
        return self

    @model_validator(mode="after")
    def _factors(self) -> AllPairs:
        if self.across is not None and self.within is None:
            raise ValueError("'across' links the groups of 'within'; name their factor, such as 'within: scene'")
        if self.across is not None and self.across == self.within:
            raise ValueError(f"'across' and 'within' are both '{self.within}'; name another factor, such as 'codec'")
        return self

    @model_validator(mode="after")
    def _shared(self) -> AllPairs:
        if self.balance is not None and self.per_observer is None:
            raise ValueError("'balance' says how observers share pairs; give 'per_observer', the pairs of each, too")
        return self

    def meet(self, setting: BlockContext) -> Block:
        """Return the block in the observer's own order.

        The response time is that of the choice, from the onset of the screen that can be answered: of the pair, or of
        the question where the pair is taken away before it.
        """
        view, groups, part = self.view(setting), self._groups(setting.stimuli), self._part(setting)
        pairs = len(self._pairs(setting.stimuli) if part is None else part) * self.repeats
        catch = self.catch.count(self._trials(setting.stimuli)) if self.catch else 0
        shown_s = (self.exposure_s or 0.0) * (2 if self.presentation == "sequence" else 1)
        timed_s = self.fixation_s + shown_s + self.between_s + self.blank_s
        ratings = sum(2 if scale.of == "both" else 1 for scale in self.ratings)
        rated_px = setting.single_layout().places_px if self.ratings else ()
        return Block(
            entry=self,
            steps=partial(self._steps, setting, view),
            trials=pairs + catch,
            expected_s=(pairs + catch) * (SECONDS_PER_TRIAL + timed_s + _SECONDS_PER_RATING * ratings),
            keys=view.keys,
            places_px=(*view.layout.places_px, *rated_px),
            scale_ends=ends_of(self.ratings),
            facts=({"catch_trials": catch} if self.catch else {})
            | ((groups if part is None else groups.only(part)).facts if groups else {}),
        )

    @property
    def between_s(self) -> float:
        """How long black lies between the intervals of a sequence, in seconds; 0 where pictures are shown at once."""
        return gap_s(self.blank_between_s, in_sequence=self.presentation == "sequence")

    def view(self, setting: BlockContext) -> SimultaneousView | SequenceView:
        """Return how the two are shown."""
        look = setting.question, setting.style, self.ties, setting.reference
        if self.presentation == "sequence":
            return SequenceView(setting.single_layout(), *look)
        return SimultaneousView(setting.pair_layout(), *look)

    def comparisons(self, setting: BlockContext) -> list[PlacedPair]:
        """Return who meets whom, in the observer's order, catch trials among them."""
        names, groups, part = chosen(self.stimuli, setting.stimuli), self._groups(setting.stimuli), self._part(setting)
        seeds = setting.pair_seed if part is None else setting.own_seed, setting.own_seed
        flip = setting.flips_sides
        if groups is None:
            order = pair_order(len(names), self.repeats, *seeds, flip=flip, part=part)
        else:
            own = groups if part is None else groups.only(part)
            order = grouped_order(own.sets, self.repeats, *seeds, flip=flip)
        pairs = [PlacedPair(names[first], names[second]) for first, second in order]
        if self.catch is None:
            return pairs
        return mix_in(pairs, self.catch, self.catch.count(len(pairs)), names, *seeds, flip=flip)

    def faults(self, stimuli: Stimuli) -> Iterator[Fault]:
        """Yield wrong stimuli, or too few, and what is wrong with groups, catch trials and ratings."""
        wrong = list(name_faults(self.stimuli, stimuli, "stimuli", at_least=2))
        if self.within is not None and not wrong:
            wrong = list(group_faults(chosen(self.stimuli, stimuli), stimuli, self.within, self.across))
        if self.per_observer is not None and not wrong:
            wrong = list(self._part_faults(stimuli, self.per_observer))
        yield from wrong
        if self.catch and not wrong:
            yield from self.catch.faults(stimuli, self._trials(stimuli))
        yield from scale_faults(self.ratings, "ratings")

    def named(self, stimuli: Stimuli) -> Iterator[Named]:
        """Yield its scales, those about both stimuli apart."""
        for rating, named in zip(self.ratings, scales_named(self.ratings), strict=True):
            yield replace(named, what="scale of both") if rating.of == "both" else named

    def pairs(self, stimuli: Stimuli) -> list[tuple[str, str]]:
        """Return the pairs that are compared, whichever comes first, each once."""
        names = chosen(self.stimuli, stimuli)
        return [(names[i], names[j]) for i, j in self._pairs(stimuli)]

    def pairs_by_place(self, stimuli: Stimuli, seed: str, places: int) -> Iterator[list[tuple[str, str]]]:
        """Yield the pairs of the first ``places`` observers in turn; ``seed`` is `BlockContext.shared_seed`."""
        pairs = self.pairs(stimuli)
        if self.per_observer is None:
            yield from (pairs for _ in range(places))
            return
        count = len(chosen(self.stimuli, stimuli))
        for part in designs(count, self._pairs(stimuli), self.per_observer, seed, places):
            yield [pairs[index] for index in part]

    def _pairs(self, stimuli: Stimuli) -> tuple[Pair, ...]:
        groups = self._groups(stimuli)
        return tuple(combinations(range(len(chosen(self.stimuli, stimuli))), 2) if groups is None else groups.sets)

    def _part(self, setting: BlockContext) -> tuple[Pair, ...] | None:
        """Return the observer's pairs; None for all, also where `faults` finds too few or many."""
        stimuli = setting.stimuli
        if self.per_observer is None or next(self._part_faults(stimuli, self.per_observer), None):
            return None
        count, place = len(chosen(self.stimuli, stimuli)), place_of(setting.observer, setting.draw.sitting)
        return observers_pairs(count, self._pairs(stimuli), self.per_observer, setting.shared_seed, place)

    def _part_faults(self, stimuli: Stimuli, each: int) -> Iterator[Fault]:
        count, pairs = len(chosen(self.stimuli, stimuli)), self._pairs(stimuli)
        if each > len(pairs):
            remedy = f"ask for {len(pairs)} or fewer, or leave it out: every observer then compares all pairs"
            yield Fault(
                f"{each} pairs per observer are more than the {len(pairs)} there are", ("per_observer",), remedy
            )
        elif each < (fewest := fewest_pairs(count, pairs)):
            where = f" within each {self.within}" if self.within is not None and self.across is None else ""
            what = f"{each} pairs per observer cannot link {count} stimuli{where}"
            yield Fault(what, ("per_observer",), f"ask for {fewest} or more, better {2 * count} or all pairs")

    def _groups(self, stimuli: Stimuli) -> PairGroups | None:
        if self.within is None:
            return None
        return pairs_in_groups(chosen(self.stimuli, stimuli), stimuli, self.within, self.across)

    def _trials(self, stimuli: Stimuli) -> int:
        """Return how many trials there are beside catch trials."""
        return (self.per_observer or len(self._pairs(stimuli))) * self.repeats

    def _steps(self, setting: BlockContext, view: SimultaneousView | SequenceView) -> Steps:
        """Ask for every pair and record each answer."""
        style, reference, trials = setting.style, setting.reference, self.comparisons(setting)
        groups = self._groups(setting.stimuli)
        layout = setting.single_layout() if self.ratings else None
        place_px = view.layout.picture_px if isinstance(view, SequenceView) else (0, 0)
        keys, targets = view.keys, view.targets  # the same for every pair
        if isinstance(view, SequenceView):
            yield replace(sequence_page(style), upcoming=view.pair(trials[0].first, trials[0].second))
        for number, trial in enumerate(trials):
            upcoming = view.pair(trial.first, trial.second)
            yield from self.rests(style, "comparisons_done", number, len(trials), upcoming)
            following = trials[number + 1] if number + 1 < len(trials) else None
            yield from self.before(style, place_px, first_of_all=number == 0)
            scene, _ = yield from present(view, trial.first, trial.second, self.exposure_s, self.between_s)
            response = answer(
                (
                    yield Ask(
                        scene,
                        keys,
                        view.pair(following.first, following.second) if following else None,
                        Compare(trial.first, trial.second, reference),
                        targets,
                    )
                )
            )
            data = trial.record(response.meaning, view.position_names[0])
            if groups:
                data |= groups.record(trial.first, trial.second)
            if layout:
                data |= yield from self._rate(setting, layout, trial, response.meaning)
            yield Draft("all_pairs", data, stimuli=trial.stimuli, response_time_s=response.time_s)

    def _rate(
        self, setting: BlockContext, layout: SingleLayout, trial: PlacedPair, meaning: str
    ) -> Generator[Ask, Response | None, dict[str, dict[str, Any]]]:
        """Ask for each rating, under the picture that it is about, and return what to record.

        After an answer that prefers neither, scales about the chosen one are left out and recorded as null.
        """
        places = {"first": trial.first, "second": trial.second}
        reference = setting.reference
        ratings: dict[str, Any] = {}
        times_s: dict[str, Any] = {}
        for scale in self.ratings:
            values, seconds = {}, {}
            for place in places if scale.of == "both" else places.keys() & {meaning}:
                name = places[place]
                items = (Picture(name, layout.picture_px, layout.aperture_px), *layout.reference(reference))
                values[place], time_s = yield from rate(
                    scale, setting.style, RatedScene(layout, items, name, reference)
                )
                seconds[place] = round(time_s, 6)
            both = scale.of == "both"
            ratings[scale.name] = values if both else values.get(meaning)
            times_s[scale.name] = seconds if both else seconds.get(meaning)
        return {"ratings": ratings, "rating_times_s": times_s}
