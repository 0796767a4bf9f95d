"""`kind: threshold`: the level of a factor at which a stimulus is just seen, by levels that follow the answers."""

from __future__ import annotations

import random
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from extensions.thresholds.fit import Easier
from extensions.thresholds.ladders import LEAST_LEVELS, Ladder, ladder_faults, ladders
from extensions.thresholds.tracks import AskedTrial, MethodSpec, QuestPlusSpec, Track, interleaved
from runner.blocks import SECONDS_PER_TRIAL, Block, BlockContext, Draft, Fault, Steps, Stimuli, StimulusNames, TimedKind
from runner.ports import Ask, Button, Choose, Hold, Response, answer
from runner.scene import Item, Offset, Picture, Scene
from runner.views import (
    Factor,
    Line,
    OptionalFactor,
    SequenceView,
    ShortSeconds,
    SimultaneousView,
    SingleLayout,
    Style,
    gap_s,
    present,
    sequence_page,
)

ThresholdTask = Literal["yes_no", "two_intervals", "two_places"]
FunctionName = Literal["weibull", "logistic", "normal"]
GUESSES: Mapping[ThresholdTask, float | None] = {"yes_no": None, "two_intervals": 0.5, "two_places": 0.5}
_PLACES = ("first", "second")
YES_NO = ("yes", "no")
_KEYS = {"left": "yes", "pad_left": "yes", "right": "no", "pad_right": "no"}
_APART, _BELOW, _WIDTH, _HEIGHT = 240.0, 75.0, 220.0, 60.0  # units of Style


@dataclass(frozen=True, slots=True)
class DetectionView:
    """One picture under the question; the left arrow says yes, the right one no, and so do clicks on these words."""

    layout: SingleLayout
    words: str
    style: Style
    reference: str | None = None

    @property
    def keys(self) -> dict[str, str]:
        """The arrows, those of a gamepad too."""
        return dict(_KEYS)

    @property
    def targets(self) -> dict[str, Button]:
        """The words of the answers."""
        size = self.style.px(_WIDTH), self.style.px(_HEIGHT)
        return {meaning: Button(place, size) for meaning, place in zip(YES_NO, self._places_px, strict=True)}

    def scene(self, stimulus: str) -> Scene:
        """Return the picture with the question and the answers."""
        return Scene((*self._pictures(stimulus), *self._words))

    def question(self) -> Scene:
        """Return the question and the answers, and the reference picture if there is one."""
        return Scene((*self.layout.reference(self.reference), *self._words))

    def present(self, stimulus: str, exposure_s: float | None) -> Generator[Hold, None, Scene]:
        """Show the picture as far as it comes before the question, and return the scene to ask with."""
        if exposure_s is None:
            return self.scene(stimulus)
        yield Hold("picture", Scene(self._pictures(stimulus)), exposure_s)
        return self.question()

    def _pictures(self, stimulus: str) -> tuple[Item, ...]:
        layout = self.layout
        return Picture(stimulus, layout.picture_px, layout.aperture_px), *layout.reference(self.reference)

    @property
    def _words(self) -> tuple[Item, ...]:
        layout, style = self.layout, self.style
        said = (style.say("yes_key"), style.say("no_key"))
        return (
            style.text_at(self.words, layout.question_px, width_px=layout.question_width_px),
            *(
                style.text_at(words, place, height=20, width_px=style.px(_WIDTH))
                for words, place in zip(said, self._places_px, strict=True)
            ),
        )

    @property
    def _places_px(self) -> tuple[Offset, Offset]:
        y = self.layout.below_px + self.style.px(_BELOW)
        half = self.style.px(_APART / 2)
        return (-half, y), (half, y)


_View = DetectionView | SequenceView | SimultaneousView


