"""`kind: threshold`: the level of a factor at which a stimulus is just seen, by levels that follow the answers."""

from __future__ import annotations

import random
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from analysis.thresholds import Easier
from documents.yaml import Natural
from runner.blocks.all_pairs import BLANK_BETWEEN_S, fixation
from runner.blocks.block import (
    SECONDS_PER_TRIAL,
    Block,
    BlockSpec,
    Draft,
    Fault,
    Hold,
    Response,
    Steps,
    StimulusNames,
    answer,
)
from runner.blocks.detection_view import YES_NO, DetectionView
from runner.blocks.field_types import Factor, Line, OptionalFactor, Seconds, ShortSeconds
from runner.blocks.layout import PairLayout, SingleLayout
from runner.blocks.message import page
from runner.blocks.pair_views import SequenceView, SimultaneousView, present, sequence_page
from runner.blocks.setting import Setting, Stimuli
from runner.blocks.style import FULL_HD_HALF, Style
from runner.blocks.tasks import Choose
from runner.blocks.threshold_ladders import LEAST_LEVELS, Ladder, ladder_faults, ladders
from runner.blocks.threshold_tracks import Asked, MethodSpec, QuestPlusSpec, Track, interleaved
from runner.ports import Ask
from runner.presenter.scene import Offset, Scene

ThresholdTask = Literal["yes_no", "two_intervals", "two_places"]
FunctionName = Literal["weibull", "logistic", "normal"]
GUESSES: Mapping[ThresholdTask, float | None] = {"yes_no": None, "two_intervals": 0.5, "two_places": 0.5}
_PLACES = ("first", "second")


