"""Colour spaces, differences and encodings."""

from __future__ import annotations

from collections.abc import Iterator
from decimal import Decimal

import numpy as np

from devices.colour import (
    SRGB_PRIMARIES_XY,
    XYZ_from_xyY,
    adaptation_matrix,
    delta_e_2000,
    delta_e_2000_of_xyz,
    lab_to_xyz,
    rgb_to_xyz_matrix,
    srgb_decoded,
    srgb_encoded,
    xyY_from_XYZ,
    xyz_to_lab,
)
from devices.errors import DeviceError
from extensions.measures import pu21_decoded, pu21_encoded
from extensions.measures.pu_measures import _P
from tests.stress.stability import sixty_digits as s
from tests.stress.stability.routine import Routine, gives, refuses

WHITE = np.array([95.047, 100.0, 108.883])
RNG = np.random.default_rng(60)
D = Decimal
_XYZ = WHITE * 10.0 ** RNG.uniform(-7.0, 0.3, (200, 3))
_LAB = np.column_stack(
    [RNG.uniform(0, 100, 250), RNG.uniform(-120, 120, (250, 2)) * 10.0 ** RNG.uniform(-3, 0, (250, 1))]
)
_PAIRS = np.hstack([_LAB, _LAB + RNG.normal(0, 1, (250, 3)) * 10.0 ** RNG.uniform(-4, 1.5, (250, 1))])


def _bent(t: Decimal) -> Decimal:
    delta = D(6) / 29
    return s.cube_root(t) if t > delta**3 else t / (3 * delta**2) + D(4) / 29


def lab(xyz: list[Decimal]) -> list[Decimal]:
    """CIELAB against `WHITE`."""
    x, y, z = (_bent(a / b) for a, b in zip(xyz, s.exact(WHITE), strict=True))
    return [116 * y - 16, 500 * (x - y), 200 * (y - z)]


def _xyz(lab_: list[Decimal]) -> list[Decimal]:
    y = (lab_[0] + 16) / 116
    delta = D(6) / 29

    def straight(t: Decimal) -> Decimal:
        return t**3 if t > delta else 3 * delta**2 * (t - D(4) / 29)

    shares = straight(y + lab_[1] / 500), straight(y), straight(y - lab_[2] / 200)
    return [a * b for a, b in zip(shares, s.exact(WHITE), strict=True)]


def ciede2000(six: list[Decimal]) -> list[Decimal]:
    """ΔE00 step by step as Sharma, Wu and Dalal write it, with angles."""
    L1, a1, b1, L2, a2, b2 = six
    mean = ((a1 * a1 + b1 * b1).sqrt() + (a2 * a2 + b2 * b2).sqrt()) / 2

    def seventh(c: Decimal) -> Decimal:
        return (c**7 / (c**7 + D(25) ** 7)).sqrt()

    grown = 1 + (1 - seventh(mean)) / 2
    a1, a2 = a1 * grown, a2 * grown
    C1, C2 = (a1 * a1 + b1 * b1).sqrt(), (a2 * a2 + b2 * b2).sqrt()
    turn, half = 2 * s.pi(), s.pi()
    h1, h2 = s.atan2(b1, a1) % turn, s.atan2(b2, a2) % turn
    h1, h2 = (h + turn if h < 0 else h for h in (h1, h2))
    dh = h2 - h1
    dh = dh - turn if dh > half else dh + turn if dh < -half else dh
    total = h1 + h2
    wide = (total + turn) / 2 if total < turn else (total - turn) / 2
    h = total / 2 if abs(h1 - h2) <= half else wide
    L, C = (L1 + L2) / 2, (C1 + C2) / 2
    T = 1 - D("0.17") * s.cos(h - s.radians(D(30))) + D("0.24") * s.cos(2 * h)
    T += D("0.32") * s.cos(3 * h + s.radians(D(6))) - D("0.20") * s.cos(4 * h - s.radians(D(63)))
    theta = 30 * (-(((h * 180 / s.pi() - 275) / 25) ** 2)).exp()
    S_L = 1 + D("0.015") * (L - 50) ** 2 / (20 + (L - 50) ** 2).sqrt()
    l_, c = (L2 - L1) / S_L, (C2 - C1) / (1 + D("0.045") * C)
    hue = 2 * (C1 * C2).sqrt() * s.sin(dh / 2) / (1 + D("0.015") * C * T)
    R = -s.sin(s.radians(2 * theta)) * 2 * seventh(C)
    return [(l_ * l_ + c * c + hue * hue + R * c * hue).sqrt()]


