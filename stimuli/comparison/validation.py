"""Is the rendering validated? Each number is compared with its limit and gives a reason.

Colour is judged on the means of the regions, and pixel by pixel as the eye resolves it: a difference that only lies
between neighbouring pixels cancels at the viewing distance and is noted, not failed (the plate of thesis Table 5.5).

Sparkle has limits of its own, so that a plate with the right mean colour and the wrong sparkle fails. A difference
fails if it is both significant (z is two-sided, because flakes lie at random) and larger than what matters: on a plate
with ten thousand sparkles a difference of two percent is significant, and invisible. A difference that is significant
but small is noted. A large difference that may be chance, or numbers of too few sparkles, leave the question open.
Equal numbers pass, however few.

If a number that would decide is missing or too uncertain, the verdict is "cannot say".
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from documents.text import significant, with_error
from stimuli.comparison.alignment import Alignment, registration_reasons
from stimuli.comparison.binocular_reasons import BinocularEvidence, binocular_reasons
from stimuli.comparison.by_pixel import DifferenceSummary
from stimuli.comparison.sparkles import SparklePair, sparkle_reasons
from stimuli.comparison.table import RegionTable
from stimuli.comparison.verdict import Limits, Outcome, Reason, Verdict, decided, decimals


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
    registration: Alignment | None = None
    eyes: BinocularEvidence | None = None
    seen_regions: Mapping[str, float] = field(default_factory=dict)
    other_flakes: bool = False


def judge(evidence: Evidence, limits: Limits | None = None) -> Verdict:
    """Return the verdict on one pair of pictures.

    Parameters
    ----------
    evidence
        The measurements: regions, maps of ΔE00, sparkle, registration, depth; what was not measured is None.
    limits
        The limits that the rendering must keep.

    Returns
    -------
    Verdict
        ``decision`` ("validated", "not validated" or "cannot say") with every reason, failures first.

    Examples
    --------
    >>> from stimuli.comparison import SparklePair
    >>> density = SparklePair("density", photo=1000.0, photo_se=20.0, rendering=1300.0, rendering_se=25.0)
    >>> judge(Evidence(sparkle=(density,))).decision
    'not validated'
    """
    limits = limits or Limits()
    reasons = [
        *colour_reasons(evidence, limits),
        *sparkle_reasons(evidence.sparkle, limits),
        *registration_reasons(evidence.registration, limits),
        *binocular_reasons(evidence.eyes, limits),
        *region_notes(evidence.regions, limits),
    ]
    return decided(reasons, limits)


def colour_reasons(evidence: Evidence, limits: Limits) -> list[Reason]:
    """Return the reasons that the regions and the two maps give on colour."""
    reasons = [] if evidence.regions is None else _regions(evidence.regions, evidence.seen_regions, limits)
    residual = evidence.registration.residual_px if evidence.registration is not None else None
    if residual is not None and residual > limits.registration_residual_px:
        return reasons  # `registration_reasons` reports that pixels cannot be compared
    if evidence.other_flakes:
        return [*reasons, *_elsewhere(evidence, limits)]
    seen = [] if evidence.seen is None else _map(evidence.seen, "as seen", "as the eye resolves them", limits)
    plain = [] if evidence.per_pixel is None else _map(evidence.per_pixel, "per pixel", "pixel by pixel", limits)
    return reasons + seen + _weighed(plain, seen)


def _regions(table: RegionTable, seen: Mapping[str, float], limits: Limits) -> list[Reason]:
    limit = limits.delta_e
    reasons = [
        Reason(
            f"region {row.name}", "excluded", "noted", f"region '{row.name}' does not count: " + "; ".join(row.excluded)
        )
        for row in table.excluded
    ]
    mean = table.mean_delta_e
    if mean is None:
        sentence = "no region is left to compare" if table.rows else "there are no regions"
        return [*reasons, Reason("regions", "ΔE00", "cannot say", sentence, None, limit)]
    worst = max(table.compared, key=lambda row: row.delta_e)
    for row in table.compared:
        if row.delta_e > limit:
            by = with_error(row.delta_e, row.delta_e_se) if row.delta_e_se else f"{row.delta_e:.2f}"
            sentence = f"region '{row.name}' differs by ΔE00 {by}, more than {limit:g}"
            as_seen = seen.get(row.name, row.delta_e)
            outcome: Outcome = "fails"
            if as_seen <= limit:
                outcome, sentence = (
                    "noted",
                    f"{sentence}; as the eye resolves it, by {as_seen:.2f}: it cancels with what is beside",
                )
            reasons.append(Reason(f"region {row.name}", "ΔE00", outcome, sentence, row.delta_e, limit))
    if worst.delta_e <= limit:
        sentence = f"no region differs by more than ΔE00 {worst.delta_e:.2f} ('{worst.name}'), within {limit:g}"
        reasons.append(Reason("regions", "largest ΔE00", "passes", sentence, worst.delta_e, limit))
    count = len(table.compared)
    average = f"{count} regions differ by" if count > 1 else "one region differs by"
    average += f" ΔE00 {mean:.2f}" + (" on average" if count > 1 else "")
    how = f"more than {limit:g}" if mean > limit else f"within {limit:g}"
    shown = [seen.get(row.name, row.delta_e) for row in table.compared]
    outcome = "passes"
    if mean > limit:
        outcome = "noted" if max(shown) <= limit else "fails"
    reasons.append(Reason("regions", "mean ΔE00", outcome, f"{average}, {how}", mean, limit))
    return reasons


def _map(summary: DifferenceSummary, subject: str, how: str, limits: Limits) -> list[Reason]:
    share, most = summary.above_limit_percent, limits.above_limit_percent
    if summary.limit != limits.delta_e:
        sentence = f"the map's share is above ΔE00 {summary.limit:g}, and the limit is {limits.delta_e:g}"
        return [Reason(subject, "limit", "cannot say", sentence, summary.limit, limits.delta_e)]
    over = summary.mean > limits.delta_e
    many = share > most
    return [
        Reason(
            subject,
            "mean ΔE00",
            "fails" if over else "passes",
            f"pixels differ by ΔE00 {summary.mean:.2f} on average {how}, {'more than' if over else 'within'} "
            f"{limits.delta_e:g}",
            summary.mean,
            limits.delta_e,
        ),
        Reason(
            subject,
            "share above the limit",
            "fails" if many else "passes",
            f"{significant(share)} % of the pixels differ by more than ΔE00 {limits.delta_e:g} {how}, "
            f"{'more than' if many else 'within'} {most:g} %",
            share,
            most,
            "%",
        ),
    ]


def _elsewhere(evidence: Evidence, limits: Limits) -> list[Reason]:
    """Return a note on the difference of single pixels, which decides nothing where flakes lie elsewhere."""
    summary, how = (
        (evidence.per_pixel, "pixel by pixel") if evidence.seen is None else (evidence.seen, "as the eye resolves them")
    )
    if summary is None:
        return []
    sentence = f"pixels differ by ΔE00 {summary.mean:.2f} on average {how}: flakes lie elsewhere, which decides nothing"
    return [Reason("as seen", "mean ΔE00", "noted", sentence, summary.mean, limits.delta_e)]


def _weighed(plain: list[Reason], seen: list[Reason]) -> list[Reason]:
    """Return the reasons of the plain map in view of what the eye resolves: by themselves they decide nothing."""
    weighed = []
    for reason in plain:
        if reason.outcome != "fails":
            weighed.append(reason)
        elif not seen:
            sentence = f"{reason.sentence}; without a viewing distance it is not known whether that is seen"
            weighed.append(_with(reason, "cannot say", sentence))
        elif any(as_seen.outcome != "passes" for as_seen in seen):
            weighed.append(_with(reason, "noted", reason.sentence))
        else:
            weighed.append(_with(reason, "noted", f"{reason.sentence}; it cancels at the viewing distance"))
    return weighed


def _with(reason: Reason, outcome: Literal["noted", "cannot say"], sentence: str) -> Reason:
    return replace(reason, outcome=outcome, sentence=sentence)


LEAST_REGIONS = 4
# A smaller one rounds to 0 with the decimals of a chromaticity.
_LEAST_ERROR = 0.5e-4
# Medians of |x| for one and of √(x² + y²) for two normal distributions of standard deviation 1.
_MEDIAN_1, _MEDIAN_2 = 0.6745, 1.1774


def region_notes(table: RegionTable | None, limits: Limits) -> list[Reason]:
    """Return notes on luminance and chromaticity, of all regions and of those that stand out."""
    if table is None or not table.compared:
        return []
    return [*_factor(table, limits), *_chromaticity(table, limits), *_luminance(table, limits)]


def _factor(table: RegionTable, limits: Limits) -> list[Reason]:
    factor = table.factor
    if factor is None:
        return []
    off, error = factor.mean_ratio - 1.0, factor.mean_ratio_se
    if abs(off) <= max(limits.stands_out_luminance, limits.stands_out_z * (error or 0.0)):
        return []
    brighter = 100 * (1.0 / factor.mean_ratio - 1.0)
    over = f"{factor.regions} {'region' if factor.regions == 1 else 'regions'}"
    sentence = (
        f"luminances differ by a factor: photograph / rendering is {with_error(factor.mean_ratio, error)} over {over}, "
        f"the rendering {significant(abs(brighter))} % {'brighter' if brighter > 0 else 'darker'}"
    )
    if table.luminance != "absolute":
        sentence += f"; colours were compared after the rendering was multiplied by {significant(table.scaled_by, 4)}"
    return [Reason("luminance", "factor", "noted", sentence, factor.mean_ratio, None)]


def _chromaticity(table: RegionTable, limits: Limits) -> list[Reason]:
    rows = table.compared
    shifts = np.array([[row.delta_x, row.delta_y] for row in rows])
    common = np.median(shifts, axis=0) if len(rows) >= LEAST_REGIONS else np.zeros(2)
    apart = np.hypot(*(shifts - common).T)
    scatter = float(np.median(apart)) / _MEDIAN_2 if len(rows) >= LEAST_REGIONS else 0.0
    least = limits.stands_out_delta_xy
    reasons = []
    if float(np.hypot(*common)) > max(least, limits.stands_out_z * scatter / math.sqrt(len(rows))):
        sentence = (
            f"chromaticities are shifted alike, by Δx {_signed(common[0])} and Δy {_signed(common[1])} in the median"
        )
        reasons.append(Reason("chromaticity", "Δxy", "noted", sentence, float(np.hypot(*common)), least))
    for row, distance in zip(rows, apart, strict=True):
        error = math.hypot(row.delta_x_se or 0.0, row.delta_y_se or 0.0)
        if distance > max(least, limits.stands_out_z * error, limits.stands_out_z * scatter):
            x, y = _signed(row.delta_x), _signed(row.delta_y)
            sentence = f"region '{row.name}' is shifted in chromaticity, by Δx {x} and Δy {y}"
            if error >= _LEAST_ERROR:
                sentence += f" (± {decimals(error, 4)})"
            reasons.append(Reason(f"region {row.name}", "Δxy", "noted", sentence, row.delta_xy, least))
    return reasons


def _signed(value: float) -> str:
    text = decimals(value, 4)
    return text if text.startswith("-") or float(text) == 0 else f"+{text}"


def _luminance(table: RegionTable, limits: Limits) -> list[Reason]:
    rows = table.compared
    ratios = np.array([row.luminance_ratio or np.nan for row in rows])  # those that count hold light
    if len(rows) < LEAST_REGIONS:
        return []  # the factor says it
    common = float(np.median(ratios))
    apart = ratios / common - 1.0
    scatter = float(np.median(np.abs(apart))) / _MEDIAN_1
    reasons = []
    for row, ratio, off in zip(rows, ratios, apart, strict=True):
        error = (row.luminance_ratio_se or 0.0) / common
        if abs(off) > max(limits.stands_out_luminance, limits.stands_out_z * max(error, scatter)):
            sentence = (
                f"region '{row.name}' stands out in luminance: photograph / rendering is {significant(ratio, 4)}, "
                f"{significant(100 * abs(off))} % {'above' if off > 0 else 'below'} the median of all"
            )
            reasons.append(Reason(f"region {row.name}", "luminance", "noted", sentence, float(ratio), None))
    return reasons
