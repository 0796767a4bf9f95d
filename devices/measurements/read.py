"""Measurements from a file of any kind that is known, by the end of its name."""

from __future__ import annotations

from pathlib import Path

from devices.errors import DeviceError
from devices.measurements.csv_table import read_csv
from devices.measurements.table import Measurements
from documents import Finding


def read_measurements(path: Path, code_range: str | None = None) -> Measurements:
    """Read ``path``: ``.csv``, ArgyllCMS's ``.ti3``, or a Psychtoolbox calibration ``.mat``; see each reader.

    ``code_range`` is for CSV; the others say their range themselves.

    Raises
    ------
    DeviceError
        With file, line, column and remedy of what is wrong.
    """
    ending = path.suffix.lower()
    if ending == ".csv":
        return read_csv(path, code_range)
    if code_range is not None:
        raise DeviceError(Finding("only the codes of a CSV file need a range", str(path), remedy="leave out --codes"))
    if ending == ".ti3":
        from devices.measurements.ti3 import read_ti3

        return read_ti3(path)
    if ending == ".mat":
        from devices.measurements.psychtoolbox import read_psychtoolbox

        return read_psychtoolbox(path)
    raise DeviceError(Finding(f"'{ending}' is no known table of measurements", str(path), remedy=".csv, .ti3 or .mat"))
