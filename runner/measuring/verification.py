"""How far a display's colours lie from those asked of it: 24 fresh colours, asked in XYZ, shown and measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.colour.ciede2000 import delta_e_2000
from devices.colour.spaces import xyz_to_lab
from devices.display.model import DisplayModel
from devices.errors import MeasuringError
from devices.instruments import Showing
from devices.instruments.simulated import Faults, Simulated, SimulatedDisplay
from devices.measurements.log import Kept, Session, Shown
from devices.patches import Patch, PatchEye, PatchSet
from devices.patches.colorchecker import AskedColour

Floats = NDArray[np.float64]
Triple = tuple[float, float, float]
_NO_FAULT = Faults(noise=0.0)


@dataclass(frozen=True, slots=True)
class Checked:
    """A colour asked, measured, and predicted: XYZ with Y in cd/m², differences in ΔE00 against the display's white.

    ``predicted_XYZ_cd_m2`` is what the display file says of the codes that stood on the screen, and
    ``predicted_delta_e_00`` how far that lies from what was asked: what codes in whole numbers and the gamut cost.
    ``desaturated`` says that the chart's own colour lies outside the gamut and a less saturated one was asked.
    """

    name: str
    asked_XYZ_cd_m2: Triple
    measured_XYZ_cd_m2: Triple
    delta_e_00: float
    desaturated: bool
    predicted_XYZ_cd_m2: Triple
    predicted_delta_e_00: float


@dataclass(frozen=True, slots=True)
class Spread:
    """The mean, 95th percentile and largest of differences in ΔE00."""

    mean: float
    p95: float
    largest: float

    @classmethod
    def of(cls, differences: Floats) -> Spread:
        """Return the spread of ``differences``, shape (n,), n at least 1."""
        return cls(float(differences.mean()), float(np.percentile(differences, 95)), float(differences.max()))

    def to_json(self) -> dict[str, float]:
        """Return the numbers."""
        return {"mean": self.mean, "p95": self.p95, "max": self.largest}


@dataclass(frozen=True, slots=True)
class Verdict:
    """The differences of the colours that were read, ``achieved`` and as the model alone has them; the ``missing`` were
    not read.
    """

    colours: tuple[Checked, ...]
    achieved: Spread
    predicted: Spread
    missing: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Return the numbers."""
        return {
            "delta_e_00": self.achieved.to_json(),
            "model_alone_delta_e_00": self.predicted.to_json(),
            "missing": list(self.missing),
            "colours": [
                {
                    "name": one.name,
                    "asked_XYZ_cd_m2": one.asked_XYZ_cd_m2,
                    "measured_XYZ_cd_m2": one.measured_XYZ_cd_m2,
                    "delta_e_00": one.delta_e_00,
                    "model_XYZ_cd_m2": one.predicted_XYZ_cd_m2,
                    "model_alone_delta_e_00": one.predicted_delta_e_00,
                    "desaturated": one.desaturated,
                }
                for one in self.colours
            ],
        }


def patches_of(asked: tuple[AskedColour, ...], model: DisplayModel) -> PatchSet:
    """Return the colours ``asked`` with the codes that ``model`` alone would show them by."""
    made = []
    for colour in asked:
        red, green, blue = map(float, model.code(colour.XYZ_cd_m2))
        made.append(Patch(colour.name, (red, green, blue)))
    return PatchSet("colorchecker", tuple(made), "ColorChecker Classic, asked in XYZ")


def asked_XYZ(asked: tuple[AskedColour, ...], model: DisplayModel) -> Mapping[str, Floats]:
    """Return what is asked by patch name: the colours, and the black and white that are shown again and again."""
    ends = {"black": model.xyz([0.0] * 3), "white": model.xyz([1.0] * 3)}
    return {**ends, **{colour.name: colour.XYZ_cd_m2 for colour in asked}}


def judge(session: Session, asked: tuple[AskedColour, ...], display: SimulatedDisplay, eye: PatchEye) -> Verdict:
    """Return how far the readings of ``session`` lie from what was ``asked`` of ``eye``.

    A gain map that makes the whole panel as dim as its dimmest place makes what was asked dimmer too. The reference
    white is the model's at full drive, dimmed alike. Raises MeasuringError if nothing was read.
    """
    kept = {session.steps[place].patch.name: one for place, one in session.readings.items()}
    found = [(colour, kept[colour.name]) for colour in asked if colour.name in kept]
    if not found:
        raise MeasuringError("none of the colours was read")
    share = 1.0 if display.gain_map is None else display.gain_map.delivered_share
    model = display.models.right if eye == "right" else display.models.left
    white = share * model.xyz([1.0, 1.0, 1.0])
    wanted = share * np.array([colour.XYZ_cd_m2 for colour, _ in found])
    read = np.array([one.reading.XYZ_cd_m2 for _, one in found])
    told = np.array([_predicted(session, one, display, eye) for _, one in found])
    wanted_lab = xyz_to_lab(wanted, white)
    achieved = delta_e_2000(wanted_lab, xyz_to_lab(read, white))
    predicted = delta_e_2000(wanted_lab, xyz_to_lab(told, white))
    colours = tuple(
        Checked(
            colour.name,
            _triple(wanted[row]),
            _triple(read[row]),
            float(achieved[row]),
            colour.desaturated,
            _triple(told[row]),
            float(predicted[row]),
        )
        for row, (colour, _) in enumerate(found)
    )
    missing = tuple(colour.name for colour in asked if colour.name not in kept)
    return Verdict(colours, Spread.of(achieved), Spread.of(predicted), missing)


def _predicted(session: Session, kept: Kept, display: SimulatedDisplay, eye: PatchEye) -> Triple:
    """Return what the display file says of the codes that stood on the screen while ``kept`` was read."""
    step = session.steps[kept.position]
    shown = kept.shown or Shown(step.patch.codes, step.patch.codes if eye == "both" else (0.0, 0.0, 0.0))
    showing = Showing(step.label, shown.own, 0, 0.0, shown.other, step.patch, shown.place)
    return Simulated(display, 0, _NO_FAULT, eye).read(showing).XYZ_cd_m2


def _triple(values: Any) -> Triple:
    X, Y, Z = map(float, values)
    return X, Y, Z
