"""The sets of patches: a person's own, the shipped ones, and those for single diagnoses."""

from __future__ import annotations

import itertools
import re
import warnings
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from devices.colour import XYZ_from_xyY, xyY_from_XYZ
from devices.diagnostics import Diagnosis, MeasuredSet, examine
from devices.diagnostics.room_light import room_lights
from devices.display import DisplayModel, EyeModels, ToneCurve
from devices.errors import DeviceError
from devices.readings import (
    Arrangement,
    Faults,
    GridCell,
    Measurements,
    Patch,
    PatchEye,
    PatchOnScreen,
    PatchSet,
    Simulated,
    SimulatedDisplay,
    asked_of,
    colorchecker_xyY,
    find_patches,
    find_sets,
    steps,
)
from devices.readings.sets import CHARACTERISATIONS, DIAGNOSTIC
from tests.devices.diagnostics.simulated import MODEL

# The sets of patches, and patches from a person's own file.
#
# The order of patches: every one once, black and white again and again, the same for a seed.
#
# The 24 colours asked of a display: the chart's own, adapted, and inside the gamut.

SRGB = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]) * 100.0
NARROW = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])


def test_table_c1_holds_the_thesis_patches() -> None:
    patches = {patch.name: patch.codes for patch in find_patches("table_c1").patches}
    assert len(patches) == 120
    names = [name.rstrip("0123456789") for name in patches]
    counts = {name: names.count(name) for name in set(names)}
    assert counts == {
        "red": 26, "green": 26, "blue": 26, "gray": 25, "yellow": 5, "cyan": 5, "magenta": 5, "black": 1, "white": 1,
    }  # fmt: skip
    assert patches["red250"] == (250 / 255, 0, 0)
    assert patches["cyan150"] == (0, 150 / 255, 150 / 255)
    assert patches["gray120"] == (120 / 255,) * 3
    assert patches["white"] == (1, 1, 1)


@pytest.mark.parametrize("name", list(CHARACTERISATIONS))
def test_every_set_has_black_and_white_and_no_colour_twice(name: str) -> None:
    codes = [patch.rounded(255).codes for patch in find_patches(name).patches]
    assert len(set(codes)) == len(codes)
    assert (0.0, 0.0, 0.0) in codes
    assert (1.0, 1.0, 1.0) in codes


def test_half_of_the_dark_set_lies_in_the_lowest_quarter_of_codes() -> None:
    codes = [max(patch.codes) for patch in find_patches("dark").patches]
    assert sum(code <= 0.25 for code in codes) >= len(codes) / 2


def test_the_nearest_name_is_told() -> None:
    with pytest.raises(DeviceError, match="did you mean 'table_c1'"):
        find_patches("table_c")


def _file(tmp_path: Path, text: str) -> str:
    (tmp_path / "own.csv").write_text(text, encoding="utf-8")
    return str(tmp_path / "own.csv")


def test_a_file_declares_its_range(tmp_path: Path) -> None:
    own = find_patches(_file(tmp_path, "# codes: 0..1023\nname,red,green,blue\na,1023,0,512\nb,0,3,0\n"))
    assert own.patches == (Patch("a", (1.0, 0.0, 512 / 1023)), Patch("b", (0.0, 3 / 1023, 0.0)))


