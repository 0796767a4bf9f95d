"""Fit every candidate, judge each on readings that it was not fitted to, and choose the simplest that does well.

The model with the fewest free numbers wins whose held-out mean is within 0.05 ΔE00 of the best, whose 95th percentile
is within 0.2, and whose luminance is about as good in every decade as that of any of these; see
`devices.characterise.cross_validation`. Readings that no model predicts from the others are left out first, see
`devices.characterise.outliers`.

How far luminance is off is judged decade by decade from white down, because ΔE00 does not see the dark: below a
ten-thousandth of white, light that is three times too dark differs by a tenth of a ΔE00, and an eye that looks at a
dark picture sees it all the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, get_args

import numpy as np
from numpy.typing import NDArray

from devices.characterise.cross_validation import CrossValidation, repeats
from devices.characterise.fit_numbers import (
    Errors,
    ModelNumbers,
    differences,
    errors_of,
    inversion_error_codes,
    r_squared,
    table_error_codes,
)
from devices.characterise.options import Name
from devices.characterise.outliers import Screened, screen
from devices.characterise.patches import Patches
from devices.characterise.readings_check import check_readings
from devices.diagnostics.channels import additivity
from devices.display.model import DisplayModel
from devices.display.model_spec import CURVES
from devices.errors import DeviceError
from devices.readings.table import Measurements
from documents import Finding
from documents.arrays import Floats
from documents.text import JsonResult, counted, did_you_mean

# A decade with fewer readings is told, and has no say in the choice of a model.
FEWEST_JUDGED = 3
# A model's light is as good as another's if it is off by this many times as much, and by so much more, as a share.
MARGIN_TIMES, MARGIN_SHARE = 1.5, 0.02
# Off by more than this, light is worth a note: twice what an eye tells apart in the dark.
_NOTABLE_SHARE = 0.1
_LEAST_RATIO = 1e-6
_MOST_TIMES = 100.0  # what is off by more gives no light, or was read of none


@dataclass(frozen=True, slots=True)
class LightError(JsonResult):
    """How far luminance is off between ``from_cd_m2`` and ``to_cd_m2``, where ``readings`` were held out.

    ``share``: half of the readings are off by less than this share of what was read, 0 or more; a third of the light
    and three times the light both count as 2. ``bias``: the median of predicted through read light, minus 1.
    """

    from_cd_m2: float
    to_cd_m2: float
    readings: int
    share: float
    bias: float
    json_names: ClassVar = "from_cd_m2 to_cd_m2 readings off_percent bias_percent"

    @property
    def judged(self) -> bool:
        """Whether there are readings enough to choose a model by."""
        return self.readings >= FEWEST_JUDGED

    @property
    def notable(self) -> bool:
        """Whether it is off by more than a tenth, in readings enough to say so."""
        return self.judged and self.share > _NOTABLE_SHARE

    @property
    def size(self) -> str:
        """How far it is off, such as ``0.4 %`` or ``3.6 times``."""
        if self.share >= _MOST_TIMES:
            return f"over {_MOST_TIMES:.0f} times"
        if self.share >= 1.0:
            return f"{1.0 + self.share:.2g} times"
        return f"{100.0 * (self.share / (1.0 + self.share) if self.bias < 0.0 else self.share):.2g} %"

    @property
    def off(self) -> str:
        """The same with its direction, where it has one."""
        if self.share < MARGIN_SHARE or abs(np.log1p(self.bias)) < 0.5 * np.log1p(self.share):
            return self.size
        return f"{self.size} too {'dark' if self.bias < 0 else 'bright'}"

    @property
    def between(self) -> str:
        """The decade, such as ``0.12 to 1.2 cd/m²``."""
        return f"{_plain(self.from_cd_m2)} to {_plain(self.to_cd_m2)} cd/m²"

    @property
    def off_percent(self) -> float:
        """The root mean square of errors, in percent."""
        return 100.0 * self.share

    @property
    def bias_percent(self) -> float:
        """The mean error in percent."""
        return 100.0 * self.bias


def _plain(luminance: float) -> str:
    return f"{luminance:.0f}" if luminance >= 100.0 else f"{luminance:.2g}"


def light_errors(predicted_cd_m2: Floats, read_cd_m2: Floats, white_cd_m2: float) -> tuple[LightError, ...]:
    """Return the error of each decade with readings, from white down; luminances (n,), white's above 0.

    Readings of no light, or less, have no relative error and do not count.
    """
    lit = read_cd_m2 > 0.0
    read = read_cd_m2[lit]
    ratio = np.log(np.maximum(predicted_cd_m2[lit] / read, _LEAST_RATIO))
    decade = np.maximum(np.floor(-np.log10(read / white_cd_m2)), 0.0).astype(int)
    return tuple(
        LightError(
            white_cd_m2 / 10.0 ** (k + 1),
            white_cd_m2 / 10.0**k,
            int((decade == k).sum()),
            float(np.expm1(np.median(np.abs(ratio[decade == k])))),
            float(np.expm1(np.median(ratio[decade == k]))),
        )
        for k in np.unique(decade).tolist()
    )


def worse(one: Sequence[LightError], all_of: Sequence[Sequence[LightError]]) -> tuple[float, LightError | None]:
    """Return by which share ``one`` is off beyond the margin about the best of ``all_of``, at most, and where.

    All have the same decades. 0 and None where it is within the margin in each.
    """
    beyond = [
        (mine.share - MARGIN_TIMES * min(errors[place].share for errors in all_of) - MARGIN_SHARE, place)
        for place, mine in enumerate(one)
        if mine.judged
    ]
    most, place = max(beyond, default=(0.0, 0))
    return (most, one[place]) if most > 0.0 else (0.0, None)


MARGIN_MEAN, MARGIN_P95 = 0.05, 0.2
# Beyond this the readings are not those of a display that any of the models describes.
MOST_MEAN = 3.0
_NOTABLE_MEAN = 1.0
_MOST_WRONG = 0.1
_NAMED = 12
# Mixtures that differ from the sum of their channels by so much, in per cent, are why models that add up fail.
_NOT_ADDITIVE = 5.0
# Repeats that differ by less than this share of what the model misses are not why it does.
_AGREE = 0.5
# With fewer held-out readings than this, the choice is little more than a guess.
_FEW = 30


@dataclass(frozen=True, slots=True)
class Candidate(JsonResult):
    """One model, fitted to all readings, and what is known of it.

    ``held_out`` is of readings that it was not fitted to, and so is ``held_out_light``. ``r2_XYZ``: of X, Y and Z over
    all readings. ``unusable`` says why it cannot be chosen, empty where it can. ``table_error_codes``: the presenter's
    table against the model; ``inversion_error_codes``: the model's inverse against the codes that gave the light; both
    in codes of 8 bits, None where it cannot be undone.
    """

    name: str
    model: DisplayModel
    free_numbers: int
    held_out: Errors
    held_out_light: tuple[LightError, ...]
    fitted: Errors
    r2_XYZ: tuple[float, ...]
    condition: float
    standard_errors: dict[str, float]
    at_bound: tuple[str, ...]
    unusable: str
    table_error_codes: float | None
    inversion_error_codes: float | None
    json_keys: ClassVar = {
        "name": "model",
        "held_out": "held_out_delta_e_2000",
        "held_out_light": "held_out_luminance",
        "fitted": "fitted_delta_e_2000",
    }
    json_names: ClassVar = (
        "name free_numbers held_out held_out_light fitted r2 condition standard_errors at_bound unusable "
        "table_error_codes inversion_error_codes"
    )

    @property
    def r2_average(self) -> float:
        """The mean coefficient of determination over X, Y and Z."""
        return float(np.mean(self.r2_XYZ))

    @property
    def worst_light(self) -> LightError | None:
        """The decade in which its held-out luminance is off by most, of those with readings enough to choose by."""
        return max((error for error in self.held_out_light if error.judged), key=lambda e: e.share, default=None)

    @property
    def numbers(self) -> ModelNumbers:
        """The model's numbers, with standard errors where the fit gives them."""
        return ModelNumbers.of(self.model, self.standard_errors)

    @property
    def r2(self) -> dict[str, float]:
        """The coefficients of determination of X, Y and Z, and their average."""
        return {**dict(zip("XYZ", self.r2_XYZ, strict=True)), "average": self.r2_average}


