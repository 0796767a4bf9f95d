"""Every model fitted to readings, and how well each predicts readings that it was not fitted to.

Five folds, seeded. Black and each channel's highest code alone stay in every training set and are not judged, because
no one would characterise a display without them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from devices.characterise.channel_fit import Kind
from devices.characterise.parametric import Fitted, fit_parametric
from devices.characterise.patches import Patches
from devices.characterise.table_fit import fit_plvc, fit_table
from devices.display.model import DisplayModel

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]
Name = Literal["gamma", "gog", "ggo", "gogo", "table", "plvc"]
NAMES: tuple[Name, ...] = ("gamma", "gog", "ggo", "gogo", "table", "plvc")
PARAMETRIC: tuple[Kind, ...] = ("gamma", "gog", "ggo", "gogo")
FOLDS = 5
_TRUSTED_TIMES, _TRUSTED_MORE = 1.5, 0.05


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A model fitted to readings: how many of its numbers were free, their condition, and what else the fit tells."""

    model: DisplayModel
    free_numbers: int
    condition: float
    fitted: Fitted | None


@dataclass(frozen=True, slots=True, eq=False)
class CrossValidation:
    """Every model fitted to ``patches``, and what each predicts of readings that it was not fitted to.

    ``predicted_XYZ`` (n, 3) in cd/m², and ``delta_e_2000`` (n,) between it and what was read, are NaN where a reading
    was never held out. ``judged``: the rows that were, fold by fold. ``fits_made``: how often all models were fitted.
    """

    patches: Patches
    fits: Mapping[Name, Fit]
    predicted_XYZ: Mapping[Name, Floats]
    delta_e_2000: Mapping[Name, Floats]
    judged: Rows
    folds: int
    fits_made: int

    @property
    def trusted(self) -> tuple[Name, ...]:
        """The models whose median ΔE00 is near the least: the others say nothing of a single reading."""
        medians = {name: float(np.median(self.delta_e_2000[name][self.judged])) for name in NAMES}
        most = _TRUSTED_TIMES * min(medians.values()) + _TRUSTED_MORE
        return tuple(name for name in NAMES if medians[name] <= most)


def cross_validate(data: Patches, seed: int, starts: dict[str, Floats] | None = None) -> CrossValidation:
    """Fit every model to all of ``data``, and to what each fold leaves; ``starts`` as `fit_all`."""
    starts = {} if starts is None else starts
    whole = fit_all(data, starts)
    folds = folds_of(data, seed)
    predicted = {name: np.full((len(data), 3), np.nan) for name in NAMES}
    delta = {name: np.full(len(data), np.nan) for name in NAMES}
    for fold in folds:
        training = data.select(np.setdiff1d(np.arange(len(data)), fold))
        for name, fit in fit_all(training, starts, judged=False).items():
            predicted[name][fold] = fit.model.xyz(data.codes[fold])
            delta[name][fold] = data.select(fold).delta_e_2000(predicted[name][fold])
    judged = np.concatenate(folds) if folds else np.zeros(0, dtype=np.intp)
    return CrossValidation(data, whole, predicted, delta, judged, len(folds), 1 + len(folds))


def fit_all(data: Patches, starts: dict[str, Floats], *, judged: bool = True) -> dict[Name, Fit]:
    """Fit every model; numbers found are kept in ``starts`` and begin the fits of nearly the same patches."""
    out: dict[Name, Fit] = {}
    for kind in PARAMETRIC:
        fitted, numbers = fit_parametric(data, kind, starts.get(kind), judged=judged)
        starts.setdefault(kind, numbers)
        out[kind] = Fit(fitted.model, fitted.free_numbers, fitted.condition, fitted)
    tables = fit_table(data, out["gogo"].model, judged=judged)
    out["table"] = Fit(tables.model, tables.free_numbers, tables.condition, tables)
    model, numbers_of, condition = fit_plvc(data, tables, judged=judged)
    out["plvc"] = Fit(model, numbers_of, condition, None)
    return out


def anchors(codes: Floats) -> NDArray[np.bool_]:
    """Return which of the codes (n, 3) no one would leave out: black, and each channel's highest code alone."""
    out = np.all(codes == 0, axis=1)
    for channel in range(3):
        alone = np.all(np.delete(codes, channel, axis=1) == 0, axis=1)
        if alone.any():
            out |= alone & (codes[:, channel] == codes[alone, channel].max())
    return np.asarray(out)


def repeats(codes: Floats) -> NDArray[np.intp]:
    """Return the number (n,) of each reading's patch: readings of the same codes have the same."""
    return np.asarray(np.unique(codes, axis=0, return_inverse=True)[1]).ravel()


def folds_of(data: Patches, seed: int) -> list[Rows]:
    """Return the rows of each fold. Repeats of a patch are together: one must not help to predict the other."""
    held = ~anchors(data.codes)
    group = repeats(data.codes)
    order = np.random.default_rng(seed).permutation(np.unique(group[held]))
    folds = [np.flatnonzero(held & np.isin(group, part)) for part in np.array_split(order, FOLDS)]
    return [fold for fold in folds if len(fold)]
