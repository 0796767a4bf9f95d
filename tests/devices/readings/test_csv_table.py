"""Tables of measurements: CSV, spectra, other programs' files, and the area of patches."""

from __future__ import annotations

import io
import re
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.io import savemat

from devices.characterise import fit_display
from devices.diagnostics import plain
from devices.diagnostics.readings import by_code
from devices.errors import DeviceError
from devices.readings import (
    GridCell,
    MatFileError,
    MeasurementLog,
    Measurements,
    Patch,
    PatchSet,
    Reading,
    find_patches,
    read_csv,
    read_mat,
    read_measurements,
    step_facts,
    steps,
    write_csv,
    xyz_from_spectra,
)
from devices.readings.cgats import MOST_FIELDS
from devices.readings.csv_table import format_csv, parse_csv
from devices.readings.psychtoolbox import read_psychtoolbox
from devices.readings.table import joined
from devices.readings.ti3 import format_ti3, parse_ti3
from tests.devices.diagnostics.simulated import characterisation
from tests.kept import known
from tests.stress.foreign_formats import FORMATS

# Measurements read from CSV and written to it.
#
# Tables of readings made to do harm: without an end, of more fields than any instrument has.

HEADER = "name,red,green,blue,X,Y,Z\n"
TABLE = "CTI3\nBEGIN_DATA_FORMAT\n{}\nEND_DATA_FORMAT\nBEGIN_DATA\n{}\nEND_DATA\n"
FIELDS = "SAMPLE_ID RGB_R RGB_G RGB_B XYZ_X XYZ_Y XYZ_Z"


def _parse(text: str, code_range: str | None = None) -> Measurements:
    return parse_csv(text.splitlines(keepends=True), "t.csv", code_range)


def test_comments_say_what_holds_for_all() -> None:
    text = (
        "# codes: 0..1023\n# mode: quad-buffered\n# eye: left\n# instrument: CS-2000\n"
        + HEADER
        + "a,0,512,1023,1,2,3\n"
    )
    found = _parse(text)
    np.testing.assert_allclose(found.codes, [[0, 512 / 1023, 1]])
    assert found.XYZ.tolist() == [[1, 2, 3]]
    assert (found.mode, found.eye, found.instrument) == ("quad-buffered", ("left",), "CS-2000")
    assert found.assumptions == ()


@pytest.mark.parametrize(("largest", "full"), [("1", 1), ("0.5", 1), ("255", 255), ("1023", 1023)])
def test_the_largest_code_tells_and_it_is_said(largest: str, full: int) -> None:
    found = _parse(HEADER + f"a,0,0,{largest},1,2,3\n")
    assert found.codes[0, 2] == pytest.approx(float(largest) / full)
    assert f"0..{full}" in found.assumptions[0]


@pytest.mark.parametrize("largest", ["2", "100", "240", "940", "4095", "0"])
def test_codes_that_do_not_tell_are_refused(largest: str) -> None:
    with pytest.raises(DeviceError, match="does not determine"):
        _parse(HEADER + f"a,0,0,{largest},1,2,3\n")
    assert _parse(HEADER + f"a,0,0,{largest},1,2,3\n", "0..5000").codes[0, 2] == float(largest) / 5000


@pytest.mark.parametrize(
    ("text", "place"),
    [
        (HEADER + "a,0,0,255,1,x,3\n", "t.csv:2:6: Y is 'x'"),
        (HEADER + "a,0,0,255,1,2,nan\n", "t.csv:2:7: Z is 'nan'"),
        (HEADER + "a,0,0,255,1,2\n", "t.csv:2: the line has 6 fields"),
        ("# codes: 0..100\n" + HEADER + "a,0,0,255,1,2,3\n", "t.csv:3:4: the code 255 lies outside 0..100"),
        ("# codes: 0..100\n" + HEADER + "a,-1,0,5,1,2,3\n", "t.csv:3:2: the code -1 lies outside"),
        ("# codes: many\n" + HEADER + "a,0,0,255,1,2,3\n", "t.csv:1: 'many' is no range"),
        ("name,red,green,blue,X,Y,Z,eyes\na,0,0,1,1,2,3,left\n", "t.csv:1:8: there is no column 'eyes'"),
        ("name,red,green,blue,X,Y,Z,eye\na,0,0,1,1,2,3,up\n", "t.csv:2:8: 'up' is no eye"),
        ("name,red,green,red,X,Y,Z\na,0,0,1,1,2,3\n", "t.csv:1:4: the column 'red' stands twice"),
        ("red,green,X,Y,Z\n0,0,1,1,2\n", "the header has no blue"),
        (HEADER, "has no rows"),
    ],
)
def test_faults_name_their_place(text: str, place: str) -> None:
    with pytest.raises(DeviceError, match=re.escape(place)):
        _parse(text)


