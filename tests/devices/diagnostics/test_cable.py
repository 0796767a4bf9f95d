"""What stands between codes and light is found where it is planted, and not on displays of any usual kind."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from devices.colour import rgb_to_xyz_matrix
from devices.diagnostics import Diagnosis, MeasuredSet, examine
from devices.diagnostics.channels import channel_constancy
from devices.diagnostics.content import black_with_picture, dynamic_contrast, picture_level
from devices.diagnostics.mixing import added_channels, standard_primaries, white_segment
from devices.diagnostics.signal_path import code_steps, frame_rate_control, last_codes, signal_range
from devices.display import DisplayModel, ToneCurve
from devices.readings import Faults, Measurements
from tests.devices.diagnostics.simulated import MODEL, characterisation, readings
from tests.devices.diagnostics.simulated_cable import CHECKS, WIDE, clean, converted, faulty, read_cable

QUIET = Faults(noise=0.001)
# A panel that can show all of sRGB, with the gamma that the simulated compositor takes for its own.
WIDEST = DisplayModel(
    np.array([0.1, 0.1, 0.1]),
    200.0 * rgb_to_xyz_matrix((0.69, 0.31), (0.21, 0.72), (0.145, 0.045), (0.3127, 0.3290)),
    (ToneCurve(gamma=2.2), ToneCurve(gamma=2.2), ToneCurve(gamma=2.2)),
)


@cache
def panel(highest: int = 255, **planted: float) -> Measurements:
    """Return the set read on a panel with the faults planted, once."""
    return read_cable(MODEL, replace(QUIET, **planted), 1, highest)


def _judged(table: Measurements) -> dict[str, Diagnosis]:
    return {one.name: one for one in (check(table) for check in CHECKS)}


def _value(diagnosis: Diagnosis) -> float:
    assert diagnosis.value is not None, diagnosis.words
    return diagnosis.value


@pytest.mark.nightly
def test_displays_without_fault_are_not_accused() -> None:
    """Hundreds of them: tests/stress."""
    assert {name: one.words for name, one in _judged(clean(0)).items() if one.passed is False} == {}


@pytest.mark.parametrize("highest", [255, pytest.param(1023, marks=pytest.mark.nightly)])
def test_everything_is_judged_at_usual_noise(highest: int) -> None:
    found = _judged(panel(highest))
    assert found.pop("standard_primaries").verdict == "no_limit"
    assert all(one.passed for one in found.values()), {name: one.words for name, one in found.items()}
    assert all(one.series and one.source for one in found.values())


@pytest.mark.parametrize(
    ("planted", "check", "says"),
    [
        ({"stretched_range": 1}, "signal_range", "the limited range, 16 to 235"),
        ({"stretched_range": 1}, "code_steps", "stretches the limited range"),
        ({"squeezed_range": 1}, "code_steps", "sends the limited range"),
        ({"panel_bits": 6}, "code_steps", "6 bits reach the eye"),
        pytest.param({"panel_bits": 7}, "code_steps", "7 bits reach the eye", marks=pytest.mark.nightly),
        ({"panel_bits": 6, "frame_rate_control": 0.02}, "frame_rate_control", "alternates between levels"),
        ({"panel_bits": 6, "frame_rate_control": 1e-9}, "last_codes", "253 levels"),
        ({"dynamic_contrast": 0.3}, "dynamic_contrast", "A backlight follows the picture"),
        ({"picture_level_limit": 0.3}, "picture_level", "the picture's mean level"),
        ({"picture_level_limit": 0.3}, "dynamic_contrast", "limited by the picture's mean level"),
        ({"white_segment": 0.3}, "white_segment", "a white one"),
    ],
)
def test_each_fault_is_found_and_named(planted: dict[str, float], check: str, says: str) -> None:
    (judge,) = (one for one in CHECKS if one.__name__ == check)
    found = judge(panel(**planted))
    assert found.passed is False, found.words
    assert says in found.words


def test_figures_are_those_that_were_planted() -> None:
    assert _value(signal_range(panel(stretched_range=1))) == 20
    assert _value(picture_level(panel(picture_level_limit=0.3))) == pytest.approx(30, abs=1)
    assert _value(white_segment(panel(white_segment=0.3))) == pytest.approx(30, abs=1)
    # Patches of a quarter of the codes lose three quarters of what black loses.
    on_black, on_white = 1 - 0.1 * (1 - 0.5), 1.0
    found = _value(dynamic_contrast(panel(dynamic_contrast=0.1)))
    assert found == pytest.approx(100 * (on_white / on_black - 1), abs=3)


def test_a_backlight_that_goes_out_is_found_by_black() -> None:
    grey = DisplayModel(0.001 * MODEL.white_XYZ_cd_m2, MODEL.primaries_XYZ_cd_m2, MODEL.curves)
    found = black_with_picture(read_cable(grey, replace(QUIET, dynamic_contrast=0.95), 1))
    assert found.passed is False
    assert "A backlight follows the picture" in found.words
    assert black_with_picture(read_cable(grey, QUIET, 1)).passed is True


def test_stray_light_is_no_dynamic_contrast() -> None:
    stray = panel(stray_light=0.02)
    assert _value(dynamic_contrast(stray)) < 0.5
    assert "adds 0.47 cd/m²" in dynamic_contrast(stray).words
    assert black_with_picture(stray).passed is True


@pytest.mark.nightly
def test_a_conversion_that_is_exact_gives_the_primaries_of_a_standard() -> None:
    """Nobody can tell a compositor from the monitor's own mode, which does no harm: it is said, and not failed."""
    found = standard_primaries(read_cable(WIDEST, replace(QUIET, compositor=1), 1))
    assert found.verdict == "no_limit"
    assert "converted from sRGB" in found.words
    assert "monitor's own sRGB mode" in found.words
    assert _value(standard_primaries(panel())) > 0.004


