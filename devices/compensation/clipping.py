"""What the gamut clip costs a picture: how many pixels a display cannot show, how far off they end up, and where."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from itertools import chain
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.colour.ciede2000 import delta_e_2000
from devices.colour.spaces import xyz_to_lab
from devices.display.model import Clipped, DisplayModel, outside_limits
from devices.errors import DeviceError
from documents import Finding, in_threads
from documents.arrays import Floats
from documents.text import counted

Result = TypeVar("Result")
_BLOCK = 1 << 13
_SHARE = 16 * _BLOCK


@dataclass(frozen=True, slots=True)
class ClipCost:
    """The clip of one picture on one display model.

    ``delta_e_00_mean`` is over all pixels, those shown as asked counting 0; Lab is relative to the display's white.
    Quantisation to device codes is not part of it.
    """

    clipping: Clipped
    delta_e_00_mean: float
    delta_e_00_max: float

    def to_json(self) -> dict[str, float]:
        """Return percentages and costs under the names that a session's header carries."""
        percent = self.clipping.percent
        return {
            "percent_red": round(percent(self.clipping.red), 4),
            "percent_green": round(percent(self.clipping.green), 4),
            "percent_blue": round(percent(self.clipping.blue), 4),
            "percent_any": round(percent(self.clipping.any_channel), 4),
            "percent_above_full": round(percent(self.clipping.above_full), 4),
            "delta_e_00_mean": round(self.delta_e_00_mean, 5),
            "delta_e_00_max": round(self.delta_e_00_max, 4),
        }


def clip_cost(model: DisplayModel, xyz_cd_m2: ArrayLike, *, half: bool = False) -> ClipCost:
    """Return what showing XYZ in cd/m², shape (..., 3), on ``model`` costs; pixels shown as asked are not compared.

    ``half`` says that the XYZ were held in half floats: what is outside by their rounding is not counted.

    Raises
    ------
    DeviceError
        If a value is not finite.
    """
    asked = np.asarray(xyz_cd_m2).reshape(-1, 3)
    lowest, highest = model.limits

    def work(part: slice) -> tuple[Clipped | None, float, float]:
        block = asked[part].astype(np.float64)
        linear = np.ascontiguousarray(model.linear(block).T)
        # A block within the channels' limits holds nothing to count or to compare.
        if (linear.min(axis=1) >= lowest).all() and (linear.max(axis=1) <= highest).all():
            return None, 0.0, 0.0
        check_finite(block)
        outside = outside_limits(linear.T, model.limits, model.tolerance(block, half=half))
        changed = ((linear < lowest[:, None]) | (linear > highest[:, None])).any(axis=0)
        if not changed.any():
            return outside, 0.0, 0.0
        difference = _difference(model, block[changed], linear[:, changed])
        return outside, float(difference.sum()), float(difference.max())

    parts = list(over_blocks(work, len(asked)))
    clipping = replace(counted_together([outside for outside, _, _ in parts if outside is not None]), pixels=len(asked))
    largest = max((most for _, _, most in parts), default=0.0)
    return ClipCost(clipping, sum(total for _, total, _ in parts) / max(len(asked), 1), largest)


def check_finite(xyz_cd_m2: Floats) -> None:
    """Refuse XYZ with what is no number or not finite: nothing can be said of what a display shows for it.

    Raises
    ------
    DeviceError
        If there is such a value.
    """
    bad = int(np.count_nonzero(~np.isfinite(xyz_cd_m2)))
    if bad:
        what = f"the picture's XYZ hold {counted(bad, 'value', 'values')} not finite"
        raise DeviceError(Finding(what, remedy="mend the picture, such as by the mean of the pixels around them"))


def over_blocks(work: Callable[[slice], Result], pixels: int) -> Iterator[Result]:
    """Yield ``work`` of slices of pixels, in their order, many slices being shared among threads.

    A slice is of so many pixels as a processor's cache holds, and as no matrix product splits among threads.
    """

    def several(first: int) -> list[Result]:
        last = min(first + _SHARE, pixels)
        return [work(slice(at, min(at + _BLOCK, last))) for at in range(first, last, _BLOCK)]

    return chain.from_iterable(in_threads(several, range(0, pixels, _SHARE)))


def counted_together(parts: Sequence[Clipped]) -> Clipped:
    """Return the counts of a picture from those of its parts."""
    names = [field.name for field in fields(Clipped)]
    return Clipped(**{name: sum(getattr(part, name) for part in parts) for name in names})


def _difference(model: DisplayModel, asked: Floats, linear: Floats) -> Floats:
    """Return the ΔE00 (n,) of XYZ (n, 3) to what is shown of their linear light (3, n)."""
    kept = np.clip(linear.T, *model.limits).T
    codes = [curve.code(channel) for curve, channel in zip(model.curves, kept, strict=True)]
    shown = model.xyz(np.stack(codes, axis=1))
    white = model.white_XYZ_cd_m2
    # Lab is defined for light only: what lies below no light at all is as black as black.
    return delta_e_2000(xyz_to_lab(np.maximum(asked, 0.0), white), xyz_to_lab(shown, white))


# What is inside the gamut is shown grey, at this share of its own luminance, so that the marks stand out.
_DIMMED = 0.5


def clip_marks(model: DisplayModel, xyz_cd_m2: ArrayLike, tolerance: Floats | None = None) -> NDArray[np.float32]:
    """Return XYZ, float32, shape (..., 3): pixels that ask too much light in red, those that ask too little in blue.

    A pixel that does both is magenta; the others keep half their luminance, in the display's white.

    Parameters
    ----------
    model
        The display that is to show the picture.
    xyz_cd_m2
        XYZ in cd/m², shape (..., 3).
    tolerance
        How far linear light may leave the model's limits, (..., 3); None takes that of single precision.

    Returns
    -------
    ndarray
        XYZ in cd/m², float32, shape (..., 3), within what the display can show.

    Examples
    --------
    >>> from pathlib import Path
    >>> from devices.display import read_display
    >>> display = read_display(Path("configs/displays/asus_vg248qe.yaml"))
    >>> model = display.models("side-by-side").left
    >>> marks = clip_marks(model, np.outer([0.5, 2.0], model.white_XYZ_cd_m2))
    >>> np.allclose(marks, [0.25 * model.white_XYZ_cd_m2, model.primaries_XYZ_cd_m2[:, 0]])
    True
    """
    asked = np.asarray(xyz_cd_m2, dtype=np.float64)
    linear = model.linear(asked)
    tolerance = model.gamut_tolerance if tolerance is None else tolerance
    above = np.any(linear > model.limits[1] + tolerance, axis=-1, keepdims=True)
    below = np.any(linear < model.limits[0] - tolerance, axis=-1, keepdims=True)
    white = model.white_XYZ_cd_m2
    share = np.clip(_DIMMED * asked[..., 1:2] / white[1], 0.0, 1.0)
    marked = share * white
    red, blue = model.primaries_XYZ_cd_m2[:, 0], model.primaries_XYZ_cd_m2[:, 2]
    marks = above * red + below * blue + model.dark_XYZ_cd_m2
    return np.asarray(np.where(above | below, marks, marked), dtype=np.float32)
