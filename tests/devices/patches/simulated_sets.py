"""Sets of patches, read with a simulated instrument as a measurement reads them, without a screen."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from devices.display import EyeModels
from devices.instruments import Faults, Showing, Simulated, SimulatedDisplay
from devices.measurements import Measurements
from devices.patches import PatchEye, find_sets, steps
from tests.devices.diagnostics.simulated import MODEL


def read_sets(
    names: tuple[str, ...], faults: Faults, eye: PatchEye = "both", seed: int = 1, room: ArrayLike = (0.0, 0.0, 0.0)
) -> Measurements:
    """Read the sets as `display measure` does, 15 s a patch."""
    model = MODEL.in_room(room)
    instrument = Simulated(SimulatedDisplay(EyeModels(model, model)), seed, faults, eye)
    taken, time_s, now_s = [], [], 0.0
    shown = steps(find_sets(names), seed, eye=eye)
    for step in shown:
        patch = step.patch
        now_s += max(15.0, patch.wait_s)
        black = (0.0, 0.0, 0.0)
        other = patch.other if patch.other is not None else patch.codes if eye == "both" else black
        place = (0.5, 0.5) if patch.place is None else patch.place.centre
        showing = Showing(step.label, patch.codes, step.position, now_s, other, patch, place)
        taken.append(instrument.read(showing).XYZ_cd_m2)
        time_s.append(now_s)
    return Measurements(
        np.array([step.patch.codes for step in shown]), np.array(taken), tuple(step.patch.name for step in shown),
        np.array(time_s), tuple(step.patch.eye or eye for step in shown),
        area=np.array([step.patch.filled for step in shown]),
        surround=np.array([step.patch.surround for step in shown]),
    )  # fmt: skip
