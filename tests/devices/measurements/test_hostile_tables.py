"""Tables of readings made to do harm: without an end, of more fields than any instrument has."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from devices.errors import DeviceError
from devices.measurements import read_measurements
from devices.measurements.cgats import MOST_FIELDS

TABLE = "CTI3\nBEGIN_DATA_FORMAT\n{}\nEND_DATA_FORMAT\nBEGIN_DATA\n{}\nEND_DATA\n"
FIELDS = "SAMPLE_ID RGB_R RGB_G RGB_B XYZ_X XYZ_Y XYZ_Z"


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
