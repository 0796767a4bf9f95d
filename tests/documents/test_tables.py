"""Every reader of tables finds separators, decimal commas, encodings and units, and names what it cannot read."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analysis.comparisons import read_table
from devices.camera import read_correspondences, read_reference
from devices.readings import read_measurements
from devices.readings.sets import read_patches
from documents import Finding, InputError
from documents.tables import ColumnSpec, Form, csv_lines, number_in
from extensions.profiles.converted_table import read_colours
from stimuli.spectral.curves import read_reflectances

Reader = Callable[[Path], Any]
WAVES = np.array([400.0, 550.0, 700.0])
# Each reader, a table with points and commas, and what must come out the same however it is written.
TABLES: dict[str, tuple[Reader, str]] = {
    "measurements": (
        lambda path: [(one := read_measurements(path)).codes.tolist(), one.XYZ.tolist(), one.name],
        "name,red,green,blue,X,Y,Z\na,0,0,255,1.5,2,3\nb,0,0,0,0,0.25,0\n",
    ),
    "correspondences": (
        lambda path: [(one := read_correspondences(path)).rgb.tolist(), one.XYZ.tolist(), one.exposures],
        "R,G,B,X,Y,Z,time_s,f_number\n0.1,0.2,0.3,4,5,6,1.3,5.6\n0.5,0.4,0.8,4,9,6,1/15,8\n",
    ),
    "reference": (lambda path: read_reference(path).XYZ.tolist(), "X,Y,Z\n1.5,2,3\n1,2,3\n"),
    "patches": (lambda path: read_patches(path).patches, "name,red,green,blue,area\na,0,0,255,0.5\n"),
    "XYZ": (lambda path: read_colours(path, "xyz", 255.0).values.tolist(), "X,Y,Z\n1.5,2,3\n"),
    "codes": (lambda path: read_colours(path, "code", 255.0).rows, "red,green,blue,note\n1.5,2,3,dim\n"),
    "reflectances": (
        lambda path: read_reflectances(path)[1]["grey"].tolist(),
        "wavelength_nm,grey\n380,0.5\n780,0.25\n",
    ),
    "comparisons": (lambda path: read_table(path).wins.tolist(), "winner,loser,count\na,b,3\nb,a,1.5\n"),
}


def _written(folder: Path, text: str, encoding: str = "utf-8") -> Path:
    file = folder / "table.csv"
    file.write_bytes(text.encode(encoding))
    return file


@pytest.mark.parametrize("name", TABLES)
def test_a_table_reads_the_same_however_it_is_written(name: str, tmp_path: Path) -> None:
    read, text = TABLES[name]
    wanted = read(_written(tmp_path, text))
    for separator in ";\t":
        parted = text.replace(",", separator)
        for encoding in ("utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"):
            mark = "\ufeff" if encoding[-3:] in ("-le", "-be") else ""
            assert read(_written(tmp_path, mark + parted, encoding)) == wanted
        assert read(_written(tmp_path, parted.replace(".", ","))) == wanted
        assert read(_written(tmp_path, parted.replace("\n", "\r\n"))) == wanted


@pytest.mark.parametrize("encoding", ["latin-1", "utf-16"])
@pytest.mark.parametrize("name", TABLES)
def test_what_is_no_text_is_refused(name: str, encoding: str, tmp_path: Path) -> None:
    read, text = TABLES[name]
    file = tmp_path / "table.csv"
    file.write_bytes(text.encode(encoding) + b"\xff" * (1 if encoding == "latin-1" else 3))
    with pytest.raises(InputError) as caught:
        read(file)
    assert caught.value.findings[0].file == str(file)


def workbook(file: Path, *sheets: str) -> Path:
    book = pytest.importorskip("openpyxl").Workbook()
    for text in sheets:
        sheet = book.create_sheet()
        for line in text.splitlines():
            numbers = [(cell, number_in(cell)) for cell in line.split(",")]
            sheet.append([(cell or None) if number != number else number for cell, number in numbers])
    book.save(file)
    return file


@pytest.mark.parametrize("name", TABLES)
def test_a_workbook_reads_as_its_sheet(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read, text = TABLES[name]
    file = workbook(tmp_path / "table.xlsx", text)
    assert read(file) == read(_written(tmp_path, text))
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    with pytest.raises(InputError) as caught:
        read(file)
    (finding,) = caught.value.findings
    assert (finding.code, finding.file) == ("workbook", str(file))
    assert "pip install openpyxl" in str(finding.remedy)


def test_a_workbook_that_is_damaged_or_holds_two_sheets_is_refused(tmp_path: Path) -> None:
    (tmp_path / "cut.xlsx").write_bytes(workbook(tmp_path / "two.xlsx", "X,Y\n1,2\n", "X,Y\n1,2\n").read_bytes()[:900])
    for name in ("cut.xlsx", "two.xlsx"):
        with pytest.raises(InputError) as caught:
            SEEN.read(tmp_path / name)
        assert [finding.code for finding in caught.value.findings] == ["workbook"]


def test_lines_of_a_workbook_are_its_rows(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        SEEN.read(workbook(tmp_path / "seen.xlsx", "# by: meter,1,2,3,4\n\nX (cd/m2),Y\n1,2\n#N/A,4\n"))
    assert [(finding.line, finding.column) for finding in caught.value.findings] == [(5, 1)]


def test_counts_have_one_decimal_mark(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        read_table(_written(tmp_path, "winner;loser;count\na;b;1,5\nb;a;2.5\n"))
    assert [(finding.line, finding.column) for finding in caught.value.findings] == [(3, 5)]


SEEN = Form((ColumnSpec("X", unit="cd/m²"), ColumnSpec("Y"), ColumnSpec("name", text=True, needed=False)))


@pytest.mark.parametrize(
    ("text", "line", "column"),
    [
        ("X;Y\n0,5;1\n1.5;1\n", 3, 1),  # 1.5 is one thing with decimal commas and another with points
        ("X,Y\n1,2,3\n", 2, None),
        ("X (fL),Y\n1,2\n", 1, 1),
        ("X,X (cd/m2)\n1,2\n", 1, 2),
        ("X\n1\n", 1, None),
        ("X,Y\n1_0,2\n", 2, 1),
        ('X,Y\n"1,500",2\n', 2, 1),  # between commas, a thousand and a half or 1.5
        ('X,Y\n"1,2\n', 2, None),
        ("", None, None),
        ("X,Y\n", None, None),
        ("# a: b\n\n;;\n", None, None),
    ],
)
def test_what_cannot_be_read_has_a_place(text: str, line: int | None, column: int | None) -> None:
    with pytest.raises(InputError) as caught:
        SEEN.parse(text, "t.csv")
    (finding,) = caught.value.findings
    assert (finding.file, finding.line, finding.column) == ("t.csv", line, column)


def test_all_faults_are_told_at_once_and_no_more_than_twenty() -> None:
    with pytest.raises(InputError) as caught:
        SEEN.parse("X,Y\na,b\n1,2\n,3\n", "t.csv")
    assert [(finding.line, finding.column) for finding in caught.value.findings] == [(2, 1), (2, 2), (4, 1)]
    with pytest.raises(InputError) as caught:
        SEEN.parse("X,Y\n" + "a,1\n" * 1000, "t.csv")
    assert len(caught.value.findings) == 20


@pytest.mark.parametrize("head", ["X (cd/m2)", "X [cd/m²]", "x (nits)", "X (cd m-2)", "X(cd/m^2)"])
def test_a_unit_may_stand_behind_the_name(head: str) -> None:
    assert SEEN.parse(f"{head};Y\n1;2\n", "t.csv").numbers("X", "Y").tolist() == [[1, 2]]


def test_a_text_may_hold_a_line_end_and_what_stands_below_keeps_its_line() -> None:
    table = SEEN.parse('# of: me\nX,Y,name\n1,2,"a\nb"\n3,4,"c,d"\n', "t.csv")
    assert table.texts("name") == ["a\nb", "c,d"]
    assert table.lines == (3, 5)
    assert table.said == {"of": ("me", 1)}


def test_luminance_and_chromaticity_are_measurements(tmp_path: Path) -> None:
    text = "R;G;B;Lv (cd/m2);x;y\n255;255;255;100,0;0,25;0,5\n0;0;0;0;0;0\n"
    assert read_measurements(_written(tmp_path, text)).XYZ.tolist() == [[50, 100, 50], [0, 0, 0]]
    with pytest.raises(InputError) as caught:
        read_measurements(_written(tmp_path, text.replace("0,5\n", "0\n")))
    assert (caught.value.findings[0].line, caught.value.findings[0].column) == (2, 6)


def test_small_letters_are_tristimulus_values_where_no_luminance_stands_beside(tmp_path: Path) -> None:
    found = read_measurements(_written(tmp_path, "r,g,b,x,y,z\n0,0,255,1,2,3\n"))
    assert found.XYZ.tolist() == [[1, 2, 3]]


def test_columns_of_comparisons_may_be_capitalised(tmp_path: Path) -> None:
    assert read_table(_written(tmp_path, "Winner;Loser;Observer\na;b;1\n")).observers == ("1",)


@pytest.mark.parametrize("hidden", ["\u202e", "\x1b[2J", "\r", "\n", "\x00", "\x9b"])
def test_what_is_told_of_a_file_cannot_move_the_terminal(hidden: str) -> None:
    told = str(Finding(f"red is '{hidden}'", f"a{hidden}.csv", 1, 2, f"write {hidden}"))
    assert told.isprintable()
    assert told.startswith("a")


def test_what_is_told_of_a_file_has_an_end() -> None:
    told = str(Finding("x" * 10**7, "a.csv", remedy="y" * 10**7))
    assert len(told) < 1300
    assert "x…" in told


@pytest.mark.parametrize("line_end", ["", "\n", "\r\n"])
def test_a_cell_of_two_lines_is_quoted_whatever_ends_lines(line_end: str) -> None:
    assert csv_lines([["g\nh", "c\rd"]], line_end) == f'"g\nh","c\rd"{line_end}'