@dataclass(frozen=True, slots=True)
class AllKept(JsonResult):
    """The choice with all readings kept: the ``model``'s name, and its ``held_out`` errors."""

    model: str
    held_out: Errors
    json_keys: ClassVar = {"model": "chosen", "held_out": "held_out_delta_e_2000"}


@dataclass(frozen=True, slots=True)
class Characterisation(JsonResult):
    """The ``chosen`` candidate and why, all of them, how they were judged, and where the chosen one errs.

    ``notes``: sentences about the readings that a reader must know. ``where_it_errs``: plain sentences. ``patches``:
    the readings that were fitted; those ``left_out`` are named, and ``all_kept`` is the choice with them, None where
    there are none. ``fits_made``: how often all models were fitted; ``residual_fits``: of those judged, how often that
    of the residual was among them.
    """

    chosen: Candidate
    reason: str
    candidates: tuple[Candidate, ...]
    folds: int
    seed: int
    notes: tuple[str, ...]
    where_it_errs: tuple[str, ...]
    left_out: tuple[str, ...]
    all_kept: AllKept | None
    patches: Patches
    fits_made: int
    residual_fits: int
    json_keys: ClassVar = {
        "chosen.name": "chosen",
        "patches.count": "patches",
        "patches.white": "white_XYZ_cd_m2",
        "notes": "said",
    }
    json_names: ClassVar = (
        "chosen.name reason patches.count folds seed patches.white notes where_it_errs left_out all_kept candidates"
    )


