"""Readings that no model predicts from the others, though it predicts what lies around them.

A reading is doubted by what models predict of it that were fitted without it. Those count whose median error is near
the least, and of them the one that misses it least: what no simple model describes is not wrong for that. It is wrong
where it is missed by 1.5 ΔE00 at least, by three times the ΔE00 that its neighbours in code are missed by, and by eight
times the share of their XYZ; black and the highest codes of the channels, on which models rest, by twice that. A
reading that a repeat of its patch confirms is not doubted.

The foremost are set aside, the models fitted again, and all readings judged again, those set aside too: what was missed
only because of a wrong reading beside it comes back.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.characterise.cross_validation import CrossValidation, anchors, cross_validate, fit_all, repeats
from devices.characterise.patches import Patches, patches
from documents.arrays import Flags, Floats

FLOOR, TIMES_DELTA, TIMES_SHARE = 1.5, 3.0, 8.0
# Models rest on black and primaries, and reach them only by going beyond what else was read.
_ANCHOR_TIMES = 2.0
_NEIGHBOURS = 8
# A repeat confirms a reading when it differs by less than this share of what the models miss it by.
_CONFIRMS = 0.25
_ROUNDS = 12
_FOREMOST = 0.5
# Where the median held-out ΔE00 of all other models is above this, the residual has a say too; it takes its time.
_ROUGH = 0.8
_BLOCK = 256
# Of white: shares of less light than this are shares of this.
_DARK = 1e-3
# With more than this set aside, too little is left to judge by.
_MOST = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Screened:
    """``wrong`` (n,): the readings to leave out. ``delta_e_2000`` (n,): by how much the best model misses each.

    ``all_kept``: every model judged with all readings, and ``kept``, the same object where none is wrong, without.
    ``fits_made``: how often all models were fitted.
    """

    wrong: Flags
    delta_e_2000: Floats
    all_kept: CrossValidation
    kept: CrossValidation
    fits_made: int


@dataclass(frozen=True, slots=True, eq=False)
class Missed:
    """By how much the best model misses each reading: ΔE00 (n,), and as a ``share`` (n,) of its XYZ, or of what was
    predicted where that is less.

    ``leading`` (n,): the readings that models rest on, which they reach only by going beyond the others.
    """

    delta_e_2000: Floats
    share: Floats
    leading: Flags


def screen(codes: Floats, XYZ: Floats, seed: int, *, residual: bool = True, further: str = "") -> Screened:
    """Return which of the readings, codes (n, 3) in 0..1 and XYZ (n, 3), are wrong, and the models judged without.

    The model of the residual, which takes its time, is fitted where the others are rough, and if it is to be judged.
    That of ``further`` curves, another package's by name, is judged with the others, and has no say in what is wrong.
    """
    data = patches(codes, XYZ)
    first = latest = cross_validate(data, seed, residual=False)
    rough = min(first.medians.values(), default=0.0) > _ROUGH
    if rough:
        first = latest = first.with_residual()
    wrong = np.zeros(len(data), dtype=bool)
    fits_made = first.fits_made + 1
    found = missed(data, first, wrong)
    tried: set[bytes] = {wrong.tobytes()}
    for _ in range(_ROUNDS):
        over = doubted(data, found)
        again = (wrong & over) | _foremost(data.codes, found.delta_e_2000, over & ~wrong)
        if np.array_equal(again, wrong) or again.mean() > _MOST:
            break
        if again.tobytes() in tried:
            again &= wrong  # it goes round in circles: what is wrong all the way stays
            if np.array_equal(again, wrong):
                break
        wrong = again
        tried.add(wrong.tobytes())
        rest = patches(codes[~wrong], XYZ[~wrong])
        latest = cross_validate(rest, seed, residual=rough) if wrong.any() else first
        data = patches(codes, XYZ, white=rest.white)
        found = missed(data, latest, wrong)
        fits_made += latest.fits_made + 1

    def whole(models: CrossValidation) -> CrossValidation:
        models = models.with_residual() if residual else models
        return models.with_curves(further) if further else models

    all_kept = whole(first)
    return Screened(wrong, found.delta_e_2000, all_kept, all_kept if latest is first else whole(latest), fits_made)


def missed(data: Patches, models: CrossValidation, wrong: Flags) -> Missed:
    """Return by how much the best trusted model that was not fitted to a reading misses it.

    ``models`` are those of the readings that are not ``wrong``.
    """
    leading = ~wrong
    leading[np.flatnonzero(~wrong)[models.judged]] = False
    residual = "residual" in models.fits
    others = (
        fit_all(data.select(np.flatnonzero(~leading & ~wrong)), {}, judged=False, residual=residual)
        if leading.any()
        else {}
    )
    delta, share = [], []
    for name in models.trusted:
        XYZ = models.fits[name].model.xyz(data.codes)
        XYZ[~wrong] = models.predicted_XYZ[name]
        if leading.any():
            XYZ[leading] = others[name].model.xyz(data.codes[leading])
        delta.append(data.delta_e_2000(XYZ))
        off = (XYZ - data.XYZ) / (np.minimum(np.abs(XYZ), np.abs(data.XYZ)) + _DARK * data.white)
        share.append(np.sqrt((off**2).mean(axis=1)))
    best = np.argmin(delta, axis=0)
    rows = np.arange(len(data))
    return Missed(np.array(delta)[best, rows], np.array(share)[best, rows], leading | anchors(data.codes))


def doubted(data: Patches, by: Missed) -> Flags:
    """Return which readings to doubt that the models miss ``by`` so much."""
    times = np.where(by.leading, _ANCHOR_TIMES, 1.0)
    near = _neighbours(data.codes)
    delta = np.maximum(np.median(by.delta_e_2000[near], axis=1), np.median(by.delta_e_2000))
    share = np.median(by.share[near], axis=1)
    over = by.delta_e_2000 > times * np.maximum(FLOOR, TIMES_DELTA * delta)
    over &= by.share > times * TIMES_SHARE * share
    return over & ~_confirmed(data, by.delta_e_2000, over)


def _foremost(codes: Floats, delta: Floats, over: Flags) -> Flags:
    """Return which of the readings ``over`` to set aside first: no other near them, and none by far, is missed by more.

    What else is missed may be so because of them.
    """
    if not over.any():
        return over
    rivals = np.where(over, delta, 0.0)
    near = _neighbours(codes)
    return np.asarray(over & (delta >= rivals[near].max(axis=1)) & (delta >= _FOREMOST * rivals.max()))


def _neighbours(codes: Floats) -> NDArray[np.intp]:
    """Return for each reading the rows of the nearest readings of other codes, (n, 8) or fewer."""
    count = min(_NEIGHBOURS, len(codes) - 1)
    out = np.empty((len(codes), count), dtype=np.intp)
    for at in range(0, len(codes), _BLOCK):
        apart = np.abs(codes[at : at + _BLOCK, None, :] - codes[None, :, :]).sum(axis=2)
        apart[apart == 0.0] = np.inf
        out[at : at + _BLOCK] = np.argpartition(apart, count, axis=1)[:, :count]
    return out


def _confirmed(data: Patches, delta: Floats, over: Flags) -> Flags:
    """Return which of the readings ``over`` another reading of the same patch agrees with."""
    group = repeats(data.codes)
    out = np.zeros(len(delta), dtype=bool)
    for row in np.flatnonzero(over):
        others = np.flatnonzero((group == group[row]) & (np.arange(len(group)) != row))
        if len(others):
            out[row] = data.apart_delta_e_2000(int(row), others).min() < _CONFIRMS * delta[row]
    return out
