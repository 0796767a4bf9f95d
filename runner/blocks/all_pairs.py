"""All-pairs forced choice: every two stimuli, at once or in sequence, which is closer to the reference?"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from runner.blocks.catch_trials import CatchTrials, Comparison, mix_in
from runner.blocks.intervals import SEQUENCE_WORDS, present
from runner.blocks.layouts import PairLayout, SingleLayout
from runner.blocks.message import page
from runner.blocks.pair_order import pair_order
from runner.blocks.pair_ratings import PairRatings
from runner.blocks.pair_views import SequenceView, SimultaneousView
from runner.blocks.steps import SECONDS_PER_TRIAL, Block, Draft, Hold, Steps, answer
from runner.blocks.style import FULL_HD_HALF, Style
from runner.blocks.tasks import Compare
from runner.blocks.ties import Ties
from runner.ports import Ask
from runner.presenter.scene import Offset, Scene, Text

_SECONDS_PER_RATING = 4.0


def fixation(style: Style, place_px: Offset = (0, 0)) -> Scene:
    """Return a cross."""
    return Scene((Text("+", place_px, style.px(48)),))


@dataclass(frozen=True, slots=True)
class AllPairs(Block):
    """The thesis's second experiment (Section 4.5.2): all pairs, one answer each, a break now and then.

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

    @property
    def trials(self) -> int:
        """Pairs times repeats, and catch trials."""
        pairs = len(self.stimuli) * (len(self.stimuli) - 1) // 2
        return pairs * self.repeats + (self.catch.count if self.catch else 0)

    @property
    def expected_s(self) -> float:
        """A few seconds for each answer and rating, and the timed scenes."""
        shown_s = (self.exposure_s or 0.0) * (2 if isinstance(self.layout, SingleLayout) else 1)
        timed_s = self.fixation_s + shown_s + self.blank_between_s + self.blank_s
        ratings = sum(2 if one.of == "both" else 1 for one in self.ratings.scales) if self.ratings else 0
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
        order = pair_order(len(self.stimuli), self.repeats, self.seed, self.order_seed, flip=self.flip_sides)
        pairs = [Comparison(self.stimuli[first], self.stimuli[second]) for first, second in order]
        if self.catch is None:
            return pairs
        return mix_in(pairs, self.catch, self.stimuli, self.seed, self.order_seed, flip=self.flip_sides)

    def steps(self) -> Steps:
        """Ask for every pair and record each answer."""
        view, trials = self.view, self.comparisons()
        if isinstance(view, SequenceView):
            yield replace(page(SEQUENCE_WORDS, self.style), upcoming=view.pair(trials[0].first, trials[0].second))
        for number, trial in enumerate(trials):
            if self.break_every and number and number % self.break_every == 0:
                words = f"Time for a break.\n{number} of {len(trials)} comparisons are done."
                yield replace(page(words, self.style), upcoming=view.pair(trial.first, trial.second))
            following = trials[number + 1] if number + 1 < len(trials) else None
            yield from self._before(view, first_of_all=number == 0)
            shown = present(view, trial.first, trial.second, self.exposure_s, self.blank_between_s)
            scene, _ = yield from shown
            response = answer(
                (
                    yield Ask(
                        scene,
                        view.keys,
                        view.pair(following.first, following.second) if following else None,
                        Compare(trial.first, trial.second, self.reference),
                        view.targets,
                    )
                )
            )
            data = _data(trial, response.meaning, view.position_names[0])
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


def _data(trial: Comparison, meaning: str, first_position: str) -> dict[str, Any]:
    """Return what is recorded: nobody is chosen in a tie, nor where a stimulus meets itself."""
    data: dict[str, Any] = {"first": trial.first, "second": trial.second, "answer": meaning}
    chosen: str | None = None
    if meaning in ("first", "second") and trial.catch != "identical":
        chosen, rejected = (trial.first, trial.second) if meaning == "first" else (trial.second, trial.first)
        data |= {"chosen": chosen, "rejected": rejected}
    data["first_position"] = first_position
    if trial.catch:
        data["catch"] = trial.catch
    if trial.catch == "obvious":
        data["correct"] = chosen == trial.better
    return data
