"""Displays: curves, matrices, tables, dither, crosstalk, mixtures, gain maps, and geometry."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import numpy as np

from devices.compensation import code_lights, least_squares
from devices.compensation.dither import adjacent_codes
from devices.display import (
    Crosstalk,
    EyeModels,
    GainMap,
    Plvc,
    SrgbCurve,
    TableCurve,
    ToneCurve,
    bt1886_curve,
    contrast_sensitivity,
    curve_table,
    disparity_arcmin,
    read_display,
    size_mm,
    visual_angle_deg,
)
from devices.display.curves import looked_up_codes
from devices.display.plvc import CROSS, PAIRS
from devices.errors import DeviceError
from documents.arrays import Floats
from tests.stress.stability import sixty_digits as s
from tests.stress.stability.routine import Routine, gives, refuses

D = Decimal
RNG = np.random.default_rng(61)
CODES = np.concatenate([10.0 ** RNG.uniform(-6, 0, 150), [0.0, 1.0]])[:, np.newaxis]
LIGHT = np.concatenate([10.0 ** RNG.uniform(-9, 0, 150), [1.0]])[:, np.newaxis]
GOGO = ToneCurve(0.96, 0.03, 2.4, 0.001)
GAMMA = ToneCurve(gamma=2.4)
MODELS = read_display(Path(__file__).parents[3] / "configs/displays/asus_vg248qe.yaml").models("side-by-side")
MODEL = replace(MODELS.left, black_XYZ_cd_m2=np.array([0.02, 0.02, 0.03]))
LEAKS = np.array([[0.05, 0.002, 0.0], [0.004, 0.04, 0.0], [0.0, 0.001, 0.06]])


def _gogo(curve: ToneCurve, code: Decimal) -> Decimal:
    drive = D(curve.gain) * code + D(curve.offset)
    return s.power(max(drive, D(0)), D(curve.gamma)) + D(curve.lift)


def _gogo_code(curve: ToneCurve, light: Decimal) -> Decimal:
    drive = s.power(max(light - D(curve.lift), D(0)), 1 / D(curve.gamma))
    return min(max((drive - D(curve.offset)) / D(curve.gain), D(0)), D(1))


def _matrix(values: Floats) -> list[list[Decimal]]:
    return [s.exact(row) for row in values]


def _forward(codes: list[Decimal]) -> list[Decimal]:
    linear = [
        _gogo(curve, code) for curve, code in zip(MODEL.curves, codes, strict=True) if isinstance(curve, ToneCurve)
    ]
    light = s.times(_matrix(MODEL.primaries_XYZ_cd_m2), linear)
    return [a + b for a, b in zip(light, s.exact(MODEL.black_XYZ_cd_m2), strict=True)]


def _linear(xyz: list[Decimal]) -> list[Decimal]:
    above = [a - b for a, b in zip(xyz, s.exact(MODEL.black_XYZ_cd_m2), strict=True)]
    return s.solved(_matrix(MODEL.primaries_XYZ_cd_m2), above)


def _inverse(xyz: list[Decimal]) -> list[Decimal]:
    curves = [curve for curve in MODEL.curves if isinstance(curve, ToneCurve)]
    return [_gogo_code(curve, light) for curve, light in zip(curves, _linear(xyz), strict=True)]


def _knotted(curve: TableCurve, light: Decimal) -> Decimal:
    """Invert the curve's own cubics of √light by bisection."""
    root, knots = light.sqrt(), list(curve.codes)
    cubics = np.asarray(curve.cubics[1])
    piece = max(i for i in range(len(knots) - 1) if root >= D(float(np.sqrt(curve.light[i]))) or i == 0)
    a, b, c, d = (D(float(cubics[power][piece])) for power in range(4))
    low, high = D(0), D(knots[piece + 1]) - D(knots[piece])
    for _ in range(220):
        middle = (low + high) / 2
        low, high = (middle, high) if ((a * middle + b) * middle + c) * middle + d < root else (low, middle)
    return D(knots[piece]) + low


