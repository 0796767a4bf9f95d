"""The noise of a sensor: its gain and read noise, given, or found in how a bracket's photographs differ.

Of two exposures of a still scene d = y_j/t_j − y_i/t_i has the variance g x (1/t_i + 1/t_j) + r² (1/t_i² + 1/t_j²).
What differs from photosite to photosite, in sensitivity as in the scene, is the same in both and drops out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from documents.arrays import Floats
from documents.text import JsonResult
from stimuli.develop import clipped_variance
from stimuli.errors import StimulusError

_BINS = 24
_LEAST_IN_BIN = 200
_ROUNDS = 6
# A pair of values is compared where the longer is expected below this share of full.
NEARLY_FULL = 0.9


@dataclass(frozen=True, slots=True)
class NoiseModel(JsonResult):
    """The variance of a value y in shares of full scale is ``gain`` · y + ``read``².

    ``gain`` is one over the electrons at full scale, ``read`` the read noise as a share of full scale. Raises
    StimulusError unless both are finite and 0 or above.
    """

    gain: float
    read: float
    json_keys: ClassVar = {"read": "read_noise"}
    json_also: ClassVar = ("full_scale_electrons", "read_noise_electrons")

    def __post_init__(self) -> None:
        for name, value in (("gain", self.gain), ("read noise", self.read)):
            if not np.isfinite(value) or value < 0:
                raise StimulusError.of(f"the {name} of a sensor is {value:g}", "give a number of 0 or above")

    @property
    def is_any(self) -> bool:
        """Whether there is noise at all."""
        return self.gain > 0 or self.read > 0

    @classmethod
    def of_electrons(cls, full_scale: float, read: float) -> NoiseModel:
        """Return the model of a sensor with ``full_scale`` electrons at full scale and ``read`` electrons of noise.

        Raises
        ------
        StimulusError
            Unless full scale is above 0 and the read noise 0 or above.
        """
        if not full_scale > 0:
            raise StimulusError.of(f"full scale is {full_scale:g} electrons", "give a number above 0")
        return cls(1 / full_scale, read / full_scale)

    @property
    def full_scale_electrons(self) -> float | None:
        """Electrons at full scale; None where the gain is not known."""
        return 1 / self.gain if self.gain > 0 else None

    @property
    def read_noise_electrons(self) -> float | None:
        """The read noise in electrons."""
        return None if self.full_scale_electrons is None else self.read * self.full_scale_electrons


def parse_noise(text: str) -> NoiseModel:
    """Return the noise written as ``45000,3``, electrons at full scale and of read noise; else StimulusError."""
    try:
        full_scale, read = map(float, text.split(","))
    except ValueError:
        remedy = "write electrons at full scale and of read noise: 45000,3"
        raise StimulusError.of(f"the noise is '{text}'", remedy) from None
    return NoiseModel.of_electrons(full_scale, read)


def estimate_noise(
    samples: Sequence[Floats],
    full: Sequence[NDArray[np.bool_]],
    relative_exposures: Sequence[float],
    level: float = 1.0,
    read: float | None = None,
) -> NoiseModel | None:
    """Return the noise of one colour by how neighbouring exposures differ; None if too few values can be compared.

    Parameters
    ----------
    samples
        For each exposure its values at the same photosites, (n,), in shares of full scale.
    full
        For each exposure where it was saturated, (n,).
    relative_exposures
        Each exposure beside the first, ascending.
    level
        The share from which photosites are full.
    read
        The read noise as a share of full scale, where dark frames have shown it; else it is found too.
    """
    comparisons: list[tuple[float, float, float, int]] = []
    for i in range(len(samples) - 1):
        short, long = relative_exposures[i], relative_exposures[i + 1]
        good = ~full[i] & ~full[i + 1] & (samples[i] * (long / short) < NEARLY_FULL * level)
        one, other = samples[i][good], samples[i + 1][good]
        light = (one + other) / (short + long)
        difference = other / long - one / short
        order = np.argsort(light, kind="stable")
        bins = min(_BINS, len(order) // _LEAST_IN_BIN)
        for part in np.array_split(order, bins) if bins else ():
            spread = clipped_variance(difference[part])
            photons = max(float(light[part].mean()), 0.0) * (1 / short + 1 / long)
            comparisons.append((photons, 1 / short**2 + 1 / long**2, spread, len(part)))
    if not comparisons:
        return None
    photon, reading, variance, count = (np.array(column, dtype=np.float64) for column in zip(*comparisons, strict=True))
    if not variance.max() > 0:
        return NoiseModel(0.0, 0.0)
    return _fitted(np.column_stack([photon, reading]), variance, count, read)


def _fitted(A: Floats, variance: Floats, count: Floats, read: float | None) -> NoiseModel:
    """Return gain and read noise with variance ≈ A (gain, read²), each weighed by its own standard error."""
    from scipy.optimize import nnls

    floor = 1e-9 * float(variance.max())
    predicted = np.maximum(variance, floor)
    found = np.zeros(2)
    for _ in range(_ROUNDS):
        weight = np.sqrt(count) / predicted
        if read is None:
            found, _ = nnls(A * weight[:, None], variance * weight)
        else:
            gain, _ = nnls(A[:, :1] * weight[:, None], np.maximum(variance - A[:, 1] * read**2, 0.0) * weight)
            found = np.array([gain[0], read**2])
        predicted = np.maximum(A @ found, floor)
    return NoiseModel(float(found[0]), float(np.sqrt(found[1])))
