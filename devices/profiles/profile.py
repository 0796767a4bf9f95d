"""A display's ICC profile, read: its white, black and luminance, and what it says of the light of a code.

The connection space is relative: the display's white is D50 with Y = 1, whatever it is in the room. Absolute light
needs two things more, and they are kept apart here: the chromatic adaptation (``chad``, or in version 2 the display's
white in ``wtpt`` and Bradford's transform), and how bright the white is (``lumi``). [ICC2022], 6.3.2.2 and 9.2.15.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from devices.colour.adaptation import bradford_matrix
from devices.colour.white_points import WHITE_POINTS_XYZ
from devices.display import GammaTable
from devices.errors import DeviceError
from devices.profiles.colour_table import ProfileTable, read_table
from devices.profiles.curves import TagCurve, curve_at
from devices.profiles.tag_table import ProfileFile, Tag, read_profile_file
from documents import Finding
from documents.arrays import Floats

# The graphics card's gamma table that a profile carries (``vcgt``): calibration programs load it with the profile.
#
# Apple's tag, which ICC never took up: a table of one or three channels in 8 or 16 bits, or gamma, least and most of
# each channel.

_MOST_ENTRIES = 65536
# Channels, entries, bytes of each and of the tag, as a program of Adobe's says it of entries of two bytes, which is how
# LittleCMS reads them.
_ADOBE = (3, 256, 1, 1576)
# A formula becomes a table of so many entries, as large as any graphics card's.
_FORMULA_ENTRIES = 4096


def read_gamma_table(tag: Tag) -> GammaTable:
    """Return the gamma table in the tag ``vcgt``.

    Raises
    ------
    DeviceError
        If the tag is of another type or size, or a formula leaves 0..1.
    """
    if tag.type != "vcgt":
        raise tag.wrong_type("'vcgt'")
    kind = tag.whole(8, "I")
    if kind == 0:
        return _table(tag)
    if kind == 1:
        return _formula(tag)
    raise tag.error(f"is of the kind {kind}", "0, a table, or 1, a formula, is needed")


def _table(tag: Tag) -> GammaTable:
    channels, entries, size = (tag.whole(at, "H") for at in (12, 14, 16))
    what = f"says that it has {channels} channels of {entries} entries of {size} bytes"
    if channels not in (1, 3) or size not in (1, 2) or not 2 <= entries <= _MOST_ENTRIES:
        raise tag.error(what, "1 or 3 channels, 2 entries or more, and 1 or 2 bytes are possible")
    if (channels, entries, size, len(tag.data)) == _ADOBE:
        size = 2
    wanted, there = channels * entries * size, len(tag.data) - 18
    # What fills up the tag behind the table is not looked at. As much again behind entries of one byte is no filling:
    # they have two then.
    if there < wanted or (size == 1 and there >= 2 * wanted):
        remedy = f"{wanted} bytes belong to that; load the calibration with its own program and save the profile again"
        raise tag.error(f"{what}, and holds {there} bytes of them", remedy)
    if size == 1:
        values = tag.u8(18, channels * entries).astype(np.uint16) * np.uint16(257)
    else:
        values = tag.u16(18, channels * entries)
    columns = values.reshape(channels, entries).T
    return GammaTable(np.repeat(columns, 3, axis=1) if channels == 1 else columns)


def _formula(tag: Tag) -> GammaTable:
    numbers = tag.fixed(12, 9).reshape(3, 3)
    if not (np.all(numbers[:, 0] > 0) and np.all((numbers[:, 1:] >= 0) & (numbers[:, 1:] <= 1))):
        rows = "; ".join("gamma {:g}, least {:g}, most {:g}".format(*row) for row in numbers.tolist())
        raise tag.error(f"holds {rows}", "gamma above 0, least and most in 0..1 are needed")
    codes = np.linspace(0.0, 1.0, _FORMULA_ENTRIES)
    columns = [least + (most - least) * codes**gamma for gamma, least, most in numbers.tolist()]
    return GammaTable.from_shares(np.stack(columns, axis=1))


D50 = np.array(WHITE_POINTS_XYZ["icc-d50"])
COLOURS = ("red", "green", "blue")
_MATRIX, _CURVES = ("rXYZ", "gXYZ", "bXYZ"), ("rTRC", "gTRC", "bTRC")
# The relative colorimetric table first: the perceptual one may lighten the dark.
TABLES = ("A2B1", "A2B0")
_MOST_CONDITION = 1e4
_WHITE_OFF = 0.01
# From this share of the black point on, light at code 0 is the display's black, and not what rounding leaves.
_OWN_BLACK = 0.1


@dataclass(frozen=True, slots=True, eq=False)
class MatrixModel:
    """``primaries``: XYZ of the connection space at full drive in its columns, shape (3, 3); a curve for each."""

    primaries: Floats
    curves: tuple[TagCurve, TagCurve, TagCurve]

    def xyz(self, codes: ArrayLike) -> Floats:
        """Return XYZ (n, 3) of the connection space for device codes (n, 3) in 0..1."""
        asked = np.asarray(codes, dtype=np.float64)
        light = np.stack([curve(asked[:, channel]) for channel, curve in enumerate(self.curves)], axis=1)
        return np.asarray(light @ self.primaries.T)


@dataclass(frozen=True, eq=False)
class IccProfile:
    """A profile of a display.

    Attributes
    ----------
    file
        The name that findings carry.
    adaptation
        Shape (3, 3): from light as it is, where the display's white has Y = 1, to the connection space.
    said
        What was taken for granted of the adaptation, in sentences.

    Tags that a colour of a picture does not need are read when they are asked for; DeviceError then, if one is damaged.
    """

    file: str
    content: ProfileFile
    adaptation: Floats
    said: tuple[str, ...]

    def tag(self, name: str) -> Tag | None:
        """Return the tag ``name``, None if there is none."""
        return self.content.tag(name)

    @cached_property
    def _lumi(self) -> float | None:
        tag = self.tag("lumi")
        return None if tag is None else float(_xyz(tag)[1])

    @property
    def luminance_cd_m2(self) -> float | None:
        """Luminance of the white; None where the profile does not say."""
        return None if self._lumi is None or self._lumi <= 0 else self._lumi

    @cached_property
    def black(self) -> Floats | None:
        """XYZ of black with the white at Y = 1, as the profile says apart from its model (``bkpt``); None: not said."""
        tag = self.tag("bkpt")
        if tag is None:
            return None
        black = _xyz(tag)
        if self.content.version[0] >= 4:
            black = np.asarray(np.linalg.solve(self.adaptation, black), dtype=np.float64)
        return black if np.all(black >= 0) and 0 < black[1] < 0.5 else None

    @cached_property
    def gamma_table(self) -> GammaTable | None:
        """The graphics card's table that the profile was made with; None where it has none."""
        tag = self.tag("vcgt")
        return None if tag is None else read_gamma_table(tag)

    @property
    def notes(self) -> tuple[str, ...]:
        """What was taken for granted, in sentences."""
        dark = self._lumi is not None and self._lumi <= 0
        return (*self.said, *(["the profile's luminance ('lumi') is 0 and was taken for none"] if dark else []))

    @cached_property
    def white(self) -> Floats:
        """XYZ (3,) of the display's white as it is in the room, with Y = 1."""
        white = np.linalg.solve(self.adaptation, D50)
        return np.asarray(white / white[1])

    @property
    def table_name(self) -> str:
        """The tag of the table from codes to the connection space, empty where there is none."""
        return next((name for name in TABLES if name in self.content.places), "")

    @cached_property
    def table(self) -> ProfileTable | None:
        """The table from codes to the connection space, None where there is none; DeviceError if it is damaged."""
        tag = self.tag(self.table_name) if self.table_name else None
        return None if tag is None else read_table(tag, self.content.pcs)

    @cached_property
    def matrix(self) -> MatrixModel | None:
        """The matrix and curves, None where the profile has none; DeviceError if one lacks or is damaged."""
        there = [name for name in (*_MATRIX, *_CURVES) if name in self.content.places]
        if not there:
            return None
        tags = [self.tag(name) for name in (*_MATRIX, *_CURVES)]
        found = [tag for tag in tags if tag is not None]
        if len(found) < len(tags):
            missing = ", ".join(name for name in (*_MATRIX, *_CURVES) if name not in there)
            raise DeviceError(
                Finding(f"the profile has {', '.join(there)} but not {missing}", self.file, remedy="all six are needed")
            )
        primaries = np.stack([_xyz(tag) for tag in found[:3]], axis=1)
        if not _spans(primaries):
            raise found[0].error("and the other two primaries do not span a space of colours", "the profile is damaged")
        red, green, blue = (curve_at(tag)[0] for tag in found[3:])
        return MatrixModel(primaries, (red, green, blue))

    @property
    def light(self) -> ProfileTable | MatrixModel:
        """What leads from codes to light: the table, which ranks above matrix and curves ([ICC2022], 8.10.2).

        DeviceError if there is neither, or what there is is damaged.
        """
        light = self.table or self.matrix
        if light is None:
            there = ", ".join(sorted(name.strip() for name in self.content.places)) or "none"
            what = "the profile does not say what light a code gives; its tags: " + there
            needed = "needed are targ (readings), A2B1 or A2B0 (a table), or rXYZ, gXYZ, bXYZ with rTRC, gTRC, bTRC"
            raise DeviceError(Finding(what, self.file, remedy=needed))
        return light

    def white_cd_m2(self, given: float | None) -> float:
        """Return the luminance of the white: ``given``, or the profile's own; DeviceError if there is neither."""
        luminance = self.luminance_cd_m2 if given is None else given
        if luminance is None:
            raise DeviceError(
                Finding(
                    "the profile does not say how bright its white is (it has no tag 'lumi')",
                    self.file,
                    remedy="measure the white, and give its luminance with --white-cd-m2",
                )
            )
        if not (np.isfinite(luminance) and luminance > 0):
            raise DeviceError(
                Finding(f"the white's luminance is {luminance} cd/m²", self.file, remedy="a number above 0 is needed")
            )
        return luminance

    def absolute(self, XYZ: ArrayLike, white_cd_m2: float) -> Floats:
        """Return XYZ in cd/m², shape (..., 3), of XYZ of the connection space."""
        return np.asarray(np.asarray(XYZ, dtype=np.float64) @ np.linalg.inv(self.adaptation).T * white_cd_m2)


