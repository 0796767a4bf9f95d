"""Loads gamma tables and ends: run as a process of its own, with the tables as JSON on standard input.

It ends without terminating glfw, which would load again what was there before.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping, Sequence

import glfw
import numpy as np

from runner.presenter.surfaces.gamma_tables import monitor_names


def _load(tables: Mapping[str, Sequence[Sequence[int]]]) -> str:
    """Load ``tables`` (red, green and blue of 16 bits) by monitor; return what went wrong, an empty text if nothing."""
    there = monitor_names(glfw)
    for name, channels in tables.items():
        if name not in there:
            return f"there is no monitor '{name}' (there: {', '.join(there) or 'none'})"
        # Half an entry more, as the library cuts what it multiplies off to whole numbers.
        shares = [[(entry + 0.5) / 65535.0 if entry < 65535 else 1.0 for entry in channel] for channel in channels]
        glfw.set_gamma_ramp(there[name], shares)  # type: ignore[arg-type] # it takes three lists
        try:
            ramp = glfw.get_gamma_ramp(there[name])
        except ValueError:
            return f"the monitor '{name}' has no gamma table"
        read = np.rint(65535.0 * np.array([ramp.red, ramp.green, ramp.blue]))
        # Hardware of 8 bits is within a step of what it was given.
        if read.shape != np.shape(channels) or np.abs(read - np.array(channels)).max() > 256:
            return f"the monitor '{name}' did not take the table"
    return ""


def main() -> None:
    """Load the tables and end; exit status 1, with the reason on standard output, if that failed."""
    tables = json.load(sys.stdin)
    wrong = _load(tables) if glfw.init() else "no display server can be reached"
    sys.stdout.write(wrong)
    sys.stdout.flush()
    os._exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
