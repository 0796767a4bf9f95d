"""How small a fault two eyes still find and name.

The table of `docs/compare.md` is what `test_detection_limits` prints with ``-s``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from stimuli.comparison.eye_evidence import EyesEvidence, eyes_reasons
from stimuli.comparison.eye_identity import identify_eyes
from stimuli.comparison.luminance import Views
from stimuli.comparison.two_eyes import measure_two_eyes
from stimuli.comparison.verdict import Limits, Reason
from tests.stimuli.comparison.two_eye_scenes import Pair, Relief, Sparkles, contrasted
from tests.stress.how_many import how_many

pytestmark = pytest.mark.stress

REPEATS = how_many(2, 3)


def fails(photo: Pair, rendering: Pair) -> list[Reason]:
    everywhere = np.ones(photo[0].shape, dtype=np.bool_)
    identity = identify_eyes(photo, rendering)
    if identity.way == "exchanged":
        rendering = rendering[::-1]
    eyes = measure_two_eyes(Views(*photo), Views(*rendering), everywhere, everywhere)
    used = eyes.photo.used, eyes.rendering.used
    reasons = eyes_reasons(EyesEvidence(eyes.measures, identity, used, eyes.same_views), Limits())
    return [reason for reason in reasons if reason.outcome == "fails"]


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
