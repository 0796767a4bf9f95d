"""How often the checks of the set ``cable`` blame a display without fault, and how often they find what is planted.

Displays are drawn at random (GOG, S-shaped, sRGB and PLVC tone responses, 60 to 400 cd/m², 500:1 to 5000:1), with noise
of 0.05 to 0.3 %, drift of up to 2 % an hour, stray light of up to 0.5 %, and channels that interact.
"""

from __future__ import annotations

from collections import Counter

import pytest

from devices.diagnostics import Diagnosis
from devices.diagnostics.channels import channel_constancy
from devices.diagnostics.mixing import added_channels, standard_primaries
from tests.devices.diagnostics.simulated_cable import CHECKS, WIDE, clean, converted, faulty, narrow
from tests.stress.how_many import how_many

pytestmark = pytest.mark.stress
CLEAN, FAULTY = how_many(200, 400), how_many(20, 40)


def test_fewer_than_one_display_in_a_hundred_without_fault_is_blamed_by_any_check() -> None:
    blamed: Counter[str] = Counter()
    judged: Counter[str] = Counter()
    displays = 0
    for seed in range(CLEAN):
        table = clean(seed)
        found = [check(table) for check in CHECKS]
        blamed.update(one.name for one in found if one.passed is False)
        judged.update(one.name for one in found if one.passed is not None)
        displays += any(one.passed is False for one in found)
    print("blamed", dict(blamed), "displays", displays, "judged", dict(judged))
    assert max(blamed.values(), default=0) <= CLEAN // 100, blamed
    assert displays <= CLEAN // 100
    assert min(judged.values()) >= 0.6 * CLEAN


@pytest.mark.parametrize(
    ("planted", "check", "least"),
    [
        ({"stretched_range": 1}, "signal_range", 0.95),
        ({"squeezed_range": 1}, "code_steps", 0.9),
        ({"panel_bits": 6}, "code_steps", 0.9),
        ({"panel_bits": 7}, "code_steps", 0.9),
        ({"panel_bits": 6, "frame_rate_control": 0.02}, "frame_rate_control", 0.95),
        ({"panel_bits": 6, "frame_rate_control": 1e-9}, "last_codes", 0.6),
        ({"dynamic_contrast": 0.08}, "dynamic_contrast", 0.9),
        ({"picture_level_limit": 0.05}, "picture_level", 0.95),
        ({"white_segment": 0.12}, "white_segment", 0.95),
    ],
)
def test_what_is_planted_is_found(planted: dict[str, float], check: str, least: float) -> None:
    by_name = {one.__name__: one for one in CHECKS}
    found = [by_name[check](faulty(seed, **planted)) for seed in range(FAULTY)]
    share = sum(one.passed is False for one in found) / FAULTY
    print(planted, check, share, "unjudged", sum(one.passed is None for one in found) / FAULTY)
    assert share >= least
    # What is not found is not judged, for its noise, but seldom called right.
    assert sum(one.passed is True for one in found) <= 0.1 * FAULTY


@pytest.mark.parametrize(
    ("share", "gamma", "least"),
    [(0.75, None, 0.95), (0.85, None, 0.9)],
)
def test_conversions_that_cut_off_colours_are_found(share: float, gamma: float | None, least: float) -> None:
    found = sum(added_channels(converted(seed, narrow(share), gamma)).passed is False for seed in range(FAULTY))
    print(share, found / FAULTY)
    assert found >= least * FAULTY


def test_conversions_for_a_wide_panel_are_found_by_their_curve_or_their_primaries() -> None:
    """Where the compositor is wrong about the panel's curve, channels change with level; else primaries are sRGB's."""

    def seen(*checks: Diagnosis) -> bool:
        return any(one.passed is False for one in checks)

    found = 0
    for seed in range(FAULTY):
        table = converted(seed, WIDE, None)
        found += seen(channel_constancy(table), standard_primaries(table), added_channels(table))
    print("any curve", found / FAULTY)
    assert found >= 0.8 * FAULTY