def test_a_column_that_is_not_read_is_told() -> None:
    found = _parse("R,G,B,X,Y,Z,remark\n0,0,255,1,2,3,dim\n")
    assert "remark" in found.assumptions[1]


NUMBERS = st.floats(-1e6, 1e6, allow_nan=False)


@given(
    st.lists(
        st.tuples(st.tuples(*[st.integers(0, 255)] * 3), st.tuples(NUMBERS, NUMBERS, NUMBERS)), min_size=1, max_size=9
    ),
    st.lists(st.text(max_size=6), min_size=9, max_size=9),
)
def test_what_is_written_reads_the_same(
    rows: list[tuple[tuple[int, ...], tuple[float, ...]]], names: list[str]
) -> None:
    codes = np.array([codes for codes, _ in rows]) / 255
    light = np.array([light for _, light in rows])
    table = Measurements(codes, light, tuple(names[: len(rows)]), np.arange(len(rows)) / 7, mode="flat")
    back = _parse(format_csv(table))
    np.testing.assert_array_equal(back.codes, table.codes)
    np.testing.assert_array_equal(back.XYZ, table.XYZ)
    np.testing.assert_array_equal(known(back.time_s), known(table.time_s))
    assert (back.mode, back.eye) == ("flat", ("both",) * len(rows))


def test_tables_are_chosen_from_and_joined() -> None:
    table = Measurements(np.eye(3), np.eye(3), ("r", "g", "b"), eye=("left", "right", "both"))
    assert table.for_eye("left").name == ("r", "b")
    assert joined([table.select([0]), table.select([1, 2])]).name == table.name
    with pytest.raises(DeviceError, match="shape"):
        Measurements(np.eye(3), np.eye(3)[:2])
    with pytest.raises(DeviceError, match=r"0\.\.1"):
        Measurements(np.eye(3) * 2, np.eye(3))


@pytest.mark.parametrize("suffix", ["csv", "ti3"])
@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="this system has no file without an end")
def test_a_table_without_an_end_is_refused(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a.{suffix}"
    path.symlink_to("/dev/zero")
    with pytest.raises(DeviceError, match=rf"a.{suffix}: this is a link to a device"):
        read_measurements(path)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (TABLE.format(FIELDS + "".join(f" F{n}" for n in range(6_000)), "1"), rf"a.ti3:3:1: .*{MOST_FIELDS} at most"),
        (TABLE.format(FIELDS + " X" * 3000, "1"), "a.ti3:3:49: the field X stands twice"),
        (TABLE.format(FIELDS, '1 "' + '""' * 200_000), "a quotation mark is not closed"),
        (TABLE.format(FIELDS, "1 nan inf -1 1e400 \u202e\x1b[2J 1\n" * 300), "RGB_R is 'nan'"),
        ("\x00" * 1_000_000, "names no fields"),
    ],
)
def test_tables_that_do_harm_are_refused_soon(tmp_path: Path, text: str, reason: str) -> None:
    path = tmp_path / "a.ti3"
    path.write_text(text, encoding="utf-8")
    began_s = time.process_time()
    with pytest.raises(DeviceError, match=reason) as caught:
        read_measurements(path)
    assert time.process_time() - began_s < 5
    assert len(caught.value.findings) <= 20
    assert all(str(finding).isprintable() and len(str(finding)) < 1500 for finding in caught.value.findings)


