"""The sets of patches, and patches from a person's own file.

The order of patches: every one once, black and white again and again, the same for a seed.

The 24 colours asked of a display: the chart's own, adapted, and inside the gamut.
"""

from __future__ import annotations

import itertools
import warnings
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.colour import XYZ_from_xyY, xyY_from_XYZ
from devices.display import DisplayModel, ToneCurve
from devices.errors import DeviceError
from devices.readings import Patch, PatchSet, asked_of, colorchecker_xyY, find_patches, steps
from devices.readings.sets import CHARACTERISATIONS

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
    with pytest.raises(DeviceError) as caught:
        find_patches(_file(tmp_path, text))
    assert finding in str(caught.value)


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