def test_the_option_goes_before_what_the_file_says(tmp_path: Path) -> None:
    file = _file(tmp_path, "# codes: 0..1023\nname,red,green,blue\na,200,0,0\n")
    assert find_patches(file, "0..200").patches[0].codes == (1.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("text", "finding"),
    [
        ("name,red,green,blue\na,12,3,4\n", "declare it"),
        ("# codes: 0..255\nname,red,green,blue\na,256,0,0\n", "own.csv:3:2: the code 256 lies outside"),
        ("# codes: 0..255\nname,red,green,blue\na,1,x,0\n", "own.csv:3:3: green is 'x'"),
        ("# codes: 0..255\nname,red,green,blue\na,1,nan,0\n", "own.csv:3:3: green is 'nan'"),
        ("# codes: 0..255\nname,red,green,blue\na,1,2,0\nb,1,2\n", "own.csv:4: the line has 3 fields"),
        ("# codes: 0..255\nname,red,green,blue\na,1,2,0\na,1,2,1\n", "own.csv:4: 'a' stands in line 3 too"),
        ("# codes: 0..255\nname,red,green\na,1,2\n", "own.csv:2: the header has no blue"),
        ("# codes: up\nname,red,green,blue\na,1,2,3\n", "own.csv:1: 'up' is no range"),
        ("", "has no rows"),
    ],
)
def test_a_wrong_file_names_its_place(tmp_path: Path, text: str, finding: str) -> None:
    with pytest.raises(DeviceError, match=re.escape(finding)):
        find_patches(_file(tmp_path, text))


def test_a_patch_is_rounded_to_codes_of_the_surface() -> None:
    assert Patch("a", (0.1, 0.5, 1.0)).rounded(255).codes == (26 / 255, 128 / 255, 1.0)
    assert Patch("a", (0.1, 0.5, 1.0)).rounded(1023).codes == (102 / 1023, 512 / 1023, 1.0)


@pytest.mark.parametrize(("name", "code"), [("a#2", 0.5), ("", 0.5), ("a", 1.1), ("a", -0.1), ("a", float("nan"))])
def test_a_patch_refuses_what_cannot_be(name: str, code: float) -> None:
    with pytest.raises(DeviceError):
        Patch(name, (code, 0.0, 0.0))


def test_a_set_refuses_a_name_twice_and_no_patches() -> None:
    with pytest.raises(DeviceError, match="called 'a'"):
        PatchSet("s", (Patch("a", (0.0, 0.0, 0.0)), Patch("a", (0.1, 0.0, 0.0))))
    with pytest.raises(DeviceError, match="no patches"):
        PatchSet("s", ())


