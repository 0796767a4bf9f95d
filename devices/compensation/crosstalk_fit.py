"""From readings through the glasses to the crosstalk matrices.

Every reading is of one eye, through its lens, while a named colour fills each eye's picture. Light above black is
additive, so that a reading with the other eye's picture lit gives one equation for the matrix K of its eye::

    reading − black − (own colour alone) = K · (the other eye's colour alone, through the other lens)

Three colours that are not nearly alike, such as red, green and blue, determine all nine numbers of K, and more give the
least-squares answer. White alone gives three equations. Of the matrices that meet them the one with the smallest norm
has rank one and would turn a leak of red into a whitish one, so that is not what is built: K is then diagonal, one
number each for X, Y and Z, which keeps the leak's own tint and lets every colour leak by it.

A leak may be negative [Baker2016]. Over black there is no light that it could take, so that such a leak shows over a
lit picture alone: where readings over a lit picture find one beyond their noise, those over black are left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from devices.display.crosstalk import NOISE_SHARE, Crosstalk, refuse_leak, wrong_lens
from devices.display.display_file import Eye
from devices.errors import DeviceError
from documents.arrays import Floats

Kind = Literal["full", "diagonal"]

BLACK = "black"
# Colours more alike than this leave the third direction of the matrix to the noise of the readings.
_MOST_CONDITION = 50.0
_OTHER: Mapping[Eye, Eye] = {"left": "right", "right": "left"}
# What a reading errs by where nothing was read twice: what the check of repeatability lets pass.
_USUAL_NOISE = 0.005
_FEWEST_REPEATS = 4
# The chance that any leak of a measurement is called negative where none is.
_FALSE_ALARM = 0.01
# Standard errors beyond which a leak is one.
_BEYOND_NOISE = 3.0
# Readings weigh alike up to this share of the brightest, and brighter ones less: they err by a share of their light.
_EVEN_SHARE = 0.1
# Darker readings repeat as the instrument's floor does, not by a share of their light.
_DARK_SHARE = 0.02


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
class EyeLeak:
    """How one eye's matrix was found: ``full`` or ``diagonal``, from how many readings, and what they leave over.

    Residuals are over X, Y and Z of all readings, in cd/m². They are 0 where there were no more readings than needed.
    ``over_black_left_out``: readings over black that were not used, because the leak is negative.
    """

    kind: Kind
    readings: int
    residual_rms_cd_m2: float
    residual_max_cd_m2: float
    over_black_left_out: int = 0


@dataclass(frozen=True, slots=True)
class LeakShare:
    """What one eye sees of ``other``, a colour in the other eye's picture, over ``own`` in its own picture.

    ``share``: of the colour's luminance, below 0 where the eye sees less of its own picture. ``standard_error``: of
    that share, from the readings' noise. ``negative``: whether it is below 0 beyond noise.
    """

    eye: Eye
    own: str
    other: str
    share: float
    standard_error: float
    negative: bool


@dataclass(frozen=True, slots=True)
class CrosstalkFit:
    """The crosstalk, how each eye's matrix was found, and ``shares``: the luminance that leaks, by pairs of colours."""

    crosstalk: Crosstalk
    left: EyeLeak
    right: EyeLeak
    shares: tuple[LeakShare, ...] = ()

    @property
    def is_negative(self) -> bool:
        """Whether an eye sees less of its own picture for the other's, beyond the readings' noise."""
        return any(share.negative for share in self.shares)


def fit_crosstalk(
    readings: Sequence[CrosstalkReading], black_XYZ_cd_m2: Mapping[Eye, ArrayLike] | None = None
) -> CrosstalkFit:
    """Return the crosstalk that explains ``readings``, in the least-squares sense; bright readings weigh less.

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
        If a reading is not three finite numbers, or of less than no light; if an eye's black, its leak, or a colour
        alone that a leak is judged by is missing; if a leak adds or takes more than all of the light, or a lens passes
        as much of the other eye's white as of its own; or if the fit cannot be undone.

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
    for (eye, own, other), xyz in values.items():
        if (black_XYZ_cd_m2 is None or eye not in black_XYZ_cd_m2) and xyz[1] < -NOISE_SHARE * _brightest(values):
            raise DeviceError(
                f"the {eye} eye's reading of {own} with {other} in the other's picture is {xyz[1]:.4g} cd/m², less "
                "than none; if black has been subtracted from the readings, give zeros for black"
            )
    for eye in _OTHER:
        white, leak = alone.get((eye, "white")), values.get((eye, BLACK, "white"))
        if white is not None and leak is not None:
            wrong = wrong_lens(eye, float(white[1]), float(leak[1] - blacks[eye][1]))
            if wrong:
                raise DeviceError(wrong)
    shares = _leak_shares(readings, values, blacks, alone)
    left, left_fit = _fit_eye("left", values, blacks["left"], alone, shares)
    right, right_fit = _fit_eye("right", values, blacks["right"], alone, shares)
    return CrosstalkFit(Crosstalk(left, right), left_fit, right_fit, shares)


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


def _brightest(values: _Values) -> float:
    return max(float(xyz[1]) for xyz in values.values())


def _relative_noise(readings: Sequence[CrosstalkReading], values: _Values) -> tuple[float, float]:
    """Return by what share of its luminance a reading errs, and the degrees of freedom that say so."""
    least = _DARK_SHARE * _brightest(values)
    groups: dict[tuple[Eye, str, str], list[float]] = {}
    for reading in readings:
        key = (reading.eye, reading.own, reading.other)
        if (mean := float(values[key][1])) > least:
            groups.setdefault(key, []).append(reading.XYZ_cd_m2[1] / mean - 1.0)
    repeats = sum(len(group) - 1 for group in groups.values())
    if repeats < _FEWEST_REPEATS:
        return _USUAL_NOISE, np.inf
    return float(np.sqrt(sum(sum(off**2 for off in group) for group in groups.values()) / repeats)), float(repeats)


def _leak_shares(
    readings: Sequence[CrosstalkReading],
    values: _Values,
    blacks: Mapping[Eye, Floats],
    alone: Mapping[tuple[Eye, str], Floats],
) -> tuple[LeakShare, ...]:
    """Return each leak's share of luminance, judged so that 1 measurement in 100 without negative leaks has any."""
    from scipy.stats import t

    noise, freedom = _relative_noise(readings, values)
    counts: dict[tuple[Eye, str, str], int] = {}
    for reading in readings:
        key = (reading.eye, reading.own, reading.other)
        counts[key] = counts.get(key, 0) + 1
    leaks = [
        (eye, own, other)
        for eye, own, other in values
        if other != BLACK and (eye, own) in alone and float(alone.get((_OTHER[eye], other), np.zeros(3))[1]) > 0.0
    ]
    critical = float(t.ppf(1.0 - _FALSE_ALARM / max(len(leaks), 1), freedom))
    found = []
    for eye, own, other in leaks:
        source = float(alone[_OTHER[eye], other][1])
        read, without = values[eye, own, other], alone[eye, own] + blacks[eye]
        times = counts.get((eye, own, BLACK), 1)
        variance = float(read[1]) ** 2 / counts[eye, own, other] + float(without[1]) ** 2 / times
        share, error = float(read[1] - without[1]) / source, noise * float(np.sqrt(variance)) / source
        found.append(LeakShare(eye, own, other, share, error, share + critical * error < -NOISE_SHARE))
    return tuple(found)


