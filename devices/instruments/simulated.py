"""A simulated instrument before a simulated display: a model with the faults of real ones, the same for a seed."""

from __future__ import annotations

import time
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from devices.display import DisplayModel
from devices.errors import DeviceError
from devices.instruments.instrument import Reading, Showing
from documents import Finding


@dataclass(frozen=True, slots=True)
class Faults:
    """How the display and the instrument depart from the model; all 0 depart in nothing.

    ``noise`` is the standard deviation of a reading, as a share of it, and ``floor_cd_m2`` of a reading of no light.
    ``drift_per_hour`` is the share of light gained in an hour. ``additivity_loss`` is the share of light that white
    lacks of the sum of its channels. ``interaction`` moves a channel's code by as much, in codes of 0..1, when the
    other two are at full drive and it is at half. ``takes_s`` is how long a reading takes.

    Raises DeviceError if one is not finite, or is below 0 where only more makes sense.
    """

    noise: float = 0.002
    floor_cd_m2: float = 0.0
    drift_per_hour: float = 0.0
    additivity_loss: float = 0.0
    interaction: float = 0.0
    takes_s: float = 0.0

    def __post_init__(self) -> None:
        for name in (field.name for field in fields(self)):
            value = getattr(self, name)
            if not np.isfinite(value) or (value < 0 and name in ("noise", "floor_cd_m2", "takes_s")):
                raise DeviceError(f"'{name}' of a simulated instrument cannot be {value}")

    @classmethod
    def parse(cls, options: dict[str, str]) -> Faults:
        """Return faults of options such as ``noise=0.01``; raise DeviceError with a finding for each wrong one."""
        known = [field.name for field in fields(cls)]
        values: dict[str, float] = {}
        findings = []
        for key, text in options.items():
            if key not in known:
                findings.append(Finding(f"there is no option '{key}'", remedy=f"expected one of: {', '.join(known)}"))
                continue
            try:
                values[key] = float(text)
            except ValueError:
                findings.append(Finding(f"'{key}' is '{text}'", remedy="a number is needed"))
        if findings:
            raise DeviceError(findings)
        return cls(**values)


class Simulated:
    """Reads ``model`` with ``faults``. The noise of a patch depends on ``seed`` and its place in the order alone."""

    def __init__(self, model: DisplayModel, seed: int = 0, faults: Faults | None = None) -> None:
        self._model = model
        self._seed = seed
        self._faults = faults or Faults()
        self.name = f"simulated (seed {seed})"

    def read(self, showing: Showing) -> Reading:
        """Return what the simulated instrument reads."""
        faults = self._faults
        time.sleep(faults.takes_s)
        light = simulated_XYZ(self._model, np.array(showing.codes), faults)
        light = light * (1.0 + faults.drift_per_hour * showing.time_s / 3600.0)
        rng = np.random.default_rng([self._seed, showing.position])
        light = light * (1.0 + faults.noise * rng.standard_normal(3)) + faults.floor_cd_m2 * rng.standard_normal(3)
        return Reading((float(light[0]), float(light[1]), float(light[2])))

    def close(self) -> None:
        """Do nothing."""


def simulated_XYZ(model: DisplayModel, codes: NDArray[np.float64], faults: Faults) -> NDArray[np.float64]:
    """Return the light of ``codes``, shape (..., 3), on a display with ``faults``, before drift and noise."""
    others = (codes.sum(axis=-1, keepdims=True) - codes) / 2.0
    moved = np.clip(codes + faults.interaction * others * 4.0 * codes * (1.0 - codes), 0.0, 1.0)
    above = model.xyz(moved) - model.black_XYZ_cd_m2
    linear = np.stack([curve.linear(moved[..., i]) for i, curve in enumerate(model.curves)], axis=-1)
    together = (linear.sum(axis=-1) - linear.max(axis=-1)) / 2.0
    lost = 1.0 - faults.additivity_loss * together
    return np.asarray(model.black_XYZ_cd_m2 + above * lost[..., np.newaxis])
