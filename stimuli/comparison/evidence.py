"""The evidence for a verdict: the measurements of one picture pair, or of one eye's, and the reasons that they give."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

from documents.text import JsonResult, significant, with_error
from stimuli.comparison.by_pixel import DifferenceSummary
from stimuli.comparison.eye_evidence import EyesEvidence
from stimuli.comparison.table import RegionTable
from stimuli.comparison.verdict import Limits, Outcome, Reason, decimals

# A displacement that was undone is named from here on, if it is above so many of its standard errors.
NAMED_PX, NAMED_Z = 0.02, 3.0
NAMED_DEG = 0.01
# From so many standard errors on, their decimals are of no use.
_MANY = 1000


@dataclass(frozen=True, slots=True)
class SparklePair(JsonResult):
    """One measure of sparkle (density, width, contrast) of both pictures, with standard errors.

    NaN where there are too few sparkles. ``where`` is the region's name, ``unit`` is for print. ``difference_se`` is
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
    json_also: ClassVar = ("relative", "relative_se", "z")

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
        """The difference in its standard errors; 0 where the numbers are equal, NaN where it is not known."""
        apart = self.rendering - self.photo
        se = math.hypot(self.photo_se, self.rendering_se) if self.difference_se is None else self.difference_se
        if apart == 0:
            return 0.0
        return apart / se if se != 0 else math.copysign(math.inf, apart)


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
class Evidence:
    """All measurements of one pair; None for what was not measured.

    ``per_pixel`` is of the plain map, ``seen`` of that of both pictures as the eye resolves them at its distance, and
    ``seen_regions`` are that map's means over regions, by name. ``other_flakes`` is true if all that is compared
    sparkles at other places in either picture, so that single pixels are not compared.
    """

    regions: RegionTable | None = None
    per_pixel: DifferenceSummary | None = None
    seen: DifferenceSummary | None = None
    sparkle: tuple[SparklePair, ...] = ()
    registration: RegistrationEvidence | None = None
    eyes: EyesEvidence | None = None
    seen_regions: Mapping[str, float] = field(default_factory=dict)
    other_flakes: bool = False


def registration_reasons(evidence: RegistrationEvidence | None, limits: Limits) -> list[Reason]:
    """Return whether the pictures lie on one grid, and how they lay before."""
    if evidence is None:
        return []
    reasons = []
    residual, most = evidence.residual_px, limits.registration_residual_px
    if residual is not None:
        good = residual <= most
        sentence = (
            f"the pictures lie {significant(residual, 2)} px apart, {'within' if good else 'more than'} {most:g} px"
        )
        if not good:
            sentence += ": single pixels cannot be compared"
        outcome: Outcome = "passes" if good else "cannot say"
        reasons.append(Reason("registration", "residual", outcome, sentence, residual, most, "px"))
    if evidence.shift_px is not None:
        shift = math.hypot(*evidence.shift_px)
        error = math.hypot(*evidence.shift_se_px) if evidence.shift_se_px is not None else 0.0
        if shift > max(NAMED_PX, NAMED_Z * error):
            across, down = (decimals(component, 2) for component in evidence.shift_px)
            sentence = f"the rendering lay ({across}, {down}) px beside the photograph, across and down"
            reasons.append(Reason("registration", "shift", "noted", sentence, shift, None, "px"))
    if evidence.rotation_deg is not None and abs(evidence.rotation_deg) > NAMED_DEG:
        sentence = f"the rendering lay turned by {decimals(evidence.rotation_deg, 2)}° against the photograph"
        reasons.append(Reason("registration", "rotation", "noted", sentence, evidence.rotation_deg, None, "°"))
    return reasons


def sparkle_reasons(pairs: Sequence[SparklePair], limits: Limits) -> list[Reason]:
    """Return a reason for every measure of sparkle."""
    return [_reason(pair, limits) for pair in pairs]


def _reason(pair: SparklePair, limits: Limits) -> Reason:
    relative = pair.relative
    outcome, why = _outcome(pair, limits)
    where = f" on '{pair.where}'" if pair.where else ""
    rendering = _number(pair.rendering, pair.rendering_se, pair.unit)
    photo = _number(pair.photo, pair.photo_se, pair.unit)
    sentence = f"sparkle {pair.measure}{where} is {rendering} in the rendering and {photo} in the photograph"
    if math.isfinite(relative) and relative:
        by = with_error(100 * abs(relative), 100 * pair.relative_se)
        sentence += f", {by} % {'more' if relative > 0 else 'less'}"
    value = 100 * abs(relative) if math.isfinite(relative) else None
    return Reason(
        f"sparkle{where}",
        pair.measure,
        outcome,
        f"{sentence}: {why}",
        value,
        100 * limits.sparkle_relative,
        "%",
    )


def _outcome(pair: SparklePair, limits: Limits) -> tuple[Outcome, str]:
    relative, z, most = pair.relative, pair.z, limits.sparkle_relative
    if math.isnan(pair.photo) and math.isnan(pair.rendering):
        return "noted", "neither picture has sparkles to measure it on"
    if math.isinf(pair.photo) or math.isinf(pair.rendering):
        return "cannot say", "one of them is no number"
    if pair.photo == pair.rendering:
        return "passes", "equal"
    if math.isnan(z) or math.isnan(relative):
        return "cannot say", "there are too few sparkles"
    large, certain = abs(relative) > most, abs(z) > limits.sparkle_z
    if large and certain:
        return "fails", f"{_standard_errors(z)} and more than {100 * most:g} %"
    if certain:
        return "noted", f"{_standard_errors(z)}, but within {100 * most:g} %"
    if large:
        return "cannot say", f"more than {100 * most:g} %, but only {_standard_errors(z)}"
    if not math.isfinite(pair.relative_se):
        return "cannot say", "it is not known how closely the difference is known"
    if pair.relative_se > limits.sparkle_relative_se:
        return "cannot say", f"the difference is known to {significant(100 * pair.relative_se, 2)} % only"
    return "passes", f"within {100 * most:g} % and {limits.sparkle_z:g} standard errors"


def _number(value: float, se: float, unit: str) -> str:
    if not math.isfinite(value):
        return "unknown"
    return f"{with_error(value, se)} {unit}".rstrip()


def _standard_errors(z: float) -> str:
    """Return how many standard errors a difference is; without any error it is certain."""
    if math.isinf(z):
        return "a difference without standard error"
    return f"{f'{abs(z):.1f}' if abs(z) < _MANY else significant(abs(z))} standard errors"
