"""Each fault is found where it is planted, on the display and on its cable, and nowhere else."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from devices.colour import rgb_to_xyz_matrix
from devices.diagnostics import Diagnosis, MeasuredSet, examine
from devices.diagnostics.channels import additivity, channel_constancy, headroom, simple_gamma, tone_response
from devices.diagnostics.colours import chromaticities, primary_colours, spectral_overlap
from devices.diagnostics.content import black_with_picture, dynamic_contrast, picture_level
from devices.diagnostics.drift import drift, repeatability
from devices.diagnostics.eyewear import glasses_transmittance, luminance_loss, transmittance
from devices.diagnostics.gamut_and_model import estimated_codes, gamut, gamut_change, model_difference
from devices.diagnostics.mixing import added_channels, standard_primaries, white_segment
from devices.diagnostics.panel import angular_colour, angular_luminance, pixel_independence
from devices.diagnostics.signal_path import code_steps, frame_rate_control, last_codes, signal_range
from devices.diagnostics.warm_up import warm_up
from devices.display import DisplayModel, EyeModels, ToneCurve
from devices.readings import Faults, Measurements, PatchEye
from documents.arrays import Floats
from tests.devices.diagnostics.simulated import MODEL, characterisation, judged, one_patch, readings, spectra
from tests.devices.diagnostics.simulated_cable import CHECKS, WIDE, converted, faulty, read_cable
from tests.kept import known

# Each fault, planted in a simulated display, is found by its check; a display without it passes.

CLEAN = characterisation()


def _found(diagnosis: Diagnosis) -> float:
    return known(diagnosis.value)


CHARACTERISED = (
    repeatability, drift, warm_up, primary_colours, channel_constancy, additivity, tone_response, headroom,
    chromaticities,
)  # fmt: skip
BY_MODEL = (lambda readings: estimated_codes(readings, MODEL), lambda readings: model_difference(readings, MODEL))
OTHERS = (pixel_independence, angular_colour, angular_luminance, spectral_overlap, gamut)


@pytest.mark.parametrize("check", [*CHARACTERISED, *BY_MODEL])
def test_a_clean_display_passes(check: Callable[[Measurements], Diagnosis]) -> None:
    found = judged(check(CLEAN), True)
    assert found.series


def test_repeatability_is_the_noise_and_not_the_drift() -> None:
    steady = characterisation(noise=0.002, over_time=lambda time: 1 - 0.02 * time / time.max())
    assert _found(repeatability(steady)) == pytest.approx(0.2, abs=0.12)
    shaky = characterisation(noise=0.02)
    assert repeatability(shaky).passed is False
    assert _found(repeatability(characterisation(noise=0.0))) == pytest.approx(0.0, abs=1e-9)


def test_drift_is_told_in_percent_from_first_to_last() -> None:
    falling = characterisation(noise=0.0, over_time=lambda time: 1 - 0.03 * time / time.max())
    found = judged(drift(falling), False)
    assert _found(found) == pytest.approx(3.0, rel=0.05)
    assert "fell" in found.words
    judged(drift(replace(falling, time_s=None)), False, "no times were kept")


def test_warm_up_finds_the_time_constant_and_when_it_is_stable() -> None:
    found = judged(warm_up(one_patch(lambda time: 1 - 0.2 * np.exp(-time / 300), minutes=60, count=31)), True)
    assert known(found.table).rows[0][2] == pytest.approx(5.0, rel=0.05)
    assert _found(found) == pytest.approx(5.0 * np.log(20), rel=0.05)


def test_a_display_that_is_still_warming_up_fails() -> None:
    assert warm_up(one_patch(lambda time: 1 - 0.3 * np.exp(-time / 1800), minutes=30, count=16)).passed is False
    assert warm_up(one_patch(lambda time: 1 + 0.05 * time / time.max(), minutes=30, count=16)).passed is False


def test_a_run_of_seconds_cannot_tell_that_a_display_is_warm() -> None:
    short = warm_up(one_patch(np.ones_like, minutes=16 / 60, count=9))
    assert (short.passed, short.value) == (None, None)
    assert "is not known" in short.words
    assert "within 16 s" in short.words
    assert warm_up(one_patch(np.ones_like, minutes=4.9, count=9)).passed is None
    assert warm_up(one_patch(np.ones_like, minutes=5.0, count=9)).passed is True
    # That it was not warm, seconds can tell.
    assert warm_up(one_patch(lambda time: 1 + 0.05 * time / time.max(), minutes=1, count=16)).passed is False


def _angles(fall: float, tint: float) -> Measurements:
    light = MODEL.xyz(np.ones(3))
    named = {
        f"white@{angle}deg": (np.ones(3), light * (1 - fall * abs(angle) / 30) * [1, 1, 1 + tint * abs(angle) / 30])
        for angle in (-30, -20, -10, 0, 10, 20, 30)
    }
    return readings(named, noise=0.0005)


def test_angles_tell_colour_from_luminance() -> None:
    assert angular_colour(_angles(0.05, 0.02)).passed is True
    assert angular_luminance(_angles(0.05, 0.02)).passed is True
    assert angular_colour(_angles(0.05, 0.5)).passed is False
    dim = judged(angular_luminance(_angles(0.6, 0.0)), False)
    assert _found(dim) == pytest.approx(5.0, abs=0.3)


def test_a_narrow_set_of_angles_is_not_judged() -> None:
    named = {f"white@{angle}deg": (np.ones(3), MODEL.xyz(np.ones(3))) for angle in (0, 5)}
    judged(angular_luminance(readings(named, noise=0.0)), None, "beyond 5°")


def test_swapped_columns_and_dead_channels_are_named() -> None:
    swapped = replace(CLEAN, codes=CLEAN.codes[:, [2, 1, 0]])
    judged(primary_colours(swapped), False, "looks red")
    codes = np.array(CLEAN.codes)
    dead = replace(CLEAN, XYZ=MODEL.xyz(codes * [1, 0, 1]))
    judged(primary_colours(dead), False, "green gives no light")


def test_primaries_alike_fail() -> None:
    alike = DisplayModel(
        MODEL.black_XYZ_cd_m2,
        MODEL.primaries_XYZ_cd_m2 @ np.array([[0.6, 0.45, 0.1], [0.35, 0.5, 0.1], [0.05, 0.05, 0.8]]),
        MODEL.curves,
    )
    assert primary_colours(characterisation(light=alike.xyz)).passed is False


def test_channel_constancy_finds_a_channel_that_shifts() -> None:
    def shifting(codes: Floats) -> Floats:
        light = MODEL.xyz(codes)
        light[:, 2] += 0.5 * codes[:, 0] * (1 - codes[:, 0])  # red's Z is largest half way up
        return light

    judged(channel_constancy(characterisation(light=shifting)), False, "red moves most")


def test_black_is_no_fault_of_the_channels() -> None:
    grey = DisplayModel(np.array([0.3, 0.3, 0.4]), MODEL.primaries_XYZ_cd_m2, MODEL.curves)
    assert channel_constancy(characterisation(noise=0.0, light=grey.xyz)).passed is True
    assert _found(additivity(characterisation(noise=0.0, light=grey.xyz))) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("strength", [0.05, -0.05])
def test_additivity_finds_interaction(strength: float) -> None:
    def interacting(codes: Floats) -> Floats:
        return np.asarray(MODEL.xyz(codes) * (1 + strength * codes.min(axis=1))[:, None])

    found = judged(additivity(characterisation(light=interacting)), False)
    assert _found(found) == pytest.approx(5.0, abs=1.0)
    assert "255 255 255" in [row[0] for row in known(found.table).rows]


def test_tone_response_finds_a_fall_and_tells_gamma() -> None:
    found = tone_response(CLEAN)
    gammas = {row[0]: row[1] for row in known(found.table).rows}
    assert gammas["red"] == pytest.approx(1.8132, abs=0.01)
    assert gammas["blue"] == pytest.approx(1.7156, abs=0.01)

    def dipping(codes: Floats) -> Floats:
        bent = np.where(np.abs(codes - 150 / 255) < 0.01, codes - 0.08, codes)
        return MODEL.xyz(bent)

    assert tone_response(characterisation(light=dipping)).passed is False


def test_simple_gamma_is_that_of_scipy_s_search() -> None:
    levels = np.linspace(0.05, 1, 20)
    light = levels**2.2 + np.random.default_rng(3).normal(0, 0.02, 20)
    known = minimize_scalar(lambda gamma: ((levels**gamma - light) ** 2).sum(), bounds=(0.2, 8.0), method="bounded")
    assert simple_gamma(levels, light)[0] == pytest.approx(known.x, abs=1e-4)  # as near as that search comes
    assert simple_gamma(levels, np.append(np.zeros(19), 1.0))[0] == 8.0


def test_headroom_finds_a_clipped_top() -> None:
    found = judged(headroom(characterisation(light=lambda codes: MODEL.xyz(np.minimum(codes, 0.95)))), False)
    assert _found(found) == pytest.approx(0.0, abs=0.6)
    assert found.at_least


def test_chromaticities_find_what_no_sum_of_primaries_can_be() -> None:
    def spilling(codes: Floats) -> Floats:
        light = MODEL.xyz(codes)
        light[:, 0] += 0.6 * codes[:, 0] * (1 - codes[:, 0]) * 4  # redder than red, half way up
        return light

    judged(chromaticities(characterisation(light=spilling)), False)
    negative = np.array(CLEAN.XYZ)
    negative[5, 2] = -0.01
    judged(chromaticities(replace(CLEAN, XYZ=negative)), False, "negative")


def test_a_share_of_variance_below_zero_is_explained_and_no_percentage() -> None:
    found = estimated_codes(characterisation(light=lambda codes: MODEL.xyz(1 - codes)), MODEL)
    assert known(found.value) < 0
    assert "R² is below 0" in found.words
    assert "%" not in found.words


def test_estimated_codes_and_colours_find_a_wrong_model() -> None:
    wrong = DisplayModel(
        MODEL.black_XYZ_cd_m2,
        MODEL.primaries_XYZ_cd_m2,
        (ToneCurve(gamma=2.2), ToneCurve(gamma=2.2), ToneCurve(gamma=2.2)),
    )
    assert estimated_codes(CLEAN, wrong).passed is False
    assert model_difference(CLEAN, wrong).passed is False
    exact = characterisation(noise=0.0)
    assert _found(estimated_codes(exact, MODEL)) == pytest.approx(1.0, abs=1e-9)
    assert _found(model_difference(exact, MODEL)) == pytest.approx(0.0, abs=1e-6)


def test_gamut_is_told_and_its_change_judged() -> None:
    told = judged(gamut(CLEAN), None)
    assert 90 < _found(told) < 105
    assert _found(gamut_change(CLEAN, CLEAN, "a", "b")) == pytest.approx(0, abs=1e-12)
    pale = DisplayModel(MODEL.black_XYZ_cd_m2, MODEL.primaries_XYZ_cd_m2 @ (0.9 * np.eye(3) + 0.05), MODEL.curves)
    judged(gamut_change(characterisation(light=pale.xyz), CLEAN, "pale", "usual"), False, "smaller")


def test_glasses_are_found_from_pairs() -> None:
    through = characterisation(2, light=lambda codes: MODEL.xyz(codes) * [0.14, 0.15, 0.13])
    found = judged(glasses_transmittance(through, CLEAN), True)
    assert _found(found) == pytest.approx(15.0, rel=0.01)
    assert luminance_loss(through, CLEAN).passed is True
    assert glasses_transmittance(CLEAN, through).passed is False  # swapped
    bent = characterisation(2, light=lambda codes: 0.15 * MODEL.xyz(codes**1.1))
    assert luminance_loss(bent, CLEAN).passed is False


def test_a_display_without_glasses_is_not_failed_for_missing_them() -> None:
    verdicts = {
        mode: glasses_transmittance(replace(CLEAN, mode=mode), CLEAN).verdict
        for mode in ("flat", "side-by-side", "top-bottom", "dual-window", "quad-buffered", "row-interleaved", "")
    }
    assert {mode for mode, verdict in verdicts.items() if verdict == "no_limit"} == {
        "flat", "side-by-side", "top-bottom", "dual-window",
    }  # fmt: skip
    assert {verdict for verdict in verdicts.values()} == {"no_limit", "failed"}
    behind = characterisation(2, light=lambda codes: 0.15 * MODEL.xyz(codes))
    assert glasses_transmittance(replace(behind, mode="side-by-side"), CLEAN).passed is True


def test_spectral_transmittance_is_the_filter_s() -> None:
    def share(waves: Floats) -> Floats:
        return np.asarray(0.15 * np.exp(-(((waves - 560) / 150) ** 2)))

    bare_codes = CLEAN.codes
    waves, bare = spectra(bare_codes)
    without = replace(CLEAN, spectra=bare, wavelengths_nm=waves)
    seen = spectra(bare_codes, share)[1][:, ::2]
    through = replace(CLEAN, spectra=seen, wavelengths_nm=waves[::2])
    found = known(transmittance(through, without, (1.0, 1.0, 1.0)))
    at, through_share = found
    assert np.abs(through_share - share(at)).max() < 1e-12
    assert _found(spectral_overlap(without)) < 50
    assert transmittance(CLEAN, without, (1.0, 1.0, 1.0)) is None


def test_overlapping_spectra_fail() -> None:
    waves, light = spectra(CLEAN.codes)
    linear = np.stack([curve.linear(CLEAN.codes[:, i]) for i, curve in enumerate(MODEL.curves)], axis=1)
    wide = np.array([np.exp(-(((waves - peak) / 80) ** 2)) for peak in (580.0, 550.0, 455.0)])
    assert spectral_overlap(replace(CLEAN, spectra=light, wavelengths_nm=waves)).passed is True
    judged(spectral_overlap(replace(CLEAN, spectra=linear @ wide, wavelengths_nm=waves)), False, "red and green")


@pytest.mark.parametrize("check", [*CHARACTERISED, *OTHERS])
def test_nothing_is_judged_by_too_little(check: Callable[[Measurements], Diagnosis]) -> None:
    found = check(CLEAN.select(np.arange(3)))
    assert (found.passed, found.value) == (None, None)
    assert found.words.endswith(".")


# What stands between codes and light is found where it is planted, and not on displays of any usual kind.

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
    judged(judge(panel(**planted)), False, says)


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
    judged(standard_primaries(replace(table, XYZ=wild)), None, "no white")


def test_a_conversion_for_another_tone_response_changes_channels_with_their_level() -> None:
    judged(channel_constancy(converted(2, WIDE, None)), False, "converted")
    assert channel_constancy(panel()).passed is True


def test_what_a_channel_adds_is_not_judged_where_light_depends_on_the_picture() -> None:
    judged(added_channels(faulty(3, dynamic_contrast=0.3)), None, "Dynamic contrast comes first")


def test_noise_that_hides_a_step_leaves_it_unjudged() -> None:
    noisy = read_cable(MODEL, Faults(noise=0.02), 1)
    assert code_steps(noisy).passed is None
    assert "measure longer" in code_steps(noisy).words
    assert last_codes(noisy).passed is None
    judged(black_with_picture(read_cable(MODEL, Faults(noise=0.001, floor_cd_m2=0.1), 1)), None, "differ too much")


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
        found = judged(check(table), None)
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


# Readings that no display gives: every check answers with a verdict or a reason, in finite numbers.

NAMES = ["white", "black", "red", "a@r1c1", "a@r1c2", "a@r2c1", "a@0deg", "a@20deg", "a@v-5deg", "a@on-white"]
NAMES += ["a@on-black", "black@other=white", "black@other=red", "x@r99c99", "b@90000deg"]
EYES: list[PatchEye] = ["left", "right", "both"]
light = st.one_of(st.sampled_from([0.0, -1.0, 1e-30, 1e30, 1.0, 5.0]), st.floats(-1e6, 1e6))


@st.composite
def tables(draw: st.DrawFn) -> Measurements:
    count = draw(st.integers(1, 24))
    code = st.sampled_from([0.0, 0.25, 0.5, 0.75, 1.0])
    codes = draw(st.lists(st.tuples(code, code, code), min_size=count, max_size=count))
    xyz = draw(st.lists(st.tuples(light, light, light), min_size=count, max_size=count))
    names = draw(st.lists(st.sampled_from(NAMES), min_size=count, max_size=count))
    eyes = draw(st.lists(st.sampled_from(EYES), min_size=count, max_size=count))
    times = draw(st.none() | st.lists(st.sampled_from([0.0, 1.0, 2.0, 60.0, 1e9]), min_size=count, max_size=count))
    spectra = np.abs(np.array(xyz)) if draw(st.booleans()) else None
    waves = None if spectra is None else np.array([450.0, 550.0, 650.0])
    time_s = None if times is None else np.array(times)
    return Measurements(np.array(codes), np.array(xyz), tuple(names), time_s, tuple(eyes), "", spectra, waves)


# More of them: tests/stress.
@settings(max_examples=3, deadline=None)
@given(tables(), st.booleans())
def test_any_readings_get_an_answer(table: Measurements, against_clean: bool) -> None:
    check_answers(table, against_clean)


def check_answers(table: Measurements, against_clean: bool) -> None:
    """Assert that every check of ``table`` answers, beside a clean display or itself without glasses."""
    other = MeasuredSet("other", characterisation() if against_clean else table)
    found = examine([MeasuredSet("a", table), other], models=EyeModels(MODEL, MODEL), without_glasses=other)
    json.dumps([one.to_json() for one in found], allow_nan=False)
    for one in found:
        assert one.words
        assert one.value is None or np.isfinite(one.value)
        assert one.passed is None or one.value is not None or one.passed is False


@cache
def cable_table(noise: float, seed: int) -> Measurements:
    """Return a simulated set ``cable``: a second each on a busy machine, and few are different."""
    return read_cable(MODEL, Faults(noise=noise), seed)


@st.composite
def cable_tables(draw: st.DrawFn) -> Measurements:
    """The set ``cable`` with readings left out, and with light that no display gives."""
    table = cable_table(draw(st.sampled_from([0.0, 0.002, 0.5])), 3)
    rng = np.random.default_rng(draw(st.integers(0, 1000)))
    changed = np.array(table.XYZ)
    how = draw(st.sampled_from(["some", "all alike", "none", "negative", "reversed", "huge"]))
    if how == "some":
        rows = rng.random(len(table)) < 0.1
        changed[rows] = rng.choice([0.0, -1.0, 1e-30, 1e30, 5.0], (int(rows.sum()), 3))
    elif how in ("all alike", "none"):
        changed[:] = 1.0 if how == "all alike" else 0.0
    else:
        changed = {"negative": -changed, "reversed": changed.max() - changed, "huge": 1e250 * changed}[how]
    kept = rng.random(len(table)) < draw(st.sampled_from([0.2, 0.7, 1.0]))
    return replace(table, XYZ=changed).select(np.flatnonzero(kept | (np.arange(len(table)) == 0)))


@pytest.mark.nightly
@settings(max_examples=15, deadline=None)
@given(cable_tables())
def test_any_readings_of_the_set_cable_get_an_answer(table: Measurements) -> None:
    check_cable_answers(table)


def test_a_wild_reading_of_a_primary_gets_an_answer() -> None:
    """Of this table one reading of full blue has a Z of 1e30."""
    table = cable_table(0.5, 3)
    rng = np.random.default_rng(7)
    wild, rows = np.array(table.XYZ), rng.random(len(table)) < 0.1
    wild[rows] = rng.choice([0.0, -1.0, 1e-30, 1e30, 5.0], (int(rows.sum()), 3))
    check_cable_answers(replace(table, XYZ=wild))


def check_cable_answers(table: Measurements) -> None:
    """Assert that every check of what codes pass on their way answers in finite numbers."""
    for one in (check(table) for check in CHECKS):
        json.dumps(one.to_json(), allow_nan=False)
        assert one.words
        assert one.value is None or np.isfinite(one.value)
