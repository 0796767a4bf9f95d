"""From readings through the glasses to the crosstalk matrices.

Every reading is of one eye, through its lens, while a named colour fills each eye's picture. Light above black is
additive, so that a reading with the other eye's picture lit gives one equation for the matrix K of its eye::

    reading − black − (own colour alone) = K · (the other eye's colour alone, through the other lens)

Three colours that are not nearly alike, such as red, green and blue, determine all nine numbers of K, and more give the
least-squares answer. White alone gives three equations. Of the matrices that meet them the one with the smallest norm
has rank one and would turn a leak of red into a whitish one, so that is not what is built: K is then diagonal, one
number each for X, Y and Z, which keeps the leak's own tint and lets every colour leak by it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.compensation.crosstalk import Crosstalk, refuse_leak
from devices.display.display_file import Eye
from devices.errors import DeviceError

Floats = NDArray[np.float64]
Kind = Literal["full", "diagonal"]

BLACK = "black"
# Colours more alike than this leave the third direction of the matrix to the noise of the readings.
_MOST_CONDITION = 50.0
_OTHER: Mapping[Eye, Eye] = {"left": "right", "right": "left"}


@dataclass(frozen=True, slots=True)
class CrosstalkReading:
    """One reading: through which lens, what filled each eye's picture (``black`` is code 0), and XYZ in cd/m²."""

    eye: Eye
    left: str
    right: str
    XYZ_cd_m2: tuple[float, float, float]

    @property
    def own(self) -> str:
        """The colour of the measured eye's own picture."""
        return self.left if self.eye == "left" else self.right

    @property
    def other(self) -> str:
        """The colour of the other eye's picture."""
        return self.right if self.eye == "left" else self.left


@dataclass(frozen=True, slots=True)
class EyeFit:
    """How one eye's matrix was found: ``full`` or ``diagonal``, from how many readings, and what they leave over.

    Residuals are over X, Y and Z of all readings, in cd/m². They are 0 where there were no more readings than needed.
    """

    kind: Kind
    readings: int
    residual_rms_cd_m2: float
    residual_max_cd_m2: float


@dataclass(frozen=True, slots=True)
class CrosstalkFit:
    """The crosstalk, and how each eye's matrix was found."""

    crosstalk: Crosstalk
    left: EyeFit
    right: EyeFit


def fit_crosstalk(
    readings: Sequence[CrosstalkReading], black_XYZ_cd_m2: Mapping[Eye, ArrayLike] | None = None
) -> CrosstalkFit:
    """Return the crosstalk that explains ``readings``, in the least-squares sense.

    The least that will do, for each eye: its own white on the other's black, and its own black on the other's white.
    Each eye's black is its reading of black on black, or ``black_XYZ_cd_m2[eye]``, shape (3,); give zeros if black has
    been subtracted already. Equal readings are averaged.

    Parameters
    ----------
    readings
        Readings through each lens, with the colour of either eye's picture.
    black_XYZ_cd_m2
        Each eye's black, shape (3,); None takes the readings of black on black.

    Returns
    -------
    CrosstalkFit
        The two matrices, and for each eye what they leave unexplained.

    Raises
    ------
    DeviceError
        If a reading is not three finite numbers; if an eye's black, its leak, or a colour alone that a leak is judged
        by is missing; if a leak is negative or more than all of the light; or if the fit cannot be undone.

    Examples
    --------
    >>> white, leak, none = (95.0, 100.0, 109.0), (1.9, 2.0, 2.18), (0.0, 0.0, 0.0)
    >>> rows = [("left", "white", "black", white), ("left", "black", "white", leak)]
    >>> rows += [("right", "black", "white", white), ("right", "white", "black", leak)]
    >>> readings = [CrosstalkReading(*row) for row in rows]
    >>> fit = fit_crosstalk(readings, {"left": none, "right": none})
    >>> fit.left.kind, np.diag(fit.crosstalk.left).round(6).tolist()
    ('diagonal', [0.02, 0.02, 0.02])
    """
    values = _averaged(readings)
    blacks = {eye: _black(eye, values, black_XYZ_cd_m2) for eye in _OTHER}
    alone: dict[tuple[Eye, str], Floats] = {}
    for (eye, own, other), xyz in values.items():
        if other == BLACK:
            alone[eye, own] = xyz - blacks[eye] if own != BLACK else np.zeros(3)
    for eye in _OTHER:
        alone[eye, BLACK] = np.zeros(3)
    left, left_fit = _fit_eye("left", values, blacks["left"], alone)
    right, right_fit = _fit_eye("right", values, blacks["right"], alone)
    return CrosstalkFit(Crosstalk(left, right), left_fit, right_fit)