def _seen(six: list[Decimal]) -> list[Decimal]:
    leak = _matrix(LEAKS)
    identity = [[D(int(i == j)) for j in range(3)] for i in range(3)]
    both = [[*identity[i], *leak[i]] for i in range(3)] + [[*leak[i], *identity[i]] for i in range(3)]
    return s.solved(both, six)


def _dithered(x: list[Decimal]) -> list[Decimal]:
    lights = s.exact(code_lights(GAMMA))
    lower = max(i for i in range(255) if lights[i] <= x[0])
    return [lower + (x[0] - lights[lower]) / (lights[lower + 1] - lights[lower])]


def _code_and_share(light: Floats) -> Floats:
    lower, share = adjacent_codes(light, code_lights(GAMMA))
    return np.asarray(lower + share)


def _gain(place: list[Decimal]) -> list[Decimal]:
    readings = [[D(80), D(90), D(70)], [D(85), D(100), D(75)]]
    across, down = place[0] / 300 * 3 - HALF, place[1] / 200 * 2 - HALF
    across, down = min(max(across, D(0)), D(2)), min(max(down, D(0)), D(1))
    column, row = min(int(across), 1), min(int(down), 0)
    u, v = across - column, down - row
    upper = (1 - u) * readings[row][column] + u * readings[row][column + 1]
    lower = (1 - u) * readings[row + 1][column] + u * readings[row + 1][column + 1]
    return [((1 - v) * upper + v * lower) / 95]


HALF = D("0.5")


def _mixed(six: list[Decimal]) -> list[Decimal]:
    """Least squares by its normal equations, scaled to white."""
    filters = ([D(1), D("0.1"), D(0)], [D(0), D("0.9"), D(1)])
    primaries = _matrix(MODELS.left.primaries_XYZ_cd_m2)
    stacked = [[primaries[i][j] * through[j] for j in range(3)] for through in filters for i in range(3)]
    normal = [[sum((row[i] * row[j] for row in stacked), D(0)) for j in range(3)] for i in range(3)]

    def fitted(values: list[Decimal]) -> list[Decimal]:
        return s.solved(
            normal, [sum((row[i] * v for row, v in zip(stacked, values, strict=True)), D(0)) for i in range(3)]
        )

    white = [sum(row, D(0)) for row in primaries] * 2
    return [a / b for a, b in zip(fitted(six), fitted(white), strict=True)]


def _barten(x: list[Decimal]) -> list[Decimal]:
    u, light, field = x
    lg = (light * field**2 / 1600).ln() / D(10).ln() * D("0.4")
    pupil = 5 - 3 * ((2 * lg).exp() - 1) / ((2 * lg).exp() + 1)
    trolands = s.pi() * pupil**2 / 4 * light * (1 - (pupil / D("9.7")) ** 2 + (pupil / D("12.4")) ** 4)
    blur = ((D("0.5") / 60) ** 2 + (D("0.08") / 60 * pupil) ** 2).sqrt()
    optics = (-2 * s.pi() ** 2 * blur**2 * u**2).exp()
    area = 1 / field**2 + D(1) / 144 + u**2 / 225
    noise = 1 / (D("0.03") * D("1.2274e6") * trolands) + D("3e-8") / (1 - (-((u / 7) ** 2)).exp())
    return [optics / 3 / (20 * area * noise).sqrt()]


def _angle(size: Decimal, distance: Decimal) -> Decimal:
    return 2 * s.atan(size / (2 * distance)) * 180 / s.pi()


def _disparity(x: list[Decimal]) -> list[Decimal]:
    parallax = x[0] * D(0.25)
    return [60 * (_angle(D(65), D(700)) - _angle(D(65) - parallax, D(700)))]


