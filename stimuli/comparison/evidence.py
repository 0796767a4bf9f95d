"""What a verdict rests on: the numbers of one picture pair, or of one eye's."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from stimuli.comparison.by_pixel import DifferenceSummary
from stimuli.comparison.table import RegionTable


@dataclass(frozen=True, slots=True)
class SparklePair:
    """One number that says something of sparkle (density, size, contrast), of both pictures, with standard errors.

    NaN where there is too little to tell. ``where`` is the region's name, ``unit`` is for print. ``difference_se`` is
    the standard error of their difference, where both have part of what they show in common; None where each has its
    own.
    """

    measure: str
    photo: float
    photo_se: float
    rendering: float
    rendering_se: float
    unit: str = ""
    where: str = ""
    difference_se: float | None = None

    @property
    def relative(self) -> float:
        """How much more the rendering has, as a share of the photograph's; infinite if that has none."""
        if self.rendering == self.photo:
            return 0.0
        return (self.rendering - self.photo) / self.photo if self.photo else math.inf

    @property
    def relative_se(self) -> float:
        """The standard error of ``relative``; infinite if there is none.

        Of a ratio of two independent numbers, or of their difference where they have part in common.
        """
        if not self.photo:
            return math.inf
        if self.difference_se is not None:
            return self.difference_se / abs(self.photo)
        ratio = self.rendering / self.photo
        return math.hypot(self.rendering_se, ratio * self.photo_se) / abs(self.photo)

    @property
    def z(self) -> float:
        """The difference in its standard errors; 0 where the numbers are equal, NaN where it cannot be told."""
        apart = self.rendering - self.photo
        se = math.hypot(self.photo_se, self.rendering_se) if self.difference_se is None else self.difference_se
        if apart == 0:
            return 0.0
        return apart / se if se != 0 else math.copysign(math.inf, apart)

    def to_json(self) -> dict[str, float | str | None]:
        """Return the numbers by name, None for what cannot be told."""
        told = {name: getattr(self, name) for name in (*self.__dataclass_fields__, "relative", "relative_se", "z")}
        return {n: v if isinstance(v, str) or (v is not None and math.isfinite(v)) else None for n, v in told.items()}


@dataclass(frozen=True, slots=True)
class RegistrationEvidence:
    """How well both lie on one grid: ``residual_px`` after ``shift_px`` and ``rotation_deg`` were undone.

    What is not known is None.
    """

    residual_px: float | None = None
    shift_px: tuple[float, float] | None = None
    shift_se_px: tuple[float, float] | None = None
    rotation_deg: float | None = None


@dataclass(frozen=True, slots=True)
class DisparityEvidence:
    """The median disparity of the rendering minus that of the photograph, across and down, and its standard error."""

    difference_px: tuple[float, float]
    standard_error_px: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Evidence:
    """All that is known of one pair; None for what was not measured.

    ``per_pixel`` is of the plain map, ``seen`` of that of both pictures as the eye resolves them at its distance, and
    ``seen_regions`` are that map's means over regions, by name. ``other_flakes`` says that all that is compared
    sparkles at other places in either picture, so that single pixels tell nothing.
    """

    regions: RegionTable | None = None
    per_pixel: DifferenceSummary | None = None
    seen: DifferenceSummary | None = None
    sparkle: tuple[SparklePair, ...] = ()
    registration: RegistrationEvidence | None = None
    disparity: DisparityEvidence | None = None
    seen_regions: Mapping[str, float] = field(default_factory=dict)
    other_flakes: bool = False
