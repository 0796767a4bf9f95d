"""Pixels that a display cannot show bright enough, and from which factor on.

A pixel is saturated where a channel's linear light is above m, that of code 1: the thesis's "maximum gray level value"
(its note 6 to Section 4.5.2.2). Linear light is M⁻¹ (k·XYZ − black), so that each channel's grows linearly with the
factor k, and pixel i saturates above

    k_i = min over channels c of (m_c + b_c) / a_ic,  a_i = M⁻¹ XYZ_i,  b = M⁻¹ black,

where channels with a_ic ≤ 0 never do. How many pixels saturate at any factor is then known from one transform of the
picture, and the largest factor with at most m saturated pixels is an order statistic, the (m + 1)-th smallest k_i.

Tone mapping is by one factor, limited where a display would saturate (Section 4.5.2.2, Expressions 4.10 and 4.11):

V_out = k V_in with k = L_ref / L_max. Where that saturates more than 0.3 % of the pixels, the largest factor that does
not is used. The thesis searches for it; `largest_factor` solves it. Image 3.1 of Table 4.3 asks for 6.69 and gets 1.78.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import astuple, dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from devices.display import DisplayModel, EyeModels
from documents.arrays import Floats
from documents.text import JsonResult
from stimuli.errors import StimulusError
from stimuli.luminance.scale import factor_to, max_luminance_cd_m2, scaled_picture
from stimuli.pictures.stereo_image import Eye, StereoImage, XYZImage

# "This saturation percentage was chosen experimentally" (note 6 to Section 4.5.2.2).
LIMIT_PERCENT = 0.3
_EYES: tuple[Eye, Eye] = ("left", "right")

# Pixels transformed at a time.
_BLOCK = 1 << 18
# A factor this far beyond the one at which additive channels would saturate is none.
_MOST_TIMES = 1e6


@dataclass(frozen=True, slots=True)
class ToneMapping(JsonResult):
    """The factor that was asked for and the one used, one for both eyes, and the pixels that saturate at either.

    ``largest_factor`` is the limit's, infinite where nothing can saturate. ``pixels_transformed`` counts the work of
    finding it.
    """

    reference_cd_m2: float
    max_cd_m2: float
    limit_percent: float
    asked_factor: float
    largest_factor: float
    saturated_at_asked: Mapping[Eye, Saturation]
    saturated: Mapping[Eye, Saturation]
    pixels_transformed: int
    json_keys: ClassVar = {
        "reference_cd_m2": "reference_luminance_cd_m2",
        "max_cd_m2": "max_luminance_cd_m2",
        "asked_factor": "asked_luminance_scale",
        "factor": "luminance_scale",
        "saturated_at_asked": "saturated_percent_at_asked",
        "saturated": "saturated_percent",
    }
    json_names: ClassVar = (
        "step reference_cd_m2 max_cd_m2 limit_percent asked_factor factor held_back saturated_at_asked saturated"
    )
    step: ClassVar = "tone_map"

    @property
    def factor(self) -> float:
        """The factor to use."""
        return min(self.asked_factor, self.largest_factor)

    @property
    def held_back(self) -> bool:
        """Whether the limit, not the reference, decided."""
        return self.largest_factor < self.asked_factor

    def apply(self, image: StereoImage) -> StereoImage:
        """Return the picture times the factor."""
        return scaled_picture(image, self.factor)


def tone_mapping(
    image: StereoImage, reference_cd_m2: float, models: EyeModels, limit_percent: float = LIMIT_PERCENT
) -> ToneMapping:
    """Return the factor that brings a picture's maximum luminance to a reference, as far as the display allows.

    The limit is for each eye by itself on its own display model, without crosstalk.

    Parameters
    ----------
    image
        XYZ in cd/m².
    reference_cd_m2
        The luminance that the brightest pixel is to have.
    models
        The display's models for both eyes.
    limit_percent
        The percentage of pixels that may saturate the display.

    Returns
    -------
    ToneMapping
        The factor asked for and the factor to use, what saturates at either, and ``apply`` for the picture.

    Raises
    ------
    StimulusError
        If the picture holds no light, or reference or limit is not a number that can be.

    Examples
    --------
    >>> from pathlib import Path
    >>> from devices.display import read_rig
    >>> rig = read_rig(Path("configs/rigs/asus_vg248qe_3dvision.yaml"))
    >>> image = StereoImage.flat(np.full((4, 6, 3), 5.0, np.float32))
    >>> mapping = tone_mapping(image, reference_cd_m2=10.0, models=rig.models)
    >>> mapping.factor, float(mapping.apply(image).left.max())
    (2.0, 10.0)
    """
    most = max_luminance_cd_m2(image)
    asked = factor_to(most, reference_cd_m2)
    same = image.is_flat and models.left is models.right
    eyes: tuple[Eye, ...] = ("left",) if same else _EYES
    scales = [largest_factor(image.eye(eye), models.eye(eye), limit_percent) for eye in eyes]
    largest = min(scale.factor for scale in scales)
    at_asked = {eye: measure_saturation(image.eye(eye), models.eye(eye), asked, half=image.half) for eye in eyes}
    used = at_asked
    if largest < asked:
        # A pixel that reaches just 1 at the largest factor is full, not saturated: what rounds above must not count.
        below = math.nextafter(largest * (1 - 4e-16), 0.0)
        used = {eye: measure_saturation(image.eye(eye), models.eye(eye), below, half=image.half) for eye in eyes}
    if same:
        at_asked, used = ({eye: counts["left"] for eye in _EYES} for counts in (at_asked, used))
    return ToneMapping(
        reference_cd_m2,
        most,
        limit_percent,
        asked,
        largest,
        at_asked,
        used,
        sum(scale.pixels_transformed for scale in scales),
    )


@dataclass(frozen=True, slots=True)
class Saturation:
    """How many of ``pixels`` ask each channel, or any of them, for more than full light."""

    pixels: int
    red: int
    green: int
    blue: int
    any_channel: int

    @property
    def percent_any(self) -> float:
        """Percentage of pixels with a saturated channel."""
        return 100.0 * self.any_channel / self.pixels

    def __add__(self, other: Saturation) -> Saturation:
        """Return the counts of both parts of a picture."""
        return Saturation(*(one + more for one, more in zip(astuple(self), astuple(other), strict=True)))

    def to_json(self) -> dict[str, float]:
        """Return percentages by channel."""
        counts = {"red": self.red, "green": self.green, "blue": self.blue, "any": self.any_channel}
        return {name: 100.0 * count / self.pixels for name, count in counts.items()}


@dataclass(frozen=True, slots=True)
class LargestFactor:
    """The largest factor at which at most ``allowed_pixels`` saturate; infinite where no factor saturates more.

    ``pixels_transformed`` is the work: each pixel once.
    """

    factor: float
    allowed_pixels: int
    pixels_transformed: int


def measure_saturation(
    xyz_cd_m2: XYZImage, model: DisplayModel, factor: float = 1.0, *, half: bool = False
) -> Saturation:
    """Count the pixels of XYZ in cd/m², shape (..., 3), that saturate ``model`` when multiplied by ``factor``.

    As `DisplayModel.clipping` counts them above full: what is just full but for the rounding of float32 is not, nor
    but for that of the half floats that held it (``half``).
    """
    channels = np.zeros(3, dtype=np.int64)
    pixels = any_channel = 0
    flat = xyz_cd_m2.reshape(-1, 3)
    for start in range(0, len(flat), _BLOCK):
        above = _saturated(flat[start : start + _BLOCK], model, factor, half=half)
        channels += above.sum(axis=0)
        any_channel += int(above.any(axis=1).sum())
        pixels += len(above)
    red, green, blue = (int(count) for count in channels)
    return Saturation(pixels, red, green, blue, any_channel)


def largest_factor(xyz_cd_m2: XYZImage, model: DisplayModel, limit_percent: float) -> LargestFactor:
    """Return the largest factor at which at most ``limit_percent`` of the pixels of XYZ, (..., 3), saturate ``model``.

    Blocks that hold nothing above the factor found so far are not sorted. Where channels do not add up (see
    `devices.display.plvc`), light does not grow linearly with the factor, and an interval is halved, in which ever
    fewer pixels are left to look at.

    Raises
    ------
    StimulusError
        If the limit is not a percentage, the picture is empty, or its black alone fills a channel of the display.
    """
    if not 0.0 <= limit_percent <= 100.0:
        raise StimulusError(f"the share of saturated pixels may be 0 to 100 %, not {limit_percent}")
    pixels = xyz_cd_m2.size // 3
    if pixels == 0:
        raise StimulusError("a picture without pixels has no factor")
    # A limit of 0.3 % of 1000 pixels is 3 of them, although 0.3 is no binary number.
    allowed = int(np.floor(limit_percent / 100.0 * pixels * (1 + 1e-12)))
    if allowed >= pixels:
        return LargestFactor(np.inf, allowed, 0)
    keep = allowed + 1
    fullest = np.empty(0)
    least = -np.inf
    for drive in _drives(xyz_cd_m2, model):
        drives = drive.max(axis=0)
        fullest = np.concatenate([fullest, drives[drives > least]])
        if len(fullest) > keep:
            fullest = np.partition(fullest, len(fullest) - keep)[-keep:]
        if len(fullest) == keep:
            least = float(fullest.min())
    factor = float(_factor_of(np.array([fullest.min()]))[0])
    if model.additive or not np.isfinite(factor):
        return LargestFactor(factor, allowed, pixels)
    return _by_halving(xyz_cd_m2, model, allowed, factor)


def _by_halving(xyz_cd_m2: XYZImage, model: DisplayModel, allowed: int, guess: float) -> LargestFactor:
    """Return as `largest_factor`, to 1e-12 of the factor; pixels that are sure to saturate, or not to, are dropped."""
    flat = xyz_cd_m2.reshape(-1, 3)
    transformed = saturated_below = 0

    def saturated(factor: float) -> NDArray[np.bool_]:
        nonlocal transformed
        transformed += len(flat)
        parts = (flat[at : at + _BLOCK] for at in range(0, len(flat), _BLOCK))
        return np.concatenate([_saturated(part, model, factor).any(axis=1) for part in parts])

    low = high = guess
    while (above := saturated(high)).sum() <= allowed:
        low, high = high, 2.0 * high
        if high > guess * _MOST_TIMES:
            return LargestFactor(np.inf, allowed, transformed)
    flat = flat[above]
    while low == high or (above := saturated(low)).sum() > allowed:
        low = 0.5 * low
    while high - low > 1e-12 * high:
        middle = 0.5 * (low + high)
        above = saturated(middle)
        if saturated_below + above.sum() <= allowed:
            low, saturated_below, flat = middle, saturated_below + int(above.sum()), flat[~above]
        else:
            high, flat = middle, flat[above]
    return LargestFactor(low, allowed, transformed)


def _saturated(xyz_cd_m2: XYZImage, model: DisplayModel, factor: float, *, half: bool = False) -> NDArray[np.bool_]:
    """Return which channels of XYZ (n, 3) times ``factor`` are above full, (n, 3)."""
    scaled = factor * xyz_cd_m2.astype(np.float64)
    return np.asarray(model.linear(scaled) > model.limits[1] + model.tolerance(scaled, half=half))


def _factor_of(drives: Floats) -> Floats:
    return np.divide(1.0, drives, out=np.full_like(drives, np.inf), where=drives > 0)


def _drives(xyz_cd_m2: XYZImage, model: DisplayModel) -> Iterator[Floats]:
    """Yield blocks (3, n) of a / (m + b): what a channel is filled to per factor, 1 being full."""
    room = model.limits[1] + model.linear_from_XYZ @ model.dark_XYZ_cd_m2
    if np.any(room <= 0):
        message = "the display's black alone fills a channel: no picture can be fitted to it"
        raise StimulusError.of(message, "check black_XYZ_cd_m2 and primaries_XYZ_cd_m2 of the display")
    matrix = model.linear_from_XYZ / room[:, None]
    flat = xyz_cd_m2.reshape(-1, 3)
    for start in range(0, len(flat), _BLOCK):
        yield np.asarray(matrix @ flat[start : start + _BLOCK].T.astype(np.float64))
