"""Checks of readings before anything is fitted to them: an error in a line each, or a note."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.characterise.parametric import robust_matrix
from devices.characterise.patches import primaries_at_full
from devices.colour.ciede2000 import delta_e_2000
from devices.colour.spaces import xyz_to_lab
from devices.errors import DeviceError
from devices.readings.code_range import LEAST_FULL_DRIVE, must_differ
from devices.readings.table import Measurements
from documents import Finding
from documents.arrays import Floats
from documents.text import counted

LEAST_LEVELS = 5
_COLOURS = ("red", "green", "blue")
_MOST_NEGATIVE = 0.01
_DEAD = 0.005
_MOST_CONDITION = 40.0
_MOST_REPEAT = 2.0
_NAMED = 8


def check_readings(readings: Measurements) -> tuple[str, ...]:
    """Return notes on ``readings``, a sentence each.

    Raises
    ------
    DeviceError
        If a channel has fewer than five levels, is never near full drive, gives no light, or is not the colour that
        it is called; if the primaries are alike; if readings are saturated, or clearly below zero.
    """
    codes, XYZ = readings.codes, readings.XYZ
    _refuse(_levels(codes))
    white = float(XYZ[:, 1].max())
    if white <= 0:
        raise DeviceError(Finding("no reading has a luminance above 0", remedy="check the instrument and the columns"))
    negative = np.flatnonzero(XYZ.min(axis=1) < 0)
    _refuse(_negative(readings, negative, white) + _saturated(readings))
    black = XYZ[np.all(codes == 0, axis=1)].mean(axis=0) if np.any(np.all(codes == 0, axis=1)) else np.zeros(3)
    _refuse(_primaries(codes, XYZ - black))
    notes = _notes(readings, white)
    if len(negative):
        single, many = "reading is a little below zero and was", "readings are a little below zero and were"
        notes.append(f"{counted(len(negative), single, many)} kept as {'it is' if len(negative) == 1 else 'they are'}")
    if not np.any(np.all(codes == 0, axis=1)):
        notes.append("black was not measured; what the codes of 0 give is inferred from the rest")
    return tuple(notes)


def _refuse(findings: list[Finding]) -> None:
    if findings:
        raise DeviceError(findings)


def _levels(codes: Floats) -> list[Finding]:
    findings = []
    for channel, colour in enumerate(_COLOURS):
        levels = len(np.unique(codes[:, channel])) if len(codes) else 0
        if levels < LEAST_LEVELS:
            findings.append(
                Finding(
                    f"{colour} was measured at {levels} different codes",
                    remedy=f"a curve needs {LEAST_LEVELS} at the very least, and about 20 to be chosen well",
                )
            )
        elif codes[:, channel].max() < LEAST_FULL_DRIVE:
            findings.append(
                Finding(
                    f"the highest code of {colour} is {codes[:, channel].max():.3g} of full drive",
                    remedy="measure full drive, or check the range that the codes were declared to have",
                )
            )
    return findings


def _negative(readings: Measurements, negative: NDArray[np.intp], white: float) -> list[Finding]:
    low = negative[readings.XYZ[negative].min(axis=1) < -_MOST_NEGATIVE * white]
    if not len(low):
        return []
    return [Finding(f"XYZ is below zero at {_names(readings, low)}", remedy="no light is negative; measure again")]


def _saturated(readings: Measurements) -> list[Finding]:
    for axis in range(3):
        values = readings.XYZ[:, axis]
        top = np.flatnonzero(values == values.max())
        if must_differ(readings.codes[top]):
            return [
                Finding(
                    f"{'XYZ'[axis]} is exactly {values.max():g} at {_names(readings, top)}",
                    remedy="the instrument was saturated; measure these again with a shorter exposure or a filter",
                )
            ]
    return []


def _primaries(codes: Floats, XYZ: Floats) -> list[Finding]:
    M = robust_matrix(codes**2.2, XYZ)
    alone = primaries_at_full(codes, XYZ, np.zeros(3))
    largest = float(np.linalg.norm(M, axis=0).max())
    findings = []
    for channel, colour in enumerate(_COLOURS):
        own = alone[:, channel] if alone[:, channel].any() else M[:, channel]
        if min(float(M[:, channel].sum()), float(own.sum())) < _DEAD * largest:
            findings.append(
                Finding(
                    f"{colour} at full drive gives hardly more light than black",
                    remedy="the channel is dead, or its codes or readings are in the wrong rows",
                )
            )
    if findings:
        return findings
    if np.linalg.cond(M / np.linalg.norm(M, axis=0)) > _MOST_CONDITION:
        return [Finding("two primaries have nearly the same chromaticity", remedy="check that patches changed colour")]
    share = M / M.sum(axis=0)
    order = [int(np.argmax(share[axis])) for axis in range(3)]
    if order != [0, 1, 2]:
        chromaticities = ", ".join(f"{c} has x {share[0, i]:.3f}, y {share[1, i]:.3f}" for i, c in enumerate(_COLOURS))
        return [
            Finding(
                f"the channels are not the colours that they are called: {chromaticities}",
                remedy="columns of codes or of XYZ are swapped; put them right",
            )
        ]
    return []


def _notes(readings: Measurements, white: float) -> list[str]:
    notes = []
    if white <= 1.5:
        notes.append(f"the brightest reading has Y = {white:.3g}; if XYZ are relative, the model is not in cd/m²")
    elif abs(white - 100.0) < 1e-9:
        notes.append("the brightest reading has Y = 100; if XYZ are relative, the model is not in cd/m²")
    elif white > 5000:
        notes.append(f"the brightest reading has Y = {white:.5g}; check that this is in cd/m²")
    _, first, group = np.unique(readings.codes, axis=0, return_index=True, return_inverse=True)
    lab = xyz_to_lab(readings.XYZ, np.maximum(readings.XYZ[np.argmax(readings.XYZ[:, 1])], 1e-9 * white))
    apart = delta_e_2000(lab, lab[first[group.ravel()]])
    if apart.max() > _MOST_REPEAT:
        where = np.flatnonzero(apart > _MOST_REPEAT)
        notes.append(
            f"repeated patches differ by up to {apart.max():.1f} ΔE00 ({_names(readings, where)}): "
            "display report separates drift from scatter"
        )
    return notes


def _names(readings: Measurements, rows: NDArray[np.intp]) -> str:
    named = ", ".join(readings.name[i] for i in rows[:_NAMED])
    return named + (f" and {len(rows) - _NAMED} more" if len(rows) > _NAMED else "")
