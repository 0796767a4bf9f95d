"""How far a display's colours lie from those asked of it: 24 fresh colours, asked in XYZ, shown and measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from devices.colour import delta_e_2000, xyz_to_lab
from devices.display import DisplayModel
from devices.patches import Patch, PatchSet
from devices.patches.colorchecker import AskedColour
from runner.measuring.errors import MeasuringError
from runner.measuring.log import Session


@dataclass(frozen=True, slots=True)
class Checked:
    """A colour asked and measured, XYZ with Y in cd/m², and the difference, in ΔE00 against the display's white.

    ``desaturated`` says that the chart's own colour lies outside the gamut and a less saturated one was asked.
    """

    name: str
    asked_XYZ_cd_m2: tuple[float, float, float]
    measured_XYZ_cd_m2: tuple[float, float, float]
    delta_e_00: float
    desaturated: bool


@dataclass(frozen=True, slots=True)
class Verdict:
    """ΔE00 of the colours that were read: mean, 95th percentile and largest; those ``missing`` were not read."""

    colours: tuple[Checked, ...]
    mean: float
    p95: float
    largest: float
    missing: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Return the numbers."""
        return {
            "delta_e_00": {"mean": self.mean, "p95": self.p95, "max": self.largest},
            "missing": list(self.missing),
            "colours": [
                {
                    "name": one.name,
                    "asked_XYZ_cd_m2": one.asked_XYZ_cd_m2,
                    "measured_XYZ_cd_m2": one.measured_XYZ_cd_m2,
                    "delta_e_00": one.delta_e_00,
                    "desaturated": one.desaturated,
                }
                for one in self.colours
            ],
        }


def patches_of(asked: tuple[AskedColour, ...], model: DisplayModel) -> PatchSet:
    """Return the codes that ``model`` says show the colours ``asked``."""
    made = []
    for colour in asked:
        red, green, blue = map(float, model.code(colour.XYZ_cd_m2))
        made.append(Patch(colour.name, (red, green, blue)))
    return PatchSet("colorchecker", tuple(made), "ColorChecker Classic, asked in XYZ")


def judge(session: Session, asked: tuple[AskedColour, ...], model: DisplayModel) -> Verdict:
    """Return how far the readings of ``session`` lie from what was ``asked``.

    The reference white is that of ``model`` at full drive, for both. Raises MeasuringError if nothing was read.
    """
    read = {session.steps[place].patch.name: kept.reading for place, kept in session.readings.items()}
    found = [(colour, read[colour.name].XYZ_cd_m2) for colour in asked if colour.name in read]
    if not found:
        raise MeasuringError("none of the colours was read")
    white = model.xyz([1.0, 1.0, 1.0])
    asked_lab = xyz_to_lab(np.array([colour.XYZ_cd_m2 for colour, _ in found]), white)
    differences = delta_e_2000(asked_lab, xyz_to_lab(np.array([XYZ for _, XYZ in found]), white))
    colours = tuple(
        Checked(colour.name, _triple(colour.XYZ_cd_m2), _triple(XYZ), float(difference), colour.desaturated)
        for (colour, XYZ), difference in zip(found, differences, strict=True)
    )
    missing = tuple(colour.name for colour in asked if colour.name not in read)
    p95 = float(np.percentile(differences, 95))
    return Verdict(colours, float(differences.mean()), p95, float(differences.max()), missing)


def _triple(values: Any) -> tuple[float, float, float]:
    X, Y, Z = map(float, values)
    return X, Y, Z
