"""The display model and its file."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from devices.display import DisplayModel, ToneCurve, read_display, read_rig
from devices.errors import DeviceError
from documents import InputError

ROOT = Path(__file__).parents[3]
ASUS = ROOT / "configs/displays/asus_vg248qe.yaml"


def test_the_shipped_display_is_the_thesis_s() -> None:
    model = read_display(ASUS).models("side-by-side").left
    assert np.array_equal(model.primaries_XYZ_cd_m2, [[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])
    white = model.white_XYZ_cd_m2
    assert white[1] == pytest.approx(26.47)
    assert np.round(white[:2] / white.sum(), 4) == pytest.approx([0.3117, 0.3151])
    # Expression 3.13, the printed inverse, to its digits.
    printed = [[0.12645, -0.06383, -0.01980], [-0.03808, 0.07320, 0.00189], [-0.00021, -0.00291, 0.03453]]
    assert np.abs(model.linear_from_XYZ - printed).max() < 5e-5


@given(st.lists(st.floats(0.05, 0.95), min_size=3, max_size=3))
def test_code_undoes_xyz(code: list[float]) -> None:
    model = DisplayModel(
        np.array([0.05, 0.06, 0.08]),
        np.array([[40.0, 35, 18], [20, 70, 7], [2, 11, 95]]),
        (ToneCurve(0.98, 0.02, 2.1), ToneCurve(1.0, 0.0, 2.3), ToneCurve(0.95, 0.05, 1.9)),
    )
    assert np.abs(model.code(model.xyz(code)) - code).max() < 1e-9


def test_clipping_counts_pixels_and_channels() -> None:
    model = read_display(ASUS).models("quad-buffered").left
    linear = np.array([[0.5, 0.5, 0.5], [1.2, 0.5, 0.5], [0.5, -0.1, 0.5], [1.5, 1.5, -0.5], [0.0, 1.0, 0.0]])
    found = model.clipping(linear @ model.primaries_XYZ_cd_m2.T)
    # Red gives 0.001 at code 0, for its offset: the green of linear light (0, 1, 0) has not enough of none.
    assert (found.pixels, found.red, found.green, found.blue) == (5, 3, 2, 1)
    assert (found.any_channel, found.above_full) == (4, 2)
    assert found.percent(found.any_channel) == pytest.approx(80.0)


# A CRT's file: curves with an offset of 0.25 and a black of 0, so that code 0 is far from dark.
CRT = DisplayModel(
    np.zeros(3),
    np.array([[40.0, 35, 18], [20, 70, 7], [2, 11, 95]]),
    (ToneCurve(0.75, 0.25, 2.1), ToneCurve(0.75, 0.25, 2.1), ToneCurve(0.75, 0.25, 2.1)),
)


def test_light_below_that_of_code_0_counts() -> None:
    black = CRT.xyz([0.0, 0.0, 0.0])
    assert black[1] > 5.0
    grey = 0.5 / black[1] * black
    found = CRT.clipping(np.stack([grey, 0.999 * black, 1.001 * black]))
    assert (found.any_channel, found.red, found.above_full) == (2, 2, 0)
    assert CRT.code(grey) == pytest.approx(0.0, abs=1e-12)
    assert CRT.shown_black_XYZ_cd_m2 == pytest.approx(black)


def test_the_shipped_display_s_nominal_white_counts_and_the_white_that_it_shows_does_not() -> None:
    """Red ends at 0.983 of its light and blue at 0.991; green goes on to 1.082."""
    model = read_display(ASUS).models("quad-buffered").left
    found = model.clipping(model.white_XYZ_cd_m2)
    assert (found.red, found.green, found.blue, found.above_full) == (1, 0, 1, 1)
    assert model.clipping(model.shown_white_XYZ_cd_m2).any_channel == 0
    assert model.shown_white_XYZ_cd_m2 == pytest.approx(model.xyz([1.0, 1.0, 1.0]), abs=1e-12)
    assert model.code(model.shown_white_XYZ_cd_m2) == pytest.approx(1.0, abs=1e-12)


_curves = st.builds(ToneCurve, st.floats(0.6, 1.1), st.floats(-0.1, 0.3), st.floats(1.2, 2.8), st.floats(-0.02, 0.05))


@given(st.tuples(_curves, _curves, _curves), st.lists(st.sampled_from([0.0, 1.0, 0.3]), min_size=3, max_size=3))
@example(
    (
        ToneCurve(1.03125, 0.265625, 1.59375, 0.0019028489442997239),
        ToneCurve(1.0918943176931264, 0.25, 1.5, 0.0019028489442997239),
        ToneCurve(1.0, 0.125, 1.201171875, 0.0),
    ),
    [1.0, 1.0, 1.0],
)
def test_a_colour_at_a_limit_is_inside_however_it_was_stored(
    curves: tuple[ToneCurve, ToneCurve, ToneCurve], code: list[float]
) -> None:
    """X, Y and Z are each rounded up or down to single precision: less than one unit in the last place."""
    model = DisplayModel(np.array([0.05, 0.06, 0.08]), CRT.primaries_XYZ_cd_m2, curves)
    asked = model.xyz(code)
    nearest = asked.astype(np.float32)
    below = np.where(nearest <= asked, nearest, np.nextafter(nearest, np.float32(-np.inf)))
    up = np.random.default_rng(0).random((50, 3)) < 0.5
    stored = np.where(up, np.nextafter(below, np.float32(np.inf)), below).astype(np.float64)
    assert model.clipping(np.stack([asked, asked.astype(np.float32)])).any_channel == 0
    assert model.clipping(stored).any_channel == 0
    off = model.primaries_XYZ_cd_m2[:, 0] * 1e-4
    assert model.clipping(model.xyz([0.0, 0.3, 0.3]) - off).red == 1
    assert model.clipping(model.xyz([1.0, 0.3, 0.3]) + off).above_full == 1


@given(st.tuples(_curves, _curves, _curves), st.integers(0, 2**32 - 1))
@example((ToneCurve(), ToneCurve(), ToneCurve(1.0, 5e-7, 2.75, 0.03125)), 0)
@example((ToneCurve(0.7424347523464738, 0.020182255892930014, 2.1, 0.008),) * 3, 1)  # off by 1.2e-6 of the light
def test_a_normalised_model_is_the_same_display(curves: tuple[ToneCurve, ToneCurve, ToneCurve], seed: int) -> None:
    """A code near zero of a curve without offset hardly changes the light: there the light says what the code is."""
    model = DisplayModel(np.array([0.05, 0.06, 0.08]), CRT.primaries_XYZ_cd_m2, curves)
    same = model.normalised
    lowest, highest = same.limits
    assert np.abs(lowest).max() < 1e-12
    assert np.abs(highest - 1.0).max() < 1e-12
    codes = np.random.default_rng(seed).random((20, 3))
    assert np.abs(same.xyz(codes) - model.xyz(codes)).max() < 1e-9
    asked = np.random.default_rng(seed).uniform(0.0, 1.3, (20, 3)) * model.shown_white_XYZ_cd_m2
    answered, expected = same.code(asked), model.code(asked)
    assert np.abs(model.xyz(answered) - model.xyz(expected)).max() < 1e-11
    assert np.abs(answered - expected)[expected > 0.01].max() < 1e-9
    assert np.abs(same.gamut_tolerance * (model.limits[1] - model.limits[0]) / model.gamut_tolerance - 1).max() < 1e-9
    assert same.clipping(asked) == model.clipping(asked)
    assert same.normalised.clipping(asked) == same.clipping(asked)


def test_primaries_that_cannot_be_told_apart_are_refused() -> None:
    curve = ToneCurve()
    with pytest.raises(DeviceError, match="nearly alike"):
        DisplayModel(np.zeros(3), np.ones((3, 3)), (curve, curve, curve))


def _file(tmp_path: Path, modes: str) -> Path:
    path = tmp_path / "d.yaml"
    path.write_text(f"schema_version: 1\npanel: {{resolution_px: [640, 480], pixel_pitch_mm: 0.3}}\nmodes:\n{modes}")
    return path


MODEL = (
    "{black_XYZ_cd_m2: [0, 0, 0], primaries_XYZ_cd_m2: {red: [4, 2, 0], green: [3, 7, 1], blue: [2, 1, 9]}, "
    "curve: {kind: gog, red: {gain: 1, offset: 0, gamma: 2}, green: {gamma: 2}, blue: {gamma: %s}}}"
)


def test_modes_per_eye_and_same_as(tmp_path: Path) -> None:
    path = _file(
        tmp_path, f"  flat: {{left: {MODEL % 2}, right: {MODEL % '2.5'}}}\n  side-by-side: {{same_as: flat}}\n"
    )
    display = read_display(path)
    models = display.models("side-by-side")
    found = [models.eye("left"), models.eye("right"), display.models("flat").left]
    curves = [model.curves[2] for model in found]
    assert [curve.gamma for curve in curves if isinstance(curve, ToneCurve)] == [2, 2.5, 2]


def test_what_an_eye_s_source_states_of_held_out_readings_is_read(tmp_path: Path) -> None:
    stated = (MODEL % 2)[:-1] + ", source: 'held-out ΔE00 mean 0.31, 95th percentile 0.80, largest 1.20'}"
    display = read_display(_file(tmp_path, f"  flat: {{left: {MODEL % 2}, right: {stated}}}\n"))
    ((eye, errors),) = display.held_out["flat"].items()
    assert (eye, errors.mean, errors.p95, errors.max) == ("right", 0.31, 0.8, 1.2)


@pytest.mark.parametrize(
    ("modes", "part"),
    [
        ("  flat: {same_as: quad}\n", ":4:19: there is no mode 'quad'"),
        ("  flat: {same_as: flat}\n", ":4:19: the mode 'flat' is the same as itself"),
        ("  flat: " + MODEL % 0 + "\n", "'modes.flat.curve.blue.gamma' is 0"),
        ("  flat: " + (MODEL % "2, lift: 0.1") + "\n", "a curve of kind 'gog' has no 'lift'"),
        ("  flat: " + (MODEL % 2).replace("kind: gog", "kind: gogg") + "\n", "did you mean 'gog'?"),
        ("  flat: " + (MODEL % 2).replace("[4, 2, 0]", "[3, 7, 1]") + "\n", ":4:3: the primaries are so nearly alike"),
        ("  flat: {}\n", "black_XYZ_cd_m2' is missing"),
        ("  flat: " + (MODEL % 2).replace("[4, 2, 0]", "[4, 2, .nan]") + "\n", "red.3"),
    ],
)
def test_faults_in_a_display_file_are_placed(tmp_path: Path, modes: str, part: str) -> None:
    with pytest.raises(InputError) as caught:
        read_display(_file(tmp_path, modes))
    assert part in str(caught.value)


@pytest.mark.promise("measured-mode")
def test_a_mode_that_was_not_characterised_is_refused() -> None:
    with pytest.raises(DeviceError, match=r"not characterised in the mode 'side-by-sid'.*did you mean 'side-by-side'"):
        read_display(ASUS).models("side-by-sid")


def test_the_rig_names_its_own_line_when_the_mode_is_absent(tmp_path: Path) -> None:
    rig = tmp_path / "rig.yaml"
    rig.write_text(f"schema_version: 1\ndisplay: {ASUS}\nmode: anaglyph\ndistance_mm: 700\n")
    with pytest.raises(InputError, match=r"rig.yaml:3:7: .*'anaglyph'"):
        read_rig(rig)
    rig.write_text("schema_version: 1\ndisplay: none.yaml\nmode: flat\ndistance_mm: 700\n")
    with pytest.raises(InputError, match=r"rig.yaml:2:10: there is no such"):
        read_rig(rig)
