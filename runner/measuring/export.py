"""A measurement as the table that models are fitted to, and as a file of it: CSV, or ArgyllCMS's ``.ti3``."""

from __future__ import annotations

import os
from pathlib import Path
from typing import cast

import numpy as np

from devices.measurements import Measurements, PatchEye, write_csv
from devices.measurements.ti3 import write_ti3
from documents import Finding
from runner.measuring.errors import MeasuringError
from runner.measuring.log import Session


def measurements(session: Session) -> Measurements:
    """Return the readings of ``session`` in the order in which they were taken; the last of each step counts.

    Spectra are there if every reading has one at the same wavelengths.

    Raises
    ------
    MeasuringError
        If there are no readings.
    """
    kept = sorted(session.readings.values(), key=lambda one: (one.time_s, one.position))
    if not kept:
        raise MeasuringError(Finding("the measurement has no readings yet", str(session.file), remedy="--resume it"))
    header = session.header
    patches = [session.steps[one.position].patch for one in kept]
    wavelengths = {one.reading.wavelengths_nm for one in kept}
    order = f"{header['set']} ({header['set_source']}), seed {header['seed']}, begun {header['begun_utc']}"
    spectral = len(wavelengths) == 1 and bool(kept[0].reading.wavelengths_nm)
    return Measurements(
        np.array([one.shown.own if one.shown else session.steps[one.position].patch.codes for one in kept]),
        np.array([one.reading.XYZ_cd_m2 for one in kept]),
        tuple(patch.name for patch in patches),
        np.array([one.time_s for one in kept]),
        tuple(patch.eye or cast(PatchEye, header["eye"]) for patch in patches),
        str(header["mode"]),
        np.array([one.reading.spectrum for one in kept]) if spectral else None,
        np.array(kept[0].reading.wavelengths_nm) if spectral else None,
        str(header["instrument"]),
        "; ".join(filter(None, (str(header.get("notes", "")), order))),
        panel=str(header.get("panel", "")),
    )


def export_table(session: Session, file: Path) -> None:
    """Write the readings of ``session`` to ``file``, whole or not at all: ``.ti3`` with spectra, CSV by any other name.

    Raises
    ------
    MeasuringError
        If there are no readings, or the file cannot be written.
    """
    table = measurements(session)
    part = file.with_name(f".{file.name}.part")
    try:
        if file.suffix.lower() == ".ti3":
            write_ti3(table, part)
        else:
            write_csv(table, part, float(session.header["highest_code"]))
        os.replace(part, file)
    except OSError as error:
        what = f"the table cannot be written: {error.strerror}"
        raise MeasuringError(Finding(what, str(file), remedy="choose another place")) from error
