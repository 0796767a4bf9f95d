"""The promises of every measure of pictures, tried on one."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from contextlib import suppress

import numpy as np

from cyclopean.testing.promises import kept
from documents import InputError
from documents.arrays import Floats32
from stimuli.measures import EyeMeasured, Measure, ViewingConditions, measure_named

_VIEWING = ViewingConditions(45.0, np.array([95.0, 100.0, 108.9]))
_STRENGTHS = (0.005, 0.02, 0.08, 0.3)
# Mirrored copies continue a picture as filters do at its edges, so that little but the number of pixels changes.
_SIZE_AGREES, _ORDER_AGREES = 0.05, 1e-4
_SIZES = ((1, 1), (1, 60), (60, 1), (11, 11), (12, 200))


def prove_measure(measure: str | Measure) -> tuple[str, ...]:
    """Prove that a measure keeps what the program promises of every measure.

    Identical pictures have the value that it says; pictures that differ more are farther from it, in the direction
    that it says; exchanged pictures have the same value where it says so. A picture and its mirror image have one
    value, and so have one and four copies. Pictures whose rows are sliced are measured as arrays are, and stay as
    they are. Its map has the pictures' size, is largest where they differ, and gives the value. Pictures that it cannot
    take, too small, too dark or on a display of unknown white, are refused by an InputError, and never have NaN.

    Parameters
    ----------
    measure
        The measure, or its name.

    Returns
    -------
    tuple of str
        The promises that it kept.

    Raises
    ------
    BrokenPromiseError
        If a promise is not kept.
    InputError
        If there is no measure of that name, or its package is not installed.

    Examples
    --------
    >>> "exchanged pictures have one value" in prove_measure("pu-psnr")
    True
    """
    tried = _Tried(measure_named(measure) if isinstance(measure, str) else measure)
    promises: dict[str, Callable[[], str | None]] = {
        "identical pictures have the value it says": tried.identical,
        "pictures stay as they are": tried.unchanged,
        "rows are measured as arrays are": tried.by_rows,
        "what differs more is farther": tried.farther,
        "its map is of the pictures, and gives the value": tried.mapped,
        "mirrored pictures have one value": tried.mirrored,
        "size does not change the value": tried.larger,
        **({"exchanged pictures have one value": tried.exchanged} if tried.measure.symmetric else {}),
        "what it cannot take is refused by an InputError": tried.refused,
    }
    return kept(promises)


class _Rows:
    """A picture whose rows can be sliced, and nothing else: as large pictures come."""

    def __init__(self, picture: Floats32) -> None:
        self._picture, self.shape = picture, picture.shape

    def __getitem__(self, rows: slice, /) -> Floats32:
        return self._picture[rows].copy()


class _Tried:
    """A measure on a picture with grain, and on others that differ from it; each attempt returns what broke."""

    def __init__(self, measure: Measure) -> None:
        self.measure = measure
        self._one = _grain((48, 64))
        noise = np.random.default_rng(5).standard_normal(self._one.shape)
        self._others = [(self._one * np.exp(strength * noise)).astype(np.float32) for strength in _STRENGTHS]
        self._other = self._others[-1]

    def _value(self, first: Floats32, second: Floats32) -> float:
        return self._of(first, second).value

    def _of(self, first: Floats32, second: Floats32) -> EyeMeasured:
        return self.measure.measure(first, second, _VIEWING)

    def _same(self, value: float, share: float) -> str | None:
        """Return what differs where a value is not that of the pictures as they are, within a share of it."""
        plain, identical = self._value(self._one, self._other), self.measure.identical
        scale = abs(plain - identical) if math.isfinite(identical) else abs(plain)
        return None if abs(value - plain) <= share * scale else f"{plain:g} and {value:g}"

    def identical(self) -> str | None:
        value, said = self._value(self._one, self._one.copy()), self.measure.identical
        return None if value == said else f"{value:g} in place of {said:g}"

    def farther(self) -> str | None:
        values = [self.measure.identical, *(self._value(self._one, other) for other in self._others)]
        sign = 1 if self.measure.better == "lower" else -1
        rises = all(sign * after > sign * before for before, after in itertools.pairwise(values))
        return None if rises else f"with more noise {', '.join(f'{value:g}' for value in values)}"

    def exchanged(self) -> str | None:
        return self._same(self._value(self._other, self._one), _ORDER_AGREES)

    def mirrored(self) -> str | None:
        found = (self._value(self._one[way], self._other[way]) for way in (np.s_[::-1], np.s_[:, ::-1]))
        return next(filter(None, (self._same(value, _ORDER_AGREES) for value in found)), None)

    def larger(self) -> str | None:
        return self._same(self._value(*(_four(each) for each in (self._one, self._other))), _SIZE_AGREES)

    def by_rows(self) -> str | None:
        measured = self.measure.measure(_Rows(self._one), _Rows(self._other), _VIEWING)
        return self._same(measured.value, _ORDER_AGREES)

    def unchanged(self) -> str | None:
        first, second = self._one.copy(), self._other.copy()
        self._of(first, second)
        return None if (first == self._one).all() and (second == self._other).all() else "it wrote into one"

    def mapped(self) -> str | None:
        spot = self._one.copy()
        spot[20:26, 30:36] *= 1.3
        measured = self._of(self._one, spot)
        errors = measured.error_map
        if errors is None:
            return None
        if errors.shape != spot.shape[:2] or errors.dtype != np.float32:
            return f"{errors.dtype} {errors.shape} for pictures of {spot.shape[:2]}"
        row, column = np.unravel_index(np.nanargmax(errors), errors.shape)
        if not (17 <= row < 29 and 27 <= column < 39):
            return f"it is largest in row {row}, column {column}, and they differ around 23, 33"
        pooled = self.measure.pooled(errors.ravel())
        same = pooled is None or math.isclose(pooled, measured.value, rel_tol=1e-6)
        return None if same else f"{pooled:g} of the map, {measured.value:g} of the pictures"

    def refused(self) -> str | None:
        dark = np.zeros_like(self._one)
        pairs = [(dark, self._one), (self._one, dark), *((_grain(size), 2 * _grain(size)) for size in _SIZES)]
        for viewing in (_VIEWING, ViewingConditions(45.0), ViewingConditions(1e9, _VIEWING.display_white_XYZ)):
            for first, second in pairs if viewing is _VIEWING else [(self._one, self._other)]:
                where = f"pictures of {first.shape[0]} × {first.shape[1]} at {viewing.pixels_per_degree:g} px/°"
                try:
                    with suppress(InputError):
                        if math.isnan(self.measure.measure(first, second, viewing).value):
                            return f"{where} have NaN"
                except Exception as error:
                    return f"{where} raise {type(error).__name__}: {error}"
        return None


def _grain(size: tuple[int, int]) -> Floats32:
    rng = np.random.default_rng(1)
    light = rng.gamma(2.0, 10.0, (*size, 1)) * rng.uniform(0.7, 1.3, (*size, 3))
    return np.asarray(light * [0.95, 1.0, 1.089], dtype=np.float32)


def _four(picture: Floats32) -> Floats32:
    wide = np.concatenate([picture, picture[:, ::-1]], axis=1)
    return np.concatenate([wide, wide[::-1]])
