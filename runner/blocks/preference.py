"""`kind: preference`: stereo or flat? The same picture in both versions, and which of them was closer to the reference.

The thesis's preliminary test (Section 4.5.1.2): every observer chose the stereoscopic version, many without knowing
which of the two it was.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Literal

from pydantic import Field, model_validator

from documents.yaml import Natural
from runner.blocks.block import SECONDS_PER_TRIAL, Block, Draft, Fault, Steps, name_faults
from runner.blocks.context import BlockContext, Stimuli
from runner.blocks.message import PausedKind
from runner.blocks.orders import spread
from runner.ports import Ask, Compare, Hold, answer
from runner.scene import Scene
from runner.views.field_types import Line, Seconds, ShortSeconds
from runner.views.pair_views import SequenceView, SimultaneousView, gap_s, present, sequence_page

View = Literal["stereo", "flat"]
_OWN_PACE_S = 3.0


@dataclass(frozen=True, slots=True)
class Versions:
    """The two stimuli that show one picture."""

    stereo: str
    flat: str


Pair = Annotated[list[str], Field(min_length=2, max_length=2)]
SomePairs = Literal["all"] | Annotated[list[Pair], Field(min_length=1)]


class Preference(PausedKind):
    """Both versions of each picture, and which was closer.

    ``pairs`` are [stereo, flat], or ``all`` that the recipe makes: stimuli that differ in the factor ``view`` alone.
    In a ``sequence`` each stays for ``exposure_s``, or until the observer goes on if that is left out, with
    ``blank_between_s`` between the two; shown at once they stay until answered, or for ``exposure_s``. ``question``
    takes the place of the experiment's.
    """

    kind: Literal["preference"]
    pairs: SomePairs = "all"
    """Pairs of stimuli to compare: all, or a list of two names each."""
    presentation: Literal["sequence", "simultaneous"] = "sequence"
    """Whether two pictures are shown at once, or one after the other."""
    question: Line | None = None
    """The question that stands above the pictures."""
    repeats: Annotated[Natural, Field(le=100_000)] = 1
    """How many times each one is asked."""
    exposure_s: Seconds | None = None
    """Seconds that the pictures are shown; left out, until the answer."""
    blank_between_s: ShortSeconds | None = None
    """Seconds of an empty screen between the two intervals of a sequence; 0.5 if left out."""
    blank_s: ShortSeconds = 0.0
    """Seconds of an empty screen between trials."""

    @model_validator(mode="after")
    def _intervals(self) -> Preference:
        if self.presentation == "simultaneous" and self.blank_between_s is not None:
            raise ValueError("'blank_between_s' belongs to 'presentation: sequence'; 'blank_s' lies between trials")
        return self

    def meet(self, setting: BlockContext) -> Block:
        """Return the block in the observer's own order.

        The response time runs from the onset of the question (of the pair, where it stays).
        """
        view, trials = self.view(setting), len(self.versions(setting.stimuli)) * self.repeats
        in_sequence = self.presentation == "sequence"
        each_s = self.exposure_s or (_OWN_PACE_S if in_sequence else 0.0)
        shown_s = each_s * (2 if in_sequence else 1) + self.between_s + self.blank_s
        return Block(
            entry=self,
            steps=partial(self._steps, setting, view),
            trials=trials,
            expected_s=trials * (SECONDS_PER_TRIAL + shown_s),
            keys=view.keys,
            places_px=view.layout.places_px,
        )

    @property
    def between_s(self) -> float:
        """How long black lies between the intervals of a sequence, in seconds; 0 where pictures are shown at once."""
        return gap_s(self.blank_between_s, in_sequence=self.presentation == "sequence")

    def view(self, setting: BlockContext) -> SimultaneousView | SequenceView:
        """Return how the two are shown."""
        look = self.question or setting.question, setting.style
        if self.presentation == "sequence":
            return SequenceView(setting.single_layout(), *look, reference=setting.reference)
        return SimultaneousView(setting.pair_layout(), *look, reference=setting.reference)

    def order(self, setting: BlockContext) -> list[tuple[Versions, bool]]:
        """Return the pictures in the observer's order, and whether the stereo version stands first.

        It does in half of them, one more or less.
        """
        versions = self.versions(setting.stimuli)
        sides = list(range(len(versions)))
        random.Random(f"{setting.pair_seed}/sides").shuffle(sides)
        rng = random.Random(f"{setting.own_seed}/preference")
        number: dict[str, int] = {}
        for version in versions:
            for name in (version.stereo, version.flat):
                number.setdefault(name, len(number))
        picture = {(number[version.stereo], number[version.flat]): index for index, version in enumerate(versions)}
        order: list[tuple[int, int]] = []
        stereo_first: list[bool] = []
        for repeat in range(self.repeats):
            part = spread(list(picture), rng, order[-1] if order else None)
            order += part
            stereo_first += [bool((sides[picture[pair]] + repeat) % 2) != setting.flips_sides for pair in part]
        return [(versions[picture[pair]], first) for pair, first in zip(order, stereo_first, strict=True)]

    def versions(self, stimuli: Stimuli) -> tuple[Versions, ...]:
        """Return the pairs that are named, or those that the stimuli's factors make."""
        if self.pairs != "all":
            return tuple(Versions(stereo, flat) for stereo, flat in self.pairs)
        both = (views for views in _by_picture(stimuli).values() if {"stereo", "flat"} <= set(views))
        return tuple(Versions(views["stereo"][0], views["flat"][0]) for views in both)

    def faults(self, stimuli: Stimuli) -> Iterator[Fault]:
        """Yield wrong names, versions the wrong way round, pairs that stand twice, and pairs that are not clear."""
        remedy = "name the pairs [stereo, flat]"
        if self.pairs == "all":
            if not self.versions(stimuli):
                yield Fault("no picture of the recipe is there in stereo and flat", ("pairs",), remedy)
            for views in _by_picture(stimuli).values():
                for view, names in views.items():
                    if len(names) > 1 and len(views) > 1:
                        yield Fault(
                            f"{names[0]} and {names[1]}, both {view}, differ in nothing but their names",
                            ("pairs",),
                            remedy,
                        )
            return
        for index, pair in enumerate(self.pairs):
            yield from name_faults(pair, stimuli, "pairs", index)
            if pair in self.pairs[:index]:
                yield Fault(f"the pair {pair[0]}, {pair[1]} stands twice", ("pairs", index), "remove one")
            for place, (name, view) in enumerate(zip(pair, ("stereo", "flat"), strict=True)):
                known = stimuli.factors.get(name, {}).get("view")
                if known is not None and known != view:
                    yield Fault(f"'{name}' is {known}, not {view}", ("pairs", index, place), remedy)

    def _steps(self, setting: BlockContext, view: SimultaneousView | SequenceView) -> Steps:
        """Show both versions of each picture, ask, and record the answer."""
        order, style = self.order(setting), setting.style
        trials = [
            (pair.stereo, pair.flat) if stereo_first else (pair.flat, pair.stereo) for pair, stereo_first in order
        ]
        if isinstance(view, SequenceView):
            yield replace(sequence_page(style), upcoming=view.pair(*trials[0]))
        for number, (first, second) in enumerate(trials):
            yield from self.rests(style, "comparisons_done", number, len(trials), view.pair(first, second))
            if self.blank_s and number:
                yield Hold("blank", Scene(), self.blank_s)
            scene, interval_s = yield from present(view, first, second, self.exposure_s, self.between_s)
            upcoming = view.pair(*trials[number + 1]) if number + 1 < len(trials) else None
            task = Compare(first, second, setting.reference)
            response = answer((yield Ask(scene, view.keys, upcoming, task, view.targets)))
            chosen, rejected = (first, second) if response.meaning == "first" else (second, first)
            stereo = order[number][0].stereo
            data = {
                "first": first,
                "second": second,
                "answer": response.meaning,
                "chosen": chosen,
                "rejected": rejected,
                "chosen_view": _view(chosen, stereo),
                "first_view": _view(first, stereo),
                "first_position": view.position_names[0],
                **({"interval_s": interval_s} if interval_s else {}),
            }
            yield Draft("preference", data, stimuli=(first, second), response_time_s=response.time_s)


def _view(name: str, stereo: str) -> View:
    return "stereo" if name == stereo else "flat"


def _by_picture(stimuli: Stimuli) -> dict[frozenset[tuple[str, str | float]], dict[str, list[str]]]:
    """Return the names of stimuli that are stereo or flat, by all their other factors and by view."""
    pictures: dict[frozenset[tuple[str, str | float]], dict[str, list[str]]] = {}
    for name in stimuli.names:
        factors = stimuli.factors[name]
        view = factors.get("view")
        if view in ("stereo", "flat"):
            picture = frozenset((key, value) for key, value in factors.items() if key != "view")
            pictures.setdefault(picture, {}).setdefault(str(view), []).append(name)
    return pictures
