"""Readings of a display's patches: what was sent, what was measured, and the files that hold them."""

from devices.measurements.csv_table import read_csv, write_csv
from devices.measurements.table import Measurements, PatchEye

__all__ = ["Measurements", "PatchEye", "read_csv", "write_csv"]
