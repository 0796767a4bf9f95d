"""The 24 colours of the ColorChecker: asked of a display in XYZ, or as a chart in some light.

To verify a display, the chart's colours under D50 are adapted to the display's white by Bradford's transform, scaled
together until the brightest fits, and those more saturated than the display can show are moved towards the grey of
their luminance, no further than need be. For a chart that nobody measured they are adapted to the light that falls on
it; a chart differs from the published one, and fades, so that its own readings are better. Sources: [ColorChecker] for
the colours, [Lam1985] for the transform.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files

import numpy as np
from numpy.typing import ArrayLike

from devices.colour.adaptation import bradford_matrix
from devices.colour.spaces import XYZ_from_xyY
from devices.display.model import DisplayModel
from devices.errors import DeviceError
from documents import Finding
from documents.arrays import Floats
from documents.tables import ColumnSpec, Form

_D50_XY = (0.345703, 0.358539)
_WITHIN = 1e-9


@dataclass(frozen=True, slots=True)
class AskedColour:
    """``XYZ_cd_m2``, shape (3,), asked under ``name``; ``desaturated`` where it is less saturated than the chart."""

    name: str
    XYZ_cd_m2: Floats
    desaturated: bool


def colorchecker_xyY() -> tuple[tuple[str, ...], Floats]:
    """Return the names of the 24 colours and their x, y and Y under D50, shape (24, 3), Y of a perfect white 1.

    Returns
    -------
    tuple of (tuple of str, ndarray)
        The 24 names, and x, y and Y in 0..1, shape (24, 3), in the order of the chart.

    Examples
    --------
    >>> names, xyY = colorchecker_xyY()
    >>> names[0], xyY[0].tolist()
    ('dark skin', [0.437484, 0.378523, 0.098324])
    """
    text = (files("devices.readings") / "colorchecker.csv").read_text(encoding="utf-8")
    chart = Form((ColumnSpec("name", text=True), ColumnSpec("x"), ColumnSpec("y"), ColumnSpec("Y"))).parse(
        text, "colorchecker.csv"
    )
    return tuple(chart.texts("name")), chart.numbers("x", "y", "Y")


def asked_of(model: DisplayModel) -> tuple[AskedColour, ...]:
    """Return the 24 colours as asked of a display: every one inside its gamut.

    Where the display's channels do not add up, how far a colour can go is found by halving.

    Parameters
    ----------
    model
        The display model of an eye.

    Returns
    -------
    tuple of AskedColour
        For each colour its name, its XYZ in cd/m², shape (3,), and whether it was desaturated to fit the gamut.

    Examples
    --------
    >>> from pathlib import Path
    >>> from devices.display import read_display
    >>> model = read_display(Path("configs/displays/asus_vg248qe.yaml")).models("quad-buffered").left
    >>> asked = asked_of(model)
    >>> len(asked), [colour.name for colour in asked if colour.desaturated]
    (24, ['cyan'])
    """
    names, xyY = colorchecker_xyY()
    lowest, highest = model.limits
    full = model.light_of(highest)
    white = model.primaries_XYZ_cd_m2 @ full
    wanted = _adapted(XYZ_from_xyY(xyY), white) @ model.linear_from_XYZ.T
    wanted = wanted / max(1.0, float((wanted / full).max()))
    luminance = model.primaries_XYZ_cd_m2[1]
    asked = []
    for name, linear in zip(names, wanted, strict=True):
        grey = full * float(luminance @ linear) / float(luminance @ full)
        grey = np.maximum(grey, lowest)
        if model.additive:
            share = _largest_share(linear, grey, lowest, highest)
        else:
            share = _halved_share(model, linear, grey, lowest, highest)
        kept = model.channels(grey + share * (linear - grey))
        XYZ = model.xyz_of_linear(np.clip(kept, lowest, highest))
        asked.append(AskedColour(name, XYZ, share < 1.0 - _WITHIN))
    return tuple(asked)


def _adapted(XYZ: Floats, white: Floats) -> Floats:
    """Return ``XYZ`` under D50, shape (n, 3), adapted to ``white``, shape (3,), in its unit."""
    return np.asarray(XYZ @ bradford_matrix(XYZ_from_xyY([*_D50_XY, 1.0]), white).T)


def _largest_share(linear: Floats, grey: Floats, lowest: Floats, highest: Floats) -> float:
    """Return how far from ``grey`` towards ``linear``, 1 at most, all channels stay in ``lowest`` to ``highest``."""
    step = linear - grey
    share = 1.0
    for channel in range(3):
        bound = highest[channel] if step[channel] > 0 else lowest[channel]
        if step[channel] != 0:
            share = min(share, float((bound - grey[channel]) / step[channel]))
    return max(share, 0.0)


def _halved_share(model: DisplayModel, light: Floats, grey: Floats, lowest: Floats, highest: Floats) -> float:
    """Return as `_largest_share`, to a millionth, where a channel's light depends on the others'."""

    def inside(share: float) -> bool:
        channels = model.channels(grey + share * (light - grey))
        return bool(np.all((channels >= lowest - _WITHIN) & (channels <= highest + _WITHIN)))

    if inside(1.0):
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(20):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if inside(middle) else (low, middle)
    return low


def colorchecker_XYZ(white_XYZ_cd_m2: ArrayLike) -> tuple[tuple[str, ...], Floats]:
    """Return the names and XYZ (24, 3) in cd/m² of a ColorChecker whose white patch has ``white_XYZ_cd_m2`` (3,).

    Parameters
    ----------
    white_XYZ_cd_m2
        XYZ of the white patch in cd/m², shape (3,), above 0.

    Returns
    -------
    tuple of (tuple of str, ndarray)
        The 24 names, and XYZ in cd/m², shape (24, 3), in the order of the chart.

    Raises
    ------
    DeviceError
        If the white is not three finite numbers above 0.

    Examples
    --------
    >>> names, XYZ = colorchecker_XYZ([95.0, 100.0, 108.0])
    >>> names[18], XYZ[18].round(2).tolist()
    ('white 9.5', [94.82, 100.0, 108.02])
    """
    white = np.asarray(white_XYZ_cd_m2, dtype=np.float64)
    if white.shape != (3,) or not np.all(np.isfinite(white) & (white > 0)):
        raise DeviceError(Finding(f"the white patch is {white.tolist()}", remedy="give its X,Y,Z in cd/m²"))
    names, xyY = colorchecker_xyY()
    XYZ = XYZ_from_xyY(xyY)
    brightest = XYZ[np.argmax(XYZ[:, 1])]
    # The patch, not a perfect white, was measured: it is taken to be as little coloured in this light as under D50.
    d50 = XYZ_from_xyY([*_D50_XY, 1.0])
    light = white / brightest * d50
    adapted = XYZ @ bradford_matrix(d50, light).T
    return names, np.asarray(adapted * white[1] / adapted[np.argmax(xyY[:, 2]), 1])
