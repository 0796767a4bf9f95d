"""Alignment, and what two eyes find, at their edges: by chance, and how little is still found and named."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from time import process_time

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from scipy.special import ndtr
from scipy.stats import binomtest

from documents.arrays import Floats
from stimuli.align import align_pair, measure_disparity, register, straighten
from stimuli.align.registration import Registration
from stimuli.comparison.binocular import measure_binocular
from stimuli.comparison.binocular_reasons import BinocularEvidence, binocular_reasons
from stimuli.comparison.disparities import EyesPair
from stimuli.comparison.eye_identity import identify_eyes
from stimuli.comparison.verdict import Limits, Reason
from stimuli.errors import StimulusError
from tests.stimuli.comparison.two_eye_scenes import Pair, Relief, Sparkles, contrasted
from tests.stress.how_many import how_many
from tests.stress.memory import run_alone

pytestmark = pytest.mark.stress


# Alignment at its edges: how often chance passes for a shift, how weak a texture gives one, how large pictures.

Maker = Callable[[np.random.Generator], Floats]
SIDE = 128


def sparse(rng: np.random.Generator, count: int, spread: float, noise: float = 0.0, side: int = SIDE) -> Floats:
    """Sparkles of lognormal light at random places between pixels."""
    x, y = rng.uniform(-4.0, side + 4.0, (2, count))
    edges = np.arange(side + 1) - 0.5
    across, down = (np.diff(ndtr((edges - place[:, None]) / 0.8), axis=1) for place in (x, y))
    light = rng.lognormal(3.0, spread, count)[:, None]
    return np.asarray(5.0 + (down * light).T @ across + rng.normal(0.0, noise, (side, side)))


def shading() -> Floats:
    return np.asarray(10.0 * np.exp(-0.5 * np.hypot(*np.mgrid[-1 : 1 : SIDE * 1j, -1 : 1 : SIDE * 1j]) ** 2))


def found(reference: NDArray[np.floating], moving: NDArray[np.floating]) -> Registration | None:
    try:
        return register(reference, moving)
    except StimulusError:
        return None


DENSE: dict[str, Maker] = {
    "white noise": lambda rng: rng.normal(10.0, 1.0, (SIDE, SIDE)),
    "blurred noise": lambda rng: 10.0 + gaussian_filter(rng.normal(0.0, 1.0, (SIDE, SIDE)), 1.5),
    "noise blurred far": lambda rng: 10.0 + gaussian_filter(rng.normal(0.0, 1.0, (SIDE, SIDE)), 6.0),
    "blurred and sharp noise": lambda rng: (
        10.0 + 5.0 * gaussian_filter(rng.normal(0.0, 1.0, (SIDE, SIDE)), 2.0) + rng.normal(0.0, 0.1, (SIDE, SIDE))
    ),
    "noise on a shading in common": lambda rng: shading() + rng.normal(0.0, 0.05, (SIDE, SIDE)),
    "photons": lambda rng: rng.poisson(0.3 * shading()).astype(np.float64),
    "noise in 8 bits": lambda rng: np.round(shading() + rng.normal(0.0, 0.5, (SIDE, SIDE))),
    "small": lambda rng: rng.normal(10.0, 1.0, (32, 32)),
    "thin": lambda rng: rng.normal(10.0, 1.0, (32, 256)),
    "1000 sparkles": lambda rng: sparse(rng, 1000, 1.0),
    "300 sparkles": lambda rng: sparse(rng, 300, 1.0),
    "300 sparkles, most of the light in few": lambda rng: sparse(rng, 300, 2.0, 0.1),
    "80 sparkles and noise": lambda rng: sparse(rng, 80, 1.0, 0.1),
    "80 sparkles in a small picture": lambda rng: sparse(rng, 80, 1.0, 0.1, 64),
}
SPARSE: dict[str, Maker] = {
    "30 sparkles on nothing": lambda rng: sparse(rng, 30, 1.0),
    "8 sparkles on nothing": lambda rng: sparse(rng, 8, 1.0),
    "30 sparkles on a smooth shading in common": lambda rng: shading() + sparse(rng, 30, 1.0),
    "8 sparkles on a smooth shading in common": lambda rng: shading() + sparse(rng, 8, 1.0),
}


@pytest.mark.parametrize("kind", DENSE)
def test_chance_does_not_pass(kind: str) -> None:
    rng = np.random.default_rng(1)
    pairs = 200 if "sparkles" in kind else 500
    passed = sum(found(DENSE[kind](rng), DENSE[kind](rng)) is not None for _ in range(pairs))
    print(f"{kind}: {passed} of {pairs} accepted")
    assert passed == 0


@pytest.mark.parametrize("kind", SPARSE)
def test_chance_seldom_passes_with_a_handful_of_sparkles(kind: str) -> None:
    """Without any noise, few sparkles laid onto few others are as alike as true pairs are."""
    rng = np.random.default_rng(2)
    passed = sum(found(SPARSE[kind](rng), SPARSE[kind](rng)) is not None for _ in range(200))
    print(f"{kind}: {passed} of 200 accepted")
    assert passed <= 6


def test_what_is_accepted_in_noise_is_right() -> None:
    rng = np.random.default_rng(3)
    for noise in (1.0, 3.0, 10.0, 20.0, 40.0):
        accepted, far = 0, 0
        for seed in range(20):
            left = sparse(np.random.default_rng(seed), 600, 0.7)
            right = np.roll(left, (1, -5), (0, 1))
            pair = (one + rng.normal(0.0, noise, one.shape) for one in (left, right))
            one = found(*pair)
            if one is not None:
                accepted += 1
                away = np.subtract(one.shift_px, (-5.0, 1.0)) / one.standard_error_px
                far += bool(np.abs(away).max() > 5.0)
        print(f"noise {noise}: {accepted} of 20 accepted, {far} beyond five standard errors")
        assert far == 0
        if noise <= 3.0:
            assert accepted == 20


def test_every_fraction_of_a_pixel() -> None:
    worst = 0.0
    for shift in np.linspace(-1.0, 1.0, 17):
        for angle in (0.0, 0.7):
            at = (shift * np.cos(angle), shift * np.sin(angle))
            pair = []
            for x, y in ((0.0, 0.0), at):
                rng = np.random.default_rng(4)
                places = rng.uniform(-10.0, 138.0, (2, 500))
                edges = np.arange(SIDE + 1) - 0.5
                across, down = (
                    np.diff(ndtr((edges - place[:, None]) / 0.7), axis=1) for place in (places[0] + x, places[1] + y)
                )
                pair.append(3.6 + (down * rng.lognormal(3.0, 0.7, 500)[:, None]).T @ across)
            worst = max(worst, float(np.abs(np.subtract(register(*pair).shift_px, at)).max()))
    print(f"worst error {worst:.4f} px")
    assert worst < 0.01


@pytest.mark.parametrize("size", [(32, 32), (33, 47), (32, 1001), (997, 32), (61, 67), (251, 509)])
def test_odd_sizes(size: tuple[int, int]) -> None:
    light = np.random.default_rng(5).uniform(1.0, 10.0, (size[0] + 4, size[1] + 4, 3)).astype(np.float32)
    left, right = light[2:-2, 2:-2], light[1:-3, 3:-1]
    shift = register(left, right)
    print(f"{size}: {shift.shift_px}")
    # The local mean of a small picture is that of another place at its edges.
    away = np.abs(np.subtract(shift.shift_px, (-1.0, 1.0)))
    assert away.max() < (0.02 if min(size) < 64 else 0.002)
    if min(size) > 32:
        one = align_pair(left, right, block_px=32)
        np.testing.assert_array_equal(one.left, one.right)
    else:
        with pytest.raises(StimulusError, match="common to both views"):
            align_pair(left, right)


@pytest.mark.parametrize("block_px", [32, 64])
def test_blocks_of_noise_are_left_out(block_px: int) -> None:
    """The floor of a block of 32 pixels is known from few cells: chance passes oftener there than the test says."""
    rng = np.random.default_rng(6)
    side = 64 * block_px
    noise = (rng.standard_normal((side, side), dtype=np.float32) + np.float32(10.0) for _ in range(2))
    report = measure_disparity(*noise, block_px=block_px)
    print(f"{report.used} of {report.blocks} blocks of {block_px} pixels of noise used")
    assert report.blocks == 4096
    assert report.used <= (4 if block_px == 32 else 1)


CODE = """
import sys, time
import numpy as np
from stimuli.align.pair import align_pair
from tests.stress.memory import forget_peak, peak_kb
rng = np.random.default_rng(0)
light = rng.random((4912, 7360 + 951, 3), dtype=np.float32)
light += 1.0
left, right = light[:, 951:], light[:, :-951]
before = forget_peak()
began = time.perf_counter()
found = align_pair(left, right, block_px=256)
taken = time.perf_counter() - began
assert abs(found.shift_px - 951.0) < 1e-3, found.shift_px
assert np.array_equal(found.left, found.right)
peak = peak_kb()
print(f"{taken:.1f} s; {(peak - before) / 2**20:.2f} GiB beyond the views' own {before / 2**20:.2f}; "
      f"{found.disparity.used} of {found.disparity.blocks} blocks")
