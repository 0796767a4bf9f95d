"""A display model as an ICC profile of version 4: matrix and curves where they are exact enough, tables otherwise.

The tables are ``A2B0`` and ``B2A0``, curves, grid, curves and matrix, for a display model of any kind. In the grid
stands only what the channels do to each other: its axes are the roots of the channels' own light, and it gives the
roots of the light in units of the primaries, which a matrix turns into XYZ. For an additive display the grid changes
nothing and any number of points is exact; for others it holds the little by which they differ, finest in the dark. Near
zero and below, where a colour takes away some of a primary, the root continues as a straight line.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from devices.colour import bradford_matrix, delta_e_2000, xyz_to_lab
from devices.display import Curve, DisplayModel, GammaTable
from devices.errors import DeviceError
from devices.profiles import D50, XYZ_RANGE, parse_profile_file, profile_of, read_table
from documents import Finding
from documents.arrays import Floats
from documents.files import whole_file, writing
from extensions.profiles import tag_bytes

ENTRIES = 4096
_NO_CURVE = b"curv\0\0\0\0\0\0\0\0"
# Below this light the root continues as its tangent: no kink where a colour takes away some of a primary.
_TOE = 0.002
_SLOPE = 2.0 * _TOE**0.5
_ROOT_0 = _TOE / _SLOPE
# Beyond its own ends a channel's root is kept this far, so that the edge of the gamut lies between points unbent.
_BELOW, _ABOVE = -0.2, 1.2
_PROBES = 17


@dataclass(frozen=True, slots=True, eq=False)
class _Range:
    """From the ``least`` to the ``most`` light (3,) in units of the primaries; ``low`` and ``high`` are their roots."""

    least: Floats
    most: Floats

    @property
    def low(self) -> Floats:
        return _root(self.least)

    @property
    def high(self) -> Floats:
        return _root(self.most)


@dataclass(frozen=True, slots=True, eq=False)
class _Units:
    """``dark`` (3,) at code 0 and ``primaries`` (3, 3) above it, in cd/m²: the units in which light is tabled."""

    dark: Floats
    primaries: Floats

    def light(self, XYZ: Floats) -> Floats:
        """Return light (n, 3) in units of the primaries, above black."""
        return np.asarray(np.linalg.solve(self.primaries, (XYZ - self.dark).T).T, dtype=np.float64)


def table_tags(model: DisplayModel, chad: Floats, luminance: float, points: int) -> tuple[bytes, bytes]:
    """Return ``A2B0`` and ``B2A0`` of ``model`` with a grid of ``points`` a side.

    ``chad`` (3, 3) and ``luminance`` in cd/m² lead from its light to the connection space.
    """
    dark = model.xyz(np.zeros(3))
    units = _Units(dark, (model.xyz(np.eye(3)) - dark).T)
    axis = np.linspace(0.0, 1.0, max(points, _PROBES))
    light = units.light(model.xyz(_codes(model, _cube(np.stack([axis] * 3)))))
    # What rounding alone leaves below 0 or above 1 is none.
    least, most = np.minimum(light.min(axis=0), 0.0), np.maximum(light.max(axis=0), 1.0)
    span = _Range(np.where(least > -1e-9, 0.0, least), np.where(most < 1.0 + 1e-9, 1.0, most))
    to_pcs = chad / luminance / XYZ_RANGE
    return _forward(model, units, span, to_pcs, points), _backward(model, units, span, to_pcs, points)


def _forward(model: DisplayModel, units: _Units, span: _Range, to_pcs: Floats, points: int) -> bytes:
    axis = np.linspace(0.0, 1.0, points)
    light = units.light(model.xyz(_codes(model, _cube(np.stack([axis] * 3)))))
    grid = (_root(light) - span.low) / (span.high - span.low)
    codes = np.linspace(0.0, 1.0, ENTRIES)
    first = b"".join(
        tag_bytes.padded(tag_bytes.sampled_curve(_share_of_root(_own(curve, codes)))) for curve in model.curves
    )
    rows = to_pcs @ units.primaries * (span.most - span.least)
    offset = to_pcs @ (units.dark + units.primaries @ span.least)
    middle = b"".join(_light_of_root(*ends) for ends in zip(span.least, span.most, span.low, span.high, strict=True))
    shaped = grid.reshape(points, points, points, 3)
    return tag_bytes.stages(b"mAB ", 3 * _NO_CURVE, rows, offset, middle, shaped, first)


def _backward(model: DisplayModel, units: _Units, span: _Range, to_pcs: Floats, points: int) -> bytes:
    axes = np.linspace(span.low, span.high, points, axis=1)
    own = model.linear(units.dark + _light(_cube(axes)) @ units.primaries.T)
    lowest, highest = model.limits
    shares = (own - lowest) / (highest - lowest)
    grid = (np.clip(_root(shares), _BELOW, _ABOVE) - _BELOW) / (_ABOVE - _BELOW)
    roots = np.linspace(_BELOW, _ABOVE, ENTRIES)
    wanted = lowest + (highest - lowest) * np.clip(_light(roots), 0.0, 1.0)[:, None]
    last = [curve.code(wanted[:, channel]) for channel, curve in enumerate(model.curves)]
    first = b"".join(tag_bytes.padded(tag_bytes.sampled_curve(code)) for code in last)
    from_pcs = np.linalg.inv(to_pcs @ units.primaries)
    scale = 1.0 / (span.most - span.least)
    rows = from_pcs * scale[:, None]
    offset = (-from_pcs @ to_pcs @ units.dark - span.least) * scale
    middle = b"".join(_root_of_light(*ends) for ends in zip(span.least, span.most, span.low, span.high, strict=True))
    shaped = grid.reshape(points, points, points, 3)
    return tag_bytes.stages(b"mBA ", 3 * _NO_CURVE, rows, offset, middle, shaped, first)


def _root(light: Floats) -> Floats:
    """Return √light, and below `_TOE` its tangent there, which goes on below zero."""
    return np.where(light >= _TOE, np.sqrt(np.maximum(light, 0.0)), (light + _TOE) / _SLOPE)


def _light(root: Floats) -> Floats:
    """Return the light of which ``root`` is the `_root`."""
    return np.where(root >= np.sqrt(_TOE), root**2, _SLOPE * root - _TOE)


def _light_of_root(least: float, most: float, low: float, high: float) -> bytes:
    """Return the curve from a root to light, both as shares of their ranges."""
    span, width = most - least, high - low
    power = [2.0, width / np.sqrt(span), low / np.sqrt(span)]
    return tag_bytes.parametric_curve(
        4, [*power, _SLOPE * width / span, (np.sqrt(_TOE) - low) / width, -least / span, 0.0]
    )


def _root_of_light(least: float, most: float, low: float, high: float) -> bytes:
    """Return the curve from light to its root, both as shares of their ranges."""
    span, width = most - least, high - low
    power = [0.5, span / width**2, least / width**2]
    return tag_bytes.parametric_curve(4, [*power, span / (_SLOPE * width), (_TOE - least) / span, -low / width, 0.0])


def _share_of_root(light: Floats) -> Floats:
    """Return the root of ``light`` in 0..1, from 0 to 1."""
    return np.asarray((_root(light) - _ROOT_0) / (1.0 - _ROOT_0))


def _own(curve: Curve, codes: Floats) -> Floats:
    """Return a channel's own light at ``codes`` from 0 to 1, as a share of what they span."""
    light = curve.linear(codes)
    return np.asarray(np.clip((light - light[0]) / (light[-1] - light[0]), 0.0, 1.0), dtype=np.float64)


