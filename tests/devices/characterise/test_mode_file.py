"""Modes written into display files, key by key, and the parts that tagged readings give them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.characterise import thesis_display
from devices.characterise.measured_parts import measured_parts
from devices.characterise.mode_file import ModeLines, set_keys, write_mode
from devices.diagnostics import MeasuredSet, examine
from devices.display import DisplayModel, PanelSpec, ToneCurve, read_display
from devices.display.model_spec import ModelSpec
from devices.errors import DeviceError
from devices.readings import Measurements, PatchEye
from documents.yaml import parse_yaml

# Modes written into display files: what is new is there, what was there stays, what would go is refused.

ROOT = Path(__file__).parents[3]
PANEL = PanelSpec(resolution_px=(640, 480), pixel_pitch_mm=0.25, refresh_hz=120, bits=10)
CROSSTALK = ["crosstalk:", *(f"  {eye}: [[0.03, 0, 0], [0, 0.03, 0], [0, 0, 0.05]]" for eye in ("left", "right"))]


def _model(white: float) -> list[str]:
    primaries = np.array([[4.0, 3, 2], [2, 7, 1], [0, 1, 9]]) * white
    return ModelSpec.of(
        DisplayModel(np.zeros(3), primaries, (ToneCurve(1, 0, 2.2),) * 3), source=f'white {white}, "measured"'
    ).lines()


def _new(parts: dict[str, list[str]] | None = None, **whites: float) -> ModeLines:
    return ModeLines({eye: _model(white) for eye, white in whites.items()}, parts or {})


def _white(path: Path, mode: str, eye: str = "left") -> float:
    models = read_display(path).models(mode)
    return float((models.left if eye == "left" else models.right).white_XYZ_cd_m2[1] / 10)


@pytest.fixture
def shipped(tmp_path: Path) -> Path:
    path = tmp_path / "asus.yaml"
    path.write_bytes((ROOT / "configs" / "displays" / "asus_vg248qe.yaml").read_bytes())
    return path


def test_a_new_file_has_its_panel_and_mode(tmp_path: Path) -> None:
    path = tmp_path / "d.yaml"
    assert write_mode(path, "flat", _new(both=2.0), PANEL).startswith(f"wrote {path}")
    assert read_display(path).panel == PANEL
    assert _white(path, "flat") == pytest.approx(2)
    with pytest.raises(DeviceError, match="no such display file yet"):
        write_mode(tmp_path / "e.yaml", "flat", _new(both=2.0))
    assert [p.name for p in tmp_path.iterdir()] == ["d.yaml"]


def test_an_added_mode_changes_no_line(shipped: Path) -> None:
    before = shipped.read_text()
    write_mode(shipped, "flat", _new(both=2.0))
    assert shipped.read_text().startswith(before)
    assert _white(shipped, "flat") == pytest.approx(2)


def test_replacing_takes_a_word_and_leaves_the_rest(shipped: Path) -> None:
    before = shipped.read_bytes()
    with pytest.raises(DeviceError, match=r"asus.yaml:5:3: .*for both"):
        write_mode(shipped, "quad-buffered", _new(both=2.0))
    assert shipped.read_bytes() == before
    told = write_mode(shipped, "quad-buffered", _new(both=2.0), replace=True)
    assert "went with it: 1." in told  # '# Expression 3.12'
    assert "The same as it: side-by-side." in told
    after = shipped.read_text().split("\n")
    assert _white(shipped, "quad-buffered") == _white(shipped, "side-by-side") == pytest.approx(2)
    for line in ("# Asus VG248QE", "panel: ", "modes:  ", "    # The thesis gives no black", "  side-by-side: {"):
        (kept,) = (old for old in before.decode().split("\n") if old.startswith(line))
        assert kept in after


def test_an_eye_is_written_by_itself(tmp_path: Path) -> None:
    path = tmp_path / "d.yaml"
    told = write_mode(path, "flat", _new(right=2.0), PANEL)
    assert "cannot be used before its left eye" in told
    told = write_mode(path, "flat", _new(left=3.0))
    assert "cannot be used" not in told
    assert (_white(path, "flat"), _white(path, "flat", "right")) == pytest.approx((3, 2))
    with pytest.raises(DeviceError, match="of the left eye already"):
        write_mode(path, "flat", _new(left=4.0))
    with pytest.raises(DeviceError, match="of the right eye already"):
        write_mode(path, "flat", _new(both=4.0))
    write_mode(path, "flat", _new(left=4.0), replace=True)
    assert (_white(path, "flat"), _white(path, "flat", "right")) == pytest.approx((4, 2))
    write_mode(path, "flat", _new(both=5.0), replace=True)
    assert (_white(path, "flat"), _white(path, "flat", "right")) == pytest.approx((5, 5))


def test_one_eye_in_place_of_both_leaves_none_for_the_other(shipped: Path) -> None:
    with pytest.raises(DeviceError, match="for both eyes already"):
        write_mode(shipped, "quad-buffered", _new(left=4.0))
    told = write_mode(shipped, "quad-buffered", _new(left=4.0), replace=True)
    assert "cannot be used before its right eye" in told
    assert read_display(shipped).lacking == {"quad-buffered": ("right",), "side-by-side": ("right",)}


def test_a_mode_that_was_the_same_as_another_gets_its_own(shipped: Path) -> None:
    with pytest.raises(DeviceError, match="holds 'same_as: quad-buffered' already"):
        write_mode(shipped, "side-by-side", _new(both=2.0))
    write_mode(shipped, "side-by-side", _new(both=2.0), replace=True)
    assert _white(shipped, "side-by-side") == pytest.approx(2)
    assert _white(shipped, "quad-buffered") == pytest.approx(2.647)


def test_parts_are_added_by_themselves_and_kept_when_the_model_changes(shipped: Path) -> None:
    before = shipped.read_text()
    write_mode(shipped, "quad-buffered", _new({"crosstalk": CROSSTALK}))
    after = shipped.read_text()
    assert after.replace("".join(f"    {line}\n" for line in CROSSTALK), "") == before
    assert read_display(shipped).crosstalk("side-by-side") is not None
    told = write_mode(shipped, "quad-buffered", _new({"crosstalk": CROSSTALK}))
    assert "There already, and the same: crosstalk." in told
    assert shipped.read_text() == after
    with pytest.raises(DeviceError, match="holds crosstalk already"):
        write_mode(shipped, "quad-buffered", _new({"crosstalk": [line.replace("0.05", "0.06") for line in CROSSTALK]}))
    told = write_mode(shipped, "quad-buffered", _new(both=2.0), replace=True)
    assert "stays: crosstalk, monitor_settings." in told
    assert read_display(shipped).crosstalk("quad-buffered") is not None
    with pytest.raises(DeviceError, match="write into 'quad-buffered'"):
        write_mode(shipped, "side-by-side", _new({"crosstalk": CROSSTALK}), replace=True)
    with pytest.raises(DeviceError, match="there is no mode 'flat' to add to"):
        write_mode(shipped, "flat", _new({"crosstalk": CROSSTALK}))


def test_what_would_not_read_is_not_put_in_place(shipped: Path) -> None:
    before = shipped.read_bytes()
    dark = [line.replace("red:   [8", "red:   [1e-30") for line in _model(2.0)]
    bad = ModeLines({"both": [line.replace("gamma: 2.2", "gamma: -1") for line in dark]}, {})
    with pytest.raises(DeviceError, match=r"asus.yaml: the file would not be right"):
        write_mode(shipped, "flat", bad)
    with pytest.raises(DeviceError, match="another panel"):
        write_mode(shipped, "flat", _new(both=2.0), PANEL)
    assert shipped.read_bytes() == before
    assert [p.name for p in shipped.parent.iterdir()] == ["asus.yaml"]


def test_a_link_stays_a_link_and_permissions_stay(shipped: Path, tmp_path: Path) -> None:
    link = tmp_path / "link.yaml"
    link.symlink_to(shipped)
    shipped.chmod(0o640)
    write_mode(link, "flat", _new(both=2.0))
    assert link.is_symlink()
    assert shipped.stat().st_mode & 0o777 == 0o640
    assert _white(shipped, "flat") == pytest.approx(2)


def test_braces_are_refused_with_their_place(tmp_path: Path) -> None:
    path = tmp_path / "d.yaml"
    write_mode(path, "flat", _new(both=2.0), PANEL)
    path.write_text(
        "{" + f"schema_version: 1, panel: {{resolution_px: [9, 9], pixel_pitch_mm: 1}}, modes: {BRACES}" + "}"
    )
    with pytest.raises(DeviceError, match=r"d.yaml:1:\d+: .*in braces"):
        write_mode(path, "quad-buffered", _new(both=2.0))


BRACES = (
    "{flat: {black_XYZ_cd_m2: [0, 0, 0], primaries_XYZ_cd_m2: {red: [4, 2, 0], green: [3, 7, 1], blue: [2, 1, 9]}, "
    "curve: {kind: gamma, red: {gamma: 2}, green: {gamma: 2}, blue: {gamma: 2}}}}"
)


# Keys set inside a YAML text; every other character stays.

TEXT = """\
# above
a: 1    # kept
modes:   # of the screen
    # about flat
    flat:
        black: [0,   0.00, 1e-3]   # old

        curve:   # bent
          kind: 'gog'
          # inside
        note: |
          several
          lines
    # about the other
    other: {same_as: flat}
    # still of modes
