"""How often two eyes find a fault where there is none, and whether their standard errors are those of repetition."""

from __future__ import annotations

from time import process_time

import numpy as np
import pytest
from scipy.stats import binomtest

from stimuli.comparison.disparities import EyesPair
from stimuli.comparison.eye_evidence import EyesEvidence, eyes_reasons
from stimuli.comparison.eye_identity import identify_eyes
from stimuli.comparison.luminance import Views
from stimuli.comparison.two_eyes import measure_two_eyes
from stimuli.comparison.verdict import Limits, Reason
from tests.stimuli.comparison.two_eye_scenes import Pair, Relief, Sparkles
from tests.stress.how_many import how_many

pytestmark = pytest.mark.stress

SMALL = (160, 240)
PAIRS = how_many(50, 100)


def judged(photo: Pair, rendering: Pair) -> tuple[list[Reason], dict[str, EyesPair]]:
    everywhere = np.ones(photo[0].shape, dtype=np.bool_)
    identity = identify_eyes(photo, rendering)
    eyes = measure_two_eyes(Views(*photo), Views(*rendering), everywhere, everywhere)
    used = eyes.photo.used, eyes.rendering.used
    return eyes_reasons(EyesEvidence(eyes.measures, identity, used, eyes.same_views), Limits()), dict(eyes.measures)


@pytest.mark.parametrize("kind", ["sparkles", "relief"])
def test_nothing_is_found_in_other_flakes_of_one_law(kind: str) -> None:
    """Of all pairs at most one in twenty may show a fault; the share's 95 % interval by Wilson is printed."""
    false, open_, started = 0, 0, process_time()
    for seed in range(PAIRS):
        if kind == "sparkles":
            photo, rendering = (Sparkles(flakes=1000 + 2 * seed + one, noise=one, shape=SMALL) for one in (0, 1))
            reasons = judged(photo.views(), rendering.views())[0]
        else:
            first, second = (Relief(texture=1000 + 2 * seed + one, noise=one, shape=SMALL) for one in (0, 1))
            reasons = judged(first.views(), second.views())[0]
        outcomes = {reason.outcome for reason in reasons}
        false += "fails" in outcomes
        open_ += "fails" not in outcomes and "cannot say" in outcomes
    low, high = binomtest(false, PAIRS).proportion_ci(method="wilson")
    took = process_time() - started
    print(f"\n{kind}: {false} of {PAIRS} false ({100 * low:.1f} to {100 * high:.1f} %), {open_} open; {took:.0f} s")
    assert false <= PAIRS // 20


def test_errors_are_those_of_repetition() -> None:
    """Over plates of other flakes, differences scatter as their standard errors say, within 45 %."""
    rows: dict[str, list[tuple[float, float]]] = {}
    for seed in range(24):
        photo, rendering = (Sparkles(flakes=3000 + 2 * seed + one) for one in (0, 1))
        for name, pair in judged(photo.views(), rendering.views())[1].items():
            rows.setdefault(name, []).append((pair.difference, pair.standard_error))
    for name in ("eye luminance", "eye contrast", "eye agreement", "one-eyed share", "sparkle depth"):
        apart, error = np.array(rows[name]).T
        share = float(apart.std() / np.sqrt(np.mean(error**2)))
        print(f"{name}: {share:.2f}")
        # The standard deviation of 24 numbers is known to 15 %: three times that.
        assert 0.55 < share < 1.45, name
