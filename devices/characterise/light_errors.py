"""How far a model's luminance is from readings that it was not fitted to, decade by decade from white down.

ΔE00 does not see the dark: below a ten-thousandth of white, light that is three times too dark differs by a tenth of a
ΔE00, and an eye that looks at a dark picture sees it all the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from documents.arrays import Floats
from documents.text import JsonResult

# A decade with fewer readings is told, and has no say in the choice of a model.
FEWEST_JUDGED = 3
# A model's light is as good as another's if it is off by this many times as much, and by so much more, as a share.
MARGIN_TIMES, MARGIN_SHARE = 1.5, 0.02
# Off by more than this, light is worth a note: twice what an eye tells apart in the dark.
_NOTABLE_SHARE = 0.1
_LEAST_RATIO = 1e-6
_MOST_TIMES = 100.0  # what is off by more gives no light, or was read of none


@dataclass(frozen=True, slots=True)
class LightError(JsonResult):
    """How far luminance is off between ``from_cd_m2`` and ``to_cd_m2``, where ``readings`` were held out.

    ``share``: half of the readings are off by less than this share of what was read, 0 or more; a third of the light
    and three times the light both count as 2. ``bias``: the median of predicted through read light, minus 1.
    """

    from_cd_m2: float
    to_cd_m2: float
    readings: int
    share: float
    bias: float
    json_names: ClassVar = "from_cd_m2 to_cd_m2 readings off_percent bias_percent"

    @property
    def judged(self) -> bool:
        """Whether there are readings enough to choose a model by."""
        return self.readings >= FEWEST_JUDGED

    @property
    def notable(self) -> bool:
        """Whether it is off by more than a tenth, in readings enough to say so."""
        return self.judged and self.share > _NOTABLE_SHARE

    @property
    def size(self) -> str:
        """How far it is off, such as ``0.4 %`` or ``3.6 times``."""
        if self.share >= _MOST_TIMES:
            return f"over {_MOST_TIMES:.0f} times"
        if self.share >= 1.0:
            return f"{1.0 + self.share:.2g} times"
        return f"{100.0 * (self.share / (1.0 + self.share) if self.bias < 0.0 else self.share):.2g} %"

    @property
    def off(self) -> str:
        """The same with its direction, where it has one."""
        if self.share < MARGIN_SHARE or abs(np.log1p(self.bias)) < 0.5 * np.log1p(self.share):
            return self.size
        return f"{self.size} too {'dark' if self.bias < 0 else 'bright'}"

    @property
    def between(self) -> str:
        """The decade, such as ``0.12 to 1.2 cd/m²``."""
        return f"{_plain(self.from_cd_m2)} to {_plain(self.to_cd_m2)} cd/m²"

    @property
    def off_percent(self) -> float:
        """The root mean square of errors, in percent."""
        return 100.0 * self.share

    @property
    def bias_percent(self) -> float:
        """The mean error in percent."""
        return 100.0 * self.bias


def _plain(luminance: float) -> str:
    return f"{luminance:.0f}" if luminance >= 100.0 else f"{luminance:.2g}"


def light_errors(predicted_cd_m2: Floats, read_cd_m2: Floats, white_cd_m2: float) -> tuple[LightError, ...]:
    """Return the error of each decade with readings, from white down; luminances (n,), white's above 0.

    Readings of no light, or less, have no relative error and do not count.
    """
    lit = read_cd_m2 > 0.0
    read = read_cd_m2[lit]
    ratio = np.log(np.maximum(predicted_cd_m2[lit] / read, _LEAST_RATIO))
    decade = np.maximum(np.floor(-np.log10(read / white_cd_m2)), 0.0).astype(int)
    return tuple(
        LightError(
            white_cd_m2 / 10.0 ** (k + 1),
            white_cd_m2 / 10.0**k,
            int((decade == k).sum()),
            float(np.expm1(np.median(np.abs(ratio[decade == k])))),
            float(np.expm1(np.median(ratio[decade == k]))),
        )
        for k in np.unique(decade).tolist()
    )


def worse(one: Sequence[LightError], all_of: Sequence[Sequence[LightError]]) -> tuple[float, LightError | None]:
    """Return by which share ``one`` is off beyond the margin about the best of ``all_of``, at most, and where.

    All have the same decades. 0 and None where it is within the margin in each.
    """
    beyond = [
        (mine.share - MARGIN_TIMES * min(errors[place].share for errors in all_of) - MARGIN_SHARE, place)
        for place, mine in enumerate(one)
        if mine.judged
    ]
    most, place = max(beyond, default=(0.0, 0))
    return (most, one[place]) if most > 0.0 else (0.0, None)