# Measurements from spectra, ArgyllCMS and Psychtoolbox files.
#
# MAT-files: what SciPy writes is read as SciPy reads it, and what a file only announces is not believed.

RNG = np.random.default_rng(1)
FILES_NUMBERS = {
    "double": np.array([[380.0, 5.0, 81.0]]),
    "single": RNG.random((3, 4, 2)).astype(np.float32),
    **{
        f"{sign}int{bits}": RNG.integers(0, 100, (2, 3)).astype(f"{sign}int{bits}")
        for sign in ("", "u")
        for bits in (8, 16, 32, 64)
    },
    "truth": np.array([[True, False]]),
}


@pytest.mark.parametrize("step", [1, 4, 5, 10])
def test_equal_energy_is_white_at_any_spacing(step: int) -> None:
    waves = np.arange(380, 781, step, dtype=float)
    # CIE 15: ȳ sums to 106.857 over 1 nm, and x̄ and z̄ to nearly the same.
    XYZ = xyz_from_spectra(np.ones(len(waves)), waves)[0]
    np.testing.assert_allclose(XYZ, 683 * 106.857, rtol=2e-3)


def test_uneven_wavelengths_are_weighed_by_their_width() -> None:
    waves = np.concatenate([np.arange(380, 500, 2), np.arange(500, 781, 5)]).astype(float)
    np.testing.assert_allclose(xyz_from_spectra(np.ones(len(waves)), waves)[0], 683 * 106.857, rtol=5e-3)


@pytest.mark.parametrize("waves", [[400, 700], np.arange(420, 781, 4), np.arange(780, 379, -4), [400, 400, 700]])
def test_spectra_that_do_not_tell_are_refused(waves: object) -> None:
    found = np.asarray(waves, dtype=float)
    with pytest.raises(DeviceError):
        xyz_from_spectra(np.ones(len(found)), found)


def _calibration(path: Path, levels: np.ndarray, ambient: bool = True) -> tuple[np.ndarray, np.ndarray]:
    from scipy.io import savemat

    waves = 380 + 4 * np.arange(101)
    peaks = [np.exp(-(((waves - at) / 30) ** 2)) * 1e-3 for at in (610, 540, 450)]
    share = (levels / levels.max()) ** 2.2
    mon = np.stack([np.concatenate([s * peak for s in share]) for peak in peaks], axis=1)
    dark = np.full(101, 1e-6)
    cal = {"S_device": [380.0, 4.0, 101.0], "rawdata": {"rawGammaInput": levels[:, None], "mon": mon}}
    if ambient:
        cal["P_ambient"] = dark[:, None]
    savemat(path, {"cals": np.array([{"S_device": 0}, cal], dtype=object)})
    return np.array(peaks), dark


def test_a_psychtoolbox_calibration(tmp_path: Path) -> None:
    path = tmp_path / "cal.mat"
    peaks, dark = _calibration(path, np.linspace(0.1, 1, 10))
    found = read_measurements(path)
    assert found.codes.shape == (31, 3)
    assert found.name[0] == "black"
    # Power per band of 4 nm, ambient added again.
    np.testing.assert_allclose(known(found.spectra)[10], (peaks[0] + dark) / 4)
    assert found.codes[10].tolist() == [1, 0, 0]
    assert "the last of 2" in found.assumptions[0]


def test_levels_of_255_and_no_ambient_are_told(tmp_path: Path) -> None:
    path = tmp_path / "cal.mat"
    _calibration(path, np.linspace(25.5, 255, 10), ambient=False)
    found = read_psychtoolbox(path)
    assert found.codes.max() == 1
    assert any("0..255" in said for said in found.assumptions)
    assert any("black is not measured" in said for said in found.assumptions)