def _codes(model: DisplayModel, shares: Floats) -> Floats:
    """Return the codes (n, 3) at which the roots of the channels' own light have ``shares`` (n, 3) of their range."""
    lowest, highest = model.limits
    light = lowest + (highest - lowest) * _light(_ROOT_0 + (1.0 - _ROOT_0) * shares)
    codes = np.stack([curve.code(light[:, channel]) for channel, curve in enumerate(model.curves)], axis=1)
    # At its ends a curve may be flat; the codes meant are 0 and 1.
    return np.where(shares == 0.0, 0.0, np.where(shares == 1.0, 1.0, codes))


def _cube(axes: Floats) -> Floats:
    """Return the points (n³, 3) of a grid with ``axes`` (3, n), the first channel slowest."""
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


ProfileKind = Literal["matrix", "table"]

# Grid points a side that are tried one after the other, until the largest difference is small enough.
GRIDS = (17, 25, 33, 45, 65)
MOST_MEAN, MOST, MOST_BACK = 0.05, 0.25, 0.5
_COPYRIGHT = "No copyright, use freely"
# Black may lie this far outside what the primaries can mix, as a share of white: less than a step of 16 bits.
_LEAST_LIFT = -2e-6
# What s15Fixed16 holds, to a ten-thousandth.
_LEAST_LUMINANCE, _MOST_LUMINANCE = 0.2, 32767.0