# of the whole file
last: "2"
"""


def test_a_key_is_replaced_where_it_stands() -> None:
    after, gone = set_keys(TEXT, ("modes", "flat"), {"curve": ["curve: new"]}, "f")
    old = "        curve:   # bent\n          kind: 'gog'\n"
    assert after == TEXT.replace(old, "        curve: new\n")
    assert gone == 1


def test_a_key_is_added_behind_the_last_with_the_comments_that_follow_it() -> None:
    after, gone = set_keys(TEXT, ("modes",), {"third": ["third:", "  same_as: flat"]}, "f")
    still = "    # still of modes\n"
    assert after == TEXT.replace(still, still + "    third:\n      same_as: flat\n")
    assert gone == 0


def test_a_block_text_ends_where_it_ends() -> None:
    after, _ = set_keys(TEXT, ("modes", "flat"), {"more": ["more: 1"], "note": ["note: short"]}, "f", ["black"])
    assert "        note: short\n        more: 1\n    # about the other\n" in after
    assert "black" not in after


@pytest.mark.parametrize("ending", ["\r\n", "\n"])
def test_line_endings_and_a_last_line_without_one_stay(ending: str) -> None:
    text = TEXT.replace("\n", ending)
    after, _ = set_keys(text, ("modes",), {"third": ["third: 1"]}, "f")
    assert after.replace(f"    third: 1{ending}", "") == text
    after, _ = set_keys(f"m:{ending}  a: 1", ("m",), {"b": ["b: 2"]}, "f")
    assert after == f"m:{ending}  a: 1{ending}  b: 2{ending}"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("m: {a: 1}\n", "f:1:4: 'm' is written in braces"),
        ("m:\n  ? a\n  : 1\n", "f:2:5: 'a' shares its line"),
        ("m:\n  a: &x {k: 1}\n  b: *x\n", "used elsewhere"),
        ("n: 1\n", "there is no mapping 'm'"),
        ("m: [\n", "not valid YAML"),
    ],
)
def test_what_cannot_be_set_is_refused_with_its_place(text: str, says: str) -> None:
    with pytest.raises(Exception, match=says) as caught:
        set_keys(text, ("m",), {"a": ["a: 2"]}, "f")
    assert isinstance(caught.value, DeviceError) or "YAML" in says


def test_an_alias_that_does_not_refer_to_it_stays() -> None:
    after, _ = set_keys("m:\n  a: &x {k: 1}\n  b: *x   # too\n", ("m",), {"c": ["c: 2"]}, "f")
    assert after == "m:\n  a: &x {k: 1}\n  b: *x   # too\n  c: 2\n"
    after, _ = set_keys("m:\n  a: &x {k: 1}\n  b: *x\n  c: 2\n", ("m",), {"b": ["b: 2"]}, "f")
    assert after == "m:\n  a: &x {k: 1}\n  b: 2\n  c: 2\n"


WORDS = st.text("abc", min_size=1, max_size=2)
VALUES = st.sampled_from(
    [
        "1",
        "[1, 2]  # said",
        "{k: v}",
        "'q # q'",
        "|\n{i}  two\n{i}  lines",
        "\n{i}  deep:\n{i}    er: 1\n{i}    # end",
        "",
    ]
)


@settings(max_examples=15)
@given(
    keys=st.dictionaries(WORDS, VALUES, min_size=1, max_size=4),
    name=WORDS,
    indent=st.sampled_from(["  ", "   "]),
    comments=st.lists(st.sampled_from(["", "# c", "  # c", "      # c"]), min_size=5, max_size=5),
)
def test_any_layout_reads_as_wanted_and_no_other_line_changes(
    keys: dict[str, str], name: str, indent: str, comments: list[str]
) -> None:
    lines = ["top: 1", "m:"]
    for comment, (key, value) in zip(comments, keys.items(), strict=False):
        lines += [comment, f"{indent}{key}: {value.replace('{i}', indent)}"]
    text = "\n".join([*lines, comments[-1], "z: 3"]) + "\n"
    if parse_yaml(text, "f").data["m"] is None:
        return
    after, _ = set_keys(text, ("m",), {name: [f"{name}: [new, 7]"]}, "f")
    assert parse_yaml(after, "f").data == {"top": 1, "m": {**parse_yaml(text, "f").data["m"], name: ["new", 7]}, "z": 3}
    left = after.replace(f"{indent}{name}: [new, 7]\n", "", 1)
    if name not in keys:
        assert left == text
    assert all(line in text.split("\n") for line in left.split("\n"))


# Crosstalk, evenness and glasses from tagged readings in one table, alike in fit and report.

DISPLAY = thesis_display()
COLOURS: dict[str, list[float]] = {
    "black": [0, 0, 0],
    "red": [1, 0, 0],
    "green": [0, 1, 0],
    "blue": [0, 0, 1],
    "white": [1, 1, 1],
}
DARK = DISPLAY.xyz([0, 0, 0])


class Readings:
    """A table that grows by a reading at a time."""

    def __init__(self) -> None:
        self.rows: list[tuple[str, list[float], np.ndarray, PatchEye]] = []

    def add(self, name: str, code: list[float], XYZ: np.ndarray, eye: PatchEye = "both") -> None:
        self.rows.append((name, code, XYZ, eye))

    def table(self) -> Measurements:
        names, codes, XYZ, eyes = zip(*self.rows, strict=True)
        return Measurements(np.array(codes), np.array(XYZ), names, eye=eyes, mode="quad-buffered")


def crosstalk(readings: Readings, leak: float = 0.04) -> None:
    eyes: tuple[PatchEye, ...] = ("left", "right")
    for eye in eyes:
        for name, code in COLOURS.items():
            readings.add(name, code, DISPLAY.xyz(code), eye)
            if name != "black":
                readings.add(f"black@other={name}", [0, 0, 0], DARK + leak * (DISPLAY.xyz(code) - DARK), eye)


def grid(readings: Readings, eye: PatchEye = "both", columns: int = 3) -> None:
    for row in (1, 2, 3):
        for column in range(1, columns + 1):
            light = DISPLAY.xyz([0.5] * 3) * (1 - 0.1 * abs(row - 2))
            readings.add(f"gray@r{row}c{column}", [0.5] * 3, light, eye)


def greys(readings: Readings, share: float, eye: PatchEye = "both") -> None:
    for level in (0.25, 0.5, 0.75, 1.0):
        readings.add("gray", [level] * 3, share * DISPLAY.xyz([level] * 3), eye)
        readings.add("gray@no-glasses", [level] * 3, DISPLAY.xyz([level] * 3), eye)


def test_plain_readings_give_no_parts() -> None:
    readings = Readings()
    readings.add("white", [1, 1, 1], DISPLAY.xyz([1, 1, 1]))
    parts = measured_parts(readings.table(), "d.csv")
    assert (parts.lines, parts.glasses, parts.diagnoses, parts.notes) == ({}, {}, (), ())


def test_crosstalk_and_gain_map_are_those_of_the_report_with_their_source() -> None:
    readings = Readings()
    crosstalk(readings)
    grid(readings)
    parts = measured_parts(readings.table(), "d.csv by CS-2000: new")
    assert list(parts.lines) == ["crosstalk", "gain_map"]
    reported = {one.name: one for one in examine([MeasuredSet("d", readings.table())]) if one.output}
    for part, name in (("crosstalk", "crosstalk"), ("gain_map", "uniformity")):
        ours = yaml.safe_load("\n".join(parts.lines[part]))[part]
        theirs = yaml.safe_load(reported[name].output)[part]
        assert ours.pop("source") == theirs.pop("source") + ", of d.csv by CS-2000: new"
        assert ours == theirs
    np.testing.assert_allclose(
        yaml.safe_load("\n".join(parts.lines["crosstalk"]))["crosstalk"]["left"], 0.04 * np.eye(3), atol=1e-6
    )
    assert set(parts.to_json()) == {"crosstalk", "uniformity"}


def test_crosstalk_through_one_lens_is_said_and_not_written() -> None:
    readings = Readings()
    crosstalk(readings)
    left = readings.table().for_eye("left")
    parts = measured_parts(left, "d.csv")
    assert not parts.lines
    assert "no crosstalk is written" in parts.notes[0]


def test_half_a_grid_is_said_and_not_written() -> None:
    readings = Readings()
    grid(readings)
    parts = measured_parts(readings.table().select(np.arange(8)), "d.csv")
    assert not parts.lines
    assert "r3c3 is missing" in parts.notes[0]
    grid(readings, "left", columns=2)
    parts = measured_parts(readings.table(), "d.csv")
    assert not parts.lines
    assert "through each lens alike" in parts.notes[0]


@pytest.mark.parametrize("apart", [False, True])
def test_glasses_are_told_for_each_eye(apart: bool) -> None:
    readings, bare = Readings(), Readings()
    greys(readings, 0.15, "left")
    greys(readings, 0.12, "right")
    table = readings.table()
    if apart:
        for level in (0.25, 0.5, 0.75, 1.0):
            bare.add("gray", [level] * 3, DISPLAY.xyz([level] * 3))
    parts = measured_parts(table, "d.csv", bare.table() if apart else None, ("left", "right"))
    assert [one.value for one in parts.glasses["left"]] == pytest.approx([15, 0])
    assert [one.value for one in parts.glasses["right"]] == pytest.approx([12, 0])
    assert "85 % is lost" in parts.glasses["left"][1].words
    assert set(parts.to_json()["glasses_transmittance"]) == {"left", "right"}
