"""PLVC and a smooth residual fitted together, with as many knots, as wide and as stiff as the readings ask for.

The curves of tables and PLVC are fitted as if one matrix explained all readings, and bend where mixtures do not follow
it. Here curves, PLVC's terms and kernels are fitted at once, by Gauss and Newton's steps. The kernels' knots are
readings far from each other in the root of light. Their number, their width and the weight of their norm are those
with the least mean ΔE00 of every reading by the fit without it, which for linear least squares is known from the fit
with all [Allen1974]: nothing but the readings that are fitted has a say.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from devices.characterise.fit_numbers import differences
from devices.characterise.patches import Patches
from devices.characterise.table_fit import (
    FUNCTIONS,
    RIDGE,
    STIFFNESS,
    curves_of,
    functions_of,
    hats,
    plvc_of,
    rising_curve,
    second_differences,
)
from devices.display.curves import TableCurve
from devices.display.plvc import Plvc
from devices.display.residual import Residual, gram, kernels, place_of
from devices.errors import DeviceError
from documents.arrays import Floats

Curves = tuple[TableCurve, TableCurve, TableCurve]

KNOTS, WIDTHS, STIFFNESSES = (8, 24, 48), (0.875, 1.75), (1.0, 4.0, 16.0, 64.0)
# With which the curves are fitted, before these are chosen.
_FIRST = (24, 0.875, 4.0)
# Knots lie on a grid of this many steps, whose places floats hold exactly.
_STEPS = 1024.0
# More readings than this have no say in what the kernels are, for the time's sake.
_MOST_JUDGED = 400
_CURVE_ROUNDS, _ROUNDS = 2, 3
_SMALL = 1e-10
# A channel; each of them is among those that `Plvc.clashes` looks at by itself.
_FIRST_LEVELS = 5


@dataclass(frozen=True, slots=True, eq=False)
class _Kernels:
    """Where the kernels are, how wide, and the weight of their norm."""

    knots: Floats
    width: float
    stiffness: float

    def functions(self, light: Floats) -> Floats:
        """PLVC's functions and the kernels, (n, FUNCTIONS + k), at the channels' light (n, 3)."""
        return np.concatenate([functions_of(light), kernels(light, self.knots, self.width)], axis=1)

    def penalty(self) -> Floats:
        """Return the ridge of PLVC's terms, and the kernels' norm, for all coefficients of X, Y and Z."""
        out = np.zeros((FUNCTIONS + len(self.knots),) * 2)
        terms = np.arange(3, FUNCTIONS)
        out[terms, terms] = RIDGE**2
        out[FUNCTIONS:, FUNCTIONS:] = self.stiffness**2 * gram(self.knots, self.width)
        return np.kron(out, np.eye(3)) + _SMALL * np.eye(3 * len(out))

    def model(self, black: Floats, curves: Curves, coefficients: Floats) -> Plvc:
        """Return the model of all ``coefficients`` (FUNCTIONS + k, 3), in cd/m²."""
        base = plvc_of(black, curves, coefficients[:FUNCTIONS])
        if not len(self.knots):
            return base
        return replace(base, residual=Residual(self.knots, self.width, coefficients[FUNCTIONS:]))


def fit_residual(patches: Patches, plvc: Plvc, free_numbers: int) -> tuple[Plvc, int]:
    """Return ``plvc``, fitted to ``patches`` with ``free_numbers``, with a residual fitted along, and its numbers.

    Of the settings the best by the readings left out is taken whose model can be undone, with curves fitted along if
    any can, and curves nearer those of ``plvc`` if not; the last of all if none can.
    """
    spread = knots_among(_light(curves_of(plvc), patches.codes), max(KNOTS))
    count, width, stiffness = _FIRST
    first = _Kernels(spread[:count], width, stiffness)
    best, chosen = plvc, first
    try:
        begin = _fitted(patches, plvc, curves_of(plvc), first)
        for model in reversed(_curves_fitted(patches, begin, first)):
            for chosen in _ranked(patches, model, spread):
                best = _fitted(patches, model, curves_of(model), chosen)
                if _can_be_undone(best):
                    return best, free_numbers + 3 * len(chosen.knots) + 2
    except DeviceError:
        pass  # numbers beyond all measure, of readings that are no display's: what was found until then stays
    return best, free_numbers + 3 * len(chosen.knots) + 2


def fit_curves_too(patches: Patches, plvc: Plvc) -> Plvc:
    """Return ``plvc``, fitted to ``patches``, with its curves and terms fitted at once, if that can be undone."""
    better = _curves_fitted(patches, plvc, _Kernels(np.zeros((0, 3)), 1.0, 1.0))[-1]
    return better if not better.clashes() else plvc


def knots_among(light: Floats, most: int) -> Floats:
    """Return ``most`` places (k, 3) at most, each of a reading's light (n, 3), as far from each other as can be."""
    places: Floats = np.asarray(np.unique(np.round(_STEPS * place_of(np.clip(light, 0.0, 1.0))) / _STEPS, axis=0))
    chosen = [int(np.argmax(places.sum(axis=1)))]
    far: Floats = np.asarray(np.linalg.norm(places - places[chosen[0]], axis=1))
    while len(chosen) < min(most, len(places)) and far.max() > 0.0:
        chosen.append(int(np.argmax(far)))
        np.minimum(far, np.linalg.norm(places - places[chosen[-1]], axis=1), out=far)
    return np.asarray(places[chosen])