def _plvc() -> Plvc:
    rng = np.random.default_rng(7)
    matrix = MODELS.left.primaries_XYZ_cd_m2
    codes = np.linspace(0.0, 1.0, 9)
    curve = TableCurve(tuple(codes), tuple(codes**2.2))
    own = matrix.T[:, np.newaxis] * (1.0 + 0.03 * rng.uniform(-1, 1, (3, 4, 3)))
    mixtures = 0.01 * rng.uniform(-1, 1, (10, 3)) * matrix.sum(axis=1)
    return Plvc(np.array([0.02, 0.02, 0.03]), matrix, (curve, curve, curve), own, mixtures)


PLVC = _plvc()


def _plvc_light(linear: list[Decimal]) -> list[Decimal]:
    """The light of channels' light: powers of each channel's nodes and mixtures of two and three, as documented."""
    total = [D(0)] * 3

    def add(coefficients: Floats, by: Decimal) -> None:
        for row, coefficient in enumerate(coefficients):
            total[row] += D(float(coefficient)) * by

    for T, powers in zip(linear, PLVC.powers, strict=True):
        root, grown = max(T, D(0)).sqrt(), T
        for coefficients in powers:
            add(coefficients, grown)
            grown *= root
    by_name = dict(zip(CROSS, PLVC.mixtures[4:], strict=True))
    for pair, (i, j) in enumerate(PAIRS):
        both = linear[i] * linear[j]
        add(PLVC.mixtures[pair], both)
        add(by_name[i, j], both * (1 - linear[i]))
        add(by_name[j, i], both * (1 - linear[j]))
    add(PLVC.mixtures[3], linear[0] * linear[1] * linear[2])
    return total


