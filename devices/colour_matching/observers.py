"""Colorimetric observers by name: the four of the CIE, and those of CIE 170 for a field size and an age.

The functions of CIE 1931 2°, CIE 1964 10° [CIE2018], CIE 2015 2° and CIE 2015 10° [CIE170-2] are the published tables,
at every nm. ``CIE 2006 FIELD age AGE`` is computed; see `devices.colour_matching.fundamentals`.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from importlib.resources import files
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from devices.errors import DeviceError
from documents import Finding
from documents.arrays import Floats
from documents.text import did_you_mean

DEFAULT_OBSERVER = "CIE 1931 2"
# Name of each standard observer: its table, its field in degrees, and lm/W where ȳ is 1. CIE 15 sets 683 for 1931; the
# others are 683 lm/W divided by ȳ at 540 THz, as the candela is defined: the rounded figures of the CIE.
_TABLES = {
    DEFAULT_OBSERVER: ("cie_1931_2.csv", 2.0, 683.0),
    "CIE 1964 10": ("cie_1964_10.csv", 10.0, 683.6),
    "CIE 2015 2": ("cie_2015_2.csv", 2.0, 683.358),
    "CIE 2015 10": ("cie_2015_10.csv", 10.0, 683.144),
}
STANDARD_OBSERVERS: tuple[str, ...] = tuple(_TABLES)
# Other ways to write the names: ArgyllCMS's, and the usual ones.
_ALSO: Mapping[str, str] = MappingProxyType(
    {"19312": "CIE 1931 2", "196410": "CIE 1964 10", "20152": "CIE 2015 2", "201510": "CIE 2015 10"}
    | {"20122": "CIE 2015 2", "201210": "CIE 2015 10", "20062": "CIE 2015 2", "200610": "CIE 2015 10"}
)
CIE_2006_NAME = re.compile(r"CIE 2006 (\d+(?:\.\d+)?) age (\d+(?:\.\d+)?)", re.ASCII)
# 540 THz in air, where the candela defines 683 lm/W.
CANDELA_NM = 555.017
FIELD_DEG, AGE_YEARS = (1.0, 10.0), (20.0, 80.0)


@dataclass(frozen=True, slots=True)
class ColorimetricObserver:
    """Colour-matching functions x̄, ȳ, z̄ and whom they are of. Equal names are equal observers.

    Attributes
    ----------
    name
        The name, such as ``CIE 1931 2`` or ``CIE 2006 4 age 45``, which `colorimetric_observer` reads.
    field_deg
        The size of the field that the functions are for, in degrees of visual angle.
    age_years
        The age that they are for; None where they are for no age.
    wavelengths_nm
        Shape (m,), rising.
    functions
        x̄, ȳ, z̄, shape (m, 3).
    efficacy_lm_W
        The luminous efficacy where ȳ is 1, in lm/W.
    """

    name: str
    field_deg: float
    age_years: float | None
    wavelengths_nm: Floats = field(compare=False, repr=False)
    functions: Floats = field(compare=False, repr=False)
    efficacy_lm_W: float = field(compare=False, repr=False)

    def __post_init__(self) -> None:
        for array in (self.wavelengths_nm, self.functions):
            array.flags.writeable = False

    def functions_at(self, wavelengths_nm: ArrayLike) -> Floats:
        """Return x̄, ȳ, z̄ at any wavelengths, shape (n, 3): linear between the tabulated ones, 0 beyond them."""
        waves = np.asarray(wavelengths_nm, dtype=np.float64)
        columns = [np.interp(waves, self.wavelengths_nm, row, left=0.0, right=0.0) for row in self.functions.T]
        return np.stack(columns, axis=-1)


def canonical_name(name: str) -> str:
    """Return the one way in which the name of an observer is written; DeviceError if there is no such observer."""
    plain = re.sub(r"degrees?|deg|observer|[\s_\-°,]+", " ", name.lower()).strip()
    plain = re.sub(r" +", " ", plain)
    if match := re.fullmatch(r"(?:cie )?2006 (\d+(?:\.\d+)?) (?:age|aged) (\d+(?:\.\d+)?)", plain, re.ASCII):
        return cie_2006_name(float(match[1]), float(match[2]))
    known = _ALSO.get(plain.removeprefix("cie").replace(" ", ""))
    if known is None:
        names = f"write {', '.join(STANDARD_OBSERVERS)}, or CIE 2006 FIELD age AGE, such as CIE 2006 4 age 45"
        remedy = did_you_mean(name, STANDARD_OBSERVERS, names)
        raise DeviceError(Finding(f"there is no colorimetric observer '{name}'", remedy=remedy))
    return known


def cie_2006_name(field_deg: float, age_years: float) -> str:
    """Return the name of the observer of CIE 170 for a field and an age; DeviceError if these are not covered."""
    for what, value, (least, most), unit in (
        ("field", field_deg, FIELD_DEG, "degrees"),
        ("age", age_years, AGE_YEARS, "years"),
    ):
        if not least <= value <= most:
            remedy = f"CIE 170-1 covers {least:g} to {most:g} {unit}"
            raise DeviceError(Finding(f"the observer's {what} is {value:g} {unit}", remedy=remedy))
    return f"CIE 2006 {field_deg:.12g} age {age_years:.12g}"


def mixed_observers(observers: Iterable[tuple[str, str]]) -> Finding | None:
    """Return a finding where things that must be of one observer are of several, else None.

    Parameters
    ----------
    observers
        What each thing is, and the name of its observer: ``("the display file", "CIE 2015 10")``.

    Returns
    -------
    Finding or None
        The finding names each thing with its observer.

    Examples
    --------
    >>> found = mixed_observers([("the photo", "CIE 1931 2"), ("the rendering", "CIE 2015 10")])
    >>> print(found.message)
    XYZ of different colorimetric observers do not compare: the photo is of CIE 1931 2, the rendering of CIE 2015 10
    """
    named = list(observers)
    if len({observer for _, observer in named}) < 2:
        return None
    (first, observer), *others = named
    each = ", ".join([f"{first} is of {observer}", *(f"{what} of {whose}" for what, whose in others)])
    remedy = "compute all from spectra for one observer; XYZ of one cannot be turned into XYZ of another"
    return Finding(f"XYZ of different colorimetric observers do not compare: {each}", remedy=remedy)


def read_columns(name: str, columns: int) -> tuple[Floats, Floats]:
    """Return wavelengths (m,) and columns (m, columns) of a table of this package; empty cells are −infinity."""
    text = (files("devices.colour_matching") / name).read_text(encoding="utf-8")
    rows = list(csv.reader(text.splitlines()[1:]))
    table = np.array([[float(cell) if cell else -np.inf for cell in row] for row in rows])
    return table[:, 0], table[:, 1 : columns + 1]


@lru_cache(maxsize=len(_TABLES))
def standard_observer(name: str) -> ColorimetricObserver:
    """Return one of `STANDARD_OBSERVERS`, whose tables are of this package."""
    file, field_deg, efficacy = _TABLES[name]
    waves, functions = read_columns(file, 3)
    return ColorimetricObserver(name, field_deg, None, waves, functions, efficacy)
