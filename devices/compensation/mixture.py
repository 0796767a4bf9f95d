"""Two views in one picture: each channel's light from the XYZ that both eyes should see (Dubois 2001).

An eye behind a filter F sees F · M · linear of a display with primaries M. What both eyes see is the stack of the two,
R · linear with R of shape (6, 3), and what they should see is a stack of two XYZ. No three channels can do that, so the
least-squares light is taken, (RᵀR)⁻¹Rᵀ times the wanted, and each channel is scaled so that the display's white, asked
for in both eyes, is full drive: filters take light, and what is left of white is the new white.

E. Dubois (2001), "A projection method to generate anaglyph stereo images", Proc. IEEE ICASSP 3, 1661-1664.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from devices.display.curves import Curve
from devices.display.display_file import Eye, EyeModels
from devices.display.model import DisplayModel, curve_limits, normalised_curves
from devices.errors import DeviceError
from documents import Finding
from documents.arrays import Floats

Row: TypeAlias = tuple[float, float, float]
# The share that a filter passes of each channel's light, or a matrix (3, 3) on XYZ.
Filter: TypeAlias = Row | tuple[Row, Row, Row]


@dataclass(frozen=True, eq=False, slots=True)
class Mixture:
    """linear = ``left`` · (XYZ of the left view − its black) + ``right`` · (that of the right view − its black).

    ``left`` and ``right``: shape (3, 3), in 1/(cd/m²); the blacks, with the room's light: shape (3,), in cd/m². What
    each eye then sees is ``left_through`` or ``right_through``, shape (3, 3), times the XYZ of that eye's display
    model: what its filter does to light, the unit matrix where the model was measured through the filter.
    """

    left: Floats
    right: Floats
    left_black_XYZ_cd_m2: Floats
    right_black_XYZ_cd_m2: Floats
    curves: tuple[Curve, Curve, Curve]
    left_through: Floats
    right_through: Floats

    def through(self, eye: Eye) -> Floats:
        """Return what the filter before ``eye`` does to XYZ, shape (3, 3)."""
        return self.left_through if eye == "left" else self.right_through

    @property
    def limits(self) -> tuple[Floats, Floats]:
        """The least and the most linear light that each channel can give, (3,) each: at code 0 and at code 1."""
        return curve_limits(self.curves)

    @property
    def normalised(self) -> Mixture:
        """The same mixture, its linear light 0 at code 0 and 1 at code 1, as a colour pass takes it."""
        curves = normalised_curves(self.curves)
        if curves is self.curves:
            return self
        lowest, highest = self.limits
        # The light at code 0 joins the blacks: what both views take off together is what matters.
        both = np.concatenate([self.left, self.right], axis=1)
        more = np.linalg.lstsq(both, lowest, rcond=None)[0]
        span = (highest - lowest)[:, np.newaxis]
        return replace(
            self,
            left=self.left / span,
            right=self.right / span,
            left_black_XYZ_cd_m2=self.left_black_XYZ_cd_m2 + more[:3],
            right_black_XYZ_cd_m2=self.right_black_XYZ_cd_m2 + more[3:],
            curves=curves,
        )

    def swapped(self) -> Mixture:
        """Return the mixture with the two views exchanged."""
        return Mixture(
            self.right,
            self.left,
            self.right_black_XYZ_cd_m2,
            self.left_black_XYZ_cd_m2,
            self.curves,
            self.right_through,
            self.left_through,
        )

    def light(self, left_XYZ_cd_m2: ArrayLike, right_XYZ_cd_m2: ArrayLike) -> Floats:
        """Return each channel's linear light, unclipped, shape (..., 3), for XYZ in cd/m² of both views."""
        left = np.asarray(left_XYZ_cd_m2, dtype=np.float64) - self.left_black_XYZ_cd_m2
        right = np.asarray(right_XYZ_cd_m2, dtype=np.float64) - self.right_black_XYZ_cd_m2
        return np.asarray(left @ self.left.T + right @ self.right.T)

    def code(self, left_XYZ_cd_m2: ArrayLike, right_XYZ_cd_m2: ArrayLike) -> Floats:
        """Return device codes in 0..1, shape (..., 3), for XYZ in cd/m² of both views, shape (..., 3) each."""
        linear = np.clip(self.light(left_XYZ_cd_m2, right_XYZ_cd_m2), *self.limits)
        return np.stack([curve.code(linear[..., i]) for i, curve in enumerate(self.curves)], axis=-1)