class Threshold(TimedKind):
    """The threshold of a numeric ``factor`` of the stimuli, by levels that follow the answers.

    In ``two_places`` and ``two_intervals`` a stimulus stands beside or before its ``reference``, which has no signal;
    in ``yes_no`` it is alone, and ``catch_share`` of the trials show the reference in its stead. ``within`` is another
    factor, such as the scene: there is a threshold for each of its levels. All tracks are interleaved. Times are in
    seconds.
    """

    by_scores = False

    kind: Literal["threshold"]
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
    blank_between_s: ShortSeconds | None = None
    """Seconds of an empty screen between the two intervals; 0.5 if left out."""

    @model_validator(mode="after")
    def _of_the_task(self) -> Threshold:
        if self.task == "two_intervals" and self.exposure_s is None:
            raise ValueError("'task: two_intervals' needs 'exposure_s', the time of each interval")
        if self.task != "two_intervals" and self.blank_between_s is not None:
            raise ValueError("'blank_between_s' belongs to 'task: two_intervals'; 'blank_s' lies between trials")
        if self.task != "yes_no" and self.catch_share:
            raise ValueError("'catch_share' belongs to 'task: yes_no'; a forced choice always has a signal")
        if isinstance(self.reference, dict) and self.within is None:
            raise ValueError("'reference' for each level needs 'within', the factor that has these levels")
        return self

    def meet(self, setting: BlockContext) -> Block:
        """Return the block as this observer begins it.

        Of every track of every ladder there are so many trials, interleaved, and catch trials without a signal beside.
        The response time is that of `AllPairs`.
        """
        view, rungs = self.view(setting), self.ladders(setting.stimuli)
        tracks = len(rungs) * self.method.count
        catch = round(tracks * self.trials * self.catch_share / (1.0 - self.catch_share))
        shown_s = (self.exposure_s or 0.0) * (2 if self.task == "two_intervals" else 1)
        timed_s = self.fixation_s + shown_s + self.between_s + self.blank_s
        trials = tracks * self.trials + catch
        return Block(
            entry=self,
            steps=partial(self._steps, setting, view, rungs, catch),
            trials=trials,
            expected_s=trials * (SECONDS_PER_TRIAL + timed_s),
            keys=view.keys,
            places_px=view.layout.places_px,
            facts=self._facts(rungs) | ({"catch_trials": catch} if catch else {}),
        )

    @property
    def between_s(self) -> float:
        """How long black lies between two intervals, in seconds."""
        return gap_s(self.blank_between_s, in_sequence=self.task == "two_intervals")

    def view(self, setting: BlockContext) -> _View:
        """Return how stimuli are shown."""
        look = self.question or setting.question, setting.style
        if self.task == "two_places":
            return SimultaneousView(setting.pair_layout(), *look, reference=setting.reference)
        view = DetectionView if self.task == "yes_no" else SequenceView
        return view(setting.single_layout(), *look, reference=setting.reference)

    def faults(self, stimuli: Stimuli) -> Iterator[Fault]:
        """Yield factors that are no numbers, unknown references, too few levels, and what a method cannot run on."""
        wanted = self.task != "yes_no" or self.catch_share > 0
        wrong = list(ladder_faults(self.stimuli, stimuli, self.factor, self.within, self.reference, wanted=wanted))
        yield from wrong
        if not wrong:
            for ladder in self.ladders(stimuli):
                where = f" in the {self.within} '{ladder.group}'" if self.within else ""
                yield from self.method.faults(ladder, where)

    def doubts(self, setting: BlockContext) -> Iterator[Fault]:
        """Yield that a level 0 among others above it has no logarithm."""
        for ladder in self.ladders(setting.stimuli):
            if min(ladder.levels) == 0 < max(ladder.levels):
                names = ", ".join(ladder.stimuli[ladder.levels.index(0)])
                what = (
                    f"level 0 of '{self.factor}' ({names}) has no logarithm: QUEST+ and the report take a linear axis"
                )
                remedy = "if it has no signal, name it as 'reference'; its trials then count as those without a signal"
                yield Fault(what, ("factor",), remedy)
                return

    def ladders(self, stimuli: Stimuli) -> tuple[Ladder, ...]:
        """Return the ladders that are fit to run, and all of them where there is no fault."""
        made = ladders(self.stimuli, stimuli, self.factor, self.within, self.reference, self.easier)
        needs = self.task != "yes_no" or self.catch_share > 0
        return tuple(each for each in made if len(each.levels) >= LEAST_LEVELS and (each.reference or not needs))

    def _facts(self, rungs: Sequence[Ladder]) -> dict[str, Any]:
        """Return how many tracks there are, and the levels of each ladder."""
        facts: dict[str, Any] = {"tracks": len(rungs) * self.method.count}
        for ladder in rungs:
            where = "" if ladder.group is None else f"_in_{ladder.group}"
            facts[f"levels_of_{self.factor}{where}"] = list(ladder.levels)
        return facts

    def _steps(self, setting: BlockContext, view: _View, rungs: Sequence[Ladder], catch: int) -> Steps:
        """Ask at the level that each track's answers call for, and record each answer."""
        tracks, rng = self._tracks(rungs, setting.own_seed), random.Random(f"{setting.own_seed}/order")
        turns = interleaved(len(tracks), self.trials, catch, rng)
        place_px = (0, 0) if isinstance(view, SimultaneousView) else view.layout.picture_px
        blanks = 0

        def ready(number: int, answering: Track | None = None) -> Scene | None:
            """Return all that may be shown in the trial of this number; ``answering`` waits for its answer."""
            if number == len(turns):
                return None
            turn = turns[number]
            track = None if turn is None else tracks[turn]
            if track is None:
                return _merged([_scene(view, _blank(rungs, blanks))])
            return _merged(_scene(view, asked) for asked in (track.following() if track is answering else (track.now,)))

        if isinstance(view, SequenceView):
            yield replace(sequence_page(setting.style), upcoming=ready(0))
        for number, turn in enumerate(turns):
            yield from self.rests(setting.style, "trials_done", number, len(turns), ready(number))
            yield from self.before(setting.style, place_px, first_of_all=number == 0)
            track = None if turn is None else tracks[turn]
            asked = _blank(rungs, blanks) if track is None else track.now
            blanks += track is None
            scene = yield from self._show(view, asked)
            upcoming = ready(number + 1, track)
            response = answer((yield Ask(scene, view.keys, upcoming, self._task(asked), view.targets)))
            data = self._data(view, asked, response.meaning)
            if turn is not None and track is not None:
                data |= {"track": turn, "track_trial": track.done}
                track.learn(right=response.meaning == ("yes" if self.task == "yes_no" else asked.place))
            shown = (asked.stimulus,) if self.task == "yes_no" else (asked.stimulus, str(asked.ladder.reference))
            yield Draft("threshold", data, stimuli=shown, response_time_s=response.time_s)

    def _tracks(self, rungs: Sequence[Ladder], seed: str) -> list[Track]:
        tracks = []
        for place, ladder in enumerate(rungs):
            for number in range(self.method.count):
                choices = self.method.choices(ladder, number, self.easier, GUESSES[self.task], self.function)
                tracks.append(Track.of(ladder, choices, self.trials, random.Random(f"{seed}/{place}/{number}")))
        return tracks

    def _show(self, view: _View, asked: AskedTrial) -> Generator[Ask | Hold, Response | None, Scene]:
        if isinstance(view, DetectionView):
            return (yield from view.present(asked.stimulus, self.exposure_s))
        scene, _ = yield from present(view, *asked.pair, self.exposure_s, self.between_s)
        return scene

    def _task(self, asked: AskedTrial) -> Choose:
        if self.task == "yes_no":
            return Choose(self.factor, YES_NO, "no" if asked.level is None else "yes", asked.level, forced=False)
        return Choose(self.factor, _PLACES, asked.place, asked.level)

    def _data(self, view: _View, asked: AskedTrial, meaning: str) -> dict[str, Any]:
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


def _blank(rungs: Sequence[Ladder], number: int) -> AskedTrial:
    """Return the trial without a signal of this number."""
    ladder = rungs[number % len(rungs)]
    return AskedTrial(ladder, str(ladder.reference), None, first=True)


def _scene(view: _View, asked: AskedTrial) -> Scene:
    return view.scene(asked.stimulus) if isinstance(view, DetectionView) else view.pair(*asked.pair)


def _merged(scenes: Iterable[Scene]) -> Scene:
    """Return a scene that holds all of what may come: it is made ready, not shown."""
    items = tuple(dict.fromkeys(item for scene in scenes for item in scene.items))
    return Scene(items)