def _ranked(patches: Patches, begin: Plvc, spread: Floats) -> list[_Kernels]:
    """Return the settings, the one first whose fits to all other readings miss each by the least.

    Knots and width come first, at one stiffness, then the stiffness.
    """
    rows = np.arange(len(patches))
    if len(rows) > _MOST_JUDGED:
        rows = np.unique(np.round(np.linspace(0, len(rows) - 1, _MOST_JUDGED)).astype(int))
    some = patches.select(rows)
    light = _light(curves_of(begin), some.codes)
    A, target = _linearised(some, begin.xyz_of_linear(light), begin.black_XYZ_cd_m2)

    def ranked(settings: list[_Kernels]) -> list[_Kernels]:
        scores = []
        for place, setting in enumerate(settings):
            left = _left_out(_columns(A, setting.functions(light)), target, setting.penalty()).reshape(-1, 3)
            scores.append((float(np.sqrt((left**2).sum(axis=1)).mean()), place))
        return [settings[place] for _, place in sorted(scores)]

    best, *others = ranked([_Kernels(spread[:count], width, _FIRST[2]) for count, width in product(KNOTS, WIDTHS)])
    return [*ranked([replace(best, stiffness=stiffness) for stiffness in STIFFNESSES]), *others]


def _fitted(patches: Patches, begin: Plvc, curves: Curves, setting: _Kernels) -> Plvc:
    """Fit the terms and the kernels on ``curves``, beginning with what ``begin`` predicts."""
    unit, black = float(patches.white[1]), begin.black_XYZ_cd_m2
    functions, penalty = setting.functions(_light(curves, patches.codes)), setting.penalty()
    XYZ = begin.xyz(patches.codes)
    coefficients: Floats = np.zeros((functions.shape[1], 3))
    for _ in range(_ROUNDS):
        A, target = _linearised(patches, XYZ, black)
        normal, wanted = _normal_equations(A, target, functions)
        found = np.linalg.solve(normal + penalty, wanted)
        coefficients = np.asarray(unit * found, dtype=np.float64).reshape(-1, 3)
        XYZ = black + functions @ coefficients
    return setting.model(black, curves, coefficients)


