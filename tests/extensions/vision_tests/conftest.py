"""The display on which vision tests are shown."""

import numpy as np

from devices.display import DisplayModel, ToneCurve

PRIMARIES = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])


def model(black: float = 0.02, scale: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> DisplayModel:
    """Return a display of these primaries, each ``scale`` times as bright, and of one ``black`` in cd/m²."""
    curve = ToneCurve(gamma=2.2)
    return DisplayModel(np.array([black, black, 1.5 * black]), PRIMARIES * scale, (curve, curve, curve))
