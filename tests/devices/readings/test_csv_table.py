"""Measurements read from CSV and written to it.

Tables of readings made to do harm: without an end, of more fields than any instrument has.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.errors import DeviceError
from devices.readings import Measurements, read_measurements
from devices.readings.cgats import MOST_FIELDS
from devices.readings.csv_table import format_csv, parse_csv
from devices.readings.table import joined

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
    with pytest.raises(DeviceError) as caught:
        _parse(text)
    assert place in str(caught.value)


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
    assert back.time_s is not None
    assert table.time_s is not None
    np.testing.assert_array_equal(back.time_s, table.time_s)
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