def least_squares(models: EyeModels, left_filter: ArrayLike | None, right_filter: ArrayLike | None) -> Mixture:
    """Return the projection for ``models`` seen through filters.

    A filter is a matrix (3, 3) on XYZ, or (3,), the share of each channel's light that it passes. None means that the
    model was measured through it.

    Parameters
    ----------
    models
        What each eye sees of the display.
    left_filter, right_filter
        What the filter before each eye passes: shares in 0..1, shape (3,), or a matrix on XYZ, shape (3, 3), or None.

    Returns
    -------
    Mixture
        How both eyes' XYZ make one picture; the display's white in both eyes is full drive.

    Raises
    ------
    DeviceError
        If the filters leave a channel that neither eye sees, or need negative light for white, or channels do not add
        up.

    Examples
    --------
    >>> from pathlib import Path
    >>> from devices.display import read_display
    >>> models = read_display(Path("configs/displays/asus_vg248qe.yaml")).models("side-by-side")
    >>> mixture = least_squares(models, (0.2, 0.0, 0.0), (0.0, 0.4, 0.3))
    >>> mixture.light(models.left.white_XYZ_cd_m2, models.right.white_XYZ_cd_m2).round(6).tolist()
    [1.0, 1.0, 1.0]
    """
    seen = [_filtered(models.left.primaries_XYZ_cd_m2, left_filter)]
    seen.append(_filtered(models.right.primaries_XYZ_cd_m2, right_filter))
    stacked = np.concatenate(seen)
    if np.linalg.matrix_rank(stacked) < 3:
        raise DeviceError("the filters leave a channel that neither eye can see")
    projection = np.linalg.pinv(stacked)
    white = [model.primaries_XYZ_cd_m2.sum(axis=1) for model in (models.left, models.right)]
    full = projection @ np.concatenate(white)
    if np.any(full <= 0.0):
        raise DeviceError("these filters need negative light to make white")
    scaled = projection / full[:, np.newaxis]
    through = _through(models.left, left_filter), _through(models.right, right_filter)
    return _mixture(models, scaled[:, :3], scaled[:, 3:], through)


def channel_split(
    models: EyeModels,
    left_channels: tuple[bool, bool, bool],
    left_filter: ArrayLike | None = None,
    right_filter: ArrayLike | None = None,
) -> Mixture:
    """Return each channel from one eye's view alone: those of ``left_channels`` from the left, the others right.

    The filters, as in `least_squares`, do not change the mixture, only what is known of what each eye sees of it.

    Parameters
    ----------
    models
        What each eye sees of the display.
    left_channels
        Which of red, green and blue are the left eye's.
    left_filter, right_filter
        What the filter before each eye passes: shares in 0..1, shape (3,), or a matrix on XYZ, shape (3, 3), or None.

    Returns
    -------
    Mixture
        How both eyes' XYZ make one picture.

    Examples
    --------
    >>> from pathlib import Path
    >>> from devices.display import read_display
    >>> models = read_display(Path("configs/displays/asus_vg248qe.yaml")).models("side-by-side")
    >>> mixture = channel_split(models, (True, False, False))
    >>> mixture.light(0.5 * models.left.white_XYZ_cd_m2, models.right.white_XYZ_cd_m2).round(6).tolist()
    [0.5, 1.0, 1.0]
    """
    owned = np.array(left_channels)[:, np.newaxis]
    return _mixture(
        models,
        np.where(owned, models.left.linear_from_XYZ, 0.0),
        np.where(owned, 0.0, models.right.linear_from_XYZ),
        (_through(models.left, left_filter), _through(models.right, right_filter)),
    )


def _filtered(primaries: Floats, through: ArrayLike | None) -> Floats:
    if through is None:
        return primaries
    given = np.asarray(through, dtype=np.float64)
    return primaries * given if given.shape == (3,) else np.asarray(given @ primaries)


def _through(model: DisplayModel, through: ArrayLike | None) -> Floats:
    """Return what a filter does to the model's XYZ, as a matrix (3, 3)."""
    return np.asarray(_filtered(model.primaries_XYZ_cd_m2, through) @ model.linear_from_XYZ)


def _mixture(models: EyeModels, left: Floats, right: Floats, through: tuple[Floats, Floats]) -> Mixture:
    """Take each channel's curve from the eye that sees more of its light; the panel has but one.

    Raises DeviceError if channels do not add up: what one gives then depends on what the other eye is shown.
    """
    if not (models.left.additive and models.right.additive):
        raise DeviceError(
            Finding(
                "two views cannot be mixed into one picture on a display whose channels act on each other "
                "(curve of kind 'plvc')",
                remedy="characterise the mode by independent channels: display fit --model table",
            )
        )
    more_left = models.left.primaries_XYZ_cd_m2[1] >= models.right.primaries_XYZ_cd_m2[1]
    red, green, blue = ((models.left if more_left[channel] else models.right).curves[channel] for channel in range(3))
    blacks = models.left.dark_XYZ_cd_m2, models.right.dark_XYZ_cd_m2
    return Mixture(left, right, *blacks, (red, green, blue), *through)
