"""Sessions of the kinds that are no paired comparisons, as the runner would have recorded them."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any
from xml.etree import ElementTree

import pytest

from analysis.bootstrap import resample
from analysis.kinds import Trial
from analysis.records import SessionLog
from analysis.report import Report, describe
from analysis.scaling import Scores
from tests.answers import new_answer

Maker = Callable[..., SessionLog]
UTC = "2026-01-02T03:04:05Z"


def trial(number: int, kind: str, data: dict[str, Any]) -> Trial:
    """Return one answered trial of a kind."""
    return new_answer(1, number, kind, (("1", 1.0),), 1.0, UTC, data)


@pytest.fixture(scope="session")
def described(make_session: Maker) -> Report:
    """The report on the twenty observers of ``sessions``, made once."""
    return describe([make_session(f"{number:02d}") for number in range(1, 21)])


@pytest.fixture(autouse=True)
def few_draws(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw a tenth of the bootstrap samples, and few studies: no test of the report looks at how many agree."""
    monkeypatch.setattr("analysis.simulation.smallest.MOST_STUDIES", 60)
    monkeypatch.setattr("analysis.report.estimate.resample", partial(resample, replicates=100))
    monkeypatch.setattr("analysis.report.reviewers.REPLICATES", 100)


@pytest.fixture
def unreviewed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out what reviewers ask, which takes half of the time: for tests of other parts."""
    monkeypatch.setattr("analysis.report.described.review_of", lambda *_: {})


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
            sessions.append(replace(session, records=tuple(trials)))
        return sessions

    return make


@pytest.fixture
def choosing(make_choices: Maker) -> Callable[..., list[SessionLog]]:
    """Sessions in which pictures are chosen from series of exposures of two paints and two kinds, and rated."""

    def make(observers: int = 6) -> list[SessionLog]:
        chosen = {"paints": ("GM1", "HI"), "kinds": ("base", "grey")}
        return [make_choices(f"{number:02d}", **chosen) for number in range(1, observers + 1)]

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
            sessions.append(replace(session, records=trials))
        return sessions

    return make


def scores_with(scores: Scores, **read: Any) -> Scores:
    """Return ``scores`` of which other ``items``, ``classes`` or ``order`` are read than they have."""
    made = replace(scores)
    vars(made).update({"items": scores.items, "classes": scores.classes} | read)
    return made


def uses(svg: str) -> list[tuple[str, float, float]]:
    """Return paint and place of every mark."""
    tree = ElementTree.fromstring(svg.replace("<svg ", '<svg xmlns:xlink="http://www.w3.org/1999/xlink" ', 1))
    return [(str(u.get("style")), float(str(u.get("x"))), float(str(u.get("y")))) for u in tree.iter("use")]