def test_what_is_no_calibration_is_refused(tmp_path: Path) -> None:
    from scipy.io import savemat

    path = tmp_path / "cal.mat"
    path.write_bytes(b"no matlab at all, but long enough to have a header" * 9)
    with pytest.raises(DeviceError, match="MATLAB"):
        read_psychtoolbox(path)
    savemat(path, {"other": 1})
    with pytest.raises(DeviceError, match="cals"):
        read_psychtoolbox(path)
    with pytest.raises(DeviceError, match="no known table"):
        read_measurements(tmp_path / "d.ods")


def _row(*values: object) -> np.ndarray:
    row = np.empty((1, len(values)), dtype=object)
    row[0, :] = values
    return row


def _saved(compressed: bool, **variables: object) -> bytes:
    stream = io.BytesIO()
    savemat(stream, variables, do_compression=compressed)  # type: ignore[arg-type]  # a stream is right too
    return stream.getvalue()


@pytest.mark.parametrize("compressed", [False, True])
def test_what_scipy_writes_is_read(compressed: bool) -> None:
    others = {"text": "a display äö€", "empty": np.zeros((0, 0)), "complex": np.array([[1 + 2j]])}
    inner = {**FILES_NUMBERS, **others, "cell": _row("x", np.eye(2)), "struct": {"deep": {"x": 3.0}}}
    data = _saved(compressed, other=np.zeros((100, 100)), cals=_row(inner, {"x": 1.0}))
    read: Any = read_mat(data, "cals", "cal")
    assert set(read) == {"cals"}
    (first,), (second,) = read["cals"]
    for name, values in FILES_NUMBERS.items():
        np.testing.assert_array_equal(first[name], values)
    assert first["text"] == others["text"]
    assert first["empty"].size == 0
    assert first["complex"] is None
    assert first["cell"][0] == "x"
    np.testing.assert_array_equal(first["cell"][1], np.eye(2))
    assert first["struct"][0]["deep"][0]["x"].tolist() == [[3.0]]
    assert second["x"].tolist() == [[1.0]]


@pytest.mark.nightly
def test_large_variables_that_are_not_wanted_are_not_unpacked() -> None:
    data = _saved(True, pictures=np.zeros(8_000_000), cal={"x": 1.0})
    assert list(read_mat(data, "cal")) == ["cal"]
    with pytest.raises(MatFileError, match="unpacks to more than 50 MB"):
        read_mat(data, "pictures")


@pytest.mark.parametrize(
    ("name", "why"),
    [
        pytest.param("a bomb", "unpacks to more than|a part states", marks=pytest.mark.nightly),
        pytest.param("a hundred bombs", "more than 20000000 numbers", marks=pytest.mark.nightly),
        pytest.param("structs", "values in one variable", marks=pytest.mark.nightly),
        ("too many cells", "values in one variable"),
        ("nested", "in each other"),
        ("variables", "more than 10000 variables"),
        ("negative", "has the dimensions -1 by -1"),
        ("version 7.3", "version 7.3"),
        ("version 4", "no MAT-file of version 5"),
        ("nothing", "no MAT-file of version 5"),
    ],
)
def test_what_a_file_only_announces_is_not_believed(name: str, why: str) -> None:
    (mat,) = (form for form in FORMATS if form.name == "mat")
    data = mat.crafted()[name]
    began_s = time.process_time()
    with pytest.raises(MatFileError, match=why):
        read_mat(data, "cals")
    assert time.process_time() - began_s < 5


# The area and the surround of patches: kept by every kind of file, absent from old ones, and out of the fit.

OLD = Measurements(np.array([[0.2, 0.2, 0.2], [1, 1, 1]]), np.array([[4, 5, 6], [95.0, 100, 108]]), ("a", "b"))
PARTS = Measurements(
    OLD.codes, OLD.XYZ, OLD.name, area=np.array([1 / 9, 1.0]), surround=np.array([[1.0, 0.2, 0.6], [0.0, 0.0, 0.0]])
)
AREAS_HEADER = "name,red,green,blue,X,Y,Z,area,surround_red,surround_green,surround_blue\n"


def _same(found: Measurements) -> None:
    np.testing.assert_allclose(found.filled, PARTS.filled, atol=1e-12)
    np.testing.assert_allclose(found.around, PARTS.around, atol=1e-12)


