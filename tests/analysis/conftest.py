"""Sessions of simulated observers, as the runner would have recorded them."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping, Sequence
from itertools import combinations
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pytest

from analysis.records import Header, SessionLog, Trial

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
            trials.append(Trial(1, number, "all_pairs", ((key, 1.25),), 1.25, utc, data))
        values: dict[str, Any] = {
            "experiment": "dynamic_range",
            "observer": observer,
            "session": session,
            "started_utc": "2026-01-02T02:59:58Z",
            "seed": 7,
            "question": "Which image is closer to the reference plate?",
            "simulated": simulated,
            "stimuli": tuple(
                {
                    "name": name,
                    "factors": {},
                    "flat": False,
                    "clipping": {"left": clip_cost(1.5), "right": clip_cost(2.5)},
                }
                for name in names
            ),
            "display": {"file": "asus_vg248qe.yaml", "mode": "side-by-side"},
            "analysis": {"alpha": 0.045, "adjust": "none"},
            "hashes": {"experiment": "ab" * 32},
            "software": {"cyclopean": "0.1.0"},
            "presentation": {"renderer": "llvmpipe"},
        }
        file = Path(f"results/sub-{observer}/ses-{session}/session.jsonl")
        return SessionLog(file, Header(**{**values, **header}), tuple(trials), complete)

    return make


@pytest.fixture
def sessions(make_session: Maker) -> list[SessionLog]:
    return [make_session(f"{number:02d}") for number in range(1, 21)]