def routines() -> Iterator[Routine]:
    """Give the routines of `devices.display` and `devices.compensation`."""
    nan = float("nan")
    yield Routine.of_row(
        "ToneCurve.linear | codes 0, 1e-6 to 1 | 8.0 ulp | goes on above 1; below the cut-off the lift",
        lambda x: GOGO.linear(x[:, 0]),
        lambda x: [_gogo(GOGO, x[0])],
        CODES,
        gives(lambda: GOGO.linear([-9.0]), [0.001]),
    )
    yield Routine.of_row(
        "ToneCurve.code | light 1e-9 to 1 | 4.0 ulp | is clipped to 0 to 1; NaN stays NaN",
        lambda x: GAMMA.code(x[:, 0]),
        lambda x: [_gogo_code(GAMMA, x[0])],
        LIGHT,
        gives(lambda: GAMMA.code([-1.0, 2.0, nan]), [0.0, 1.0, nan]),
    )
    yield Routine.of_row(
        "ToneCurve.code, with offset and lift | light from just above code 0's to above full | 1e-12 code | "
        "is clipped to 0 to 1",
        lambda x: GOGO.code(x[:, 0]),
        lambda x: [_gogo_code(GOGO, x[0])],
        0.00103 + LIGHT,
        gives(lambda: GOGO.code([0.0, 9.0]), [0.0, 1.0]),
    )
    bt1886 = bt1886_curve(100.0, 0.1)
    yield Routine.of_row(
        "bt1886_curve | codes 0, 1e-6 to 1, black 0.1 % of white | 1e-15 light | "
        "white that is not above black is refused",
        lambda x: bt1886.linear(x[:, 0]),
        _bt1886,
        CODES,
        refuses(DeviceError, lambda: bt1886_curve(1.0, 1.0)),
    )
    srgb = SrgbCurve()
    yield Routine.of_row(
        "SrgbCurve.code | light 1e-9 to 1 | 8.0 ulp | is clipped to 0 to 1",
        lambda x: srgb.code(x[:, 0]),
        _srgb_code,
        LIGHT,
        gives(lambda: srgb.code([-1.0, 2.0]), srgb.code([0.0, 1.0])),
    )
    table = TableCurve((0.0, 0.2, 0.5, 0.8, 1.0), (0.0, 0.03, 0.22, 0.62, 1.0))
    yield Routine.of_row(
        "TableCurve.code | light 1e-9 to 1 | 1e-12 code | is clipped to 0 to 1",
        lambda x: table.code(x[:, 0]),
        lambda x: [_knotted(table, x[0])],
        LIGHT,
        gives(lambda: table.code([-1.0, 2.0]), [0.0, 1.0]),
    )
    colours = RNG.uniform(0.001, 1.0, (150, 3))
    yield Routine.of_row(
        "DisplayModel.xyz | codes 0.001 to 1 | 16.0 ulp | goes on above 1; NaN stays NaN",
        MODEL.xyz,
        _forward,
        colours,
        gives(lambda: np.isnan(MODEL.xyz([nan, 0.5, 0.5])).all(), True),
    )
    yield Routine.of_row(
        "DisplayModel.linear | XYZ of codes 0.001 to 1 | 4e-15 light | light beyond 0 to 1 is returned, to be counted",
        MODEL.linear,
        _linear,
        MODEL.xyz(colours),
        gives(lambda: MODEL.linear([0.0, 0, 0]).min() < 0, True),
    )
    yield Routine.of_row(
        "DisplayModel.code | XYZ of codes 0.02 to 1 | 1e-12 code | is clipped to the gamut",
        MODEL.code,
        _inverse,
        MODEL.xyz(RNG.uniform(0.02, 1.0, (150, 3))),
        gives(lambda: MODEL.code(9.0 * MODEL.white_XYZ_cd_m2), [1.0, 1, 1]),
    )
    yield Routine.of_row(
        "looked_up_codes | light 1e-9 to 1, gamma 2.4, 1024 entries in 32 bits | 2e-6 code | takes the ends",
        lambda x: looked_up_codes(x[:, 0], curve_table(GAMMA).astype(np.float32)),
        lambda x: [_gogo_code(GAMMA, x[0])],
        LIGHT,
        gives(lambda: looked_up_codes(np.array([-1.0, 9.0]), curve_table(GAMMA).astype(np.float32)), [0, 1]),
    )
    yield Routine.of_row(
        "adjacent_codes (dither) | light 1e-9 to 1, gamma 2.4, 8 bits | 1e-10 code | is shown as the end",
        lambda x: _code_and_share(x[:, 0]),
        _dithered,
        LIGHT[LIGHT[:, 0] < 1],
        gives(lambda: _code_and_share(np.array([-1.0, 2.0])), [0, 255]),
    )
    leaks = Crosstalk(LEAKS, LEAKS)
    six = RNG.uniform(0.0, 50.0, (100, 6))
    yield Routine.of_row(
        "Crosstalk.solve | leaks of 4 to 6 %, XYZ 0 to 50 cd/m² | 8.0 ulp | leaks of a condition above 1e6 are refused",
        lambda x: np.hstack(leaks.solve(x[:, :3], x[:, 3:])),
        _seen,
        six,
        refuses(DeviceError, lambda: Crosstalk(np.eye(3), np.eye(3))),
    )
    panel = GainMap(np.array([[80.0, 90, 70], [85, 100, 75]]), (300, 200), "cells", "centre")
    yield Routine.of_row(
        "GainMap.gain | all of the panel, gains 0.74 to 1.05 | 6.0 ulp | "
        "a place beyond the panel has the gain of its edge",
        lambda x: panel.gain(x[:, 0], x[:, 1]),
        _gain,
        RNG.uniform([0, 0], [300, 200], (150, 2)),
        gives(lambda: panel.gain(-50.0, 0.0), panel.gain(0.0, 0.0)),
    )
    mixture = least_squares(EyeModels(MODELS.left, MODELS.left), (1.0, 0.1, 0.0), (0.0, 0.9, 1.0))
    yield Routine.of_row(
        "Mixture.light | XYZ 0 to 50 cd/m² | 40.0 ulp | filters that leave a channel unseen are refused",
        lambda x: mixture.light(x[:, :3], x[:, 3:]),
        _mixed,
        six,
        refuses(DeviceError, lambda: least_squares(MODELS, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))),
    )
    yield Routine.of_row(
        "Plvc.light_of | channels' light 0.001 to 1 | 16.0 ulp | NaN stays NaN",
        PLVC.light_of,
        _plvc_light,
        colours,
        gives(lambda: np.isnan(PLVC.light_of([nan, 0.5, 0.5])).any(), True),
    )
    yield Routine.of_row(
        "Plvc.channels | light of channels 0.001 to 1 | 1e-13 light | "
        "light beyond the gamut is returned, to be counted",
        lambda x: PLVC.channels(x),
        _plvc_channels,
        PLVC.light_of(colours),
        gives(lambda: PLVC.channels(PLVC.light_of([-0.01, 0.5, 0.5]))[0] < 0, True),
    )
    seen = np.column_stack(
        [10.0 ** RNG.uniform(-1, 1.7, 100), 10.0 ** RNG.uniform(-2, 3, 100), RNG.uniform(0.5, 40, 100)]
    )
    yield Routine.of_row(
        "contrast_sensitivity | 0.1 to 50 cycles per degree, 0.01 to 1000 cd/m², fields of 0.5° to 40° | "
        "100.0 ulp | a frequency of 0 is refused",
        lambda x: contrast_sensitivity(x[:, 0], x[:, 1], x[:, 2]),
        _barten,
        seen,
        refuses(DeviceError, lambda: contrast_sensitivity(0.0, 100.0)),
    )
    sizes = 10.0 ** RNG.uniform(-6, 4, (150, 1))
    yield Routine.of_row(
        "visual_angle_deg | 1 nm to 10 m from 700 mm | 4.0 ulp | a distance that is not above 0 is refused",
        lambda x: visual_angle_deg(x[:, 0], 700.0),
        lambda x: [_angle(x[0], D(700))],
        sizes,
        refuses(DeviceError, lambda: visual_angle_deg(1.0, 0.0)),
    )
    yield Routine.of_row(
        "size_mm | angles to 179° | 40.0 ulp | a distance that is not above 0 is refused",
        lambda x: size_mm(x[:, 0], 700.0),
        _size,
        RNG.uniform(1e-6, 179.0, (150, 1)),
        refuses(DeviceError, lambda: size_mm(1.0, 0.0)),
    )
    yield Routine.of_row(
        "disparity_arcmin | 250 px to either side | 1e-12 arcmin | a pitch that is not above 0 is refused",
        lambda x: disparity_arcmin(x[:, 0], 0.25, 700.0),
        _disparity,
        RNG.uniform(-250, 250, (150, 1)),
        refuses(DeviceError, lambda: disparity_arcmin(1.0, 0.0, 700.0)),
    )


