"""Colours seen at several exposures and in several lights, brought to one (thesis Table 4.2).

Between sets the thesis dims the light as it lengthens the exposure. A row of any set becomes what the camera would have
seen at the reference exposure in the reference light: its signal is divided by the exposure, relative to the reference,
and signal and XYZ alike are multiplied until the set's brightest patch has the luminance of the reference's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.camera.camera_model import ExposureSet, Form
from devices.camera.correspondences import Correspondences
from devices.camera.exposure import Exposure
from devices.errors import DeviceError
from documents import Finding

Floats = NDArray[np.float64]

_ONE_LIGHT = 0.01
_MOST_OFF = 0.03


@dataclass(frozen=True, slots=True, eq=False)
class Pooled:
    """``signal`` (n,): by what each row's signal is divided; ``light`` (n,): by what its light is multiplied."""

    reference: Exposure | None
    signal: Floats
    light: Floats
    sets: tuple[ExposureSet, ...]


def pool(colours: Correspondences, form: Form, asked: Exposure | None) -> Pooled:
    """Return how to bring the rows of ``colours`` to one exposure: ``asked``, or the least that they have.

    Raises
    ------
    DeviceError
        If the form is affine and there are several exposures, or that asked for is none of the colours'.
    """
    ones = np.ones(len(colours))
    if colours.exposures is None:
        return Pooled(asked, ones, ones, ())
    distinct = sorted(dict.fromkeys(colours.exposures), key=lambda one: (one.light, one.time_s, one.iso))
    reference = asked if asked is not None else distinct[0]
    if not any(reference.same_signal(one) for one in distinct):
        raise DeviceError(
            Finding(f"the exposure asked for, {reference}, is none of the table's", colours.file, remedy="leave it out")
        )
    if form == "affine" and len(distinct) > 1:
        raise DeviceError(
            Finding(
                f"the colours were seen at {len(distinct)} exposures, and an affine model serves one",
                colours.file,
                remedy="fit the linear form, or give the rows of one exposure",
            )
        )
    rows = {one: np.array([other == one for other in colours.exposures]) for one in distinct}
    brightest = {one: float(colours.XYZ[rows[one], 1].max()) for one in distinct}
    base = next(brightest[one] for one in distinct if reference.same_signal(one))
    signal, light = ones.copy(), ones.copy()
    for one in distinct:
        signal[rows[one]] = one.relative_to(reference)
        light[rows[one]] = base / brightest[one] if brightest[one] > 0 else 1.0
    return Pooled(reference, signal, light, _sets(distinct, brightest))


def _sets(exposures: list[Exposure], brightest: dict[Exposure, float]) -> tuple[ExposureSet, ...]:
    """Return the exposures that share a light, each light by its brightest patch."""
    grouped: list[tuple[float, list[Exposure]]] = []
    for one in exposures:
        near = [members for level, members in grouped if abs(level - brightest[one]) <= _ONE_LIGHT * level]
        if near:
            near[0].append(one)
        else:
            grouped.append((brightest[one], [one]))
    return tuple(ExposureSet(level, tuple(members)) for level, members in grouped)


def uneven(colours: Correspondences, used: NDArray[np.bool_], estimated: Floats) -> list[str]:
    """Return in sentences which exposures, of several, are off: the settings say one thing and the sensor another."""
    if colours.exposures is None or len(set(colours.exposures)) < 2:
        return []
    ratio = estimated[:, 1] / np.maximum(colours.XYZ[:, 1], 1e-12)
    said = []
    for one in dict.fromkeys(colours.exposures):
        rows = used & np.array([other == one for other in colours.exposures])
        if rows.any() and abs(np.median(ratio[rows]) - 1.0) > _MOST_OFF:
            said.append(f"at {one} the camera saw {np.median(ratio[rows]):.3f} × the light that its settings say")
    return said