def characterise(
    readings: Measurements, model: str = "auto", *, seed: int = 1, keep_all: bool = False
) -> Characterisation:
    """Fit the candidates to ``readings`` and choose, or take ``model``.

    With ``keep_all`` no reading is left out, however wrong it looks. A ``model`` that is not one of ours is another
    package's curves by their name, which say how they are fitted. For a ``model`` that is named the others are
    fitted all the same: a reading is doubted by what all of them miss. But that of the residual, which takes twice as
    long as they, is then left out where they predict the readings without it.

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
    further = _of_others(model)
    screened = screen(readings.codes, readings.XYZ, seed, residual=model in ("auto", "residual"), further=further)
    wrong = np.zeros(len(readings), dtype=bool) if keep_all else screened.wrong
    judged = screened.all_kept if keep_all else screened.kept
    if not len(judged.judged):
        raise DeviceError(Finding("no readings are left to judge a model by", remedy="measure more patches"))
    chosen, reason, candidates = _chosen_of(judged, model)
    before = None
    if screened.wrong.any():
        other, _, _ = _chosen_of(screened.all_kept, model, undone=False)
        before = None if keep_all else AllKept(other.name, other.held_out)
        notes.append(_on_wrong(readings, screened, before, chosen, keep_all=keep_all))
    names = tuple(readings.name[i] for i in np.flatnonzero(~wrong))
    if len(judged.judged) < _FEW:
        notes.append(
            f"only {counted(len(judged.judged), 'reading was', 'readings were')} held out, too few to choose or judge "
            "a model by: measure more"
        )
    mean = chosen.held_out.mean
    if mean > _NOTABLE_MEAN:
        why = _not_additive(readings, judged.patches, mean)
        if mean > MOST_MEAN:
            raise DeviceError(_no_model(model, chosen, why))
        notes.append(
            f"the chosen model errs by {mean:.2f} ΔE00 on average, which people see: "
            + (why[0] if why else "measure again, or more")
        )
    if far := [error for error in chosen.held_out_light if error.notable]:
        notes.append(
            "its light is off by "
            + ", ".join(f"{error.off} from {error.between}" for error in far)
            + ": dark parts of pictures are not shown as they are; more dark patches, read more often, help"
        )
    if chosen.unusable:
        notes.append(f"{chosen.name} was asked for; {chosen.unusable}")
    errs = (
        *_where(judged.delta_e_2000[chosen.name], judged.patches, names, judged.judged),
        "held-out luminance from white down: "
        + ", ".join(f"{error.off} from {error.between} ({error.readings})" for error in chosen.held_out_light),
    )
    left_out = tuple(readings.name[i] for i in np.flatnonzero(wrong))
    return Characterisation(
        chosen,
        reason,
        candidates,
        len(judged.folds),
        seed,
        tuple(notes),
        errs,
        left_out,
        before,
        judged.patches,
        screened.fits_made,
        sum("residual" in fit for fit in (judged.fits, *(fits for _, fits in judged.folds))),
    )


def _of_others(model: str) -> str:
    """Return the name of another package's curves, empty where ``model`` is ours; DeviceError where nobody fits it."""
    ours = ("auto", *get_args(Name))
    if model in ours:
        return ""
    kind = CURVES.get(model)
    if kind is None or not kind.can_be_fitted():
        names = [*ours, "none", *(name for name in CURVES.names() if CURVES[name].can_be_fitted())]
        raise DeviceError(Finding(f"no model '{model}' is fitted", remedy=did_you_mean(model, names)))
    return model


def _on_wrong(
    readings: Measurements, screened: Screened, before: AllKept | None, chosen: Candidate, *, keep_all: bool
) -> str:
    """Return the note on readings that disagree with the rest; refuse if these are many."""
    rows = np.flatnonzero(screened.wrong)
    by = [f"{readings.name[i]} (by {screened.delta_e_2000[i]:.1f} ΔE00)" for i in rows]
    listed = ", ".join(by[:_NAMED]) + (" and more" if len(by) > _NAMED else "")
    if keep_all:
        single, many = "reading disagrees with the rest and stays", "readings disagree with the rest and stay"
        return f"{counted(len(rows), single, many)}: {listed}"
    if screened.wrong.mean() > _MOST_WRONG:
        raise DeviceError(
            Finding(
                f"{len(rows)} of {len(readings)} readings {'disagrees' if len(rows) == 1 else 'disagree'} with the "
                f"rest: {listed}",
                remedy="measure them again; from so many wrong readings no model can be trusted. --keep-all fits "
                "them all the same",
            )
        )
    assert before is not None
    single, many = "reading disagrees with the rest and was", "readings disagree with the rest and were"
    with_them = (
        f"{before.model} with a mean of {before.held_out.mean:.2f} ΔE00, 95th percentile {before.held_out.p95:.2f}, "
        f"largest {before.held_out.max:.2f}"
    )
    without = f"{chosen.name} with {chosen.held_out.mean:.2f}, {chosen.held_out.p95:.2f} and {chosen.held_out.max:.2f}"
    return (
        f"{counted(len(rows), single, many)} left out: {listed}; --keep-all keeps {'it' if len(rows) == 1 else 'them'} "
        f"and chooses {with_them}, in place of {without}"
    )


