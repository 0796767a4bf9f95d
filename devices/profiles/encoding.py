"""A picture's embedded profile: from codes to light relative to its white, exact where it has matrix and curves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from devices.colour import srgb_decoded
from devices.profiles.curves import TagCurve
from devices.profiles.display_model import is_srgb
from devices.profiles.profile import MatrixModel, profile_of
from devices.profiles.tag_table import parse_profile_file
from documents.arrays import Floats


@dataclass(frozen=True, slots=True, eq=False)
class ProfileEncoding:
    """From RGB codes in 0..1 to XYZ as it is in the room, with the white at Y = 1: its own white, not D50.

    ``curves`` and ``matrix`` (3, 3) of a profile without a table, else none; ``xyz`` leads from codes (n, 3) to XYZ
    (n, 3) for every profile.
    """

    matrix: Floats | None
    curves: tuple[Callable[[ArrayLike], Floats], ...]
    xyz: Callable[[Floats], Floats]


def profile_encoding(data: bytes, file: str) -> ProfileEncoding:
    """Read the ICC profile that is embedded in a picture.

    Parameters
    ----------
    data
        The profile's bytes, of version 2 or 4, of an RGB display or colour space.
    file
        The name that findings carry.

    Returns
    -------
    ProfileEncoding
        A table, or, of a profile without one, matrix and curves: as `Profile.light` ranks them. The adaptation to D50
        of its connection space is undone by the matrix that the profile names (``chad``, or Bradford's from its white
        point).

    Raises
    ------
    DeviceError
        If the profile is damaged, not of RGB, or has neither a matrix nor a table.

    Examples
    --------
    >>> from PIL import ImageCms
    >>> data = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    >>> float(profile_encoding(data, "plate.png").xyz(np.ones((1, 3)))[0, 1].round(4))
    1.0
    """
    profile = profile_of(parse_profile_file(data, file))
    light = profile.light
    if not isinstance(light, MatrixModel):
        return ProfileEncoding(None, (), lambda codes: profile.absolute(light.xyz(codes), 1.0))
    curves = tuple(_curve(curve) for curve in light.curves)
    absolute = profile.absolute(light.primaries.T, 1.0).T

    def by_matrix(codes: Floats) -> Floats:
        channels = np.stack([curve(codes[:, channel]) for channel, curve in enumerate(curves)], axis=1)
        return np.asarray(channels @ absolute.T)

    return ProfileEncoding(absolute, curves, by_matrix)


def _curve(curve: TagCurve) -> Callable[[ArrayLike], Floats]:
    """Return the curve that ``curve`` rounds: sRGB's or a power; else itself."""
    if is_srgb(curve):
        return srgb_decoded
    return curve if (exact := curve.exact()) is None else exact.linear
