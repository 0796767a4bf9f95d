"""How small a fault two eyes still find, how often one is found where there is none, and how errors cover.

The table of `docs/compare.md` is what `test_detection_limits` prints with ``-s``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from time import perf_counter

import numpy as np
import pytest
from scipy.stats import binomtest

from stimuli.comparison.eye_evidence import EyesEvidence, eyes_reasons
from stimuli.comparison.eye_identity import identify_eyes
from stimuli.comparison.jackknife import EyesPair
from stimuli.comparison.two_eyes import measure_two_eyes
from stimuli.comparison.verdict import Limits, Reason
from stimuli.comparison.views import Views
from tests.stimuli.comparison.two_eye_scenes import Pair, Relief, Sparkles, contrasted

pytestmark = pytest.mark.stress

REPEATS = 4
SMALL = (160, 240)


def judged(photo: Pair, rendering: Pair) -> tuple[list[Reason], dict[str, EyesPair]]:
    everywhere = np.ones(photo[0].shape, dtype=np.bool_)
    identity = identify_eyes(photo, rendering)
    if identity.way == "exchanged":
        rendering = rendering[::-1]
    eyes = measure_two_eyes(Views(*photo), Views(*rendering), everywhere, everywhere)
    used = eyes.photo.used, eyes.rendering.used
    return eyes_reasons(EyesEvidence(eyes.measures, identity, used, eyes.same_views), Limits()), dict(eyes.measures)


def fails(photo: Pair, rendering: Pair) -> list[Reason]:
    return [reason for reason in judged(photo, rendering)[0] if reason.outcome == "fails"]


def relief(seed: int, relief_px: float = 3.0) -> tuple[Relief, Relief]:
    photo = Relief(relief_px=relief_px, texture=seed, noise=2 * seed)
    return photo, replace(photo, noise=2 * seed + 1)


def paint(seed: int, shared: float = 0.5) -> tuple[Sparkles, Sparkles]:
    photo = Sparkles(shared=shared, flakes=seed, noise=2 * seed)
    return photo, replace(photo, noise=2 * seed + 1)


def twice(rendering: Relief | Sparkles) -> Pair:
    """Return the left view for both eyes, each with noise of its own, as rendering twice gives it."""
    return rendering.views()[0], replace(rendering, noise=rendering.noise + 9999).views()[0]


def swapped_relief(size: float, seed: int) -> tuple[Pair, Pair]:
    photo, rendering = relief(seed, size)
    return photo.views(), rendering.views()[::-1]


def swapped_paint(size: float, seed: int) -> tuple[Pair, Pair]:
    photo, rendering = paint(seed, shared=1 - size)
    return photo.views(), rendering.views()[::-1]


def flat_relief(size: float, seed: int) -> tuple[Pair, Pair]:
    photo, rendering = relief(seed, size)
    return photo.views(), twice(rendering)


def flat_paint(size: float, seed: int) -> tuple[Pair, Pair]:
    photo, rendering = paint(seed, shared=1 - size)
    return photo.views(), twice(rendering)


def contrast_relief(size: float, seed: int) -> tuple[Pair, Pair]:
    photo, rendering = relief(seed)
    return photo.views(), contrasted(rendering.views(), size)


def contrast_paint(size: float, seed: int) -> tuple[Pair, Pair]:
    photo, _ = paint(seed)
    return photo.views(), contrasted(Sparkles(flakes=seed + 500, noise=seed).views(), size)


def based(size: float, seed: int) -> tuple[Pair, Pair]:
    photo, rendering = relief(seed)
    return photo.views(), replace(rendering, base=size).views()


def inverted(size: float, seed: int) -> tuple[Pair, Pair]:
    photo, rendering = relief(seed, size)
    return photo.views(), replace(rendering, base=-1.0).views()


def shuffled(size: float, seed: int) -> tuple[Pair, Pair]:
    photo, rendering = paint(seed)
    return photo.views(), replace(rendering, shuffled=size).views()


def rolled(size: float, seed: int) -> tuple[Pair, Pair]:
    photo, rendering = relief(seed)
    return photo.views(), replace(rendering, roll_deg=size).views()


# The fault, the words that name it, the sizes tried, and that from which it must be found every time.
SWEEPS: list[tuple[str, Callable[[float, int], tuple[Pair, Pair]], str, tuple[float, ...], float]] = [
    ("eyes swapped, relief of px", swapped_relief, "eyes are exchanged", (0.3, 0.6, 1.0, 2.0, 3.0), 3.0),
    ("eyes swapped, share seen by one eye", swapped_paint, "eyes are exchanged", (0.05, 0.1, 0.2, 0.35, 0.5), 0.5),
    ("view twice, relief of px", flat_relief, "is flat", (0.3, 0.6, 1.0, 2.0, 3.0), 3.0),
    ("view twice, share seen by one eye", flat_paint, "is flat", (0.05, 0.1, 0.2, 0.35, 0.5), 0.5),
    ("contrast of one eye, relief, times", contrast_relief, "left eye's contrast", (1.1, 1.2, 1.25, 1.4, 2.0), 2.0),
    ("contrast, other flakes, times", contrast_paint, "left eye's contrast", (1.2, 1.3, 1.5, 1.7, 2.0), 2.0),
    ("base, times", based, "times the photograph's", (1.05, 1.1, 1.12, 1.15, 1.2), 1.2),
    ("depth inverted, relief of px", inverted, "depth is inverted", (0.3, 0.6, 1.0, 2.0, 3.0), 3.0),
    ("sparkles of one eye shuffled, share", shuffled, "", (0.1, 0.2, 0.3, 0.5, 1.0), 1.0),
    ("roll of one eye, °", rolled, "right view is turned", (0.1, 0.2, 0.25, 0.3, 1.0), 1.0),
]


@pytest.mark.parametrize("sweep", SWEEPS, ids=[sweep[0] for sweep in SWEEPS])
def test_detection_limits(
    sweep: tuple[str, Callable[[float, int], tuple[Pair, Pair]], str, tuple[float, ...], float],
) -> None:
    """At the stated size each fault is found and named every time; more of it is found as often or oftener."""
    name, planted, words, sizes, stated = sweep
    found = []
    for size in sizes:
        count = 0
        for seed in range(REPEATS):
            photo, rendering = planted(size, seed)
            count += any(words in reason.sentence for reason in fails(photo, rendering))
        found.append(count)
    print(
        f"\n{name}: " + ", ".join(f"{size:g}: {count} of {REPEATS}" for size, count in zip(sizes, found, strict=True))
    )
    assert found[sizes.index(stated)] == REPEATS
    assert found[-1] >= found[0]


@pytest.mark.parametrize("kind", ["sparkles", "relief"])
def test_nothing_is_found_in_other_flakes_of_one_law(kind: str) -> None:
    """Of 100 pairs at most 5 may show a fault; the share's 95 % interval by Wilson is printed."""
    false, open_, started = 0, 0, perf_counter()
    for seed in range(100):
        if kind == "sparkles":
            photo, rendering = (Sparkles(flakes=1000 + 2 * seed + one, noise=one, shape=SMALL) for one in (0, 1))
            reasons = judged(photo.views(), rendering.views())[0]
        else:
            first, second = (Relief(texture=1000 + 2 * seed + one, noise=one, shape=SMALL) for one in (0, 1))
            reasons = judged(first.views(), second.views())[0]
        outcomes = {reason.outcome for reason in reasons}
        false += "fails" in outcomes
        open_ += "fails" not in outcomes and "cannot say" in outcomes
    low, high = binomtest(false, 100).proportion_ci(method="wilson")
    took = perf_counter() - started
    print(f"\n{kind}: {false} of 100 false ({100 * low:.1f} to {100 * high:.1f} %), {open_} open; {took:.0f} s")
    assert false <= 5


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
