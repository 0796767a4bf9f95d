"""Sessions of choices from series, as the runner would have recorded them."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

from analysis.records import Header, SessionLog, Trial
from analysis.series import SeriesSummary, summarise_series

PAINTS = ("GM1", "GM2", "HI", "BC", "BR")
KINDS = ("base", "brighter", "grey")
EXPOSURES_S = (1.3, 1.6, 2.0, 2.5, 3.0, 4.0)
WEIGHTS: Mapping[str, tuple[float, ...]] = {
    "base": (1, 1, 1, 1.1, 1.2, 2.0),
    "brighter": (1, 1, 1.1, 1.6, 2.5, 6.0),
    "grey": (1, 1, 1.1, 1.6, 2.5, 6.0),
}
Law = Callable[[random.Random, str, str], int]
Maker = Callable[..., SessionLog]


def by_weights(rng: random.Random, paint: str, kind: str) -> int:
    """Choose by the weights of configs/observers/figure_4_14.yaml."""
    return rng.choices(range(len(EXPOSURES_S)), WEIGHTS.get(kind, WEIGHTS["base"]))[0]


def record(series: str, stimuli: Sequence[str], index: int, ratings: Mapping[str, float]) -> dict[str, Any]:
    """Return what a block records of one choice: straight through the series, and back to the one chosen."""
    path = [*range(len(stimuli)), *range(len(stimuli) - 2, index - 1, -1)]
    dwell_s = [float(path.count(place)) for place in range(len(stimuli))]
    return {
        "series": series,
        "stimuli": list(stimuli),
        "start": 0,
        "chosen": stimuli[index],
        "chosen_index": index,
        "path": [[place, 1.0] for place in path],
        "dwell_s": dwell_s,
        "ratings": dict(ratings),
        "rating_times_s": dict.fromkeys(ratings, 1.5),
    }


def header(observer: str, stimuli: Sequence[Mapping[str, Any]], **change: Any) -> Header:
    """Return a header of the experiment ``exposure_series``."""
    values: dict[str, Any] = {
        "experiment": "exposure_series",
        "observer": observer,
        "session": "20260102T030405abcd",
        "started_utc": "2026-01-02T03:04:05Z",
        "seed": 7,
        "question": "Which image is closest to the reference plate?",
        "simulated": False,
        "stimuli": tuple(stimuli),
        "display": {},
        "analysis": {},
        "hashes": {},
        "software": {},
        "presentation": {},
    }
    return Header(**{**values, **change})


@pytest.fixture(scope="session")
def make_choices() -> Maker:
    def make(
        observer: str = "01",
        *,
        law: Law = by_weights,
        paints: Sequence[str] = PAINTS,
        kinds: Sequence[str] = KINDS,
        rate: Callable[[random.Random, str, str], Mapping[str, float]] | None = None,
        complete: bool = True,
        seed: str = "",
        **change: Any,
    ) -> SessionLog:
        rng = random.Random(f"{observer}/{seed}")
        stimuli = [
            {
                "name": f"{paint}-{kind}-{exposure_s:g}",
                "factors": {"paint": paint, "series": kind, "exposure_s": exposure_s, "view": "stereo"},
            }
            for paint in paints
            for kind in kinds
            for exposure_s in EXPOSURES_S
        ]
        trials = []
        series = [(paint, kind) for paint in paints for kind in kinds]
        rng.shuffle(series)
        for number, (paint, kind) in enumerate(series):
            names = [f"{paint}-{kind}-{exposure_s:g}" for exposure_s in EXPOSURES_S]
            index = law(rng, paint, kind)
            ratings = (
                rate(rng, paint, kind)
                if rate
                else {"similarity": rng.randint(4, 8) + (kind == "base"), "difficulty": rng.randint(3, 7)}
            )
            data = record(f"{paint}-{kind}", names, index, ratings)
            trials.append(Trial(1, number, "best_of_series", (), sum(data["dwell_s"]), "2026-01-02T03:04:05Z", data))
        file = Path(f"results/sub-{observer}/session.jsonl")
        return SessionLog(file, header(observer, stimuli, **change), tuple(trials), complete)

    return make


@pytest.fixture(scope="session")
def fifteen(make_choices: Maker) -> list[SessionLog]:
    return [make_choices(f"{number:02d}") for number in range(1, 16)]


@pytest.fixture(scope="session")
def summary(fifteen: list[SessionLog]) -> SeriesSummary:
    return summarise_series(fifteen)
