"""Tables of colours: what is read, and what is refused at which place."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from devices.camera import Exposure, read_correspondences, read_reference
from devices.errors import DeviceError

GOOD = "# source: made up\nR,G,B,X,Y,Z,name\n0.1,0.2,0.3,4,5,6,one\n0.2,0.4,0.999,7,8,9,two\n"


def _file(folder: Path, text: str | bytes) -> Path:
    path = folder / "chart.csv"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def test_a_table(tmp_path: Path) -> None:
    found = read_correspondences(_file(tmp_path, GOOD))
    assert found.rgb.tolist() == [[0.1, 0.2, 0.3], [0.2, 0.4, 0.999]]
    assert found.XYZ.tolist() == [[4, 5, 6], [7, 8, 9]]
    assert found.names == ("one", "two")
    assert found.saturated.tolist() == [[False] * 3, [False, False, True]]


def test_raw_values_with_their_range_and_columns_in_any_order(tmp_path: Path) -> None:
    text = "\ufeff# rgb: 0..16383\nX,Y,Z,note,red,green,blue\n4,5,6,a,0,8191.5,16383\n1,2,3,b,100,20,30\n"
    found = read_correspondences(_file(tmp_path, text))
    assert found.rgb[0] == pytest.approx([0, 0.5, 1])
    assert found.names == ("patch 1", "patch 2")


def test_rows_with_their_exposure(tmp_path: Path) -> None:
    text = "R,G,B,X,Y,Z,time_s,f_number,iso\n0.1,0.2,0.3,4,5,6,1/15,8,800\n0.2,0.4,0.9,7,8,9,1.3,5.6,400\n"
    assert read_correspondences(_file(tmp_path, text)).exposures == (Exposure(1 / 15, 8, 800), Exposure(1.3, 5.6, 400))
    plain = text.replace(",iso", "").replace(",800", "").replace(",400", "")
    assert read_correspondences(_file(tmp_path, plain)).exposures == (Exposure(1 / 15, 8), Exposure(1.3, 5.6))
    with pytest.raises(DeviceError, match=r"csv:2:7: the exposure is '1/0, 8, 800'"):
        read_correspondences(_file(tmp_path, text.replace("1/15", "1/0")))
    with pytest.raises(DeviceError, match="needs both time_s and f_number"):
        read_correspondences(_file(tmp_path, text.replace("f_number", "aperture")))


def test_a_reference_needs_no_camera(tmp_path: Path) -> None:
    found = read_reference(_file(tmp_path, "X,Y,Z,name\n4,5,6,one\n7,8,9,two\n"))
    assert found.names == ("one", "two")
    assert np.array_equal(found.XYZ, [[4, 5, 6], [7, 8, 9]])
    assert len(read_reference(_file(tmp_path, GOOD)).names) == 2


@pytest.mark.parametrize(
    ("text", "line", "column", "words"),
    [
        (GOOD.replace("0.3", "nan"), 3, 3, "B is 'nan'"),
        (GOOD.replace("0.3", "soon"), 3, 3, "B is 'soon'"),
        (GOOD.replace("7,8", "inf,8"), 4, 4, "X is 'inf'"),
        (GOOD.replace("4,5,6,one", "4,5"), 3, None, "5 fields, the header 7"),
        (GOOD.replace("R,G", "R,R"), 2, 2, "'R' stands twice"),
        (GOOD.replace("R,G", "R,Grn"), 2, None, "has no G"),
        ("R,G,B,X,Y,Z\n", None, None, "has no rows"),
        ("", None, None, "has no rows"),
        ("# rgb: 1..5\n" + GOOD, 1, None, "range of the camera's values"),
        (GOOD.replace("0.1,0.2,0.3", "25,51,76"), None, None, "values reach 76"),
        (b"R,G,B\xff", None, None, "not UTF-8"),
        (GOOD.replace("one", '"one'), 3, None, "not CSV"),
    ],
)
def test_faults_have_a_place(
    tmp_path: Path, text: str | bytes, line: int | None, column: int | None, words: str
) -> None:
    path = _file(tmp_path, text)
    with pytest.raises(DeviceError, match=words) as caught:
        read_correspondences(path)
    (finding,) = caught.value.findings
    assert (finding.file, finding.line, finding.column) == (str(path), line, column)


def test_a_reference_is_light(tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match="must not be negative"):
        read_reference(_file(tmp_path, "X,Y,Z\n1,2,3\n1,-2,3\n"))
