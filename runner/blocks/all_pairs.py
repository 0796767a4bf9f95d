"""`kind: all_pairs`: every two stimuli, at once or in sequence; which is closer to the reference?"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from documents.yaml import Natural
from runner.blocks.block import (
    SECONDS_PER_TRIAL,
    Block,
    BlockSpec,
    Draft,
    Fault,
    Hold,
    Named,
    Response,
    Steps,
    StimulusNames,
    answer,
    chosen,
    name_faults,
)
from runner.blocks.catch_trials import CatchSpec, CatchTrials, Comparison, mix_in
from runner.blocks.field_types import OptionalFactor, Seconds, ShortSeconds
from runner.blocks.incomplete_pairs import designs, fewest_pairs, observers_pairs, place_of
from runner.blocks.layout import PairLayout, SingleLayout
from runner.blocks.message import page
from runner.blocks.orders import Pair, grouped_order, pair_order
from runner.blocks.pair_groups import PairGroups, group_faults, pair_groups
from runner.blocks.pair_views import SequenceView, SimultaneousView, Ties, present, sequence_page
from runner.blocks.scale import Scale, ScaleSpec, ends_of, rate, scale_faults, scales_named
from runner.blocks.setting import Setting, Stimuli
from runner.blocks.style import FULL_HD_HALF, Style
from runner.blocks.tasks import Compare
from runner.ports import Ask
from runner.presenter.scene import Offset, Picture, Scene


@dataclass(frozen=True, slots=True)
class PairRating:
    """A scale about the chosen stimulus, or about each of the two in turn."""

    scale: Scale
    of: Literal["chosen", "both"] = "chosen"


@dataclass(frozen=True, slots=True)
class PairRatings:
    """The scales of a trial, each under the picture that it is about."""

    scales: tuple[PairRating, ...]
    layout: SingleLayout
    style: Style
    reference: str | None = None

    def ask(
        self, places: Mapping[str, str], chosen: str | None
    ) -> Generator[Ask, Response | None, dict[str, dict[str, Any]]]:
        """Ask for each rating and return what to record; to be used with ``yield from``.

        ``places`` maps ``first`` and ``second`` to their stimuli, ``chosen`` is one of these words; None after an
        answer that prefers neither, when scales about the chosen one are left out and recorded as null.
        """
        ratings: dict[str, Any] = {}
        times_s: dict[str, Any] = {}
        for rating in self.scales:
            name = rating.scale.name
            if rating.of == "chosen":
                ratings[name], times_s[name] = (
                    (yield from self._rate(rating.scale, places[chosen])) if chosen else (None, None)
                )
                continue
            both = yield from self._rate_each(rating.scale, places, ("first", "second"))
            ratings[name] = {place: value for place, (value, _) in both.items()}
            times_s[name] = {place: time_s for place, (_, time_s) in both.items()}
        return {"ratings": ratings, "rating_times_s": times_s}

    def _rate_each(
        self, scale: Scale, places: Mapping[str, str], which: Sequence[str]
    ) -> Generator[Ask, Response | None, dict[str, tuple[int, float]]]:
        rated = {}
        for place in which:
            rated[place] = yield from self._rate(scale, places[place])
        return rated

    def _rate(self, scale: Scale, stimulus: str) -> Generator[Ask, Response | None, tuple[int, float]]:
        layout = self.layout
        items = (Picture(stimulus, layout.picture_px, layout.aperture_px), *layout.reference(self.reference))
        value, time_s = yield from rate(
            scale, self.style, layout=layout, items=items, stimulus=stimulus, reference=self.reference
        )
        return value, round(time_s, 6)


_SECONDS_PER_RATING = 4.0


def fixation(style: Style, place_px: Offset = (0, 0)) -> Scene:
    """Return a cross."""
    return Scene((style.text_at("+", place_px, height=48),))


@dataclass(frozen=True, slots=True)
class AllPairs(Block):
    """The thesis's second experiment (Section 4.5.2): all pairs, one answer each, a break now and then.

    With ``groups``, those pairs alone that it names; each record then has its ``group``, such as the scene. With
    ``part``, this observer has those pairs i < j alone, of all that observers share among them.

    A ``layout`` for two pictures shows them at once, one for a single picture in two intervals of ``exposure_s`` with
    ``blank_between_s`` between them. In seconds, to the nearest frame: ``fixation_s`` shows a cross before each pair,
    ``exposure_s`` takes a pair that is shown at once away again and leaves the question (None: it stays until
    answered), ``blank_s`` is black between two trials. The response time is that of the choice, from the onset of the
    screen that can be answered: of the pair, or of the question where the pair is taken away before it.
    """

    stimuli: tuple[str, ...]
    question: str
    layout: PairLayout | SingleLayout
    seed: str
    order_seed: str
    flip_sides: bool = False
    repeats: int = 1
    break_every: int | None = None
    fixation_s: float = 0.0
    exposure_s: float | None = None
    blank_s: float = 0.0
    style: Style = FULL_HD_HALF
    reference: str | None = None
    blank_between_s: float = 0.0
    ties: Ties = "none"
    catch: CatchTrials | None = None
    ratings: PairRatings | None = None
    groups: PairGroups | None = None
    part: tuple[Pair, ...] | None = None

    @property
    def trials(self) -> int:
        """Pairs times repeats, and catch trials."""
        count = len(self.stimuli)
        pairs = count * (count - 1) // 2 if self.groups is None else len(self.groups.sets)
        pairs = pairs if self.part is None else len(self.part)
        return pairs * self.repeats + (self.catch.count if self.catch else 0)

    @property
    def facts(self) -> dict[str, Any]:
        """How many pairs each group has, of this observer where observers share them."""
        return {} if self.groups is None else self._own(self.groups).facts

    @property
    def scale_ends(self) -> dict[str, tuple[int, int]]:
        """Those of its scales."""
        return ends_of([rated.scale for rated in self.ratings.scales] if self.ratings else [])

    @property
    def expected_s(self) -> float:
        """A few seconds for each answer and rating, and the timed scenes."""
        shown_s = (self.exposure_s or 0.0) * (2 if isinstance(self.layout, SingleLayout) else 1)
        timed_s = self.fixation_s + shown_s + self.blank_between_s + self.blank_s
        ratings = sum(2 if scale.of == "both" else 1 for scale in self.ratings.scales) if self.ratings else 0
        return self.trials * (SECONDS_PER_TRIAL + timed_s + _SECONDS_PER_RATING * ratings)

    @property
    def keys(self) -> dict[str, str]:
        """What chooses."""
        return self.view.keys

    @property
    def view(self) -> SimultaneousView | SequenceView:
        """How the two are shown."""
        look = self.question, self.style, self.ties, self.reference
        if isinstance(self.layout, SingleLayout):
            return SequenceView(self.layout, *look)
        return SimultaneousView(self.layout, *look)

    def comparisons(self) -> list[Comparison]:
        """Return who meets whom, in order, catch trials among them."""
        seeds = self.repeats, self.seed, self.order_seed
        if self.groups is None:
            order = pair_order(len(self.stimuli), *seeds, flip=self.flip_sides, part=self.part)
        else:
            order = grouped_order(self._own(self.groups).sets, *seeds, flip=self.flip_sides)
        pairs = [Comparison(self.stimuli[first], self.stimuli[second]) for first, second in order]
        if self.catch is None:
            return pairs
        return mix_in(pairs, self.catch, self.stimuli, self.seed, self.order_seed, flip=self.flip_sides)

    def _own(self, groups: PairGroups) -> PairGroups:
        return groups if self.part is None else groups.only(self.part)

    @property
    def places_px(self) -> tuple[Offset, ...]:
        """Where the pictures stand, in the pairs and above the scales."""
        rated = self.ratings.layout.places_px if self.ratings else ()
        return (*self.layout.places_px, *rated)

    def steps(self) -> Steps:
        """Ask for every pair and record each answer."""
        view, trials = self.view, self.comparisons()
        keys, targets = view.keys, view.targets  # the same for every pair
        if isinstance(view, SequenceView):
            yield replace(sequence_page(self.style), upcoming=view.pair(trials[0].first, trials[0].second))
        for number, trial in enumerate(trials):
            if self.break_every and number and number % self.break_every == 0:
                words = self.style.say("comparisons_done", done=number, all=len(trials))
                yield replace(page(words, self.style), upcoming=view.pair(trial.first, trial.second))
            following = trials[number + 1] if number + 1 < len(trials) else None
            yield from self._before(view, first_of_all=number == 0)
            shown = present(view, trial.first, trial.second, self.exposure_s, self.blank_between_s)
            scene, _ = yield from shown
            response = answer(
                (
                    yield Ask(
                        scene,
                        keys,
                        view.pair(following.first, following.second) if following else None,
                        Compare(trial.first, trial.second, self.reference),
                        targets,
                    )
                )
            )
            data = trial.record(response.meaning, view.position_names[0])
            if self.groups:
                data |= self.groups.record(trial.first, trial.second)
            if self.ratings:
                places = {"first": trial.first, "second": trial.second}
                chosen = response.meaning if response.meaning in places else None
                data |= yield from self.ratings.ask(places, chosen)
            yield Draft("all_pairs", data, stimuli=trial.stimuli, response_time_s=response.time_s)

    def _before(self, view: SimultaneousView | SequenceView, *, first_of_all: bool) -> Iterator[Hold]:
        if self.blank_s and not first_of_all:
            yield Hold("blank", Scene(), self.blank_s)
        if self.fixation_s:
            place_px = view.layout.picture_px if isinstance(view, SequenceView) else (0, 0)
            yield Hold("fixation", fixation(self.style, place_px), self.fixation_s)


BLANK_BETWEEN_S = 0.5


class PairRatingSpec(ScaleSpec):
    """A scale that follows each choice: about the stimulus chosen, or about both."""

    of: Literal["chosen", "both"] = "chosen"
    """Which of the two pictures is rated: the chosen one, or both."""

    def make(self) -> Scale:
        """Return the scale."""
        return Scale(**self.model_dump(exclude={"of"}))


class AllPairsSpec(BlockSpec):
    """Every two of the stimuli together, one answer each.

    ``within`` is a factor of the stimuli, such as their scene: only stimuli with the same level are compared. With
    ``across``, another factor, stimuli of different groups are compared too if they have the same level of it. With
    ``per_observer``, observers share the pairs, each linking all stimuli that all pairs link.

    Times are in seconds, to the nearest frame: a fixation cross before each pair, a limited exposure of the pair (it
    stays until answered if left out), black between trials. In a ``sequence``, ``exposure_s`` is each interval's and
    ``blank_between_s`` lies between the two. ``ties`` are answers that prefer neither, ``ratings`` scales that follow
    each choice.
    """

    kind: Literal["all_pairs"]
    """Which kind of entry this is; it decides which other keys there are."""
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
    break_every: Natural | None = None
    """After how many trials there is a page to rest; left out, there is none."""
    fixation_s: ShortSeconds = 0.0
    """Seconds of a fixation mark before each trial."""
    exposure_s: Seconds | None = None
    """Seconds that the pictures are shown; left out, until the answer."""
    blank_between_s: ShortSeconds | None = None
    """Seconds of an empty screen between the two intervals of a sequence."""
    blank_s: ShortSeconds = 0.0
    """Seconds of an empty screen between trials."""
    ties: Ties = "none"
    """Which answers other than one of the two pictures are allowed."""
    catch: CatchSpec | None = None
    """Trials with a known answer, which show whether an observer attends."""
    ratings: Annotated[tuple[PairRatingSpec, ...], Field(max_length=10)] = ()
    """Scales that are asked beside the choice."""

    @model_validator(mode="after")
    def _intervals(self) -> AllPairsSpec:
        if self.presentation == "sequence" and self.exposure_s is None:
            raise ValueError("'presentation: sequence' needs 'exposure_s', the time of each interval")
        if self.presentation == "simultaneous" and self.blank_between_s is not None:
            raise ValueError("'blank_between_s' belongs to 'presentation: sequence'; 'blank_s' lies between trials")
        return self

    @model_validator(mode="after")
    def _factors(self) -> AllPairsSpec:
        if self.across is not None and self.within is None:
            raise ValueError("'across' links the groups of 'within'; name their factor, such as 'within: scene'")
        if self.across is not None and self.across == self.within:
            raise ValueError(f"'across' and 'within' are both '{self.within}'; name another factor, such as 'codec'")
        return self

    @model_validator(mode="after")
    def _shared(self) -> AllPairsSpec:
        if self.balance is not None and self.per_observer is None:
            raise ValueError("'balance' says how observers share pairs; give 'per_observer', the pairs of each, too")
        return self

    def make(self, setting: Setting) -> AllPairs:
        """Return the block in the observer's own order."""
        between_s = BLANK_BETWEEN_S if self.blank_between_s is None else self.blank_between_s
        part = self._part(setting.stimuli, setting.shared_seed, place_of(setting.observer, setting.draw.sitting))
        return AllPairs(
            chosen(self.stimuli, setting.stimuli),
            setting.question,
            self._layout(setting),
            setting.pair_seed if part is None else setting.own_seed,
            order_seed=setting.own_seed,
            flip_sides=setting.flips_sides,
            repeats=self.repeats,
            break_every=self.break_every,
            fixation_s=self.fixation_s,
            exposure_s=self.exposure_s,
            blank_s=self.blank_s,
            style=setting.style,
            reference=setting.reference,
            blank_between_s=between_s if self.presentation == "sequence" else 0.0,
            ties=self.ties,
            catch=self.catch.make(self._trials(setting.stimuli)) if self.catch else None,
            ratings=self._ratings(setting),
            groups=self._groups(setting.stimuli),
            part=part,
        )

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

    def _layout(self, setting: Setting) -> PairLayout | SingleLayout:
        return setting.single_layout() if self.presentation == "sequence" else setting.pair_layout()

    def pairs(self, stimuli: Stimuli) -> list[tuple[str, str]]:
        """Return the pairs that are compared, whichever comes first, each once."""
        names = chosen(self.stimuli, stimuli)
        return [(names[i], names[j]) for i, j in self._pairs(stimuli)]

    def pairs_by_place(self, stimuli: Stimuli, seed: str, places: int) -> Iterator[list[tuple[str, str]]]:
        """Yield the pairs of the first ``places`` observers in turn; ``seed`` is `Setting.shared_seed`."""
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

    def _part(self, stimuli: Stimuli, seed: str, place: int) -> tuple[Pair, ...] | None:
        """Return the pairs of the observer at ``place``; None for all, also where `faults` finds too few or many."""
        if self.per_observer is None or next(self._part_faults(stimuli, self.per_observer), None):
            return None
        count = len(chosen(self.stimuli, stimuli))
        return observers_pairs(count, self._pairs(stimuli), self.per_observer, seed, place)

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
        return pair_groups(chosen(self.stimuli, stimuli), stimuli, self.within, self.across)

    def _trials(self, stimuli: Stimuli) -> int:
        return (self.per_observer or len(self._pairs(stimuli))) * self.repeats

    def _ratings(self, setting: Setting) -> PairRatings | None:
        if not self.ratings:
            return None
        scales = tuple(PairRating(rating.make(), rating.of) for rating in self.ratings)
        return PairRatings(scales, setting.single_layout(), setting.style, setting.reference)
