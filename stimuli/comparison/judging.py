"""Is the rendering validated? Each number is compared with its limit and gives a reason.

Colour is judged on the means of the regions, and pixel by pixel as the eye resolves it: a difference that only lies
between neighbouring pixels cancels at the viewing distance and is noted, not failed (the plate of thesis Table 5.5).

Sparkle has limits of its own, so that a plate with the right mean colour and the wrong sparkle fails. A difference
fails if it is larger than chance and larger than what matters. Chance, because flakes lie at random: z is two-sided.
What matters, because on a plate with ten thousand sparkles a difference of two percent is certain, and nobody sees
it. A difference that is certain but small is noted. One that would matter but may be chance, or numbers that are too
few, leave the question open. Equal numbers pass, however few.

If a number that would decide is missing or too uncertain, the verdict is "cannot say".
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from stimuli.comparison.colour_reasons import colour_reasons, region_notes
from stimuli.comparison.evidence import DisparityEvidence, Evidence, RegistrationEvidence, SparklePair
from stimuli.comparison.verdict import Limits, Outcome, Reason, Verdict, decided, decimals

# A displacement that was undone is named from here on, if it is above so many of its standard errors.
NAMED_PX, NAMED_Z = 0.02, 3.0
NAMED_DEG = 0.01


def judge(evidence: Evidence, limits: Limits | None = None) -> Verdict:
    """Return the verdict on one pair."""
    limits = limits or Limits()
    reasons = [
        *colour_reasons(evidence, limits),
        *sparkle_reasons(evidence.sparkle, limits),
        *registration_reasons(evidence.registration, limits),
        *disparity_reasons(evidence.disparity, limits),
        *region_notes(evidence.regions, limits),
    ]
    return decided(reasons, limits)


def registration_reasons(found: RegistrationEvidence | None, limits: Limits) -> list[Reason]:
    """Return whether the pictures lie on one grid, and how they lay before."""
    if found is None:
        return []
    reasons = []
    residual, most = found.residual_px, limits.registration_residual_px
    if residual is not None:
        good = residual <= most
        said = f"the pictures lie {residual:.2g} px apart, {'within' if good else 'more than'} {most:g} px"
        if not good:
            said += ": nothing can be said of single pixels"
        outcome: Outcome = "passes" if good else "cannot say"
        reasons.append(Reason("registration", "residual", outcome, said, residual, most, "px"))
    if found.shift_px is not None:
        shift = math.hypot(*found.shift_px)
        error = math.hypot(*found.shift_se_px) if found.shift_se_px is not None else 0.0
        if shift > max(NAMED_PX, NAMED_Z * error):
            across, down = (decimals(one, 2) for one in found.shift_px)
            said = f"the rendering lay ({across}, {down}) px beside the photograph, across and down"
            reasons.append(Reason("registration", "shift", "noted", said, shift, None, "px"))
    if found.rotation_deg is not None and abs(found.rotation_deg) > NAMED_DEG:
        said = f"the rendering lay turned by {decimals(found.rotation_deg, 2)}° against the photograph"
        reasons.append(Reason("registration", "rotation", "noted", said, found.rotation_deg, None, "°"))
    return reasons


def disparity_reasons(found: DisparityEvidence | None, limits: Limits) -> list[Reason]:
    """Return whether both eyes see the rendering as deep as the photograph.

    What is beyond the limit by fewer than ``NAMED_Z`` standard errors is left open, and so is what is known less well
    than to the limit.
    """
    if found is None:
        return []
    reasons = []
    most = limits.disparity_px
    for name, apart, error in zip(("across", "down"), found.difference_px, found.standard_error_px, strict=True):
        outcome: Outcome = "passes"
        if math.isnan(apart) or math.isnan(error):
            outcome = "cannot say"
        elif abs(apart) > most:
            outcome = "fails" if abs(apart) - NAMED_Z * error > most else "cannot say"
        elif error > most:
            outcome = "cannot say"
        how = "within" if outcome == "passes" else "more than" if outcome == "fails" else "too uncertain against"
        said = f"disparity {name} differs by {decimals(apart, 2)} ± {error:.2g} px, {how} {most:g} px"
        reasons.append(Reason("disparity", name, outcome, said, apart, most, "px"))
    return reasons


def sparkle_reasons(pairs: Sequence[SparklePair], limits: Limits) -> list[Reason]:
    """Return a reason for every number that says something of sparkle."""
    return [_reason(pair, limits) for pair in pairs]


def _reason(pair: SparklePair, limits: Limits) -> Reason:
    relative = pair.relative
    outcome, why = _outcome(pair, limits)
    where = f" on '{pair.where}'" if pair.where else ""
    unit = f" {pair.unit}" if pair.unit else ""
    said = (
        f"sparkle {pair.measure}{where} is {pair.rendering:.4g}{_error(pair.rendering_se)}{unit} in the rendering and "
        f"{pair.photo:.4g}{_error(pair.photo_se)}{unit} in the photograph"
    )
    if math.isfinite(relative) and relative:
        error = _error(100 * pair.relative_se)
        said += f", {100 * abs(relative):.3g}{error} % {'more' if relative > 0 else 'less'}"
    value = 100 * abs(relative) if math.isfinite(relative) else None
    return Reason(
        f"sparkle{where}",
        pair.measure,
        outcome,
        f"{said}: {why}",
        value,
        100 * limits.sparkle_relative,
        "%",
    )


def _outcome(pair: SparklePair, limits: Limits) -> tuple[Outcome, str]:
    relative, z, most = pair.relative, pair.z, limits.sparkle_relative
    if math.isnan(pair.photo) and math.isnan(pair.rendering):
        return "noted", "neither has what it is measured on"
    if pair.photo == pair.rendering:
        return "passes", "equal"
    if math.isnan(z) or math.isnan(relative):
        return "cannot say", "there is too little to tell"
    large, certain = abs(relative) > most, abs(z) > limits.sparkle_z
    if large and certain:
        return "fails", f"{abs(z):.1f} standard errors and more than {100 * most:g} %"
    if certain:
        return "noted", f"{abs(z):.1f} standard errors, but within {100 * most:g} %"
    if large:
        return "cannot say", f"more than {100 * most:g} %, but only {abs(z):.1f} standard errors"
    if pair.relative_se > limits.sparkle_relative_se:
        return "cannot say", f"the difference is known to {100 * pair.relative_se:.2g} % only"
    return "passes", f"within {100 * most:g} % and {limits.sparkle_z:g} standard errors"


def _error(se: float) -> str:
    return f" ± {se:.2g}" if math.isfinite(se) else ""
