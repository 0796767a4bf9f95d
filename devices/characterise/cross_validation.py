"""Every model fitted to readings, and how well each predicts readings that it was not fitted to.

Five folds, seeded. Black and each channel's highest code alone stay in every training set and are not judged, because
no one would characterise a display without them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from devices.characterise.channel_fit import Kind
from devices.characterise.parametric import Fitted, fit_parametric
from devices.characterise.patches import Patches
from devices.characterise.residual_fit import fit_curves_too, fit_residual
from devices.characterise.table_fit import fit_plvc, fit_table
from devices.display.model import DisplayModel
from devices.display.model_spec import CURVES, DisplayCurves
from devices.display.plvc import Plvc
from documents.arrays import Floats

Rows = NDArray[np.intp]
PARAMETRIC: tuple[Kind, ...] = ("gamma", "gog", "ggo", "gogo")
FOLDS = 5
_TRUSTED_TIMES, _TRUSTED_MORE = 1.5, 0.05


@dataclass(frozen=True, slots=True, eq=False)
class ModelFit:
    """A model fitted to readings: how many of its numbers were free, their condition, and what else the fit tells.

    ``before``: the model before its curves were fitted along with its terms, None where they were not.
    """

    model: DisplayModel
    free_numbers: int
    condition: float
    fitted: Fitted | None
    before: Plvc | None = None


Fits: TypeAlias = Mapping[str, ModelFit]


@dataclass(frozen=True, slots=True, eq=False)
class CrossValidation:
    """Every model fitted to ``patches``, and what each predicts of readings that it was not fitted to.

    ``folds``: of each the rows that were held out, and every model fitted to the rest.
    ``predicted_XYZ`` (n, 3) in cd/m², and ``delta_e_2000`` (n,) between it and what was read, are NaN where a reading
    was never held out. ``fits_made``: how often all models were fitted.
    """

    patches: Patches
    fits: Fits
    folds: tuple[tuple[Rows, Fits], ...]
    predicted_XYZ: Mapping[str, Floats]
    delta_e_2000: Mapping[str, Floats]
    fits_made: int

    @property
    def judged(self) -> Rows:
        """The rows that were held out, fold by fold."""
        return np.concatenate([rows for rows, _ in self.folds]) if self.folds else np.zeros(0, dtype=np.intp)

    @property
    def medians(self) -> dict[str, float]:
        """The median held-out ΔE00 of each model."""
        return {name: float(np.median(delta[self.judged])) for name, delta in self.delta_e_2000.items()}

    @property
    def trusted(self) -> tuple[str, ...]:
        """The models whose median ΔE00 is near the least: the others say nothing of a single reading."""
        medians = self.medians
        most = _TRUSTED_TIMES * min(medians.values()) + _TRUSTED_MORE
        return tuple(name for name, median in medians.items() if median <= most)

    def with_residual(self) -> CrossValidation:
        """Return the same with the model of the residual too, on the PLVC that each fold has already."""
        if "residual" in self.fits:
            return self
        return self._with("residual", lambda training, own: residual_of(training, own["plvc"]))

    def with_curves(self, name: str) -> CrossValidation:
        """Return the same with another package's curves of that ``name`` too, begun at each fold's GOGO model."""
        with CURVES.blamed(name):
            return self._with(name, lambda training, own: _curves_of(CURVES[name], training, own["gogo"].model))

    def _with(self, name: str, fit: Callable[[Patches, Fits], ModelFit]) -> CrossValidation:
        folds: list[tuple[Rows, Fits]] = []
        for rows, own in self.folds:
            training = self.patches.select(np.setdiff1d(np.arange(len(self.patches)), rows))
            folds.append((rows, {**own, name: fit(training, own)}))
        fits = {**self.fits, name: fit(self.patches, self.fits)}
        return _predicted(self.patches, fits, tuple(folds), self.fits_made)


def cross_validate(data: Patches, seed: int, *, residual: bool = True) -> CrossValidation:
    """Fit every model to all of ``data``, and to what each fold leaves; that of the residual if it is asked for."""
    starts: dict[str, Floats] = {}
    whole = fit_all(data, starts, residual=residual)
    folds: list[tuple[Rows, Fits]] = []
    for rows in folds_of(data, seed):
        training = data.select(np.setdiff1d(np.arange(len(data)), rows))
        folds.append((rows, fit_all(training, starts, judged=False, residual=residual)))
    return _predicted(data, whole, tuple(folds), 1 + len(folds))


def _predicted(data: Patches, fits: Fits, folds: tuple[tuple[Rows, Fits], ...], fits_made: int) -> CrossValidation:
    predicted = {name: np.full((len(data), 3), np.nan) for name in fits}
    delta = {name: np.full(len(data), np.nan) for name in fits}
    for rows, own in folds:
        for name, fit in own.items():
            predicted[name][rows] = fit.model.xyz(data.codes[rows])
            delta[name][rows] = data.select(rows).delta_e_2000(predicted[name][rows])
    return CrossValidation(data, fits, folds, predicted, delta, fits_made)


def fit_all(data: Patches, starts: dict[str, Floats], *, judged: bool = True, residual: bool = True) -> Fits:
    """Fit every model; numbers found are kept in ``starts`` and begin the fits of nearly the same patches."""
    out: dict[str, ModelFit] = {}
    for kind in PARAMETRIC:
        fitted, numbers = fit_parametric(data, kind, starts.get(kind), judged=judged)
        starts.setdefault(kind, numbers)
        out[kind] = ModelFit(fitted.model, fitted.free_numbers, fitted.condition, fitted)
    tables = fit_table(data, out["gogo"].model, judged=judged)
    out["table"] = ModelFit(tables.model, tables.free_numbers, tables.condition, tables)
    plvc, numbers_of, condition = fit_plvc(data, tables, judged=judged)
    out["plvc"] = ModelFit(fit_curves_too(data, plvc), numbers_of, condition, None, plvc)
    if residual:
        out["residual"] = residual_of(data, out["plvc"])
    return out


def residual_of(data: Patches, plvc: ModelFit) -> ModelFit:
    """Return the model of the residual on the PLVC fitted to the same ``data``."""
    assert plvc.before is not None
    return ModelFit(*fit_residual(data, plvc.before, plvc.free_numbers), float("nan"), None)


def _curves_of(kind: type[DisplayCurves], data: Patches, begin: DisplayModel) -> ModelFit:
    return ModelFit(*kind.fitted(data.codes, data.XYZ, begin), float("nan"), None)


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