def _not_additive(readings: Measurements, data: Patches, mean: float) -> tuple[str, str] | None:
    """Return why mixtures, and not bad readings, are behind an error of ``mean`` ΔE00, and what to do; or None."""
    found = additivity(readings)
    if found.value is None:
        return None
    apart_percent = np.abs([line.y for line in found.series[-1].lines]).max(axis=0)
    if float(np.median(apart_percent)) < _NOT_ADDITIVE:
        return None  # one mixture that differs is a wrong reading
    group = repeats(data.codes)
    apart = [
        data.apart_delta_e_2000(int(rows[0]), rows[1:]).max()
        for rows in (np.flatnonzero(group == g) for g in np.flatnonzero(np.bincount(group) > 1))
    ]
    if apart and float(np.median(apart)) > _AGREE * mean:
        return None
    agree = f", while repeats agree within {max(apart):.2g} ΔE00" if apart else ""
    return (
        f"mixtures are not additive, up to {found.value:.3g} % from the sum of their channels{agree}",
        "the display mixes colours itself (a white segment, brilliant or dynamic colour, a gamut setting): switch that "
        "off in its menu and measure again",
    )


def _no_model(asked: str, chosen: Candidate, why: tuple[str, str] | None) -> Finding:
    problem = (
        f"{'no model predicts' if asked == 'auto' else asked + ' does not predict'} these readings: "
        f"the mean held-out difference of {chosen.name} is {chosen.held_out.mean:.1f} ΔE00"
    )
    if asked != "auto":
        return Finding(problem, remedy="let --model auto choose")
    if why:
        return Finding(f"{problem}; {why[0]}", remedy=why[1])
    return Finding(problem, remedy="check the range of the codes and the order of the rows, or measure again")


def _chosen_of(
    judged: CrossValidation, asked: str, *, undone: bool = True
) -> tuple[Candidate, str, tuple[Candidate, ...]]:
    """Return the choice, why, and all; how well each is undone takes as long as all else, and is told if ``undone``."""
    candidates = tuple(_candidate(name, judged, undone=undone) for name in judged.fits)
    return (*_choose(candidates, asked), candidates)


def _candidate(name: str, judged: CrossValidation, *, undone: bool) -> Candidate:
    fit, data = judged.fits[name], judged.patches
    model = fit.model
    unusable = ""
    try:
        assert model.steps
    except DeviceError as error:
        unusable = str(error)
    return Candidate(
        name,
        model,
        fit.free_numbers,
        errors_of(judged.delta_e_2000[name][judged.judged], data.XYZ[judged.judged, 1]),
        light_errors(judged.predicted_XYZ[name][judged.judged, 1], data.XYZ[judged.judged, 1], float(data.white[1])),
        errors_of(differences(model, data), data.XYZ[:, 1]),
        r_squared(data.XYZ, model.xyz(data.codes)),
        fit.condition,
        fit.fitted.standard_errors if fit.fitted else {},
        fit.fitted.at_bound if fit.fitted else (),
        unusable,
        table_error_codes(model) if undone and not unusable else None,
        inversion_error_codes(model) if undone and not unusable else None,
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
    light = [c.held_out_light for c in near]
    beyond = {c.name: worse(c.held_out_light, light) for c in near}
    least = min(share for share, _ in beyond.values())
    chosen = min((c for c in near if beyond[c.name][0] <= least), key=lambda c: c.free_numbers)
    simplest = min(near, key=lambda c: c.free_numbers)
    darker = ""
    if simplest is not chosen and (where := beyond[simplest.name][1]):
        darker = f"; {simplest.name} is simpler, but its light from {where.between} is off by {where.off}"
    if chosen is best:
        only = darker or ", and no simpler model comes within the margin"
        return chosen, f"it has the least held-out error{only}"
    return chosen, (
        f"it is the simplest within {MARGIN_MEAN} ΔE00 in the mean and {MARGIN_P95} in the 95th percentile "
        f"of the best, {best.name}{darker}"
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
