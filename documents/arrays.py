"""What arrays are called in annotations; shape, unit and range stand in the docstring of what takes or returns one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Floats32 = NDArray[np.float32]
Flags = NDArray[np.bool_]
Indices = NDArray[np.intp]
