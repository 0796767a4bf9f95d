"""Fit every candidate, judge each on readings that it was not fitted to, and choose the simplest that does well.

Cross-validation in five folds, seeded. Black and each channel's highest code alone stay in every training set and are
not judged, because no one would characterise a display without them. The model with the fewest free numbers wins whose
held-out mean is within 0.05 ΔE00 of the best and whose 95th percentile is within 0.2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from devices.characterise.channel_fit import Kind
from devices.characterise.figures import (
    Errors,
    ModelNumbers,
    differences,
    errors_of,
    inversion_error_codes,
    r_squared,
    table_error_codes,
)
from devices.characterise.parametric import Fitted, fit_parametric
from devices.characterise.patches import Patches, patches
from devices.characterise.readings_check import check_readings
from devices.characterise.table_fit import fit_plvc, fit_table
from devices.display.model import DisplayModel
from devices.display.plvc import Plvc
from devices.errors import DeviceError
from devices.measurements.table import Measurements
from documents import Finding
from documents.text import counted

Floats = NDArray[np.float64]
Name = Literal["gamma", "gog", "ggo", "gogo", "table", "plvc"]
NAMES: tuple[Name, ...] = ("gamma", "gog", "ggo", "gogo", "table", "plvc")
PARAMETRIC: tuple[Kind, ...] = ("gamma", "gog", "ggo", "gogo")

MARGIN_MEAN, MARGIN_P95 = 0.05, 0.2
FOLDS = 5
# Beyond this the readings are not those of a display that any of the models describes.
MOST_MEAN = 3.0
_NOTABLE_MEAN = 1.0
# A reading is doubted when the robust fit misses it by this much, and by this many times the median.
_DOUBT, _DOUBT_TIMES = 4.0, 6.0
_MOST_DOUBTED = 0.1
# With fewer held-out readings than this, the choice is little more than a guess.
_FEW = 30


@dataclass(frozen=True, slots=True)
class Candidate:
    """One model, fitted to all readings, and what is known of it.

    ``held_out`` is of readings that it was not fitted to. ``r2_XYZ``: of X, Y and Z over all readings. ``unusable``
    says why it cannot be chosen, empty where it can. ``table_error_codes``: the presenter's table against the model;
    ``inversion_error_codes``: the model's inverse against the codes that gave the light; both in codes of 8 bits, None
    where it cannot be undone.
    """

    name: Name
    model: DisplayModel
    free_numbers: int
    held_out: Errors
    fitted: Errors
    r2_XYZ: tuple[float, ...]
    condition: float
    standard_errors: dict[str, float]
    at_bound: tuple[str, ...]
    unusable: str
    table_error_codes: float | None
    inversion_error_codes: float | None

    @property
    def r2_average(self) -> float:
        """The mean coefficient of determination over X, Y and Z."""
        return float(np.mean(self.r2_XYZ))

    @property
    def numbers(self) -> ModelNumbers:
        """The model's numbers, with standard errors where the fit gives them."""
        return ModelNumbers.of(self.model, self.standard_errors)

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON; the model itself is left out."""
        return {
            "model": self.name,
            "free_numbers": self.free_numbers,
            "held_out_delta_e_2000": self.held_out.to_json(),
            "fitted_delta_e_2000": self.fitted.to_json(),
            "r2": {**dict(zip("XYZ", self.r2_XYZ, strict=True)), "average": self.r2_average},
            "condition": self.condition if np.isfinite(self.condition) else None,
            "standard_errors": self.standard_errors,
            "at_bound": list(self.at_bound),
            "unusable": self.unusable,
            "table_error_codes": self.table_error_codes,
            "inversion_error_codes": self.inversion_error_codes,
        }


@dataclass(frozen=True, slots=True)
class Characterisation:
    """The ``chosen`` candidate and why, all of them, how they were judged, and where the chosen one errs.

    ``notes``: sentences about the readings that a reader must know. ``where_it_errs``: plain sentences. ``patches``:
    the readings that were fitted; those ``left_out`` are named.
    """

    chosen: Candidate
    reason: str
    candidates: tuple[Candidate, ...]
    folds: int
    seed: int
    notes: tuple[str, ...]
    where_it_errs: tuple[str, ...]
    left_out: tuple[str, ...]
    patches: Patches

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "chosen": self.chosen.name,
            "reason": self.reason,
            "patches": len(self.patches),
            "folds": self.folds,
            "seed": self.seed,
            "white_XYZ_cd_m2": self.patches.white.tolist(),
            "said": list(self.notes),
            "where_it_errs": list(self.where_it_errs),
            "left_out": list(self.left_out),
            "candidates": [candidate.to_json() for candidate in self.candidates],
        }


def characterise(readings: Measurements, model: Name | Literal["auto"] = "auto", *, seed: int = 1) -> Characterisation:
    """Fit the candidates to ``readings`` and choose, or take ``model``.

    Raises
    ------
    DeviceError
        As `devices.characterise.readings_check.check_readings`; if readings of both eyes are mixed; if more than a
        tenth of the readings disagree with the rest; or if no model, or not the one asked for, predicts them.
    """
    eyes = set(readings.eye)
    if {"left", "right"} <= eyes:
        raise DeviceError(Finding("the readings are of both eyes", remedy="choose one with --eye left or --eye right"))
    notes = list(readings.assumptions) + list(check_readings(readings))
    kept, doubted = _sound(readings)
    if doubted:
        notes.append(
            counted(len(doubted), "reading disagrees with the rest and was", "readings disagree with the rest and were")
            + f" left out: {', '.join(doubted)}"
        )
    data = patches(readings.codes[kept], readings.XYZ[kept])
    names = tuple(readings.name[i] for i in kept)
    starts: dict[str, Floats] = {}
    whole = fit_all(data, starts)
    folds = _folds(data, seed)
    delta = {name: np.full(len(data), np.nan) for name in NAMES}
    for fold in folds:
        training = data.select(np.setdiff1d(np.arange(len(data)), fold))
        for name, fit in fit_all(training, starts, judged=False).items():
            delta[name][fold] = differences(fit[0], data.select(fold))
    if not folds:
        raise DeviceError(Finding("no readings are left to judge a model by", remedy="measure more patches"))
    judged = np.concatenate(folds)
    if len(judged) < _FEW:
        notes.append(
            f"only {counted(len(judged), 'reading was', 'readings were')} held out, too few to choose or judge "
            "a model by: measure more"
        )
    candidates = tuple(_candidate(name, whole[name], data, delta[name][judged], judged) for name in NAMES)
    chosen, reason = _choose(candidates, model)
    mean = chosen.held_out.mean
    if mean > MOST_MEAN:
        raise DeviceError(
            Finding(
                f"{'no model predicts' if model == 'auto' else model + ' does not predict'} these readings: "
                f"the mean held-out difference of {chosen.name} is {mean:.1f} ΔE00",
                remedy="check the range of the codes and the order of the rows, or measure again"
                if model == "auto"
                else "let --model auto choose",
            )
        )
    if mean > _NOTABLE_MEAN:
        notes.append(f"the chosen model errs by {mean:.2f} ΔE00 on average, which people see: measure again, or more")
    if chosen.unusable:
        notes.append(f"{chosen.name} was asked for; {chosen.unusable}")
    errs = _where(delta[chosen.name], data, names, judged)
    return Characterisation(chosen, reason, candidates, len(folds), seed, tuple(notes), errs, doubted, data)


def fit_all(
    data: Patches, starts: dict[str, Floats], *, judged: bool = True
) -> dict[Name, tuple[DisplayModel, int, float, Fitted | None]]:
    """Fit every model; numbers found are kept in ``starts`` and begin the fits of nearly the same patches."""
    out: dict[Name, tuple[DisplayModel, int, float, Fitted | None]] = {}
    for kind in PARAMETRIC:
        fitted, numbers = fit_parametric(data, kind, starts.get(kind), judged=judged)
        starts.setdefault(kind, numbers)
        out[kind] = (fitted.model, fitted.free_numbers, fitted.condition, fitted)
    tables = fit_table(data, out["gogo"][0], judged=judged)
    out["table"] = (tables.model, tables.free_numbers, tables.condition, tables)
    model, numbers_of, condition = fit_plvc(data, tables, judged=judged)
    out["plvc"] = (model, numbers_of, condition, None)
    return out


def _sound(readings: Measurements) -> tuple[NDArray[np.intp], tuple[str, ...]]:
    """Return the rows that agree with a robust fit, and the names of the others; refuse if these are many."""
    data = patches(readings.codes, readings.XYZ)
    delta = np.min([differences(fit_parametric(data, kind)[0].model, data) for kind in ("gog", "gogo")], axis=0)
    doubted = delta > max(_DOUBT, _DOUBT_TIMES * float(np.median(delta)))
    names = tuple(readings.name[i] for i in np.flatnonzero(doubted))
    if doubted.mean() > _MOST_DOUBTED:
        raise DeviceError(
            Finding(
                f"{len(names)} of {len(delta)} readings {'disagrees' if len(names) == 1 else 'disagree'} with "
                f"the rest, by up to {delta.max():.1f} ΔE00: "
                + ", ".join(names[:12])
                + (" and more" if len(names) > 12 else ""),
                remedy="measure them again; from so many wrong readings no model can be trusted",
            )
        )
    return np.flatnonzero(~doubted), names


def _folds(data: Patches, seed: int) -> list[NDArray[np.intp]]:
    held = np.ones(len(data), dtype=bool)
    held[np.all(data.codes == 0, axis=1)] = False
    for channel in range(3):
        alone = np.all(np.delete(data.codes, channel, axis=1) == 0, axis=1)
        if alone.any():
            held[alone & (data.codes[:, channel] == data.codes[alone, channel].max())] = False
    # Repeats of a patch are judged together: one must not help to predict the other.
    _, group = np.unique(data.codes, axis=0, return_inverse=True)
    groups = np.unique(group.ravel()[held])
    order = np.random.default_rng(seed).permutation(groups)
    folds = [np.flatnonzero(held & np.isin(group.ravel(), part)) for part in np.array_split(order, FOLDS)]
    return [fold for fold in folds if len(fold)]


def _candidate(
    name: Name,
    fit: tuple[DisplayModel, int, float, Fitted | None],
    data: Patches,
    held_out: Floats,
    judged: NDArray[np.intp],
) -> Candidate:
    model, free_numbers, condition, fitted = fit
    unusable = ""
    if isinstance(model, Plvc):
        try:
            assert model.steps
        except DeviceError as error:
            unusable = str(error)
    return Candidate(
        name,
        model,
        free_numbers,
        errors_of(held_out, data.XYZ[judged, 1]),
        errors_of(differences(model, data), data.XYZ[:, 1]),
        r_squared(data.XYZ, model.xyz(data.codes)),
        condition,
        fitted.standard_errors if fitted else {},
        fitted.at_bound if fitted else (),
        unusable,
        None if unusable else table_error_codes(model),
        None if unusable else inversion_error_codes(model),
    )


def _choose(candidates: tuple[Candidate, ...], asked: str) -> tuple[Candidate, str]:
    if asked != "auto":
        return next(c for c in candidates if c.name == asked), "it was asked for"
    fit = [c for c in candidates if not c.unusable]
    best = min(fit, key=lambda c: c.held_out.mean)
    near = [
        c
        for c in fit
        if c.held_out.mean <= best.held_out.mean + MARGIN_MEAN and c.held_out.p95 <= best.held_out.p95 + MARGIN_P95
    ]
    chosen = min(near, key=lambda c: c.free_numbers)
    if chosen is best:
        return chosen, "it has the least held-out error, and no simpler model comes within the margin"
    return chosen, (
        f"it is the simplest within {MARGIN_MEAN} ΔE00 in the mean and {MARGIN_P95} in the 95th percentile "
        f"of the best, {best.name}"
    )


def _where(delta: Floats, data: Patches, names: tuple[str, ...], judged: NDArray[np.intp]) -> tuple[str, ...]:
    """Say in plain sentences where held-out readings are missed by most."""
    by_light = judged[np.argsort(data.XYZ[judged, 1], kind="stable")]
    thirds = np.array_split(by_light, 3)
    sentences = [
        "mean held-out ΔE00 from dark to bright: "
        + ", ".join(f"{delta[t].mean():.2f}" for t in thirds if len(t))
        + " (thirds by luminance, up to "
        + " and ".join(f"{data.XYZ[t, 1].max():.3g}" for t in thirds[:2] if len(t))
        + " cd/m²)"
    ]
    lit = data.codes > 0
    groups = {
        "red alone": lit[:, 0] & ~lit[:, 1] & ~lit[:, 2],
        "green alone": ~lit[:, 0] & lit[:, 1] & ~lit[:, 2],
        "blue alone": ~lit[:, 0] & ~lit[:, 1] & lit[:, 2],
        "greys": lit.all(axis=1) & (np.ptp(data.codes, axis=1) == 0),
        "other mixtures": (lit.sum(axis=1) > 1) & (np.ptp(data.codes, axis=1) > 0),
    }
    parts = [f"{what} {delta[rows].mean():.2f}" for what, where in groups.items() if len(rows := judged[where[judged]])]
    sentences.append("by kind of patch: " + ", ".join(parts))
    worst = judged[np.argsort(-delta[judged], kind="stable")[:5]]
    sentences.append("worst: " + ", ".join(f"{names[i]} {delta[i]:.2f} at {data.XYZ[i, 1]:.3g} cd/m²" for i in worst))
    return tuple(sentences)
