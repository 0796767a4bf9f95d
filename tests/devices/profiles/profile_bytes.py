"""ICC profiles put together byte by byte, apart from the code that writes them in `devices.profiles`.

Displays that were never measured, drawn at random within what displays are.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence

import numpy as np
from hypothesis import strategies as st

from devices.colour import rgb_to_xyz_matrix
from devices.display import Curve, DisplayModel, Plvc, TableCurve, ToneCurve

D50 = (0.9642, 1.0, 0.8249)
# sRGB's primaries and Bradford's matrix from D65, as the ICC's own sRGB profile has them.
COLORANTS = {
    "rXYZ": (0.43606567, 0.22248840, 0.01391602),
    "gXYZ": (0.38514709, 0.71687317, 0.09707642),
    "bXYZ": (0.14306641, 0.06060791, 0.71409607),
}
CHAD = (1.04788208, 0.02291870, -0.05021667, 0.02958679, 0.99047852, -0.01707458, -0.00924683, 0.01507568, 0.75167847)
STEPS = tuple(np.linspace(0, 1, 18).tolist())


def s15(*values: float) -> bytes:
    return b"".join(struct.pack(">i", round(value * 65536)) for value in values)


def xyz(*values: float) -> bytes:
    return b"XYZ \0\0\0\0" + s15(*values)


def curv(*values: int) -> bytes:
    return b"curv\0\0\0\0" + struct.pack(f">I{len(values)}H", len(values), *values)


def para(kind: int, *numbers: float) -> bytes:
    return b"para\0\0\0\0" + struct.pack(">HH", kind, 0) + s15(*numbers)


def text(words: str) -> bytes:
    return b"text\0\0\0\0" + words.encode() + b"\0"


def vcgt(channels: int, size: int, values: Sequence[int], entries: int | None = None) -> bytes:
    count = len(values) // channels if entries is None else entries
    form = "B" if size == 1 else "H"
    head = b"vcgt\0\0\0\0" + struct.pack(">IHHH", 0, channels, count, size)
    return head + struct.pack(f">{len(values)}{form}", *values)


def matrix_tags(*curves: bytes, lumi: float | None = 100.0) -> dict[str, bytes]:
    """Return the tags of a display with sRGB's primaries; one curve serves all three channels."""
    three = curves * 3 if len(curves) == 1 else curves
    tags = {name: xyz(*values) for name, values in COLORANTS.items()}
    tags |= dict(zip(("rTRC", "gTRC", "bTRC"), three, strict=True))
    tags |= {"wtpt": xyz(*D50), "chad": b"sf32\0\0\0\0" + s15(*CHAD)}
    return tags | ({"lumi": xyz(0.0, lumi, 0.0)} if lumi is not None else {})


def profile(
    tags: Mapping[str, bytes],
    *,
    version: int = 4,
    kind: bytes = b"mntr",
    space: bytes = b"RGB ",
    pcs: bytes = b"XYZ ",
) -> bytes:
    """Return a profile of ``tags``."""
    at = 128 + 4 + 12 * len(tags)
    table, body = struct.pack(">I", len(tags)), b""
    for name, data in tags.items():
        table += name.encode() + struct.pack(">II", at + len(body), len(data))
        body += data + b"\0" * (-len(data) % 4)
    size = at + len(body)
    head = struct.pack(">I4xI4s4s4s", size, version << 24, kind, space, pcs) + b"\0" * 12 + b"acsp"
    head += b"\0" * 28 + s15(*D50)
    return head.ljust(128, b"\0") + table + body


def _table(gamma: float, bend: float) -> TableCurve:
    codes = np.asarray(STEPS)
    light = codes**gamma * (1 + bend * np.sin(np.pi * codes) * (1 - codes))
    light = 0.998 * np.maximum.accumulate(light / light[-1]) + 0.002 * codes**2
    return TableCurve(STEPS, tuple(light.tolist()))


@st.composite
def displays(draw: st.DrawFn) -> DisplayModel:
    """Draw an additive display: primaries, white, luminance, black, and curves of the GOG family or tables."""
    move = st.floats(-0.02, 0.02)
    corners = [(x + draw(move), y + draw(move)) for x, y in ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06), (0.31, 0.33))]
    luminance = draw(st.floats(5.0, 1000.0))
    primaries = luminance * rgb_to_xyz_matrix(*corners)
    black = primaries @ np.array([draw(st.floats(0.0, 0.01)) for _ in range(3)])
    curves: list[Curve] = []
    tabled = draw(st.booleans())
    for _ in range(3):
        gamma = draw(st.floats(1.6, 2.6))
        offset = draw(st.floats(-0.05, 0.05))
        curve = _table(gamma, draw(st.floats(-0.2, 0.2))) if tabled else ToneCurve(1.0 - offset, offset, gamma)
        curves.append(curve)
    return DisplayModel(black, primaries, (curves[0], curves[1], curves[2]))


def plvc_display(strength: float) -> Plvc:
    """Return a display whose primaries vary with their level, and whose channels take from each other, by a share."""
    primaries = 100.0 * rgb_to_xyz_matrix((0.64, 0.33), (0.30, 0.60), (0.15, 0.06), (0.31, 0.33))
    rng = np.random.default_rng(4)
    share = strength * (1 - np.array([0.0, 0.25, 0.5, 0.75]))[None, :, None] * rng.uniform(-1, 1, (3, 1, 3))
    mixtures = strength * rng.uniform(-1, 1, (10, 3)) * 8.0
    curves = (_table(2.2, 0.0), _table(2.1, 0.1), _table(2.3, -0.1))
    return Plvc(np.array([0.08, 0.08, 0.1]), primaries, curves, primaries.T[:, None] * (1 + share), mixtures)