def read_profile(path: str | Path) -> IccProfile:
    """Read the ICC profile of a display, of version 2 or 4.

    Parameters
    ----------
    path
        The profile, ``.icc`` or ``.icm``.

    Returns
    -------
    IccProfile
        What it says of white, black and luminance; its table, and its matrix and curves, are read when asked for.

    Raises
    ------
    DeviceError
        If it cannot be read, is damaged, or is not of an RGB display; with file, tag and value.

    Examples
    --------
    >>> import tempfile
    >>> from PIL import ImageCms
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "srgb.icc")
    ...     _ = file.write_bytes(ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes())
    ...     round(read_profile(file).white_cd_m2(80.0), 2)
    80.0
    """
    profile = profile_of(read_profile_file(Path(path)))
    # Of a display they count, whatever is asked of it first.
    _ = profile.luminance_cd_m2, profile.black, profile.gamma_table
    return profile


def profile_of(content: ProfileFile) -> IccProfile:
    """Return what the profile in ``content`` says; errors as `read_profile`, of what every colour needs."""
    notes: list[str] = []
    adaptation = _adaptation(content, notes)
    return IccProfile(content.file, content, adaptation, tuple(notes))


def _adaptation(content: ProfileFile, notes: list[str]) -> Floats:
    """Return ``chad``, or Bradford's matrix from the white of a profile of version 2 to D50."""
    chad, wtpt = content.tag("chad"), content.tag("wtpt")
    if chad is not None:
        if chad.type != "sf32":
            raise chad.wrong_type("'sf32'")
        matrix = chad.fixed(8, 9).reshape(3, 3)
        if not _spans(matrix) or not np.all(np.linalg.solve(matrix, D50) > 0):
            rows = "; ".join(" ".join(f"{value:g}" for value in row) for row in matrix.tolist())
            raise chad.error(f"is no chromatic adaptation: {rows}", "the profile is damaged")
        return matrix
    white = None if wtpt is None else _xyz(wtpt)
    if wtpt is not None and white is not None and not (np.all(white > 0) and np.all(white < 3)):
        numbers = " ".join(f"{value:g}" for value in white)
        raise wtpt.error(f"is {numbers}", "X, Y and Z of a white, above 0, are needed")
    if white is None or np.allclose(white, D50, atol=5e-4):
        notes.append("the profile does not say what white it was adapted from; its white was taken for D50")
        return np.eye(3)
    assert white is not None
    if content.version[0] >= 4:
        notes.append("the profile has no 'chad'; Bradford's transform from its white point was taken")
    elif abs(white[1] - 1.0) > _WHITE_OFF:
        notes.append(f"the white point has Y = {white[1]:.4g}, and was taken to be 1")
    return bradford_matrix(white, D50)


def _spans(matrix: Floats) -> bool:
    """Whether the columns of ``matrix`` (3, 3) span a space, far from a plane."""
    sizes = np.linalg.svd(matrix, compute_uv=False)
    return bool(sizes[-1] * _MOST_CONDITION > sizes[0])


def _xyz(tag: Tag) -> Floats:
    if tag.type != "XYZ ":
        raise tag.wrong_type("'XYZ '")
    return tag.fixed(8, 3)


def black_beneath(profile: IccProfile, matrix: MatrixModel) -> Floats | None:
    """Return XYZ (3,) of the black that lies beneath the light of ``matrix``, with the white at Y = 1; None if none.

    That is the black point (``bkpt``) where the curves give no light at code 0. Where they do, it is in them already.
    """
    own = float(matrix.xyz(np.zeros((1, 3)))[0, 1])
    return None if profile.black is None or own > _OWN_BLACK * profile.black[1] else profile.black