def test_tables_keep_what_a_patch_filled_and_what_was_around_it(tmp_path: Path) -> None:
    write_csv(PARTS, tmp_path / "t.csv")
    _same(read_csv(tmp_path / "t.csv"))
    _same(parse_ti3(format_ti3(PARTS).splitlines(), "t.ti3"))


def test_a_measurement_on_disk_keeps_them(tmp_path: Path) -> None:
    patches = (
        Patch("a", (0.2, 0.2, 0.2), around=(1.0, 0.2, 0.6)),
        Patch("b", (1.0, 1.0, 1.0), before=(0.0, 0.0, 0.0)),
        Patch("c", (1.0, 1.0, 1.0), area=0.25),
    )
    order = steps(PatchSet("s", patches, characterisation=False), 1, shuffled=False)
    header = {
        "steps": step_facts(order), "eye": "both", "mode": "flat", "instrument": "none", "set": "s", "set_source": "",
        "seed": 1, "begun_utc": "2024-01-01T00:00:00+00:00", "highest_code": 255,
    }  # fmt: skip
    with MeasurementLog.create(tmp_path / "m.jsonl", header) as log:
        for step in order:
            log.keep(step, float(step.position), Reading((95.0, 100.0, 108.0)))
    found = read_measurements(tmp_path / "m.jsonl")
    np.testing.assert_allclose(found.filled, [1 / 9, 1.0, 0.25])
    np.testing.assert_allclose(found.around, [[1.0, 0.2, 0.6], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])


def test_old_tables_read_as_patches_that_filled_the_picture() -> None:
    for found in (
        parse_csv(["name,red,green,blue,X,Y,Z\n", "a,0,0,255,1,2,3\n"], "t.csv"),
        parse_ti3(format_ti3(OLD).splitlines(), "t.ti3"),
    ):
        assert found.area is None
        assert found.surround is None
        assert np.all(found.filled == 1)
        assert "area" not in format_csv(found)
        assert len(plain(found)) == len(found)


def test_empty_cells_stand_for_all_of_the_picture() -> None:
    found = parse_csv([AREAS_HEADER, "a,0,0,255,1,2,3,,,,\n", "b,0,0,255,1,2,3,0.1,255,0,0\n"], "t.csv")
    assert found.filled.tolist() == [1.0, 0.1]
    assert found.around.tolist() == [[0, 0, 0], [1, 0, 0]]


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        ([AREAS_HEADER, "a,0,0,255,1,2,3,0,0,0,0\n"], "t.csv:2:8: the area is '0'"),
        ([AREAS_HEADER, "a,0,0,255,1,2,3,1.5,0,0,0\n"], "t.csv:2:8: the area is '1.5'"),
        ([AREAS_HEADER, "a,0,0,255,1,2,3,much,0,0,0\n"], "t.csv:2:8: area is 'much'"),
        (
            ["# codes: 0..255\n", AREAS_HEADER, "a,0,0,255,1,2,3,0.5,300,0,0\n"],
            "t.csv:3:9: the code 300 lies outside 0..255",
        ),
        (["name,red,green,blue,X,Y,Z,surround_red\n", "a,0,0,255,1,2,3,0\n"], "has no surround_green, surround_blue"),
    ],
)
def test_wrong_areas_and_surrounds_name_their_place(lines: list[str], says: str) -> None:
    with pytest.raises(DeviceError, match=re.escape(says)):
        parse_csv(lines, "t.csv")


def test_an_area_of_nothing_in_a_ti3_names_its_place() -> None:
    text = format_ti3(PARTS).replace(" 11.1111111111 ", " 0 ")
    with pytest.raises(DeviceError, match=r"t\.ti3:\d+:\d+: PATCH_AREA is 0"):
        parse_ti3(text.splitlines(), "t.ti3")


def test_tables_refuse_what_no_patch_can_fill() -> None:
    with pytest.raises(DeviceError, match="an area is a share"):
        Measurements(OLD.codes, OLD.XYZ, area=np.array([0.0, 1.0]))
    with pytest.raises(DeviceError, match="surround must lie in"):
        Measurements(OLD.codes, OLD.XYZ, surround=np.full((2, 3), 1.5))


