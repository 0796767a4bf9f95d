"""A display model as a `.cube` table for players, graders and graphics programs ([Cube2013]): what goes in, to codes.

From sRGB a table of three dimensions: a picture's codes become the display's, so that each colour is seen as the
picture means it, white as the display's white. From light a table of one: a share of each channel's light becomes its
code, which makes an additive display linear.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from devices.colour import SRGB_PRIMARIES_XY, bradford_matrix, delta_e_2000, rgb_to_xyz_matrix, srgb_decoded, xyz_to_lab
from devices.display import DisplayModel
from devices.errors import DeviceError
from devices.profiles import between
from documents import Finding
from documents.arrays import Floats
from documents.files import write_whole, writing

CubeInput = Literal["srgb", "light"]

ENTRIES = 4096
POINTS = 65
_D65_XY = (0.3127, 0.3290)
_PROBES = 4000


@dataclass(frozen=True, slots=True)
class WrittenCube:
    """A table's ``text`` and how well it does what it says.

    ``points``: of a side, or of a channel where it has one dimension. ``mean`` and ``largest``: ΔE00 of the light that
    the display gives for what the table makes of 4000 inputs, to the light that was meant, where the gamut holds it;
    ``outside``: the share of inputs whose light it does not hold.
    """

    text: str
    points: int
    mean: float
    largest: float
    outside: float

    def sentence(self, given: CubeInput) -> str:
        """Return what it is and how well it does that."""
        what = f"{self.points} points a side, from sRGB" if given == "srgb" else f"{self.points} entries, from light"
        words = f"{what}; against the model ΔE00 {self.mean:.3f} on average, {self.largest:.3f} at most"
        return (
            f"{words}; {100.0 * self.outside:.1f} % of its inputs lie outside the gamut" if given == "srgb" else words
        )


def cube_of_model(
    model: DisplayModel, title: str, given: CubeInput = "srgb", *, points: int | None = None
) -> WrittenCube:
    """Return a display model as the text of a `.cube` table.

    Parameters
    ----------
    model
        The display model of an eye; the room's light is left out, as in an ICC profile.
    title
        What programs show as its name.
    given
        What goes in. ``srgb``: codes of IEC 61966-2-1, whose white becomes the display's own by Bradford's transform.
        ``light``: shares of each channel's light from code 0 to full drive.
    points
        Points a side, 2 to 129; with ``light`` entries, 2 to 65536. None: 65, and 4096.

    Returns
    -------
    WrittenCube
        The table and its differences from the model. Colours outside the gamut become the nearest codes, channel by
        channel.

    Raises
    ------
    DeviceError
        If the points are not in range, or light was to go into the table of a display whose channels act on each other.

    Examples
    --------
    >>> from devices.characterise import thesis_display
    >>> cube = cube_of_model(thesis_display(), "thesis", "light", points=5)
    >>> cube.text.splitlines()[-1]
    '1.000000 1.000000 1.000000'
    """
    size = (POINTS if given == "srgb" else ENTRIES) if points is None else points
    most = 129 if given == "srgb" else 65536
    if not 2 <= size <= most:
        raise DeviceError(f"a .cube of {size} points; 2 to {most} are possible")
    own = model.in_the_dark
    return _from_srgb(own, title, size) if given == "srgb" else _from_light(own, title, size)


def write_cube(
    model: DisplayModel, path: str | Path, title: str, given: CubeInput = "srgb", *, points: int | None = None
) -> WrittenCube:
    """Write a display model as a `.cube` table, whole or not at all.

    Parameters
    ----------
    model
        The display model of an eye, as in `cube_of_model`.
    path
        The table to write; a file in its place is replaced.
    title, given, points
        As in `cube_of_model`.

    Returns
    -------
    WrittenCube
        The table and its differences from the model.

    Raises
    ------
    DeviceError
        As `cube_of_model`, or if the file cannot be written.
    """
    made = cube_of_model(model, title, given, points=points)
    with writing(Path(path), "table", DeviceError):
        write_whole(Path(path), made.text, make_folder=False)
    return made


def _from_srgb(model: DisplayModel, title: str, points: int) -> WrittenCube:
    axis = np.linspace(0.0, 1.0, points)
    # Red runs fastest.
    blue, green, red = np.meshgrid(axis, axis, axis, indexing="ij")
    asked = np.stack([red, green, blue], axis=-1).reshape(-1, 3)
    codes = np.asarray(np.round(model.code(_meant(model, asked)), 6), dtype=np.float64)
    head = [
        "# In: sRGB codes (IEC 61966-2-1), 0..1. Out: device codes, 0..1, not rounded.",
        "# White becomes the display's white, the rest follows by Bradford's transform; clipped outside the gamut.",
        f"LUT_3D_SIZE {points}",
    ]
    grid = codes.reshape(points, points, points, 3).transpose(2, 1, 0, 3)
    probes = np.random.default_rng(1).random((_PROBES, 3))
    meant = _meant(model, probes)
    return _judged(model, _text(title, head, codes), points, between(grid, probes), meant, _held(model, meant))


def _from_light(model: DisplayModel, title: str, points: int) -> WrittenCube:
    if not model.additive:
        what = "the display's channels act on each other, so that no table of one dimension makes it linear"
        raise DeviceError(Finding(what, remedy="take sRGB as the input, or write an ICC profile"))
    axis = np.linspace(0.0, 1.0, points)
    lowest, highest = model.limits
    light = lowest + (highest - lowest) * axis[:, None]
    columns = [curve.code(light[:, channel]) for channel, curve in enumerate(model.curves)]
    codes = np.asarray(np.round(np.stack(columns, axis=1), 6), dtype=np.float64)
    head = [
        "# In: share of each channel's light from code 0 to full drive, 0..1. Out: device codes, 0..1, not rounded.",
        f"LUT_1D_SIZE {points}",
    ]
    probes = np.random.default_rng(1).random((_PROBES, 3)) ** 2
    given = np.stack([np.interp(probes[:, i], axis, codes[:, i]) for i in range(3)], axis=1)
    meant = model.xyz_of_linear(lowest + (highest - lowest) * probes)
    return _judged(model, _text(title, head, codes), points, given, meant, np.ones(len(probes), dtype=bool))


def _meant(model: DisplayModel, srgb: Floats) -> Floats:
    """Return the XYZ in cd/m² that sRGB codes (n, 3) mean on a display whose white is white."""
    light = srgb_decoded(srgb)
    matrix = rgb_to_xyz_matrix(*SRGB_PRIMARIES_XY, _D65_XY)
    white = model.shown_white_XYZ_cd_m2
    return np.asarray(light @ (white[1] * bradford_matrix(matrix.sum(axis=1), white / white[1]) @ matrix).T)


def _held(model: DisplayModel, XYZ: Floats) -> NDArray[np.bool_]:
    """Return which of XYZ (n, 3) the display can show: those that its own codes give back."""
    shown = model.xyz(model.code(XYZ))
    return np.asarray(np.all(np.abs(shown - XYZ) <= 1e-6 * model.shown_white_XYZ_cd_m2, axis=1))


def _judged(
    model: DisplayModel, text: str, points: int, codes: Floats, meant: Floats, held: NDArray[np.bool_]
) -> WrittenCube:
    white = model.shown_white_XYZ_cd_m2
    off = delta_e_2000(xyz_to_lab(model.xyz(codes), white), xyz_to_lab(meant, white))[held]
    mean, largest = (float(off.mean()), float(off.max())) if len(off) else (0.0, 0.0)
    return WrittenCube(text, points, mean, largest, float(1.0 - held.mean()))


def _text(title: str, head: list[str], codes: Floats) -> str:
    words = " ".join(title.split()).replace('"', "'")
    rows = ["{:.6f} {:.6f} {:.6f}".format(*row) for row in codes.tolist()]
    return "\n".join([f'TITLE "{words}"', *head, "DOMAIN_MIN 0 0 0", "DOMAIN_MAX 1 1 1", *rows]) + "\n"