def _srgb(x: list[Decimal]) -> list[Decimal]:
    light = x[0]
    return [D("12.92") * light if light <= D("0.0031308") else D("1.055") * s.power(light, 1 / D("2.4")) - D("0.055")]


def _decoded(x: list[Decimal]) -> list[Decimal]:
    code = x[0]
    return [
        code / D("12.92")
        if code <= D("12.92") * D("0.0031308")
        else s.power((code + D("0.055")) / D("1.055"), D("2.4"))
    ]


def _pu(x: list[Decimal]) -> list[Decimal]:
    p = [D(str(number)) for number in _P]
    light = s.power(x[0], p[3])
    return [p[6] * (s.power((p[0] + p[1] * light) / (1 + p[2] * light), p[4]) - p[5])]


def _unpu(x: list[Decimal]) -> list[Decimal]:
    p = [D(str(number)) for number in _P]
    share = s.power(x[0] / p[6] + p[5], 1 / p[4])
    return [s.power((share - p[0]) / (p[1] - p[2] * share), 1 / p[3])]


def _primaries(xy: list[Decimal]) -> list[Decimal]:
    columns = [[xy[2 * i], xy[2 * i + 1], 1 - xy[2 * i] - xy[2 * i + 1]] for i in range(4)]
    matrix = [[columns[j][i] for j in range(3)] for i in range(3)]
    scale = s.solved(matrix, [value / columns[3][1] for value in columns[3]])
    return [matrix[i][j] * scale[j] for i in range(3) for j in range(3)]


_CAT16 = [
    ["0.401288", "0.650173", "-0.051461"],
    ["-0.250268", "1.204414", "0.045854"],
    ["-0.002079", "0.048952", "0.953127"],
]


def _adapted(whites: list[Decimal]) -> list[Decimal]:
    cat = [[D(float(number)) for number in row] for row in _CAT16]
    before, after = s.times(cat, whites[:3]), s.times(cat, whites[3:])
    gained = [[b / a * value for value in row] for a, b, row in zip(before, after, cat, strict=True)]
    back = s.inverse(cat)
    return [sum((back[i][k] * gained[k][j] for k in range(3)), D(0)) for i in range(3) for j in range(3)]