def test_tables_with_and_without_areas_are_joined() -> None:
    both = joined([OLD, PARTS])
    np.testing.assert_allclose(both.filled, [1, 1, 1 / 9, 1])
    np.testing.assert_allclose(both.around[2], PARTS.around[0])
    _same(both.select([2, 3]))


CLEAN = characterisation(noise=0.0)
DIM = Measurements(CLEAN.codes, 0.5 * CLEAN.XYZ, CLEAN.name, CLEAN.time_s, area=np.full(len(CLEAN), 0.1))


def test_patches_with_a_surround_are_not_plain() -> None:
    every = joined([CLEAN, DIM])
    assert len(plain(every)) == len(CLEAN)
    assert by_code(every) == by_code(CLEAN)


@pytest.mark.nightly
@pytest.mark.usefixtures("fits_kept")
def test_patches_with_a_surround_are_no_part_of_the_fit() -> None:
    every = joined([CLEAN, DIM])
    fit, alone = fit_display(every, model="gog"), fit_display(CLEAN, model="gog")
    found, expected = (one.eyes["both"].characterisation.chosen.held_out for one in (fit, alone))
    assert found == expected
    assert f"{len(CLEAN)} readings" in " ".join(fit.notes)


def test_patch_files_say_area_and_surround(tmp_path: Path) -> None:
    file = tmp_path / "own.csv"
    file.write_text(
        "# codes: 0..255\nname,red,green,blue,area,surround_red,surround_green,surround_blue\n"
        "a,255,255,255,0.1,0,0,0\nb,51,51,51,,255,0,0\nc,0,0,0,,,,\n"
    )
    a, b, c = find_patches(str(file)).patches
    assert (a.filled, a.surround) == (0.1, (0, 0, 0))
    assert (b.filled, b.surround) == (1 / 9, (1, 0, 0))
    assert (c.filled, c.around, c.area) == (1, None, None)
    file.write_text("# codes: 0..255\nname,red,green,blue,area,surround_red\na,255,255,255,2,0\n")
    with pytest.raises(DeviceError, match=re.escape("own.csv:2: the header has no surround_green")) as told:
        find_patches(str(file))
    assert "own.csv:3:5: the area is '2'" in str(told.value)


def test_a_patch_has_one_area() -> None:
    assert Patch("a", (0, 0, 0), place=GridCell(1, 1, 2, 2)).filled == 0.25
    with pytest.raises(DeviceError, match="a cell of a grid, which is its area"):
        Patch("a", (0, 0, 0), place=GridCell(1, 1), area=0.5)
    with pytest.raises(DeviceError, match="has the area 0"):
        Patch("a", (0, 0, 0), area=0.0)


@pytest.mark.nightly
@pytest.mark.usefixtures("fits_kept")
def test_a_display_measured_on_one_surround_throughout_is_fitted_so() -> None:
    table = replace(CLEAN, area=DIM.area, surround=np.full((len(CLEAN), 3), 0.5))
    assert len(plain(plain(table))) == len(CLEAN)
    fit, alone = fit_display(table, model="gog"), fit_display(CLEAN, model="gog")
    found, expected = (one.eyes["both"].characterisation.chosen.held_out for one in (fit, alone))
    assert found == expected
    assert "10 % of the picture, with codes 128" in " ".join(fit.notes)
    assert len(plain(replace(CLEAN, area=np.linspace(0.1, 0.9, len(CLEAN))))) == 0


def test_a_set_in_part_of_the_picture_has_its_black_and_white_there_too() -> None:
    patches = find_patches("table_c1").in_part(0.25, (0.5, 0.5, 0.5))
    assert {(step.patch.filled, step.patch.surround) for step in steps(patches, 1)} == {(0.25, (0.5, 0.5, 0.5))}
    for name in ("crosstalk", "uniformity", "on-white", "cable"):
        assert find_patches(name).in_part(0.25, None) == find_patches(name)