def _without_light_to_take(eye: Eye, shares: Sequence[LeakShare]) -> set[str]:
    """Return the other eye's colours whose readings over black tell ``eye`` nothing, because its leak is negative.

    They are those that add no light beyond noise, where any colour takes light from a lit picture.
    """
    mine = [leak for leak in shares if leak.eye == eye]
    if not any(leak.negative and leak.own != BLACK for leak in mine):
        return set()
    return {
        leak.other
        for leak in mine
        if leak.own == BLACK and leak.share <= NOISE_SHARE + _BEYOND_NOISE * leak.standard_error
    }


def _fit_eye(
    eye: Eye,
    values: _Values,
    black: Floats,
    alone: Mapping[tuple[Eye, str], Floats],
    shares: Sequence[LeakShare],
) -> tuple[Floats, EyeLeak]:
    """Return the matrix (3, 3) of ``eye`` and how it was found."""
    sent, leaked, weights = [], [], []
    even = _EVEN_SHARE * _brightest(values)
    censored, left_out = _without_light_to_take(eye, shares), 0
    for (measured, own, other), xyz in values.items():
        if measured != eye or other == BLACK:
            continue
        for needed in ((eye, own), (_OTHER[eye], other)):
            if needed not in alone:
                raise DeviceError(
                    f"a leak into the {eye} eye needs a reading of the {needed[0]} eye's {needed[1]} alone, "
                    "with the other eye's picture black"
                )
        if own == BLACK and other in censored:
            left_out += 1
            continue
        source = alone[_OTHER[eye], other]
        leak = xyz - black - alone[eye, own]
        if source[1] <= 0:
            raise DeviceError(f"the {_OTHER[eye]} eye's {other} gives no light above black ({source[1]:.4g} cd/m²)")
        refuse_leak(eye, other, float(leak[1]), float(source[1]))
        sent.append(source)
        leaked.append(leak)
        weights.append(even / max(even, float(np.hypot(xyz[1], (black + alone[eye, own])[1]))))
    if not sent:
        raise DeviceError(
            f"nothing was measured of what leaks into the {eye} eye; "
            f"read it with its own picture black and the {_OTHER[eye]} eye's white"
        )
    matrix, kind = _least_squares(eye, np.array(sent), np.array(leaked), np.array(weights))
    left_over = np.array(leaked) - np.array(sent) @ matrix.T
    rms = float(np.sqrt(np.mean(left_over**2)))
    return matrix, EyeLeak(kind, len(sent), rms, float(np.abs(left_over).max()), left_out)


def _least_squares(eye: Eye, sent: Floats, leaked: Floats, weights: Floats) -> tuple[Floats, Kind]:
    """Return K (3, 3) with leaked ≈ sent · Kᵀ, all of it where the colours allow, else its diagonal."""
    spread = np.linalg.svd(sent, compute_uv=False)
    sent, leaked = weights[:, np.newaxis] * sent, weights[:, np.newaxis] * leaked
    if len(spread) == 3 and spread[2] * _MOST_CONDITION > spread[0]:
        solution = np.linalg.lstsq(sent, leaked, rcond=None)[0]
        return np.asarray(solution.T), "full"
    power = (sent**2).sum(axis=0)
    if np.any(power <= 0):
        raise DeviceError(f"the colours leaking into the {eye} eye have no X, no Y or no Z; measure white as well")
    return np.diag((sent * leaked).sum(axis=0) / power), "diagonal"