def _bt1886(x: list[Decimal]) -> list[Decimal]:
    white, black, gamma = D(100), D(0.1), D("2.4")
    a = s.power(white, 1 / gamma) - s.power(black, 1 / gamma)
    light = s.power(a * x[0] + s.power(black, 1 / gamma), gamma)
    return [(light - black) / (white - black)]


def _srgb_code(x: list[Decimal]) -> list[Decimal]:
    light = x[0]
    return [D("12.92") * light if light <= D("0.0031308") else D("1.055") * s.power(light, 1 / D("2.4")) - D("0.055")]


def _size(x: list[Decimal]) -> list[Decimal]:
    half = s.radians(x[0]) / 2
    return [1400 * s.sin(half) / s.cos(half)]


def _plvc_channels(light: list[Decimal]) -> list[Decimal]:
    """Newton's method with derivatives by differences of 1e-30."""
    linear, nudge = list(light), D(10) ** -30
    for _ in range(60):
        now = _plvc_light(linear)
        off = [a - b for a, b in zip(now, light, strict=True)]
        if max(map(abs, off)) < D(10) ** -50:
            return linear
        moved = [_plvc_light([*linear[:i], linear[i] + nudge, *linear[i + 1 :]]) for i in range(3)]
        slopes = [[(moved[j][i] - now[i]) / nudge for j in range(3)] for i in range(3)]
        linear = [a - b for a, b in zip(linear, s.solved(slopes, off), strict=True)]
    raise AssertionError