def test_primaries_that_add_up_to_no_white_are_not_judged() -> None:
    """One reading with a wild Z: the eye cannot adapt to the sum of the three."""
    table = panel()
    wild = np.array(table.XYZ)
    wild[np.all(table.codes == [0, 0, 1], axis=1), 2] = 1e30
    found = standard_primaries(replace(table, XYZ=wild))
    assert found.passed is None
    assert "no white" in found.words


def test_a_conversion_for_another_tone_response_changes_channels_with_their_level() -> None:
    found = channel_constancy(converted(2, WIDE, None))
    assert found.passed is False
    assert "converted" in found.words
    assert channel_constancy(panel()).passed is True


def test_what_a_channel_adds_is_not_judged_where_light_depends_on_the_picture() -> None:
    found = added_channels(faulty(3, dynamic_contrast=0.3))
    assert found.passed is None
    assert "Dynamic contrast comes first" in found.words


def test_noise_that_hides_a_step_leaves_it_unjudged() -> None:
    noisy = read_cable(MODEL, Faults(noise=0.02), 1)
    assert code_steps(noisy).passed is None
    assert "measure longer" in code_steps(noisy).words
    assert last_codes(noisy).passed is None
    dark = black_with_picture(read_cable(MODEL, Faults(noise=0.001, floor_cd_m2=0.1), 1))
    assert dark.passed is None
    assert "differ too much" in dark.words


def test_one_reading_of_each_code_cannot_show_what_is_noise() -> None:
    table = panel()
    once = table.select(np.array(["#" not in name for name in table.name]))
    assert code_steps(once).passed is None
    assert frame_rate_control(once).passed is None


def test_without_the_set_nothing_is_judged_and_it_is_said_what_to_use() -> None:
    table = characterisation()
    for check in CHECKS:
        if check in (channel_constancy, white_segment, standard_primaries):
            continue
        found = check(table)
        assert found.passed is None
        assert found.words == "Not measured: use display measure --set cable."
    # These know enough of any characterisation.
    assert white_segment(table).passed is True
    assert standard_primaries(table).verdict == "no_limit"


def test_the_set_alone_shows_the_primaries_and_their_mixtures() -> None:
    found = {one.name: one for one in examine([MeasuredSet("cable", panel())])}
    assert found["primaries"].passed is True
    assert found["additivity"].passed is True
    assert found["gamut"].value == pytest.approx(98.4, abs=5)


def test_patches_without_columns_are_read_by_their_names() -> None:
    """Tables of before say the surround in the name alone."""
    light = {level: MODEL.xyz(np.full(3, level)) for level in (0.25, 0.5, 0.75)}
    named = {
        f"grey{round(1000 * level)}@on-{around}": (np.full(3, level), share * XYZ)
        for level, XYZ in light.items()
        for around, share in (("black", 1.0), ("white", 1.1))
    }
    assert _value(dynamic_contrast(readings(named, noise=0.0))) == pytest.approx(10.0)
