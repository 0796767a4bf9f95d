"""Displays drawn at random: gamuts, blacks, every kind of curve, channels that act on each other, leaks, uneven panels.

    from tests.displays import display_models, picture_of

A kind of curve or of model that is new needs a line in `CURVES` or in `display_models`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from hypothesis import assume
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.colour import XYZ_from_xyY
from devices.compensation import Correction
from devices.display import (
    Crosstalk,
    Curve,
    DisplayModel,
    EyeModels,
    GainMap,
    Plvc,
    Residual,
    SrgbCurve,
    TableCurve,
    ToneCurve,
    bt1886_curve,
)
from devices.display.gain_map import Normalise, Positions
from devices.display.residual import MOST_KNOTS
from devices.errors import DeviceError
from documents.arrays import Floats

# Chromaticities of red, green and blue: sRGB, P3 and BT.2020, around which displays are drawn.
_GAMUTS = (
    ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06)),
    ((0.68, 0.32), (0.265, 0.69), (0.15, 0.06)),
    ((0.708, 0.292), (0.17, 0.797), (0.131, 0.046)),
)
_GAMMAS = st.floats(1.6, 2.9)
_SHARES = st.floats(-1.0, 1.0)


def _gogo(gamma: float, offset: float, end: float, lift: float) -> ToneCurve:
    """A curve from an offset, 0.15 at most either way, and a lift of either sign, to about 1."""
    return ToneCurve(1.0 - 0.15 * offset + 0.05 * end, 0.15 * offset, gamma, 0.01 * lift)


def _table(gamma: float, bend: float, flat: float, entries: int) -> TableCurve:
    """A table over an S-shape of a power, flat at its start or its end as a cut-off or a clipped signal is."""
    codes = np.linspace(0.0, 1.0, entries)
    shaped = codes + 0.08 * bend * np.sin(2.0 * np.pi * codes)
    if abs(flat) > 0.5:
        shaped = np.maximum(shaped - 0.2, 0.0) if flat > 0.0 else np.minimum(shaped / 0.8, 1.0)
    root = 0.999 * (shaped / shaped.max()) ** (gamma / 2.0) + 1e-3 * codes
    root = np.maximum.accumulate(root / root[-1])
    root[-1] = 1.0
    return TableCurve(tuple(codes), tuple(root**2))


CURVES: dict[str, st.SearchStrategy[Curve]] = {
    "gamma": st.builds(lambda gamma: ToneCurve(gamma=gamma), _GAMMAS),
    "gogo": st.builds(_gogo, _GAMMAS, _SHARES, _SHARES, _SHARES),
    "srgb": st.just(SrgbCurve()),
    "bt1886": st.builds(lambda black: bt1886_curve(100.0, black), st.floats(0.0, 2.0)),
    "table": st.builds(_table, _GAMMAS, _SHARES, _SHARES, st.integers(5, 40)),
}


@st.composite
def three_curves(draw: st.DrawFn, kinds: Sequence[str] = tuple(CURVES)) -> tuple[Curve, Curve, Curve]:
    """Curves of one kind, or each of a kind of its own."""
    first = draw(st.sampled_from(list(kinds)))
    one_kind = draw(st.booleans())
    others = [first if one_kind else draw(st.sampled_from(list(kinds))) for _ in range(2)]
    red, green, blue = (draw(CURVES[kind]) for kind in (first, *others))
    return red, green, blue


@st.composite
def primaries(draw: st.DrawFn) -> Floats:
    """XYZ of the channels, columns, of a white of 20 to 1000 cd/m²."""
    xy = np.array(draw(st.sampled_from(_GAMUTS)))
    xy = xy + 0.02 * np.array([[draw(_SHARES) for _ in range(2)] for _ in range(3)])
    share = np.array([0.22, 0.7, 0.08]) * np.array([1.0 + 0.3 * draw(_SHARES) for _ in range(3)])
    white_cd_m2 = 10.0 ** draw(st.floats(1.3, 3.0))
    columns = [XYZ_from_xyY([x, max(y, 0.03), white_cd_m2 * Y]) for (x, y), Y in zip(xy, share, strict=True)]
    return np.stack(columns, axis=1)


@st.composite
def residuals(draw: st.DrawFn, white_XYZ_cd_m2: Floats) -> Residual:
    """A residual of any number of knots and width, up to 5 % of ``white_XYZ_cd_m2`` in all."""
    count, width = draw(st.integers(1, MOST_KNOTS)), draw(st.floats(0.2, 3.0))
    rng = np.random.default_rng(draw(st.integers(0, 2**31)))
    size = 0.05 * draw(st.floats(0.1, 1.0)) / count**0.5
    return Residual(rng.uniform(0, 0.88, (count, 3)), width, size * rng.uniform(-1, 1, (count, 3)) * white_XYZ_cd_m2)


def _undone(model: Plvc) -> bool:
    try:
        return model.steps > 0
    except DeviceError:
        return False


@st.composite
def display_models(
    draw: st.DrawFn, kinds: Sequence[str] = tuple(CURVES), plvc: bool | None = None, residual: bool | None = None
) -> DisplayModel:
    """A display of any gamut, black and curves.

    ``plvc`` chooses whether its channels act on each other, and ``residual`` whether that leaves something over.
    """
    matrix = draw(primaries())
    black = matrix.sum(axis=1) * draw(st.sampled_from([0.0, 1e-4, 2e-3, 0.02]))
    black = black * np.array([1.0 + 0.2 * draw(_SHARES) for _ in range(3)])
    interacts = draw(st.booleans()) if plvc is None else plvc
    if not interacts:
        return DisplayModel(black, matrix, draw(three_curves(kinds)))
    rng = np.random.default_rng(draw(st.integers(0, 2**31)))
    own = matrix.T[:, np.newaxis] * (1.0 + 0.06 * draw(st.floats(0.0, 1.0)) * rng.uniform(-1, 1, (3, 4, 3)))
    mixtures = 0.02 * draw(st.floats(0.0, 1.0)) * rng.uniform(-1, 1, (10, 3)) * matrix.sum(axis=1)
    model = Plvc(black, matrix, draw(three_curves(("table",))), own, mixtures)
    if not (draw(st.booleans()) if residual is None else residual):
        assume(_undone(model))
        return model
    left_over = draw(residuals(matrix.sum(axis=1)))
    # Less of it until it can be undone, because most at the widest drawn cannot be.
    smaller = (
        replace(model, residual=replace(left_over, XYZ_cd_m2=share * left_over.XYZ_cd_m2))
        for share in 0.5 ** np.arange(8)
    )
    found = next((one for one in smaller if _undone(one)), None)
    assume(found is not None)
    assert found is not None
    return found


@st.composite
def eye_models(
    draw: st.DrawFn, kinds: Sequence[str] = tuple(CURVES), plvc: bool | None = None, residual: bool | None = None
) -> EyeModels:
    """What each eye sees: the same, or another display of a light less; in the dark, or in a lit room."""
    room = draw(st.sampled_from([0.0, 1e-3, 0.02]))
    left = draw(display_models(kinds, plvc, residual))
    left = left.in_room(room * left.primaries_XYZ_cd_m2.sum(axis=1)) if room else left
    if draw(st.booleans()):
        return EyeModels(left, left)
    share = draw(st.floats(0.7, 1.0))
    black, matrix = share * left.black_XYZ_cd_m2, share * left.primaries_XYZ_cd_m2
    ambient = 0.9 * left.ambient_XYZ_cd_m2
    if isinstance(left, Plvc):
        fewer = left.residual and replace(left.residual, XYZ_cd_m2=share * left.residual.XYZ_cd_m2)
        own, mixtures = share * left.XYZ_per_light_cd_m2, share * left.mixtures_XYZ_cd_m2
        right: DisplayModel = Plvc(black, matrix, left.curves, own, mixtures, fewer)
    else:
        right = DisplayModel(black, matrix, draw(three_curves(kinds)))
    return EyeModels(left, right.in_room(ambient))


@st.composite
def crosstalks(draw: st.DrawFn, takes: float = 0.06, adds: float = 0.08) -> Crosstalk:
    """Leaks that add to each of X, Y and Z, or take from them, and a little of each into the others."""

    def matrix() -> Floats:
        own = np.diag([draw(st.floats(-takes, adds)) for _ in range(3)])
        return np.asarray(own + 0.003 * np.array([[draw(_SHARES) for _ in range(3)] for _ in range(3)]))

    return Crosstalk(matrix(), matrix())


@st.composite
def gain_maps(draw: st.DrawFn, resolution_px: tuple[int, int]) -> GainMap:
    """A panel of ``resolution_px`` that gives 60 to 100 % of its light at some places."""
    positions: Positions = draw(st.sampled_from(("cells", "corners")))
    least = 2 if positions == "corners" else 1
    rows, columns = draw(st.integers(least, 4)), draw(st.integers(least, 5))
    rng = np.random.default_rng(draw(st.integers(0, 2**31)))
    normalise: Normalise = draw(st.sampled_from(("minimum", "centre")))
    return GainMap(rng.uniform(60.0, 100.0, (rows, columns)), resolution_px, positions, normalise)


@st.composite
def corrections(
    draw: st.DrawFn, resolution_px: tuple[int, int], lifts: bool = True, takes: float = 0.06, adds: float = 0.08
) -> Correction:
    """Crosstalk, an uneven panel, or both; ``lifts`` where black may be lifted, which takes channels that add up."""
    which = draw(st.sampled_from(["crosstalk", "gain map", "both"]))
    crosstalk = None if which == "gain map" else draw(crosstalks(takes, adds))
    gain_map = None if which == "crosstalk" else draw(gain_maps(resolution_px))
    lift_share = draw(st.sampled_from([0.0, 0.01, 0.05])) if lifts and crosstalk else 0.0
    return Correction(crosstalk, gain_map, lift_share)


def picture_of(model: DisplayModel, size_px: tuple[int, int], seed: int) -> NDArray[np.float32]:
    """XYZ (height, width, 3): codes, half codes, single channels and greys to 1e-7 of full, and what is beyond it."""
    width, height = size_px
    rng = np.random.default_rng(seed)
    count = width * height // 6
    lone = 10.0 ** rng.uniform(-7, 0, (count, 1)) * np.eye(3)[rng.integers(0, 3, count)]
    parts = [
        model.xyz(rng.uniform(0, 1, (count, 3))),
        model.xyz((rng.integers(0, 255, (count, 3)) + 0.5) / 255.0),
        model.xyz(rng.integers(0, 1024, (count, 3)) / 1023.0),
        model.xyz_of_linear(lone),
        model.xyz_of_linear(np.geomspace(1e-7, 1.0, count)[:, np.newaxis] * np.ones(3)),
        model.xyz_of_linear(rng.uniform(-0.3, 1.4, (width * height - 5 * count, 3))),
    ]
    XYZ = rng.permutation(np.concatenate(parts))
    return np.asarray(XYZ.reshape(height, width, 3), dtype=np.float32)