@dataclass(frozen=True, slots=True, eq=False)
class WrittenProfile:
    """A profile's ``data`` and how it agrees with its model.

    ``kind``: matrix and curves, or a table with ``points`` a side (0 of a matrix). ``mean`` and ``largest``: ΔE00 of
    the light of 3344 codes over the gamut; ``back_mean`` and ``back_largest``: of the model's light of the codes that
    the table gives for theirs (0 of a matrix, which is undone exactly).
    """

    data: bytes
    kind: ProfileKind
    points: int
    mean: float
    largest: float
    back_mean: float
    back_largest: float

    @property
    def close(self) -> bool:
        """Whether both ways are within the limits that a profile is held to."""
        mean = max(self.mean, self.back_mean)
        return mean <= MOST_MEAN and self.largest <= MOST and self.back_largest <= MOST_BACK

    def sentence(self) -> str:
        """Return what it is and how it agrees with its model."""
        what = "matrix and curves" if self.kind == "matrix" else f"tables of {self.points} points a side"
        words = f"{what}; against the model ΔE00 {self.mean:.3f} on average, {self.largest:.3f} at most"
        if self.kind == "matrix":
            return words
        return f"{words}; from light back to codes {self.back_mean:.3f} and {self.back_largest:.3f}"


def profile_of_model(
    model: DisplayModel,
    description: str,
    *,
    kind: ProfileKind | None = None,
    points: int | None = None,
    gamma_table: GammaTable | None = None,
) -> WrittenProfile:
    """Return a display model as an ICC profile.

    Parameters
    ----------
    model
        The display model of an eye; the room's light is left out, because a profile describes the display.
    description
        What programs show as the profile's name.
    kind
        ``matrix`` or ``table``; None takes a matrix where it is within 0.05 ΔE00 of the model on average and 0.25 at
        most.
    points
        Grid points a side of a table, 2 to 65; None takes as few as keep these limits.
    gamma_table
        The graphics card's table that the model was measured with; one that is known and not the identity is written
        into ``vcgt``.

    Returns
    -------
    WrittenProfile
        The profile and its differences from the model.

    Raises
    ------
    DeviceError
        If the white gives no light, the points are not in range, or a matrix was asked for and cannot express the
        model.
    """
    model = model.in_the_dark
    white = model.xyz(np.ones(3))
    if not np.all(white > 0):
        raise DeviceError(f"a profile needs a white with X, Y and Z above 0, not {white.tolist()}")
    if not _LEAST_LUMINANCE <= white[1] <= _MOST_LUMINANCE:
        what = f"the white's luminance is {white[1]:g} cd/m²"
        raise DeviceError(Finding(what, remedy=f"a profile holds {_LEAST_LUMINANCE} to {_MOST_LUMINANCE:.0f} cd/m²"))
    if points is not None and not 2 <= points <= 65:
        raise DeviceError(f"a grid of {points} points a side; 2 to 65 are possible")
    luminance = float(np.frombuffer(tag_bytes.fixed(white[1]), ">i4")[0]) / 65536.0
    chad = np.frombuffer(tag_bytes.fixed(bradford_matrix(white / white[1], D50)), ">i4").reshape(3, 3) / 65536.0
    common = {
        "desc": tag_bytes.text(description),
        "cprt": tag_bytes.text(_COPYRIGHT),
        "wtpt": tag_bytes.xyz(D50),
        "chad": tag_bytes.matrix(chad),
        "lumi": tag_bytes.xyz([0.0, luminance, 0.0]),
    }
    if gamma_table is not None and gamma_table.known and not gamma_table.is_identity:
        common["vcgt"] = tag_bytes.gamma_table(gamma_table)
    if kind != "table":
        tags = _matrix_tags(model, chad, luminance)
        made = None if tags is None else _judged(model, common | tags, "matrix", 0)
        if made is not None and (kind == "matrix" or made.close):
            return made
        if kind == "matrix":
            what = "channels act on each other" if not model.additive else "black is no mixture of the primaries"
            remedy = "write tables: leave --profile-kind out"
            raise DeviceError(Finding(f"no matrix and curves can express the model: its {what}", remedy=remedy))
    best: WrittenProfile | None = None
    for size in GRIDS if points is None else (points,):
        forward, backward = table_tags(model, chad, luminance, size)
        tables = {"A2B0": forward, "A2B1": forward, "B2A0": backward, "B2A1": backward}
        made = _judged(model, common | tables, "table", size)
        if made.close:
            return made
        worst = max(made.largest, made.back_largest)
        best = made if best is None or worst < max(best.largest, best.back_largest) else best
    assert best is not None
    return best