def routines() -> Iterator[Routine]:
    """Give the routines of `devices.colour` and PU21."""
    nan = float("nan")
    yield Routine.of_row(
        "colour.xyz_to_lab | 1e-7 to 2 times white, each of X, Y and Z | 2e-12 Lab | "
        "below 0 the straight line goes on; NaN stays NaN",
        lambda x: xyz_to_lab(x, WHITE),
        lab,
        _XYZ,
        gives(lambda: np.isnan(xyz_to_lab([nan, 1.0, 1.0], WHITE)), [False, True, False]),
    )
    yield Routine.of_row(
        "colour.lab_to_xyz | L* 0 to 100, a* and b* to ±120 | 24.0 ulp | a white that is not above 0 is refused",
        lambda x: lab_to_xyz(x, WHITE),
        _xyz,
        _LAB,
        refuses(DeviceError, lambda: lab_to_xyz([50.0, 0, 0], [0.0, 1, 1])),
    )
    yield Routine.of_row(
        "colour.delta_e_2000 | L* 0 to 100, a* and b* to ±120, differences of 1e-4 to 60 | 2e-12 ΔE00 | "
        "a NaN gives NaN",
        lambda x: delta_e_2000(x[:, :3], x[:, 3:]),
        ciede2000,
        _PAIRS,
        gives(lambda: delta_e_2000([nan, 0, 0], [50.0, 0, 0]), nan),
    )
    near = np.hstack([_XYZ[:100], _XYZ[:100] * RNG.uniform(0.5, 1.5, (100, 3))])
    yield Routine.of_row(
        "colour.delta_e_2000_of_xyz | 1e-7 to 2 times white, halved to 1.5 times | 2e-12 ΔE00 | "
        "a white that is not above 0 is refused",
        lambda x: delta_e_2000_of_xyz(x[:, :3], x[:, 3:], WHITE),
        lambda six: ciede2000(lab(six[:3]) + lab(six[3:])),
        near,
        refuses(DeviceError, lambda: delta_e_2000_of_xyz([1.0, 1, 1], [1.0, 1, 1], [1.0, nan, 1])),
    )
    shares = np.concatenate([10.0 ** RNG.uniform(-8, 0, 150), [0.0, 1.0, 0.0031308, 0.04045]])[:, np.newaxis]
    yield Routine.of_row(
        "colour.srgb_decoded | codes 1e-8 to 1 | 8.0 ulp | below 0 the straight start goes on",
        lambda x: srgb_decoded(x[:, 0]),
        _decoded,
        shares,
        gives(lambda: srgb_decoded(-1.292) < 0, True),
    )
    yield Routine.of_row(
        "colour.srgb_encoded | light 1e-8 to 1 | 8.0 ulp | below 0 the straight start goes on",
        lambda x: srgb_encoded(x[:, 0]),
        _srgb,
        shares,
        gives(lambda: srgb_encoded(-0.1) < 0, True),
    )
    xyY = np.column_stack([RNG.uniform(0.05, 0.7, 200), RNG.uniform(0.02, 0.8, 200), 10.0 ** RNG.uniform(-6, 4, 200)])
    yield Routine.of_row(
        "colour.XYZ_from_xyY | x 0.05 to 0.7, y 0.02 to 0.8, Y 1e-6 to 1e4 | 4.0 ulp | light without y is refused",
        XYZ_from_xyY,
        lambda x: [x[0] * x[2] / x[1], x[2], (1 - x[0] - x[1]) * x[2] / x[1]],
        xyY,
        refuses(DeviceError, lambda: XYZ_from_xyY([0.3, 0.0, 1.0])),
    )
    yield Routine.of_row(
        "colour.xyY_from_XYZ | 1e-7 to 2 times white, each of X, Y and Z | 4.0 ulp | black has the chromaticity 0, 0",
        xyY_from_XYZ,
        lambda x: [x[0] / sum(x), x[1] / sum(x), x[1]],
        _XYZ,
        gives(lambda: xyY_from_XYZ([0.0, 0, 0]), [0.0, 0, 0]),
    )
    corners = np.array([*np.ravel(SRGB_PRIMARIES_XY), 0.3127, 0.329]) + RNG.uniform(-0.05, 0.05, (100, 8))
    yield Routine.of_row(
        "colour.rgb_to_xyz_matrix | chromaticities within 0.05 of sRGB's | 30.0 ulp | "
        "primaries on one line are refused",
        lambda x: [rgb_to_xyz_matrix(r[:2], r[2:4], r[4:6], r[6:]).ravel() for r in x],
        _primaries,
        corners,
        refuses(DeviceError, lambda: rgb_to_xyz_matrix((0, 0.1), (0.1, 0.2), (0.2, 0.3), (0.3, 0.3))),
    )
    whites = np.hstack([WHITE * RNG.uniform(0.5, 1.5, (100, 3)), WHITE * RNG.uniform(0.5, 1.5, (100, 3))])
    yield Routine.of_row(
        "colour.adaptation_matrix | whites of 0.5 to 1.5 of D65 in each of X, Y and Z | 20.0 ulp | "
        "a white to which a response is not above 0 is refused",
        lambda x: [adaptation_matrix(r[:3], r[3:]).ravel() for r in x],
        _adapted,
        whites,
        refuses(DeviceError, lambda: adaptation_matrix([1.0, 0, 0], [1.0, 1, 1])),
    )
    light = 10.0 ** RNG.uniform(np.log10(0.0051), 4.0, (150, 1))
    yield Routine.of_row(
        "measures.pu21_encoded | 0.0051 to 10,000 cd/m² | 2e-12 PU21 | takes the ends of 0.005 to 10,000 cd/m²",
        lambda x: pu21_encoded(x[:, 0]),
        _pu,
        light,
        gives(lambda: pu21_encoded([0.0, 1e9]), pu21_encoded([0.005, 1e4])),
    )
    yield Routine.of_row(
        "measures.pu21_decoded | 0.0051 to 10,000 cd/m² | 1e3 ulp | takes the ends of 0.005 to 10,000 cd/m²",
        lambda x: pu21_decoded(x[:, 0]),
        _unpu,
        pu21_encoded(light),
        gives(lambda: pu21_decoded([-5.0, 1e4]), [0.005, 1e4]),
    )