def _curves_fitted(patches: Patches, begin: Plvc, setting: _Kernels) -> list[Plvc]:
    """Fit the roots of light at the curves' codes together with the terms; bends beyond those of ``begin`` cost.

    Return ``begin`` and the models after each step; one that leaves more than the last is not taken.
    """
    unit, black = float(patches.white[1]), begin.black_XYZ_cd_m2
    knots = [np.asarray(curve.codes) for curve in curves_of(begin)]
    starts = [np.sqrt(curve.light) for curve in curves_of(begin)]
    roots = [start.copy() for start in starts]
    weights = [hats(patches.codes[:, c], knots[c]) for c in range(3)]
    bends = [STIFFNESS * second_differences(knots[c])[:, 1:-1] for c in range(3)]
    models, penalty = [begin], setting.penalty()
    terms = len(penalty)
    sizes = [len(k) - 2 for k in knots]
    cuts = np.cumsum([terms, *sizes])
    whole = np.zeros((cuts[-1], cuts[-1]))
    whole[:terms, :terms] = penalty
    for c in range(3):
        whole[cuts[c] : cuts[c + 1], cuts[c] : cuts[c + 1]] = bends[c].T @ bends[c]
    for _ in range(_CURVE_ROUNDS):
        model = models[-1]
        z = np.stack([weights[c] @ roots[c] for c in range(3)], axis=1)
        light = np.clip(z, 0.0, 1.0) ** 2
        functions = setting.functions(light)
        XYZ = model.xyz_of_linear(light)
        A, target = _linearised(patches, XYZ, black)
        by_light = np.einsum("nix,xp,npc->nic", A / unit, model.primaries_XYZ_cd_m2, model.slopes(light))
        own = [
            ((by_light[:, :, c] * 2.0 * z[:, None, c])[:, :, None] * weights[c][:, None, 1:-1]).reshape(-1, sizes[c])
            for c in range(3)
        ]
        now = np.concatenate([root[1:-1] for root in roots])
        J = np.concatenate([_columns(A, functions), *own], axis=1)
        wanted = J.T @ (target + np.concatenate(own, axis=1) @ now)
        for c in range(3):
            wanted[cuts[c] : cuts[c + 1]] += bends[c].T @ (bends[c] @ starts[c][1:-1])
        found = np.linalg.solve(J.T @ J + whole + _SMALL * np.eye(len(whole)), wanted)
        for c in range(3):
            roots[c] = np.sqrt(rising_curve(knots[c], found[cuts[c] : cuts[c + 1]]).light)
        curves = (_curve(knots[0], roots[0]), _curve(knots[1], roots[1]), _curve(knots[2], roots[2]))
        try:
            new = _fitted(patches, setting.model(black, curves, unit * found[:terms].reshape(-1, 3)), curves, setting)
        except DeviceError:
            break  # numbers beyond all measure
        if differences(new, patches).mean() >= differences(model, patches).mean():
            break
        models.append(new)
    return models


def _curve(codes: Floats, roots: Floats) -> TableCurve:
    return TableCurve(tuple(codes.tolist()), tuple((roots**2).tolist()))


def _light(curves: Curves, codes: Floats) -> Floats:
    return np.stack([curve.linear(codes[:, i]) for i, curve in enumerate(curves)], axis=1)


def _linearised(patches: Patches, XYZ: Floats, black: Floats) -> tuple[Floats, Floats]:
    """Return ΔE00's slopes (n, 3, 3) by light in units of white's Y, and what they are to give (3n,), about ``XYZ``."""
    unit = float(patches.white[1])
    left = patches.residuals(XYZ)
    weight = (1.0 + left**2) ** -0.25
    A = patches.slopes(XYZ) * unit * weight[:, :, None]
    target = np.einsum("nix,nx->ni", A, (XYZ - black) / unit) - weight * left
    return A, target.ravel()


def _columns(A: Floats, functions: Floats) -> Floats:
    return (A[:, :, None, :] * functions[:, None, :, None]).reshape(3 * len(A), -1)


def _normal_equations(A: Floats, target: Floats, functions: Floats) -> tuple[Floats, Floats]:
    """Return Jᵀ · J and Jᵀ · ``target`` of J = `_columns` (A, functions), without making what is so wide."""
    count = functions.shape[1]
    weights = np.einsum("nix,niy->nxy", A, A)
    normal = np.empty((count, 3, count, 3))
    for x in range(3):
        for y in range(x, 3):
            normal[:, x, :, y] = normal[:, y, :, x] = functions.T @ (weights[:, x, y, None] * functions)
    wanted = functions.T @ np.einsum("nix,ni->nx", A, target.reshape(-1, 3))
    return normal.reshape(3 * count, 3 * count), wanted.ravel()


def _can_be_undone(model: Plvc) -> bool:
    """Return whether no level clashes; a few levels out of all, looked at first, show most of those that do."""
    return not model.clashes(_FIRST_LEVELS) and not model.clashes()


def _left_out(J: Floats, target: Floats, penalty: Floats) -> Floats:
    """Return what the fit to all other readings leaves of each, (3n,): (I − H)⁻¹ · what the fit to all leaves."""
    inverse = np.linalg.inv(J.T @ J + penalty)
    left = target - J @ (inverse @ (J.T @ target))
    own = J.reshape(-1, 3, J.shape[1])
    hats_of = np.einsum("nip,njp->nij", own @ inverse, own)
    return np.asarray(np.linalg.solve(np.eye(3) - hats_of, left.reshape(-1, 3, 1))).ravel()
