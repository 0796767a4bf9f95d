"""Sessions of the kinds that are no paired comparisons, as the runner would have recorded them."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from analysis.records import SessionLog, Trial
from analysis.scaling import Scores

Maker = Callable[..., SessionLog]
UTC = "2026-01-02T03:04:05Z"


def trial(number: int, kind: str, data: dict[str, Any]) -> Trial:
    """Return one answered trial of a kind."""
    return Trial(1, number, kind, (("1", 1.0),), 1.0, UTC, data)


@pytest.fixture
def preferring(make_session: Maker) -> Callable[..., list[SessionLog]]:
    """Sessions in which pictures' stereo versions are chosen with a given chance."""

    def make(observers: int = 8, chance: float = 0.7, pictures: tuple[str, ...] = ("1.1", "2.1")) -> list[SessionLog]:
        names = tuple(f"{picture}-{view}" for picture in pictures for view in ("stereo", "flat"))
        sessions = []
        for number in range(1, observers + 1):
            rng = random.Random(number)
            trials = []
            for place, picture in enumerate(pictures * 2):
                views = ("stereo", "flat") if place % 2 else ("flat", "stereo")
                view = "stereo" if rng.random() < chance else "flat"
                data = {
                    "first": f"{picture}-{views[0]}",
                    "second": f"{picture}-{views[1]}",
                    "first_view": views[0],
                    "chosen": f"{picture}-{view}",
                    "chosen_view": view,
                }
                trials.append(trial(place, "preference", data))
            session = make_session(f"{number:02d}", names=names, answers=[])
            sessions.append(replace(session, answers=tuple(trials)))
        return sessions

    return make


@pytest.fixture
def choosing(make_session: Maker) -> Callable[..., list[SessionLog]]:
    """Sessions in which pictures are chosen from series of three exposures, and rated."""

    def make(observers: int = 6) -> list[SessionLog]:
        series = {f"{paint}-{kind}": (paint, kind) for paint in ("GM1", "HI") for kind in ("base", "grey")}
        stimuli = tuple(
            {"name": f"{name}-{level}", "factors": {"paint": paint, "series": kind, "exposure_s": float(level)}}
            for name, (paint, kind) in series.items()
            for level in (1, 2, 4)
        )
        names = tuple(str(one["name"]) for one in stimuli)
        sessions = []
        for number in range(1, observers + 1):
            rng = random.Random(number)
            trials = []
            for place, name in enumerate(series):
                index = rng.choice((0, 1, 1, 2))
                shown = [f"{name}-{level}" for level in (1, 2, 4)]
                data = {
                    "series": name,
                    "stimuli": shown,
                    "start": 0,
                    "chosen": shown[index],
                    "chosen_index": index,
                    "path": [[0, 1.0], [1, 1.0], [2, 1.0]],
                    "dwell_s": [1.0, 1.0, 1.0],
                    "ratings": {"similarity": rng.randint(3, 9), "difficulty": rng.randint(1, 9)},
                    "rating_times_s": {"similarity": 1.0, "difficulty": 1.0},
                }
                trials.append(trial(place, "best_of_series", data))
            session = make_session(f"{number:02d}", names=names, answers=[], stimuli=stimuli)
            sessions.append(replace(session, answers=tuple(trials)))
        return sessions

    return make


@pytest.fixture
def rating(make_session: Maker) -> Callable[..., list[SessionLog]]:
    """Sessions in which single stimuli are rated on one scale."""

    def make(observers: int = 6, scale: str = "quality") -> list[SessionLog]:
        sessions = []
        for number in range(1, observers + 1):
            rng = random.Random(number)
            session = make_session(f"{number:02d}", names="abc", answers=[])
            data = [
                {"stimulus": name, "ratings": {scale: mean + rng.randint(0, 2)}, "rating_times_s": {scale: 1.0}}
                for name, mean in zip("abc", (1, 4, 7), strict=True)
            ]
            trials = tuple(trial(place, "rating", one) for place, one in enumerate(data))
            sessions.append(replace(session, answers=trials))
        return sessions

    return make


def scores_with(scores: Scores, **read: Any) -> Scores:
    """Return ``scores`` of which other ``items``, ``classes`` or ``order`` are read than they have."""
    made = replace(scores)
    vars(made).update({"items": scores.items, "classes": scores.classes} | read)
    return made