sys.exit(peak - before > 3 * 2**20)
"""


def test_36_megapixels() -> None:
    """Beyond the two views: the two aligned ones (0.75 GiB), and planes for what is compared."""
    run_alone(CODE)


def turned(roll_deg: float, scale: float, seed: int, own: float = 0.15, side: int = 448) -> NDArray[np.float32]:
    """Sparkles turned and enlarged about the middle; this eye alone sees the share ``own``, drawn by itself."""
    shared, rng = np.random.default_rng(seed // 2), np.random.default_rng(10_000 + seed)
    count = side**2 // 80
    places = shared.uniform(-30, side + 30, (2, count)) - (side - 1) / 2
    light = shared.lognormal(3.0, 0.7, count)
    mine = rng.random(count) < own
    places[:, mine] = rng.uniform(-30, side + 30, (2, int(mine.sum()))) - (side - 1) / 2
    angle = np.radians(roll_deg)
    turn = scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    edges = np.arange(side + 1) - 0.5
    across, down = (np.diff(ndtr((edges - place[:, None]) / 0.8), axis=1) for place in turn @ places + (side - 1) / 2)
    plane = 5.0 + (down * light[:, None]).T @ across
    plane += rng.normal(0.0, 0.005 * plane.max(), plane.shape)
    return np.repeat(plane[:, :, None], 3, axis=2).astype(np.float32)


def test_level_cameras_are_seldom_straightened() -> None:
    """Three of ten sparkles are no other eye's; what chance undoes is small beside a pixel."""
    corners = []
    for pair in range(50):
        made = straighten(turned(0.0, 1.0, 2 * pair), turned(0.0, 1.0, 2 * pair + 1))
        if made.applied:
            corners.append(made.roll_scale.corner_px)
    print(f"{len(corners)} of 50 level pairs straightened, by {max(corners, default=0.0):.3f} px at most")
    assert len(corners) <= 4
    assert max(corners, default=0.0) < 0.15