_Values = dict[tuple[Eye, str, str], Floats]


def _averaged(readings: Sequence[CrosstalkReading]) -> _Values:
    groups: dict[tuple[Eye, str, str], list[Floats]] = {}
    for number, reading in enumerate(readings, start=1):
        xyz = np.asarray(reading.XYZ_cd_m2, dtype=np.float64)
        if xyz.shape != (3,) or not np.all(np.isfinite(xyz)):
            raise DeviceError(f"crosstalk reading {number} is {reading.XYZ_cd_m2}; it needs three finite numbers")
        groups.setdefault((reading.eye, reading.own, reading.other), []).append(xyz)
    return {key: np.asarray(np.mean(group, axis=0)) for key, group in groups.items()}


def _black(eye: Eye, values: _Values, given: Mapping[Eye, ArrayLike] | None) -> Floats:
    if given is not None and eye in given:
        black = np.asarray(given[eye], dtype=np.float64)
        if black.shape != (3,) or not np.all(np.isfinite(black)):
            raise DeviceError(f"the {eye} eye's black is {black.tolist()}; it needs three finite numbers")
        return black
    if (eye, BLACK, BLACK) in values:
        return values[eye, BLACK, BLACK]
    raise DeviceError(
        f"the {eye} eye's black was not measured; read it with both pictures black, "
        "or give zeros if black has been subtracted from the readings"
    )


def _fit_eye(
    eye: Eye, values: _Values, black: Floats, alone: Mapping[tuple[Eye, str], Floats]
) -> tuple[Floats, EyeFit]:
    """Return the matrix (3, 3) of ``eye`` and how it was found."""
    sent, leaked = [], []
    for (measured, own, other), xyz in values.items():
        if measured != eye or other == BLACK:
            continue
        for needed in ((eye, own), (_OTHER[eye], other)):
            if needed not in alone:
                raise DeviceError(
                    f"a leak into the {eye} eye needs a reading of the {needed[0]} eye's {needed[1]} alone, "
                    "with the other eye's picture black"
                )
        source = alone[_OTHER[eye], other]
        leak = xyz - black - alone[eye, own]
        if source[1] <= 0:
            raise DeviceError(f"the {_OTHER[eye]} eye's {other} gives no light above black ({source[1]:.4g} cd/m²)")
        refuse_leak(eye, other, float(leak[1]), float(source[1]))
        sent.append(source)
        leaked.append(leak)
    if not sent:
        raise DeviceError(
            f"nothing was measured of what leaks into the {eye} eye; "
            f"read it with its own picture black and the {_OTHER[eye]} eye's white"
        )
    matrix, kind = _least_squares(eye, np.array(sent), np.array(leaked))
    left_over = np.array(leaked) - np.array(sent) @ matrix.T
    rms = float(np.sqrt(np.mean(left_over**2)))
    return matrix, EyeFit(kind, len(sent), rms, float(np.abs(left_over).max()))


def _least_squares(eye: Eye, sent: Floats, leaked: Floats) -> tuple[Floats, Kind]:
    """Return K (3, 3) with leaked ≈ sent · Kᵀ, all of it where the colours allow, else its diagonal."""
    spread = np.linalg.svd(sent, compute_uv=False)
    if len(spread) == 3 and spread[2] * _MOST_CONDITION > spread[0]:
        solution = np.linalg.lstsq(sent, leaked, rcond=None)[0]
        return np.asarray(solution.T), "full"
    power = (sent**2).sum(axis=0)
    if np.any(power <= 0):
        raise DeviceError(f"the colours leaking into the {eye} eye have no X, no Y or no Z; measure white as well")
    return np.diag((sent * leaked).sum(axis=0) / power), "diagonal"
