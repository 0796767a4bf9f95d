"""Which number a file writes for full drive, and whether codes reach from black to near full drive."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.errors import DeviceError
from documents import Finding
from documents.tables import MOST_FINDINGS, Cells, ColumnSpec

CODES = ("red", "green", "blue")
SURROUND = ("surround_red", "surround_green", "surround_blue")
DRIVEN = (
    ColumnSpec("name", ("SAMPLE_NAME",), text=True, needed=False),
    *(ColumnSpec(name, (name[0].upper(), f"RGB_{name[0].upper()}")) for name in CODES),
)
PARTS = (ColumnSpec("area", needed=False, empty=1.0), *(ColumnSpec(name, needed=False, empty=0.0) for name in SURROUND))
"""Columns of a patch's name and codes, and of what of the picture it fills and what is around it."""
_RANGE = re.compile(r"^\s*(?:0\s*(?:\.\.+|-|–|to)\s*)?(\d+(?:\.\d*)?)\s*$")
_FULL_CODES = (255.0, 1023.0)
LEAST_FULL_DRIVE = 0.75
"""The least highest code of a channel, as a share of full drive, from which a model is fitted."""
# Half a code of 16 bits is lost in writing a table.
ROUNDING = 1e-5


def parse_code_range(text: str, file: str, line: int | None = None) -> float:
    """Return the code of full drive that ``0..255`` or ``255`` names.

    Raises
    ------
    DeviceError
        If the text is no such range.
    """
    match = _RANGE.match(text)
    if not match or float(match[1]) <= 0:
        raise DeviceError(
            Finding(f"'{text.strip()}' is no range of codes", file, line, remedy="write 0..1, 0..255 or 0..1023")
        )
    return float(match[1])


def full_code(largest: float, declared: float | None, file: str) -> tuple[float, str]:
    """Return the code of full drive, and a sentence about what was assumed, empty where it was ``declared``.

    Raises
    ------
    DeviceError
        If the range was not declared and ``largest``, the largest code in the file, does not determine it.
    """
    if declared is not None:
        return declared, ""
    if 0 < largest <= 1:
        return 1.0, f"codes were taken to be 0..1, because the largest is {largest:g}"
    if largest in _FULL_CODES:
        return largest, f"codes were taken to be 0..{largest:g}, because the largest is {largest:g}"
    raise DeviceError(
        Finding(
            f"the largest code is {largest:g}, which does not determine the code of full drive",
            file,
            remedy="declare it in a line '# codes: 0..255', or with --codes 0..255",
        )
    )


@dataclass(frozen=True, slots=True, eq=False)
class DrivenCodes:
    """What a table's codes drive: ``codes`` (n, 3) and those ``around`` each patch, if it has any, 0..1 of ``full``."""

    codes: NDArray[np.float64]
    around: NDArray[np.float64] | None
    full: float
    assumed: str


def driven(table: Cells, code_range: str | None) -> DrivenCodes:
    """Return the codes of a table of `DRIVEN` and `PARTS`, as shares of the code of full drive.

    That is what a person gives, else what the comment ``# codes: 0..255`` says, else what the largest code tells.

    Raises
    ------
    DeviceError
        If it is not known, or codes lie outside.
    """
    names = [name for name in (*CODES, *SURROUND) if name in table]
    codes = table.numbers(*names)
    declared = None
    if code_range is not None:
        declared = parse_code_range(code_range, table.file)
    elif "codes" in table.said:
        declared = parse_code_range(table.comment("codes"), table.file, table.line_of("codes"))
    full, assumed = full_code(float(codes.max()), declared, table.file)
    outside = np.argwhere((codes < 0) | (codes > full))[:MOST_FINDINGS].tolist()
    if outside:
        what = [f"the code {codes[row, at]:g} lies outside 0..{full:g}" for row, at in outside]
        places = [table.fault(row, names[at], told) for (row, at), told in zip(outside, what, strict=True)]
        raise DeviceError(places)
    codes = codes / full
    return DrivenCodes(codes[:, :3], codes[:, 3:] if len(names) > len(CODES) else None, full, assumed)


def part_faults(table: Cells) -> Iterator[Finding]:
    """Yield what is wrong with the `PARTS` of a table."""
    missing = [name for name in SURROUND if name not in table]
    if 0 < len(missing) < len(SURROUND):
        what = f"the header has no {', '.join(missing)}"
        yield Finding(what, table.file, table.header_line, remedy="all three, or none")
    for row, area in enumerate(table.numbers("area").tolist() if "area" in table else ()):
        if area <= 0 or area > 1:
            what = f"the area is '{table.texts('area')[row]}'"
            yield table.fault(row, "area", what, "a share of the picture above 0 and at most 1")


_LEAST_CODES = 3


def must_differ(codes: NDArray[np.float64]) -> bool:
    """Return whether a display cannot give one light at all of ``codes``, whatever filter is before the instrument.

    A channel that stays at one level may give all the light behind a filter that takes the others'.

    Parameters
    ----------
    codes
        Device codes in 0..1, shape (n, 3).

    Returns
    -------
    bool
        Whether there are three colours or more, and no channel that is lit stays at one level.

    Examples
    --------
    >>> must_differ(np.array([[0.9, 0.9, 0.9], [0.95, 0.95, 0.95], [1, 1, 1]]))
    True
    >>> must_differ(np.array([[1, 0, 0], [1, 1, 0], [1, 1, 1]]))
    False
    """
    different = np.unique(codes, axis=0)
    stays = (np.ptp(different, axis=0) == 0) & (different[0] > 0)
    return len(different) >= _LEAST_CODES and not bool(stays.any())


def can_be_modelled(black: NDArray[np.float64], codes: NDArray[np.float64], sent: NDArray[np.float64]) -> bool:
    """Return whether models can be fitted to the codes that a gamma table ``sent`` as well as to ``codes``.

    Without code 0 no model finds the panel's own black, and where a table ends far below full drive, none knows the
    rest. Then the codes before the table are those to fit to, which hold while it is loaded.

    Parameters
    ----------
    black
        What the table makes of code 0, as shares of full drive, shape (3,).
    codes, sent
        The codes before and behind the table, 0..1, shape (n, 3).
    """
    driven = codes.max(axis=0, initial=0.0) >= LEAST_FULL_DRIVE
    reached = sent.max(axis=0, initial=0.0) >= LEAST_FULL_DRIVE
    return bool(np.all(black <= ROUNDING) and np.all(reached[driven]))
