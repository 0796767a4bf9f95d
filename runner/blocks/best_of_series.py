"""`kind: best_of_series`: the observer browses the pictures of a series, chooses the closest, and rates the choice."""

from __future__ import annotations

import random
from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Literal

from pydantic import Field

from runner.blocks.block import SECONDS_PER_TRIAL, Block, Draft, Fault, Named, Steps
from runner.blocks.context import BlockContext, Stimuli
from runner.blocks.message import PausedKind
from runner.blocks.orders import spaced
from runner.blocks.scale import RatedScene, Scale, ends_of, rate_all, scale_faults, scales_named
from runner.blocks.series import (
    Browsable,
    SomeSeries,
    find_series,
    series_faults,
    series_named,
    series_pictures,
    series_scene,
    series_targets,
)
from runner.ports import Ask, Browse, Response, answer
from runner.scene import Scene
from runner.views.field_types import Line
from runner.views.interface import Interface
from runner.views.layout import SingleLayout
from runner.views.style import Style


def usual_scale(name: str, interface: Interface) -> Scale:
    """Return the scale of ``similarity``, ``quality`` or ``difficulty`` that a choice is rated on by default."""
    low, high = interface.say(f"{name}_low"), interface.say(f"{name}_high")
    return Scale(name=name, question=interface.say(name), low_anchor=low, high_anchor=high)


# The thesis's two, as files of before have them.
SIMILARITY = Scale(
    name="similarity",
    question="How similar is the image that you chose to the reference?",
    low_anchor="not similar at all",
    high_anchor="looks the same",
)
DIFFICULTY = Scale(
    name="difficulty",
    question="How difficult was it to tell the images of this series apart?",
    low_anchor="very easy",
    high_anchor="very difficult",
)
_LEAF = {
    "left": "previous",
    "right": "next",
    "wheel_up": "previous",
    "wheel_down": "next",
    "pad_left": "previous",
    "pad_right": "next",
}
_CHOOSE = {"enter": "choose", "space": "choose", "pad_a": "choose"}
_SECONDS_PER_PICTURE = 3.0


@dataclass(frozen=True, slots=True)
class BrowsedSeries:
    """How one series was gone through: the index chosen, and each picture that was shown with its time in s."""

    index: int
    path: tuple[tuple[int, float], ...]

    @property
    def time_s(self) -> float:
        """From the first picture's onset to the choice."""
        return round(sum(time_s for _, time_s in self.path), 6)

    def dwell_s(self, count: int) -> list[float]:
        """Return how long each of ``count`` pictures was shown altogether."""
        return [round(sum(time_s for index, time_s in self.path if index == place), 6) for place in range(count)]


@dataclass(frozen=True, slots=True)
class _Look:
    """Where the pictures stand, how words look, the question, and the reference picture if there is one."""

    layout: SingleLayout
    style: Style
    question: str
    reference: str | None