@settings(max_examples=15)
@given(st.sampled_from(list(CHARACTERISATIONS)), st.integers(0, 99), st.integers(0, 40))
def test_every_patch_once_and_black_and_white_throughout(name: str, seed: int, every: int) -> None:
    patches = find_patches(name)
    order = steps(patches, seed, every)
    counts = Counter(step.patch for step in order)
    assert set(counts) == set(patches.patches)
    for patch, count in counts.items():
        if patch.name not in ("black", "white"):
            assert count == 1
    if every:
        others = len(patches.patches) - 2
        assert counts[Patch("white", (1.0, 1.0, 1.0))] == 1 + -(-others // every)
        whites = [step.position for step in order if step.patch.name == "white"]
        assert all(after - before <= every + 2 for before, after in itertools.pairwise(whites))
        assert [step.patch.name for step in order[:2]] == ["black", "white"]
        assert [step.patch.name for step in order[-2:]] == ["black", "white"]
    else:
        assert len(order) == len(patches.patches)
    assert [step.position for step in order] == list(range(len(order)))
    labels = [step.label for step in order]
    assert len(set(labels)) == len(labels)
    assert order == steps(patches, seed, every)


def test_another_seed_is_another_order() -> None:
    patches = find_patches("table_c1")
    assert steps(patches, 1) != steps(patches, 2)
    assert [step.patch for step in steps(patches, 1, 0, shuffled=False)] == list(patches.patches)


def test_labels_count_the_showings() -> None:
    whites = [step.label for step in steps(find_patches("grey"), 1) if step.patch.name == "white"]
    assert whites == ["white", "white#2", "white#3", "white#4"]


def test_wrong_repeats_are_refused() -> None:
    with pytest.raises(DeviceError, match="repeated every -1"):
        steps(find_patches("grey"), 1, -1)
    with pytest.raises(DeviceError, match="'white' has other codes"):
        steps(PatchSet("s", (Patch("white", (0.9, 0.9, 0.9)),)), 1)


def _model(primaries: np.ndarray, gain: float = 1.0, lift: float = 0.0, black: float = 0.1) -> DisplayModel:
    curve = ToneCurve(gain, 0.0, 2.2, lift)
    return DisplayModel(np.full(3, black), primaries, (curve, curve, curve))


def test_the_colours_are_those_of_colour_science() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import colour
    chart = colour.CCS_COLOURCHECKERS["ColorChecker24 - After November 2014"]
    names, xyY = colorchecker_xyY()
    assert [name.split("(")[0].strip().lower() for name in chart.data] == list(names)
    np.testing.assert_allclose(xyY, np.array(list(chart.data.values())), atol=1e-6)


@pytest.mark.parametrize("gain", [0.95, 1.0, 1.08])
@pytest.mark.parametrize("lift", [0.0, 0.01])
@pytest.mark.parametrize("primaries", [SRGB, NARROW], ids=["srgb", "narrow"])
def test_every_colour_lies_in_the_gamut(primaries: np.ndarray, gain: float, lift: float) -> None:
    model = _model(primaries, gain, lift)
    asked = asked_of(model)
    assert len(asked) == 24
    XYZ = np.array([colour.XYZ_cd_m2 for colour in asked])
    np.testing.assert_allclose(model.xyz(model.code(XYZ)), XYZ, rtol=1e-9)


def test_an_srgb_display_lacks_only_the_cyan() -> None:
    assert [colour.name for colour in asked_of(_model(SRGB, black=0.0)) if colour.desaturated] == ["cyan"]


def test_colours_that_fit_keep_the_charts_chromaticity_adapted_as_colour_science_does() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from colour.adaptation import chromatic_adaptation_VonKries
    model = _model(SRGB, black=0.0)
    _, xyY = colorchecker_xyY()
    white = model.white_XYZ_cd_m2
    d50 = XYZ_from_xyY([0.345703, 0.358539, 1.0])
    expected = chromatic_adaptation_VonKries(XYZ_from_xyY(xyY), d50, white / white[1], transform="Bradford")
    for colour_, theirs in zip(asked_of(model), expected, strict=True):
        if not colour_.desaturated:
            np.testing.assert_allclose(xyY_from_XYZ(colour_.XYZ_cd_m2)[:2], xyY_from_XYZ(theirs)[:2], atol=2e-5)
            np.testing.assert_allclose(colour_.XYZ_cd_m2[1] / white[1], theirs[1], rtol=2e-4)


def test_a_desaturated_colour_keeps_its_luminance() -> None:
    model = _model(NARROW, black=0.0)
    asked = {colour.name: colour for colour in asked_of(model)}
    names, xyY = colorchecker_xyY()
    cyan, white = asked["cyan"], asked["white 9.5"]
    assert cyan.desaturated
    ratio = xyY[names.index("cyan"), 2] / xyY[names.index("white 9.5"), 2]
    # Bradford's transform moves luminances of colours a little.
    assert cyan.XYZ_cd_m2[1] / white.XYZ_cd_m2[1] == pytest.approx(ratio, rel=0.06)


# The sets for single diagnoses: read with a simulated display, each is judged, passes, and finds its own fault.
#
# Sets of patches, read with a simulated instrument as a measurement reads them, without a screen.
def read_sets(
    names: tuple[str, ...], faults: Faults, eye: PatchEye = "both", seed: int = 1, room: ArrayLike = (0.0, 0.0, 0.0)
) -> Measurements:
    """Read the sets as `display measure` does, 15 s a patch."""
    model = MODEL.in_room(room)
    instrument = Simulated(SimulatedDisplay(EyeModels(model, model)), seed, faults, eye)
    taken, time_s, now_s = [], [], 0.0
    shown = steps(find_sets(names), seed, eye=eye)
    for step in shown:
        patch = step.patch
        now_s += max(15.0, patch.wait_s)
        black = (0.0, 0.0, 0.0)
        other = patch.other if patch.other is not None else patch.codes if eye == "both" else black
        place = (0.5, 0.5) if patch.place is None else patch.place.centre
        showing = PatchOnScreen(step.label, patch.codes, step.position, now_s, other, patch, place)
        taken.append(instrument.read(showing).XYZ_cd_m2)
        time_s.append(now_s)
    return Measurements(
        np.array([step.patch.codes for step in shown]), np.array(taken), tuple(step.patch.name for step in shown),
        np.array(time_s), tuple(step.patch.eye or eye for step in shown),
        area=np.array([step.patch.filled for step in shown]),
        surround=np.array([step.patch.surround for step in shown]),
    )  # fmt: skip


def _judged(table: Measurements) -> dict[str, Diagnosis]:
    return {one.name: one for one in examine([MeasuredSet("m", table)])}


@pytest.mark.parametrize("eye", ["both", pytest.param("left", marks=pytest.mark.nightly)])
def test_all_sets_let_every_check_be_made_and_a_display_without_fault_passes(eye: PatchEye) -> None:
    found = _judged(read_sets(("all",), Faults(noise=0.001, glasses_loss=0.85), eye))
    undecided = {name for name, one in found.items() if one.passed is None}
    # Spectra are not simulated; a gamut, a contrast and primaries of a standard are numbers without a verdict.
    ours = undecided - {"observer_metamerism"}  # of an extension
    assert ours == {"spectral_overlap", "gamut", "room_light", "standard_primaries"}
    failed = {name: one.value for name, one in found.items() if one.passed is False}
    # Taking the glasses off moves the gamut by nothing here; nothing else is planted either.
    assert failed == {}


@pytest.mark.parametrize(
    ("name", "check", "fault", "value"),
    [
        ("crosstalk", "crosstalk", {"crosstalk": 0.08}, 8.0),
        ("uniformity", "uniformity", {"edge_loss": 0.5}, 100 * 0.5 * 4 / 9),
        ("on-white", "pixel_independence", {"surround_gain": 0.05}, 5.0),
        ("additivity", "additivity", {"additivity_loss": 0.08}, 8.7),
        ("repeatability", "repeatability", {"noise": 0.01}, 1.0),
        ("warm-up", "warm_up", {"warm_up_loss": 0.9}, None),
        ("glasses", "glasses_transmittance", {"glasses_loss": 0.4}, 60.0),
        ("angles", "angular_luminance", {"angle_loss": 1.0}, 9.5),
    ],
)  # fmt: skip
def test_each_set_finds_its_own_fault(name: str, check: str, fault: dict[str, float], value: float | None) -> None:
    found = _judged(read_sets((name,), Faults(**{"noise": 0.001, **fault})))[check]
    assert found.passed is False
    if value is not None:
        assert found.value == pytest.approx(value, rel=0.15)


def test_negative_crosstalk_is_found_and_told_in_words() -> None:
    found = _judged(read_sets(("crosstalk",), Faults(noise=0.001, crosstalk=-0.03)))["crosstalk"]
    assert found.passed is True
    assert found.value == pytest.approx(3.0, abs=0.4)
    assert "negative crosstalk" in found.words
    assert "were left out of the matrix" in found.words
    numbers = [float(number) for number in re.findall(r"-?\d\.\d{6}", found.output)]
    assert numbers[0] == pytest.approx(-0.03, abs=0.004)
    assert _judged(read_sets(("crosstalk",), Faults(noise=0.001, crosstalk=-0.08)))["crosstalk"].passed is False
    none = _judged(read_sets(("crosstalk",), Faults(noise=0.005)))["crosstalk"]
    assert "negative" not in none.words


def test_the_room_s_light_is_read_with_the_display_switched_off() -> None:
    ambient = np.array([0.3, 0.32, 0.27])
    table = read_sets(("grey", "ambient"), Faults(noise=0.001), room=ambient)
    found = room_lights(table)["both"]
    assert found.readings == 3
    assert found.held
    assert found.ambient_XYZ_cd_m2 == pytest.approx(ambient, rel=0.01)
    start = Arrangement("left")
    off = Arrangement("left", screen_off=True)
    assert "switch the display off" in off.request(start)
    assert start.request(off).startswith("Switch the display on again")


def test_a_set_leaves_the_plain_readings_alone() -> None:
    """What is read for a diagnosis never looks like a reading of the display as it is characterised."""
    from devices.diagnostics import plain

    told = ("crosstalk", "uniformity", "on-white", "warm-up", "angles")
    assert len(plain(read_sets(told, Faults()))) == 0
    assert {name for name in plain(read_sets(("glasses",), Faults())).name if "@" in name} == set()


@pytest.mark.parametrize("eye", ["both", "left", "right"])
def test_the_instrument_is_moved_once_for_each_arrangement(eye: PatchEye) -> None:
    order = steps(find_sets(("all",)), 3, eye=eye)
    stood = [arrangement for arrangement, _ in itertools.groupby(step.patch.arrangement(eye) for step in order)]
    assert len(stood) == len(set(stood))
    assert stood[0] == Arrangement(eye)
    assert len({step.label for step in order}) == len(order)


START, CORNER, SIDE = Arrangement("left"), Arrangement("left", GridCell(1, 3)), Arrangement("left", angle="v-10deg")

BARE = Arrangement("left", glasses=False)


@pytest.mark.parametrize(
    ("before", "after", "request_"),
    [
        (START, START, "^$"),
        (START, CORNER, "at the patch .row 1, column 3: top right"),
        (CORNER, START, "at the middle of the screen"),
        (START, Arrangement("right"), "^Put the right lens"),
        (START, BARE, "^Take the glasses away"),
        (BARE, START, "^Put the glasses .* again. Put the left lens"),
        (START, SIDE, "middle of the screen from 10° below"),
        (SIDE, START, "straight ahead"),
    ],
)
def test_what_a_person_must_do_is_told(before: Arrangement, after: Arrangement, request_: str) -> None:
    assert re.search(request_, after.request(before))


def test_wrong_patches_are_refused() -> None:
    with pytest.raises(DeviceError, match="which eye is read"):
        Patch("a", (0.0, 0.0, 0.0), other=(1.0, 1.0, 1.0))
    with pytest.raises(DeviceError, match="cannot wait"):
        Patch("a", (0.0, 0.0, 0.0), wait_s=float("inf"))
    with pytest.raises(DeviceError, match="three in"):
        Patch("a", (0.0, 0.0, 0.0), around=(2.0, 0.0, 0.0))
    with pytest.raises(DeviceError, match="no row 4"):
        GridCell(4, 1)
    with pytest.raises(DeviceError, match="did you mean 'uniformity'"):
        find_sets(("unifomity",))
    with pytest.raises(DeviceError, match="no set"):
        find_sets(())


def test_sets_are_named_once_and_all_holds_one_for_each_diagnosis() -> None:
    assert [one.name for one in find_sets(("grey", "uniformity", "grey"))] == ["grey", "uniformity"]
    assert set(DIAGNOSTIC) - {"warm-up-places"} <= {one.name for one in find_sets(("all",))}


def test_the_places_of_a_warm_up_are_read_round_after_round() -> None:
    (places,) = find_sets(("warm-up-places",), every_s=60.0)
    order = steps((places, find_sets(("warm-up",))[0]), 5)
    assert [step.label for step in order[:4]] == [
        "gray120@warm-up-r2c1",
        "gray120@warm-up-r2c2",
        "gray120@warm-up-r2c3",
        "gray120@warm-up-r2c1#2",
    ]
    assert [step.patch.wait_s for step in order[:4]] == [60.0, 0.0, 0.0, 60.0]
    assert len(order) == 21 + 31
    assert steps(places, 1) == steps(places, 2)
