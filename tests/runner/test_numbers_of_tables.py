"""Every reader of CSV tables of measurements refuses what is no finite number, with file, line and column."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analysis.comparisons import read_table
from devices.camera import read_correspondences, read_reference
from devices.readings import read_csv, read_measurements
from devices.readings.sets import read_patches
from documents import InputError
from extensions.profiles import read_colours
from stimuli.spectral.curves import read_illuminant, read_reflectances, read_sensitivities

Reader = Callable[[Path], Any]
WAVES = np.array([400.0, 550.0, 700.0])
CODES = "name,red,green,blue"
# Each reader, the header of its table, and a sound line; every number in the line is then replaced in turn.
TABLES: dict[str, tuple[Reader, str, str]] = {
    "measurements": (read_csv, f"{CODES},X,Y,Z,time_s,area", "a,0,0,1,1.5,2.5,3.5,4.5,0.5"),
    "measurements by any name": (read_measurements, f"{CODES},X,Y,Z", "a,0,0,1,1.5,2.5,3.5"),
    "codes to convert": (lambda file: read_colours(file, "code", 1.0), "red,green,blue", "0,0.5,1"),
    "XYZ to convert": (lambda file: read_colours(file, "xyz", 1.0), "X,Y,Z", "1.5,2.5,3.5"),
    "patches": (read_patches, CODES, "a,0,0,1"),
    "correspondences": (read_correspondences, "red,green,blue,X,Y,Z", "0,0.5,1,1.5,2.5,3.5"),
    "exposures": (
        read_correspondences,
        "red,green,blue,X,Y,Z,time_s,f_number,iso",
        "0,0.5,1,1.5,2.5,3.5,0.25,8,100",
    ),
    "reference": (read_reference, "X,Y,Z,name", "1.5,2.5,3.5,a"),
    "reflectances": (read_reflectances, "wavelength_nm,grey", "400,0.5\n700,0.5"),
    "sensitivities": (
        lambda file: read_sensitivities(file, WAVES),
        "wavelength_nm,red,green,blue",
        "400,1,1,1\n700,1,1,1",
    ),
    "illuminant": (lambda file: read_illuminant(str(file), WAVES), "wavelength_nm,value", "400,1\n700,1"),
    "comparisons": (read_table, "winner,loser,count,ties", "a,b,2,3"),
}
CELLS = [
    (name, place)
    for name, (_, header, lines) in TABLES.items()
    for place, cell in enumerate(lines.split("\n")[0].split(","))
    if cell[0].isdigit()
]


@pytest.mark.parametrize("name", TABLES)
def test_sound_tables_are_read(name: str, tmp_path: Path) -> None:
    reader, header, lines = TABLES[name]
    (tmp_path / "t.csv").write_text(f"{header}\n{lines}\n")
    reader(tmp_path / "t.csv")


@pytest.mark.parametrize("text", ["nan", "NaN", "inf", "-inf", "1e999", "NA", "#N/A"])
@pytest.mark.parametrize(("name", "place"), CELLS)
def test_what_is_no_finite_number_is_refused_with_its_place(name: str, place: int, text: str, tmp_path: Path) -> None:
    reader, header, lines = TABLES[name]
    first, *more = lines.split("\n")
    cells = first.split(",")
    cells[place] = text
    file = tmp_path / "t.csv"
    file.write_text("\n".join([header, ",".join(cells), *more]) + "\n")
    with pytest.raises(InputError) as raised:
        reader(file)
    found = raised.value.findings[0]
    column = len(",".join(cells[:place])) + 2 if name == "comparisons" else place + 1
    assert (found.file, found.line, found.column) == (str(file), 2, column)
    assert text in found.message
