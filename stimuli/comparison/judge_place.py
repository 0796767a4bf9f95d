"""Where the two pictures, and what both eyes see in them, lie: registration and disparity."""

from __future__ import annotations

import math

from stimuli.comparison.evidence import DisparityEvidence, RegistrationEvidence
from stimuli.comparison.limits import Limits
from stimuli.comparison.reason import Outcome, Reason, decimals

# A displacement that was undone is named from here on, if it is above so many of its standard errors.
NAMED_PX, NAMED_Z = 0.02, 3.0
NAMED_DEG = 0.01


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