def write_profile(
    model: DisplayModel,
    path: str | Path,
    description: str,
    *,
    kind: ProfileKind | None = None,
    points: int | None = None,
    gamma_table: GammaTable | None = None,
) -> WrittenProfile:
    """Write a display model as an ICC profile, whole or not at all.

    Parameters
    ----------
    model
        The display model of an eye.
    path
        The profile to write; a file in its place is replaced.
    description, kind, points, gamma_table
        As in `profile_of_model`.

    Returns
    -------
    WrittenProfile
        The profile and its differences from the model.

    Raises
    ------
    DeviceError
        As `profile_of_model`, or if the file cannot be written.
    """
    made = profile_of_model(model, description, kind=kind, points=points, gamma_table=gamma_table)
    path = Path(path)
    with writing(path, "profile", DeviceError), whole_file(path, make_folder=False) as draft:
        draft.write_bytes(made.data)
    return made


def _matrix_tags(model: DisplayModel, chad: Floats, luminance: float) -> dict[str, bytes] | None:
    """Return primaries and curves; None if channels act on each other, or black is no mixture of the primaries.

    A matrix has no black of its own: what black takes of each primary is added to the primary's curve.
    """
    if not model.additive:
        return None
    primaries = chad @ model.primaries_XYZ_cd_m2 / luminance
    lifts = np.linalg.solve(model.primaries_XYZ_cd_m2, model.black_XYZ_cd_m2)
    tags: dict[str, bytes] = {}
    for channel, (letter, curve) in enumerate(zip("rgb", model.curves, strict=True)):
        lift = float(lifts[channel])
        full = float(curve.linear(1.0)) + lift
        if float(curve.linear(0.0)) + lift < _LEAST_LIFT or full <= 0:
            return None
        tags[f"{letter}XYZ"] = tag_bytes.xyz(primaries[:, channel] * full)
        if (function := curve.icc_function(lift, full)) is not None:
            tags[f"{letter}TRC"] = tag_bytes.parametric_curve(4, function)
        else:
            tags[f"{letter}TRC"] = tag_bytes.sampled_curve((curve.linear(np.linspace(0.0, 1.0, ENTRIES)) + lift) / full)
    return tags


def _judged(model: DisplayModel, tags: dict[str, bytes], kind: ProfileKind, points: int) -> WrittenProfile:
    """Return the profile of ``tags`` with its differences from ``model``, as it is read back from its bytes.

    A fitted model may give X or Z below 0 for saturated colours, which no light has and no profile holds: there it is
    the nearest that one holds that counts.
    """
    data = tag_bytes.profile(tags, D50)
    profile = profile_of(parse_profile_file(data, "profile"))
    codes = _probes()
    relative = np.maximum(model.xyz(codes) @ profile.adaptation.T / profile.white_cd_m2(None), 0.0)
    wanted = profile.absolute(relative, profile.white_cd_m2(None))
    white = model.xyz(np.ones(3))
    source = profile.matrix if kind == "matrix" else profile.table
    assert source is not None
    found = profile.absolute(source.xyz(codes), profile.white_cd_m2(None))
    off = _differences(found, wanted, white)
    back = np.zeros(1)
    if kind == "table":
        tag = profile.tag("B2A0")
        assert tag is not None
        back = _differences(model.xyz(read_table(tag, "XYZ").through(relative / XYZ_RANGE)), wanted, white)
    return WrittenProfile(
        data, kind, points, float(off.mean()), float(off.max()), float(back.mean()), float(back.max())
    )


def _differences(found: Floats, wanted: Floats, white: Floats) -> Floats:
    return delta_e_2000(xyz_to_lab(found, white), xyz_to_lab(wanted, white))


def _probes() -> Floats:
    """Return codes over the gamut (n, 3): a cube, greys, the channels alone, and others at random, many dark."""
    axis = np.linspace(0.0, 1.0, 10)
    cube = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    ramp = np.linspace(0.0, 1.0, 86)
    ramps = [ramp[:, None] * np.array(direction) for direction in (*np.eye(3), np.ones(3))]
    return np.concatenate([cube, *ramps, np.random.default_rng(1).random((2000, 3)) ** 2])
