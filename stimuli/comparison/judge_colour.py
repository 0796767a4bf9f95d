"""Colour differences held against their limit: the regions' means, the pixels as seen, the pixels as they are.

A region may be smaller than what the eye resolves: one whose mean differs too much, and whose pixels do not once both
pictures are seen at their distance, is noted.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

from stimuli.comparison.difference_map import DifferenceSummary
from stimuli.comparison.evidence import Evidence
from stimuli.comparison.limits import Limits
from stimuli.comparison.reason import Outcome, Reason
from stimuli.comparison.region_table import RegionTable


def colour_reasons(evidence: Evidence, limits: Limits) -> list[Reason]:
    """Return what the regions and the two maps say of colour."""
    reasons = [] if evidence.regions is None else _regions(evidence.regions, evidence.seen_regions, limits)
    residual = evidence.registration.residual_px if evidence.registration is not None else None
    if residual is not None and residual > limits.registration_residual_px:
        return reasons  # that nothing can be said of pixels is said where registration is judged
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
        said = "no region is left to compare" if table.rows else "there are no regions"
        return [*reasons, Reason("regions", "ΔE00", "cannot say", said, None, limit)]
    worst = max(table.compared, key=lambda row: row.delta_e)
    for row in table.compared:
        if row.delta_e > limit:
            error = "" if row.delta_e_se is None else f" ± {row.delta_e_se:.2g}"
            said = f"region '{row.name}' differs by ΔE00 {row.delta_e:.2f}{error}, more than {limit:g}"
            as_seen = seen.get(row.name, row.delta_e)
            outcome: Outcome = "fails"
            if as_seen <= limit:
                outcome, said = (
                    "noted",
                    f"{said}; as the eye resolves it, by {as_seen:.2f}: it cancels with what is beside",
                )
            reasons.append(Reason(f"region {row.name}", "ΔE00", outcome, said, row.delta_e, limit))
    if worst.delta_e <= limit:
        said = f"no region differs by more than ΔE00 {worst.delta_e:.2f} ('{worst.name}'), within {limit:g}"
        reasons.append(Reason("regions", "largest ΔE00", "passes", said, worst.delta_e, limit))
    count = len(table.compared)
    told = f"{count} regions differ by" if count > 1 else "one region differs by"
    told += f" ΔE00 {mean:.2f}" + (" on average" if count > 1 else "")
    how = f"more than {limit:g}" if mean > limit else f"within {limit:g}"
    shown = [seen.get(row.name, row.delta_e) for row in table.compared]
    outcome = "passes"
    if mean > limit:
        outcome = "noted" if max(shown) <= limit else "fails"
    reasons.append(Reason("regions", "mean ΔE00", outcome, f"{told}, {how}", mean, limit))
    return reasons


def _map(summary: DifferenceSummary, subject: str, how: str, limits: Limits) -> list[Reason]:
    share, most = summary.above_limit_percent, limits.above_limit_percent
    if summary.limit != limits.delta_e:
        said = f"the map's share is above ΔE00 {summary.limit:g}, and the limit is {limits.delta_e:g}"
        return [Reason(subject, "limit", "cannot say", said, summary.limit, limits.delta_e)]
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
            f"{share:.3g} % of the pixels differ by more than ΔE00 {limits.delta_e:g} {how}, "
            f"{'more than' if many else 'within'} {most:g} %",
            share,
            most,
            "%",
        ),
    ]


def _elsewhere(evidence: Evidence, limits: Limits) -> list[Reason]:
    """Return a note of what single pixels differ by where it says that flakes lie elsewhere, and no more."""
    summary, how = (
        (evidence.per_pixel, "pixel by pixel") if evidence.seen is None else (evidence.seen, "as the eye resolves them")
    )
    if summary is None:
        return []
    said = f"pixels differ by ΔE00 {summary.mean:.2f} on average {how}: flakes lie elsewhere, which decides nothing"
    return [Reason("as seen", "mean ΔE00", "noted", said, summary.mean, limits.delta_e)]


def _weighed(plain: list[Reason], seen: list[Reason]) -> list[Reason]:
    """Return what the plain map says once it is known what of it is seen: it decides nothing by itself."""
    weighed = []
    for reason in plain:
        if reason.outcome != "fails":
            weighed.append(reason)
        elif not seen:
            said = f"{reason.said}; without a viewing distance it is not known whether that is seen"
            weighed.append(_with(reason, "cannot say", said))
        elif any(one.outcome != "passes" for one in seen):
            weighed.append(_with(reason, "noted", reason.said))
        else:
            weighed.append(_with(reason, "noted", f"{reason.said}; it cancels at the viewing distance"))
    return weighed


def _with(reason: Reason, outcome: Literal["noted", "cannot say"], said: str) -> Reason:
    return replace(reason, outcome=outcome, said=said)
