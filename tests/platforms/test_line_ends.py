r"""Files whose lines end in \r\n, as editors and spreadsheets of Windows write them, say what they said before."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analysis.comparisons import read_table
from analysis.records import read_session, session_files
from devices.camera import read_correspondences, read_reference
from devices.readings import Measurements, read_measurements, write_csv
from devices.readings.sets import read_patches
from devices.readings.ti3 import write_ti3
from stimuli.spectral.curves import read_reflectances

Study = Any  # tests/conftest.py
CODES = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], dtype=float)
READINGS = Measurements(CODES, CODES @ np.array([[10.8, 5.6, 0.5], [9.7, 18.7, 1.6], [5.7, 2.2, 29.2]]) + 0.1)
WAVES = [400, 500, 600, 700]
TEXTS: dict[str, tuple[str, Callable[[Path], Any]]] = {
    "comparisons.csv": ('winner,loser,count\n"a,b",c,2\nc,"a,b",1\n', read_table),
    "patches.csv": ("red,green,blue\n0,0,0\n255,128,0\n", read_patches),
    "reflectances.csv": (
        "wavelength_nm,one,two\n" + "".join(f"{wave},0.5,0.25\n" for wave in WAVES),
        read_reflectances,
    ),
    "reference.csv": ("name,X,Y,Z\nA1,10,11,12\nA2,20,21,22\n", read_reference),
    "correspondences.csv": (
        "name,R,G,B,X,Y,Z\nA1,0.1,0.2,0.3,10,11,12\nA2,0.2,0.3,0.4,20,21,22\n",
        read_correspondences,
    ),
}


def plain(value: Any) -> Any:
    """Return a value that can be compared: arrays as lists."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    return [plain(item) for item in value] if isinstance(value, (list, tuple)) else value


def alike(file: Path, read: Callable[[Path], Any]) -> None:
    before = plain(read(file))
    content = file.read_bytes()
    assert b"\r" not in content.replace(b"\r\n", b"\n")
    file.write_bytes(content.replace(b"\r\n", b"\n").replace(b"\n", b"\r\n"))
    assert plain(read(file)) == before
    file.write_bytes(b"\xef\xbb\xbf" + file.read_bytes() if file.suffix == ".csv" else file.read_bytes())
    assert plain(read(file)) == before  # and with the mark that spreadsheets put before UTF-8


@pytest.mark.parametrize("name", TEXTS)
def test_tables_read_the_same(name: str, tmp_path: Path) -> None:
    text, read = TEXTS[name]
    (tmp_path / name).write_text(text, encoding="utf-8", newline="\n")
    alike(tmp_path / name, read)


@pytest.mark.parametrize("name", ["readings.csv", "readings.ti3"])
def test_readings_of_a_display_read_the_same(name: str, tmp_path: Path) -> None:
    write: Callable[[Measurements, Path], None] = write_csv if name.endswith("csv") else write_ti3
    write(READINGS, tmp_path / name)
    alike(tmp_path / name, lambda file: (read_measurements(file).codes, read_measurements(file).XYZ))


def test_a_session_reads_the_same(study: Study) -> None:
    study.cyclopean(
        "run", study.experiment, "--observer", "01", "--results", study.results, "--simulate", study.observers
    )
    (file,) = session_files(study.results)
    alike(file, lambda log: repr(read_session(log)))
