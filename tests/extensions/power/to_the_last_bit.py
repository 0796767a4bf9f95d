"""All numbers of a simulated power, to compare without any tolerance."""

from __future__ import annotations

import numpy as np

from extensions.power.results import Power


def numbers(found: Power) -> list[bytes]:
    """Return all numbers, to the last bit."""
    return [value.tobytes() for name in Power.__slots__ if isinstance(value := getattr(found, name), np.ndarray)]
