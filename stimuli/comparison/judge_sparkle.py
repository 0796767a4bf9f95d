"""Sparkle held against its limits, so that a plate with the right mean colour and the wrong sparkle fails.

Two things are asked of a difference, and both must hold for it to fail. It must be larger than chance: flakes lie at
random, and two prints of one paint differ by several standard errors' worth of nothing, so z is two-sided. And it must
be larger than what matters: of a large plate with ten thousand sparkles a difference of two percent is certain, and
nobody sees it. A difference that is certain but small is noted; one that would matter but may be chance, and numbers
too few to tell, leave it open. Equal numbers pass however few.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from stimuli.comparison.evidence import SparklePair
from stimuli.comparison.limits import Limits
from stimuli.comparison.reason import Outcome, Reason


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