@dataclass(frozen=True, slots=True)
class Threshold(Block):
    """``track_trials`` trials of every track of every ladder, interleaved, and ``catch_trials`` without a signal.

    In a forced choice the stimulus and its ladder's reference stand in two places or two intervals; with yes/no the
    stimulus is alone. Times are those of `AllPairs`, and so is the response time.
    """

    factor: str
    task: ThresholdTask
    question: str
    layout: PairLayout | SingleLayout
    seed: str
    ladders: tuple[Ladder, ...]
    track_trials: int
    method: MethodSpec = field(default_factory=lambda: QuestPlusSpec(kind="quest_plus"))
    function: str = "weibull"
    easier: Easier = "higher"
    within: str | None = None
    catch_trials: int = 0
    break_every: int | None = None
    fixation_s: float = 0.0
    exposure_s: float | None = None
    blank_between_s: float = 0.0
    blank_s: float = 0.0
    style: Style = FULL_HD_HALF
    reference: str | None = None

    @property
    def trials(self) -> int:
        """Trials of all tracks, and catch trials."""
        return len(self.ladders) * self.method.count * self.track_trials + self.catch_trials

    @property
    def facts(self) -> dict[str, Any]:
        """How many tracks there are, and the levels of each ladder."""
        facts: dict[str, Any] = {"tracks": len(self.ladders) * self.method.count}
        for ladder in self.ladders:
            where = "" if ladder.group is None else f"_in_{ladder.group}"
            facts[f"levels_of_{self.factor}{where}"] = list(ladder.levels)
        return facts | ({"catch_trials": self.catch_trials} if self.catch_trials else {})

    @property
    def expected_s(self) -> float:
        """A few seconds for each answer, and the timed scenes."""
        shown_s = (self.exposure_s or 0.0) * (2 if self.task == "two_intervals" else 1)
        timed_s = self.fixation_s + shown_s + self.blank_between_s + self.blank_s
        return self.trials * (SECONDS_PER_TRIAL + timed_s)

    @property
    def keys(self) -> dict[str, str]:
        """What answers."""
        return self.view.keys

    @property
    def places_px(self) -> tuple[Offset, ...]:
        """Where the pictures stand."""
        return self.layout.places_px

    @property
    def view(self) -> DetectionView | SequenceView | SimultaneousView:
        """How stimuli are shown."""
        if isinstance(self.layout, PairLayout):
            return SimultaneousView(self.layout, self.question, self.style, reference=self.reference)
        if self.task == "yes_no":
            return DetectionView(self.layout, self.question, self.style, self.reference)
        return SequenceView(self.layout, self.question, self.style, reference=self.reference)

    def steps(self) -> Steps:
        """Ask at the level that each track's answers call for, and record each answer."""
        tracks, rng = self._tracks(), random.Random(f"{self.seed}/order")
        turns = interleaved(len(tracks), self.track_trials, self.catch_trials, rng)
        view, blanks = self.view, 0
        if isinstance(view, SequenceView):
            yield replace(sequence_page(self.style), upcoming=_merged(self._may_come(tracks, turns[:1], blanks)))
        for number, turn in enumerate(turns):
            if self.break_every and number and number % self.break_every == 0:
                words = self.style.say("trials_done", done=number, all=len(turns))
                upcoming = _merged(self._may_come(tracks, turns[number : number + 1], blanks))
                yield replace(page(words, self.style), upcoming=upcoming)
            yield from self._before(first_of_all=number == 0)
            track = None if turn is None else tracks[turn]
            asked = self._blank(blanks) if track is None else track.now
            blanks += track is None
            scene = yield from self._show(asked)
            upcoming = _merged(self._may_come(tracks, turns[number + 1 : number + 2], blanks, track))
            response = answer((yield Ask(scene, view.keys, upcoming, self._task(asked), view.targets)))
            data = self._data(asked, response.meaning)
            if turn is not None and track is not None:
                data |= {"track": turn, "track_trial": track.done}
                track.learn(right=response.meaning == ("yes" if self.task == "yes_no" else asked.place))
            shown = (asked.stimulus,) if self.task == "yes_no" else (asked.stimulus, str(asked.ladder.reference))
            yield Draft("threshold", data, stimuli=shown, response_time_s=response.time_s)

    def _tracks(self) -> list[Track]:
        tracks = []
        for place, ladder in enumerate(self.ladders):
            for number in range(self.method.count):
                choices = self.method.choices(ladder, number, self.easier, GUESSES[self.task], self.function)
                rng = random.Random(f"{self.seed}/{place}/{number}")
                tracks.append(Track.of(ladder, choices, self.track_trials, rng))
        return tracks

    def _blank(self, number: int) -> Asked:
        ladder = self.ladders[number % len(self.ladders)]
        return Asked(ladder, str(ladder.reference), None, first=True)

    def _may_come(
        self, tracks: Sequence[Track], turns: Sequence[int | None], blanks: int, answering: Track | None = None
    ) -> Iterator[Scene]:
        """Yield what may be shown in the trial of ``turns``, if there is one; ``answering`` waits for its answer."""
        for turn in turns:
            track = None if turn is None else tracks[turn]
            if track is None:
                yield self._ready(self._blank(blanks))
            else:
                yield from map(self._ready, track.following() if track is answering else (track.now,))

    def _ready(self, asked: Asked) -> Scene:
        view = self.view
        if isinstance(view, DetectionView):
            return view.scene(asked.stimulus)
        return view.pair(*asked.pair)

    def _show(self, asked: Asked) -> Generator[Ask | Hold, Response | None, Scene]:
        view = self.view
        if isinstance(view, DetectionView):
            return (yield from view.present(asked.stimulus, self.exposure_s))
        scene, _ = yield from present(view, *asked.pair, self.exposure_s, self.blank_between_s)
        return scene

    def _task(self, asked: Asked) -> Choose:
        if self.task == "yes_no":
            return Choose(self.factor, YES_NO, "no" if asked.level is None else "yes", asked.level, forced=False)
        return Choose(self.factor, _PLACES, asked.place, asked.level)

    def _data(self, asked: Asked, meaning: str) -> dict[str, Any]:
        data: dict[str, Any] = {
            "task": self.task,
            "factor": self.factor,
            "stimulus": asked.stimulus,
            "level": asked.level,
            "answer": meaning,
            "method": self.method.kind,
            "function": self.function,
            "easier": self.easier,
        }
        view = self.view
        if not isinstance(view, DetectionView):
            data |= {
                "reference": asked.ladder.reference,
                "first_position": view.position_names[0],
                "correct_answer": asked.place,
                "correct": meaning == asked.place,
            }
        if self.within is not None:
            data |= {"group": asked.ladder.group, "group_factor": self.within}
        return data

    def _before(self, *, first_of_all: bool) -> Iterator[Hold]:
        if self.blank_s and not first_of_all:
            yield Hold("blank", Scene(), self.blank_s)
        if self.fixation_s:
            place_px = self.layout.picture_px if isinstance(self.layout, SingleLayout) else (0, 0)
            yield Hold("fixation", fixation(self.style, place_px), self.fixation_s)


def _merged(scenes: Iterable[Scene]) -> Scene | None:
    """Return a scene that holds all of what may come: it is made ready, not shown."""
    items = tuple(dict.fromkeys(item for scene in scenes for item in scene.items))
    return Scene(items) if items else None


