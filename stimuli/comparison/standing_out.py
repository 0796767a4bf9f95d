"""What regions have in common, and which stand out: named, whatever the verdict.

A region stands out if it departs from the median of all by more than a least amount, by more than its own standard
error accounts for, and by more than regions scatter here. Of fewer than four regions the median is taken to be no
difference.
"""

from __future__ import annotations

import math

import numpy as np

from stimuli.comparison.limits import Limits
from stimuli.comparison.reason import Reason, decimals
from stimuli.comparison.region_table import RegionTable

LEAST_REGIONS = 4
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
    given = "" if error is None else f" ± {error:.2g}"
    brighter = 100 * (1.0 / factor.mean_ratio - 1.0)
    over = f"{factor.regions} {'region' if factor.regions == 1 else 'regions'}"
    said = (
        f"luminances differ by a factor: photograph / rendering is {factor.mean_ratio:.4g}{given} over {over}, "
        f"the rendering {abs(brighter):.3g} % {'brighter' if brighter > 0 else 'darker'}"
    )
    if table.luminance != "absolute":
        said += f"; colours were compared after the rendering was multiplied by {table.scaled_by:.4g}"
    return [Reason("luminance", "factor", "noted", said, factor.mean_ratio, None)]


def _chromaticity(table: RegionTable, limits: Limits) -> list[Reason]:
    rows = table.compared
    shifts = np.array([[row.delta_x, row.delta_y] for row in rows])
    common = np.median(shifts, axis=0) if len(rows) >= LEAST_REGIONS else np.zeros(2)
    apart = np.hypot(*(shifts - common).T)
    scatter = float(np.median(apart)) / _MEDIAN_2 if len(rows) >= LEAST_REGIONS else 0.0
    least = limits.stands_out_delta_xy
    reasons = []
    if float(np.hypot(*common)) > max(least, limits.stands_out_z * scatter / math.sqrt(len(rows))):
        said = f"chromaticities are shifted alike, by Δx {_signed(common[0])} and Δy {_signed(common[1])} in the median"
        reasons.append(Reason("chromaticity", "Δxy", "noted", said, float(np.hypot(*common)), least))
    for row, distance in zip(rows, apart, strict=True):
        error = math.hypot(row.delta_x_se or 0.0, row.delta_y_se or 0.0)
        if distance > max(least, limits.stands_out_z * error, limits.stands_out_z * scatter):
            x, y = _signed(row.delta_x), _signed(row.delta_y)
            said = f"region '{row.name}' is shifted in chromaticity, by Δx {x} and Δy {y}"
            if error:
                said += f" (± {error:.1g})"
            reasons.append(Reason(f"region {row.name}", "Δxy", "noted", said, row.delta_xy, least))
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
            said = (
                f"region '{row.name}' stands out in luminance: photograph / rendering is {ratio:.4g}, "
                f"{100 * abs(off):.3g} % {'above' if off > 0 else 'below'} the median of all"
            )
            reasons.append(Reason(f"region {row.name}", "luminance", "noted", said, float(ratio), None))
    return reasons
