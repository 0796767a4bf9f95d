"""What proves a reader: ours keep the promises, one that breaks a promise is found out; another package's is used."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cyclopean.testing import BrokenPromiseError, prove_reader
from devices.errors import DeviceError
from devices.readings import READERS, Measurements, read_measurements, write_csv
from devices.readings.ti3 import write_ti3

CODES = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0.5, 0.25, 0.75]])
LIGHT = np.array([[0.123, 0.145, 0.167], [95.25, 100.125, 108.875], [20.5, 31.25, 42.75]])
LINES = "begin\n" + "".join(f"{code} {light}\n" for code, light in zip(CODES, LIGHT, strict=True)).translate(
    str.maketrans("[]", "  ")
)
READER = """
from devices.errors import DeviceError
from devices.readings import Measurements
from documents import Finding

CYCLOPEAN_INTERFACE = 1

def read(path):
    lines = path.read_bytes().decode("ascii", "replace").splitlines()
    if lines[:1] != ["begin"]:
        raise DeviceError(Finding("it does not begin", str(path), 1, remedy="begin"))
    rows = []
    for number, line in enumerate(lines[1:], 2):
        try:
            rows.append([float(word) for word in line.split()])
            Measurements([rows[-1][:3]], [rows[-1][3:]])
        except (ValueError, DeviceError) as error:
            raise DeviceError(Finding(f"'{line}' is no reading", str(path), number, remedy="six numbers")) from error
    if not rows:
        raise DeviceError(Finding("it has no readings", str(path), 1, remedy="measure"))
    return Measurements([row[:3] for row in rows], [row[3:] for row in rows])
"""
BROKEN = {
    "row[3:] for row": ("[2 * value for value in row[3:]] for row", "what the file holds"),
    "    return Meas": ("    path.write_bytes(path.read_bytes().rstrip())\n    return Meas", "stays as it is"),
    "    if not rows": ("    if len(lines[-1].split()) < 6: raise OSError\n    if not rows", "cut short"),
    "(ValueError, DeviceError)": ("DeviceError", "no traceback|ValueError"),
    'str(path), number, remedy="six numbers"': ("str(path), number", "no remedy"),
    "str(path), number, remedy": ("str(path), number + 1, remedy", "on line 2"),
    "float(word) for word": ("0.1 if word == 'word' else float(word) for word", "was read"),
    "    if lines": (
        "    if lines == ['a text']: return Measurements(*[[[0, 0, 0]]] * 2)\n    if lines",
        "a text was read",
    ),
}


def _reader(old: str = "", new: str = "") -> Callable[[Path], Measurements]:
    held: dict[str, Callable[[Path], Measurements]] = {}
    exec(READER.replace(old, new) if old else READER, held)
    return held["read"]


@pytest.mark.parametrize("write", [write_csv, write_ti3])
def test_our_readers_keep_the_promises(write: Callable[[Measurements, Path], None], tmp_path: Path) -> None:
    file = tmp_path / f"readings.{write.__name__[-3:]}"
    write(Measurements(CODES, LIGHT), file)
    assert len(prove_reader(file, CODES, LIGHT)) == 6


@pytest.mark.parametrize("old", ["", *BROKEN])
def test_a_broken_promise_is_found(old: str, tmp_path: Path) -> None:
    file = tmp_path / "readings.glow"
    file.write_text(LINES)
    new, said = BROKEN.get(old, ("", ""))
    if not old:
        assert len(prove_reader(file, CODES, LIGHT, reader=_reader())) == 6
        return
    with pytest.raises(BrokenPromiseError, match=said):
        prove_reader(file, CODES, LIGHT, reader=_reader(old, new))


def test_another_packages_reader_is_found_by_the_end_of_the_name(
    install: Callable[..., None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(READERS, "_loaded", {})
    file = tmp_path / "readings.GLOW"
    file.write_text(LINES)
    with pytest.raises(DeviceError) as unknown:
        read_measurements(file)
    assert ".ti3" in (unknown.value.findings[0].remedy or "")
    install("glows", READER, "2.1", group=READERS.group, glow="read")
    found = read_measurements(file)
    assert (found.XYZ.tolist(), found.notes) == (LIGHT.tolist(), "read by glows 2.1")
    install("torn", READER.replace("return", "return 1 / 0 and"), group=READERS.group, torn="read")
    torn = file.rename(tmp_path / "readings.torn")
    with pytest.raises(Exception, match=r"torn 1\.0.*ZeroDivisionError"):
        read_measurements(torn)
