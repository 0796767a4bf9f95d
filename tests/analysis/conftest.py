"""Sessions of simulated observers, as the runner would have recorded them."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pytest

from analysis.comparisons import Answer, Comparisons
from analysis.records import SessionLog, new_header
from tests.answers import new_answer

NAMES = ("1.1 mono", "1.1 stereo", "2.1 mono", "2.1 stereo", "3.1 mono", "3.1 stereo")
SCORES = (0.06, 0.2, 0.08, 0.3, 0.06, 0.3)
Maker = Callable[..., SessionLog]
# V. Medina (2016), Table 4.4: sample, printed score, class.
_TABLE_4_4 = MappingProxyType(
    {
        "8": (0.0296, "5"),
        "2": (0.0432, "4"),
        "7": (0.0543, "3+4"),
        "1": (0.0718, "3"),
        "5": (0.0740, "3"),
        "9": (0.0751, "3"),
        "3": (0.0762, "3"),
        "10": (0.1149, "2"),
        "4": (0.2036, "1"),
        "6": (0.2574, "1"),
    }
)


@pytest.fixture(scope="session")
def table_4_4() -> Mapping[str, tuple[float, str]]:
    """The thesis's Table 4.4: each sample's printed score and class."""
    return _TABLE_4_4


def answers_of(comparisons: Comparisons) -> list[Answer]:
    """Return the answers one by one, those with ties last."""
    names, people, tied = comparisons.items, comparisons.observers, comparisons.tied
    lines = [
        Answer(names[w], names[x], c, people[o], names[w] if first else names[x])
        for w, x, c, o, first in zip(
            comparisons.winner,
            comparisons.loser,
            comparisons.count,
            comparisons.observer,
            comparisons.winner_was_first,
            strict=True,
        )
    ]
    lines += [
        Answer(names[a], names[b], c, people[o], names[a] if first else names[b], tie=True)
        for a, b, c, o, first in zip(tied.item_a, tied.item_b, tied.count, tied.observer, tied.a_was_first, strict=True)
    ]
    return lines


def clip_cost(percent: float) -> dict[str, float]:
    return {
        "percent_red": percent,
        "percent_green": percent,
        "percent_blue": percent,
        "percent_any": percent,
        "percent_above_full": percent / 2,
        "delta_e_00_mean": percent / 100,
        "delta_e_00_max": 10 * percent,
    }


@pytest.fixture(scope="session")
def make_session() -> Maker:
    def make(
        observer: str = "01",
        *,
        names: Sequence[str] = NAMES,
        answers: Sequence[tuple[str, str]] | None = None,
        complete: bool = True,
        simulated: bool = False,
        session: str = "20260102T030405abcd",
        **header: Any,
    ) -> SessionLog:
        law = dict(zip(names, SCORES, strict=False))
        rng = random.Random(observer)
        if answers is None:
            pairs = list(combinations(names, 2))
            rng.shuffle(pairs)
            answers = [
                pair if rng.random() < law[pair[0]] / (law[pair[0]] + law[pair[1]]) else pair[::-1] for pair in pairs
            ]
        trials = []
        for number, (chosen, rejected) in enumerate(answers):
            first, second = (chosen, rejected) if rng.random() < 0.5 else (rejected, chosen)
            data: Mapping[str, Any] = {
                "first": first,
                "second": second,
                "answer": "first" if first == chosen else "second",
                "chosen": chosen,
                "rejected": rejected,
                "first_position": "top",
            }
            utc = f"2026-01-02T{3 + number // 1800:02d}:{number // 30 % 60:02d}:{number % 30 * 2:02d}Z"
            key = "up" if first == chosen else "down"
            trials.append(new_answer(1, number, "all_pairs", ((key, 1.25),), 1.25, utc, data))
        values: dict[str, Any] = {
            "experiment": "dynamic_range",
            "observer": observer,
            "session": session,
            "started_utc": "2026-01-02T02:59:58Z",
            "seed": 7,
            "question": "Which image is closer to the reference plate?",
            "simulated": simulated,
            "stimuli": [
                {"name": name, "clipping": {"left": clip_cost(1.5), "right": clip_cost(2.5)}} for name in names
            ],
            "display": {"file": "asus_vg248qe.yaml", "mode": "side-by-side"},
            "analysis": {"alpha": 0.045, "adjust": "none"},
            "hashes": {"experiment": "ab" * 32},
            "software": {"cyclopean": "0.1.0"},
            "presentation": {"renderer": "llvmpipe"},
        }
        file = Path(f"results/sub-{observer}/ses-{session}/session.jsonl")
        return SessionLog(file, new_header(**{**values, **header}), tuple(trials), complete)

    return make


@pytest.fixture
def sessions(make_session: Maker) -> list[SessionLog]:
    return [make_session(f"{number:02d}") for number in range(1, 21)]


PAINTS = ("GM1", "GM2", "HI", "BC", "BR")
KINDS = ("base", "brighter", "grey")
EXPOSURES_S = (1.3, 1.6, 2.0, 2.5, 3.0, 4.0)
WEIGHTS: Mapping[str, tuple[float, ...]] = {
    "base": (1, 1, 1, 1.1, 1.2, 2.0),
    "brighter": (1, 1, 1.1, 1.6, 2.5, 6.0),
    "grey": (1, 1, 1.1, 1.6, 2.5, 6.0),
}
Law = Callable[[random.Random, str, str], int]


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


@pytest.fixture(scope="session")
def make_choices(make_session: Maker) -> Maker:
    """Sessions of choices from series of exposures, with two ratings of each."""

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
            trials.append(
                new_answer(1, number, "best_of_series", (), sum(data["dwell_s"]), "2026-01-02T03:04:05Z", data)
            )
        wishes = {"experiment": "exposure_series", "display": {}, "analysis": {}, **change}
        made = make_session(observer, names=[], answers=[], stimuli=tuple(stimuli), complete=complete, **wishes)
        return replace(made, records=tuple(trials))

    return make