class ThresholdSpec(BlockSpec):
    """The threshold of a numeric ``factor`` of the stimuli, by levels that follow the answers.

    In ``two_places`` and ``two_intervals`` a stimulus stands beside or before its ``reference``, which has no signal;
    in ``yes_no`` it is alone, and ``catch_share`` of the trials show the reference in its stead. ``within`` is another
    factor, such as the scene: there is a threshold for each of its levels. All tracks are interleaved. Times are in
    seconds.
    """

    kind: Literal["threshold"]
    """Which kind of entry this is; it decides which other keys there are."""
    factor: Factor
    """The factor of the stimuli whose threshold is measured; its levels are numbers."""
    task: ThresholdTask
    """What is asked: yes or no, or in which of two intervals or two places the stimulus was."""
    trials: Annotated[int, Field(ge=1, le=100_000)]
    """How many trials each track has."""
    method: MethodSpec = Field(default_factory=lambda: QuestPlusSpec(kind="quest_plus"))
    """What chooses the next level: quest_plus, or a staircase."""
    stimuli: StimulusNames = "all"
    """Which stimuli take part: all, or a list of their names."""
    reference: Line | dict[Line, Line] | None = None
    """The stimulus without a signal, or one for each level of within; left out, that of the layout."""
    within: OptionalFactor = None
    """Another factor, such as scene: each of its levels has a threshold of its own."""
    function: FunctionName = "weibull"
    """The shape of the psychometric function: weibull, logistic or normal."""
    easier: Easier = "higher"
    """Which levels are easier: higher or lower ones."""
    question: Line | None = None
    """The question, in place of the experiment's."""
    catch_share: Annotated[float, Field(ge=0, le=0.5)] = 0.0
    """The share of trials without a signal, for yes or no."""
    break_every: Natural | None = None
    """After how many trials there is a page to rest; left out, there is none."""
    fixation_s: ShortSeconds = 0.0
    """Seconds of a fixation mark before each trial."""
    exposure_s: Seconds | None = None
    """Seconds that the pictures are shown; left out, until the answer."""
    blank_between_s: ShortSeconds | None = None
    """Seconds of an empty screen between the two intervals."""
    blank_s: ShortSeconds = 0.0
    """Seconds of an empty screen between trials."""

    @model_validator(mode="after")
    def _of_the_task(self) -> ThresholdSpec:
        if self.task == "two_intervals" and self.exposure_s is None:
            raise ValueError("'task: two_intervals' needs 'exposure_s', the time of each interval")
        if self.task != "two_intervals" and self.blank_between_s is not None:
            raise ValueError("'blank_between_s' belongs to 'task: two_intervals'; 'blank_s' lies between trials")
        if self.task != "yes_no" and self.catch_share:
            raise ValueError("'catch_share' belongs to 'task: yes_no'; a forced choice always has a signal")
        if isinstance(self.reference, dict) and self.within is None:
            raise ValueError("'reference' for each level needs 'within', the factor that has these levels")
        return self

    def make(self, setting: Setting) -> Threshold:
        """Return the block as this observer begins it."""
        rungs = self._ladders(setting.stimuli)
        whole = self.trials * len(rungs) * self.method.count
        between_s = BLANK_BETWEEN_S if self.blank_between_s is None else self.blank_between_s
        return Threshold(
            self.factor,
            self.task,
            self.question or setting.question,
            setting.pair_layout() if self.task == "two_places" else setting.single_layout(),
            setting.own_seed,
            rungs,
            self.trials,
            method=self.method,
            function=self.function,
            easier=self.easier,
            within=self.within,
            catch_trials=round(whole * self.catch_share / (1.0 - self.catch_share)),
            break_every=self.break_every,
            fixation_s=self.fixation_s,
            exposure_s=self.exposure_s,
            blank_between_s=between_s if self.task == "two_intervals" else 0.0,
            blank_s=self.blank_s,
            style=setting.style,
            reference=setting.reference,
        )

    def faults(self, stimuli: Stimuli) -> Iterator[Fault]:
        """Yield factors that are no numbers, unknown references, too few levels, and what a method cannot run on."""
        wanted = self.task != "yes_no" or self.catch_share > 0
        wrong = list(ladder_faults(self.stimuli, stimuli, self.factor, self.within, self.reference, wanted=wanted))
        yield from wrong
        if not wrong:
            for ladder in self._ladders(stimuli):
                where = f" in the {self.within} '{ladder.group}'" if self.within else ""
                yield from self.method.faults(ladder, where)

    def _ladders(self, stimuli: Stimuli) -> tuple[Ladder, ...]:
        """Return the ladders that are fit to run, and all of them where there is no fault."""
        made = ladders(self.stimuli, stimuli, self.factor, self.within, self.reference, self.easier)
        needs = self.task != "yes_no" or self.catch_share > 0
        return tuple(each for each in made if len(each.levels) >= LEAST_LEVELS and (each.reference or not needs))
