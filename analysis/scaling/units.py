"""Units of perceived difference: nats, standard deviations, JOD and JND.

One JOD (just objectionable difference) is the difference at which three of four answers prefer the better stimulus
[PerezOrtiz2017]; one JND of ISO 20462 is the difference that gives 75 : 25 in paired comparison as well [ISO20462].
On a scale fitted as a whole they are the same length, whatever the question was: what the unit is called tells what
was asked. If it was overall quality, ISO 20462 speaks of quality JNDs; of one attribute, of attribute JNDs.

- Thurstone's Case V with the strengths in standard deviations of a difference: Φ(d) = 0.75, d = 0.6745. Equal
  standard deviations of single perceptions are then 1 / (0.6745 √2) = 1.0484 JOD, those of differences 1.4826 JOD.
- Bradley and Terry: 1 / (1 + exp(−d)) = 0.75, d = log 3 = 1.0986 nats.
- ISO 20462 turns the share of a single pair into JNDs by the angular law, (12/π) arcsin √p − 3, which ends at ±3
  JNDs instead of going to infinity; it is for pairs, and no scale here is fitted by it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

STANDARD_DEVIATIONS_PER_JOD = 0.6744897501960817
NATS_PER_JND = 1.0986122886681098
JOD_PER_STANDARD_DEVIATION = 1 / STANDARD_DEVIATIONS_PER_JOD


def iso_20462_jnd(share: Floats) -> Floats:
    """Return the JNDs between two stimuli of which the better is preferred with ``share`` (0 to 1); −3 to 3."""
    return 12 / np.pi * np.arcsin(np.sqrt(share)) - 3
