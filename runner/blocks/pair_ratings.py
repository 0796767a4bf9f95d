"""Scales that follow a choice between two, about the one chosen or about both."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from runner.blocks.layouts import SingleLayout
from runner.blocks.scale import Scale, rate
from runner.blocks.steps import Response
from runner.blocks.style import Style
from runner.ports import Ask
from runner.presenter.scene import Picture


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