@pytest.mark.parametrize("roll_deg", [0.02, 0.1, 0.5, 1.0, 1.5])
def test_rolls_of_any_size_come_back(roll_deg: float) -> None:
    errors = []
    for pair in range(5):
        scale = 1 + 0.004 * (2 * pair - 4) / 4
        left, right = turned(0.0, 1.0, 2 * pair), turned(roll_deg, scale, 2 * pair + 1)
        # Beyond half a degree the views may agree in too few places to begin by themselves.
        made = straighten(left, right, offset_px=(0.0, 0.0) if roll_deg > 0.5 else None)
        errors.append([np.radians(made.roll_scale.roll_deg - roll_deg) * 224, (made.roll_scale.scale - scale) * 224])
    print(f"roll {roll_deg}: worst error {np.abs(errors).max():.3f} px at the edge")
    assert np.abs(errors).max() < 0.1


# How small a fault two eyes still find and name.
#
# The table of decision 0082 is what `test_detection_limits` prints with ``-s``.

REPEATS = how_many(2, 3)


def fails(photo: Pair, rendering: Pair) -> list[Reason]:
    everywhere = np.ones(photo[0].shape, dtype=np.bool_)
    identity = identify_eyes(photo, rendering)
    if identity.way == "exchanged":
        rendering = rendering[::-1]
    eyes = measure_binocular(photo, rendering, everywhere, everywhere)
    used = eyes.photo.used, eyes.rendering.used
    reasons = binocular_reasons(BinocularEvidence(eyes.measures, identity, used, eyes.same_views), Limits())
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


# How often two eyes find a fault where there is none, and whether their standard errors are those of repetition.

SMALL = (160, 240)
PAIRS = how_many(50, 100)


def judged(photo: Pair, rendering: Pair) -> tuple[list[Reason], dict[str, EyesPair]]:
    everywhere = np.ones(photo[0].shape, dtype=np.bool_)
    identity = identify_eyes(photo, rendering)
    eyes = measure_binocular(photo, rendering, everywhere, everywhere)
    used = eyes.photo.used, eyes.rendering.used
    evidence = BinocularEvidence(eyes.measures, identity, used, eyes.same_views)
    return binocular_reasons(evidence, Limits()), dict(eyes.measures)


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
