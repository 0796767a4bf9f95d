"""A display model as an ICC profile of version 4: matrix and curves where they are exact enough, tables otherwise."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from devices.colour import delta_e_2000, xyz_to_lab
from devices.colour.adaptation import bradford_matrix
from devices.display import DisplayModel, GammaTable
from devices.errors import DeviceError
from devices.profiles import tag_bytes
from devices.profiles.colour_table import XYZ_RANGE, read_table
from devices.profiles.profile import D50, profile_of
from devices.profiles.table_tags import ENTRIES, table_tags
from devices.profiles.tag_table import parse_profile_file
from documents import Finding
from documents.arrays import Floats
from documents.files import whole_file, writing

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