class BestOfSeries(PausedKind):
    """The observer browses each series, chooses a picture, and rates the choice.

    This is the thesis's first experiment (Section 4.5.1.1): which picture of each series is the closest to the
    reference? ``series`` names the pictures of each series in order, or gives the factors that make them. ``question``
    stands above the picture in place of the experiment's. With ``see_all`` every picture must be seen before one can be
    chosen; with ``wrap`` the last is followed by the first. ``start`` is where in a series one begins. Where
    ``ratings`` is left out, the choice is rated for ``similarity`` to the reference, or for ``quality`` where there is
    none, and the series for ``difficulty``.
    """

    kind: Literal["best_of_series"]
    series: SomeSeries
    """The series of pictures: by name with their stimuli in order, or by factors."""
    question: Line | None = None
    """The question that stands above the pictures."""
    ratings: Annotated[tuple[Scale, ...], Field(max_length=12)] = (SIMILARITY, DIFFICULTY)
    """Scales that are asked of the chosen picture."""
    start: Literal["random", "first"] = "random"
    """Which picture of a series is shown first."""
    see_all: bool = True
    """Whether every picture of a series must be seen before one is chosen."""
    wrap: bool = False
    """Whether the series goes on at its other end."""

    def meet(self, setting: BlockContext) -> Block:
        """Return the block in the observer's own order, series of one group apart where that can be avoided.

        The response time is that of the choice.
        """
        look = _Look(setting.single_layout(), setting.style, self.question or setting.question, setting.reference)
        all_series, scales = find_series(self.series, setting.stimuli), self.scales(setting)
        pictures = sum(len(series.stimuli) for series in all_series)
        return Block(
            entry=self,
            steps=partial(self._steps, all_series, scales, look, setting.own_seed),
            trials=len(all_series),
            expected_s=pictures * _SECONDS_PER_PICTURE + len(all_series) * len(scales) * SECONDS_PER_TRIAL,
            keys=_keys(scales),
            places_px=look.layout.places_px,
            scale_ends=ends_of(scales),
        )

    def scales(self, setting: BlockContext) -> tuple[Scale, ...]:
        """Return the scales that are written, or those that suit the experiment."""
        if "ratings" in self.model_fields_set:
            return self.ratings
        names = "similarity" if setting.has_reference else "quality", "difficulty"
        return tuple(usual_scale(name, setting.style.interface) for name in names)

    def faults(self, stimuli: Stimuli) -> Iterator[Fault]:
        """Yield wrong stimuli or factors, series of one picture, and scales of one name."""
        yield from scale_faults(self.ratings, "ratings")
        yield from series_faults(self.series, stimuli)

    def named(self, stimuli: Stimuli) -> Iterator[Named]:
        """Yield its series and its scales."""
        yield from series_named(self.series, stimuli)
        yield from scales_named(self.ratings)

    def _steps(self, all_series: Sequence[Browsable], scales: Sequence[Scale], look: _Look, seed: str) -> Steps:
        """Let every series be gone through, and record each choice with its ratings."""
        rng = random.Random(seed)
        order = spaced(all_series, lambda series: series.group or series.name, rng)
        starts = [rng.randrange(len(series.stimuli)) if self.start == "random" else 0 for series in order]
        for number, (series, start) in enumerate(zip(order, starts, strict=True)):
            first_seen = self._scene(look, series, start, frozenset({start}))
            yield from self.rests(look.style, "series_done", number, len(order), first_seen)
            choice = yield from self._browse(look, series, start)
            chosen = series.stimuli[choice.index]
            following: Scene | None = None
            if number + 1 < len(order):
                first = starts[number + 1]
                following = self._scene(look, order[number + 1], first, frozenset({first}))
            pictures = series_pictures(chosen, look.layout, look.reference)
            about = RatedScene(look.layout, pictures, chosen, look.reference, following)
            ratings, times_s = yield from rate_all(scales, look.style, about)
            yield Draft(
                "best_of_series",
                {
                    "series": series.name,
                    "stimuli": list(series.stimuli),
                    "start": start,
                    "chosen": chosen,
                    "chosen_index": choice.index,
                    "path": [[index, time_s] for index, time_s in choice.path],
                    "dwell_s": choice.dwell_s(len(series.stimuli)),
                    "ratings": ratings,
                    "rating_times_s": times_s,
                },
                stimuli=series.stimuli,
                response_time_s=choice.time_s,
            )

    def _browse(self, look: _Look, series: Browsable, start: int) -> Generator[Ask, Response | None, BrowsedSeries]:
        """Let one leaf through ``series`` from ``start`` on, and return the choice."""
        count = len(series.stimuli)
        index, travel = start, 1
        seen = {start}
        path: list[tuple[int, float]] = []
        while True:
            ready = not self.see_all or len(seen) == count
            following = self._neighbour(index, travel, count)
            if following is None:
                following = self._neighbour(index, -travel, count)
            means = {"previous": -1, "next": 1}
            possible = {meaning for meaning, way in means.items() if self._neighbour(index, way, count) is not None}
            possible |= {"choose"} if ready else set()
            targets = series_targets(count, look.layout, look.style)
            ask = Ask(
                self._scene(look, series, index, frozenset(seen)),
                {key: meaning for key, meaning in (_LEAF | _CHOOSE).items() if meaning in possible},
                None if following is None else self._scene(look, series, following, frozenset(seen | {following})),
                Browse(series.stimuli, index, frozenset(seen), look.reference),
                {meaning: target for meaning, target in targets.items() if meaning in possible},
            )
            response = answer((yield ask))
            path.append((index, round(response.time_s, 6)))
            if response.meaning == "choose":
                return BrowsedSeries(index, tuple(path))
            travel = means[response.meaning]
            neighbour = self._neighbour(index, travel, count)
            index = index if neighbour is None else neighbour
            seen.add(index)

    def _neighbour(self, index: int, way: int, count: int) -> int | None:
        """Return the index ``way`` from ``index``, None beyond the ends."""
        if self.wrap:
            return (index + way) % count
        return index + way if 0 <= index + way < count else None

    def _scene(self, look: _Look, series: Browsable, index: int, seen: frozenset[int]) -> Scene:
        ready = not self.see_all or len(seen) == len(series.stimuli)
        hint = look.style.say("leaf_or_choose" if ready else "leaf")
        return series_scene(
            series.stimuli,
            index,
            seen,
            look.question,
            hint,
            look.layout,
            look.style,
            look.reference,
            wrap=self.wrap,
        )


def _keys(scales: Sequence[Scale]) -> dict[str, str]:
    """Return what leafs and chooses, and what answers the scales."""
    keys = {**_LEAF, **_CHOOSE}
    for scale in scales:
        for key, meaning in scale.keys.items():
            if keys.get(key, meaning) != meaning and not keys[key].endswith(f", {meaning}"):
                keys[key] = f"{keys[key]}, {meaning}"
            else:
                keys.setdefault(key, meaning)
    return keys
