"""What codes pass on their way to the panel: a shortened range, too few bits, frames in turn.

All by readings of the set ``cable``, each patch read three times. An instrument sees means over many frames, so that
dithering over time whose mean is exact, and that is faster than a reading, cannot be seen here; what can be seen are
codes that have no light of their own, and readings that differ more between a panel's levels than on them.
"""

from __future__ import annotations

import numpy as np

from devices.diagnostics.diagnosis import Check, Diagnosis, PlotAxes, Readout, Trace, numbers
from devices.diagnostics.readings import tagged
from devices.readings import Measurements
from documents.arrays import Floats

NOT_MEASURED = "Not measured: use display measure --set cable."
_FULL = 255
# A code of 8 bits may be rounded to the nearest of 10: by 0.13 at most.
_NEAR = 0.2


def cable_greys(measurements: Measurements) -> dict[int, Floats]:
    """Return the luminances, shape (k,) in cd/m², of each grey of the set ``cable``, by code of 8 bits, rising."""
    found: dict[int, list[float]] = {}
    for row, own in tagged(measurements, "cable"):
        codes = _FULL * measurements.codes[row]
        code = round(float(codes[0]))
        if not own.parts[0] and np.ptp(codes) == 0 and abs(codes[0] - code) < _NEAR:
            found.setdefault(code, []).append(float(measurements.XYZ[row, 1]))
    return {code: np.array(found[code]) for code in sorted(found)}


def pooled_deviation(groups: list[Floats]) -> float:
    """Return the standard deviation of a reading within its group, from all groups; NaN where none repeats."""
    freedom = sum(len(group) - 1 for group in groups)
    scale = max((float(np.abs(group).max()) for group in groups), default=0.0) or 1.0
    squares = sum(float((((group - group.mean()) / scale) ** 2).sum()) for group in groups)
    return scale * float(np.sqrt(squares / freedom)) if freedom else float("nan")


RANGE = Check(
    "signal_range",
    "Signal range",
    8.0,
    "codes at the top with the light of full drive",
    "this project: a range of 16 to 235 that is stretched loses 20 codes at the top, a 6-bit panel with frame rate "
    "control 3",
)
_TOP_FROM, _TOP_KNEE = 215, 235
_BOTTOM_TO = 48
_ALIKE_TOP, _ALIKE_BOTTOM, _SURE = 0.35, 0.04, 3.0
_LIMITED_BOTTOM = 16


def signal_range(measurements: Measurements) -> Diagnosis:
    """Judge how many codes below full drive give its light, and say how many above 0 give that of black.

    Codes are alike where, by three standard errors, light rises by less than 35 % of what it does per code from 215 to
    235 at the top, and by less than 4 % of the rise from 0 to 48 at the bottom.
    """
    greys = cable_greys(measurements)
    if not {0, _BOTTOM_TO, _TOP_FROM, _TOP_KNEE, _FULL} <= set(greys):
        return RANGE.unjudged(NOT_MEASURED)
    light = {code: float(readings.mean()) for code, readings in greys.items()}
    top = [code for code in greys if code >= _TOP_KNEE]
    bottom = [code for code in greys if code <= _BOTTOM_TO]
    slope = (light[_TOP_KNEE] - light[_TOP_FROM]) / (_TOP_KNEE - _TOP_FROM)
    if slope <= 0:
        return RANGE.unjudged(f"Light does not rise from code {_TOP_FROM} to {_TOP_KNEE}.")
    unsure_top = _SURE * _error_of_difference([greys[code] for code in top])
    unsure_bottom = _SURE * _error_of_difference([greys[code] for code in bottom if code <= _LIMITED_BOTTOM])
    alike = {code: light[_FULL] - light[code] + unsure_top < _ALIKE_TOP * slope * (_FULL - code) for code in top}
    lost_top = max((_FULL - code for code in top if alike[code]), default=0)
    rise = light[_BOTTOM_TO] - light[0]
    lost_bottom = max((c for c in bottom if light[c] - light[0] + unsure_bottom < _ALIKE_BOTTOM * rise), default=0)
    first = next((code for code in bottom if code > lost_bottom), _BOTTOM_TO)
    alike_top = f"Codes {_FULL - lost_top} to {_FULL} give the same light" if lost_top else "Code 255 has its own light"
    words = f"{alike_top}, and light clearly rises above black from code {first} on."
    if lost_top > (RANGE.limit or 0) and lost_bottom >= _LIMITED_BOTTOM:
        words += (
            " The display takes the signal for the limited range, 16 to 235: set the same range (full, 0 to 255) in "
            "the graphics driver and in the monitor."
        )
    elif lost_top > (RANGE.limit or 0):
        words += " The monitor's contrast setting is too high, or the graphics card's table is clipped."
    elif lost_bottom >= _LIMITED_BOTTOM:
        words += " Dark codes are lost, but no bright ones: the monitor's brightness (black level) setting is low."
    white = light[_FULL]
    panels = tuple(
        PlotAxes(
            title,
            "code (0–255)",
            "luminance, % of white",
            (Trace("", numbers(codes), numbers(100 * light[code] / white for code in codes), "ink", "points"),),
        )
        for title, codes in (("near black", bottom), ("near white", [code for code in greys if code >= _TOP_FROM]))
    )
    rows = tuple((float(code), light[code], 100 * light[code] / white) for code in (*bottom, *top))
    table = Readout(("code (0–255)", "luminance, cd/m²", "% of white"), rows)
    return RANGE.judged(float(lost_top), words, series=panels, table=table)


def _error_of_difference(groups: list[Floats]) -> float:
    """Return the standard error of the difference of two means, 0 where nothing repeats."""
    deviation = pooled_deviation(groups)
    count = min(len(group) for group in groups)
    return float(np.sqrt(2 / count)) * deviation if np.isfinite(deviation) else 0.0


STEPS = Check(
    "code_steps",
    "Steps of successive codes",
    1.0,
    "of the steps missing or doubled",
    "this project: a code's own light is what a model gives it; by noise alone, where it is judged, fewer than one "
    "display in a hundred has two such steps",
)
_FEWEST_CODES = 12
_LARGEST_ERROR = 0.2
_SIX_BITS, _SEVEN_BITS = 0.6, 0.35


def code_steps(measurements: Measurements) -> Diagnosis:
    """Judge how many of the steps between successive codes are under half or over one and a half of a code.

    A step's size in codes is its light over the slope of a parabola through all of them.
    """
    greys = cable_greys(measurements)
    codes = _successive(greys)
    if len(codes) < _FEWEST_CODES:
        return STEPS.unjudged(NOT_MEASURED)
    if min(float(greys[code].mean()) for code in codes) <= 0:
        return STEPS.unjudged(f"Some code from {codes[0]} to {codes[-1]} gives no light.")
    deviation = pooled_deviation([greys[code] / greys[code].mean() for code in codes])
    light = np.array([greys[code].mean() for code in codes])
    at = np.array(codes, dtype=np.float64)
    fit = np.polynomial.Polynomial.fit(at, light, 2)
    slope = np.asarray(fit.deriv()((at[1:] + at[:-1]) / 2))
    if not np.isfinite(deviation):
        return STEPS.unjudged("Each code was read once: how sure a step is, only repeats can say (--set cable).")
    if np.any(slope <= 0):
        return STEPS.unjudged("Light does not rise with these codes.")
    count = min(len(greys[code]) for code in codes)
    error = float(np.sqrt(2 / count) * deviation * light.mean() / slope.mean())
    if error > _LARGEST_ERROR:
        return STEPS.unjudged(
            f"Repeated readings differ by {100 * deviation:.2g} %, so that a step of one code "
            f"({100 * slope.mean() / light.mean():.2g} % of light) is known to {error:.2g} of a code only. Let the "
            "instrument measure longer, or read more repeats."
        )
    steps = np.diff(light) / slope
    missing, doubled = int((steps < 0.5).sum()), int((steps > 1.5).sum())
    words = f"Of {len(steps)} steps {missing} are missing and {doubled} are doubled or larger."
    if missing + doubled > (STEPS.limit or 0):
        words += f" {_cause(missing, doubled, len(steps))}"
    panels = (
        PlotAxes(
            "",
            "code (0–255)",
            "step from the code before, codes",
            (Trace("", numbers(at[1:]), numbers(steps), "ink", "points"),),
            (0.5, 1.5),
        ),
    )
    rows = tuple((f"{low} to {low + 1}", f"{step:.2f}") for low, step in zip(codes, steps, strict=False))
    return STEPS.judged(float(missing + doubled), words, series=panels, table=Readout(("codes", "step, codes"), rows))


def _cause(missing: int, doubled: int, count: int) -> str:
    if missing >= _SIX_BITS * count:
        return (
            "Codes come in fours: 6 bits reach the eye. Set 8 or 10 bits a channel in the graphics driver; if it is so "
            "already, the panel has 6."
        )
    if missing >= _SEVEN_BITS * count:
        return "Codes come in pairs: 7 bits reach the eye."
    if not doubled:
        return (
            "About one code in seven has no light of its own, as where the graphics card sends the limited range, 16 "
            "to 235: set full range (0 to 255) in its driver and in the monitor. A table of 8 bits does the same."
        )
    if not missing:
        return (
            "Some steps are doubled, as where the monitor stretches the limited range, 16 to 235: set full range (0 to "
            "255) in it and in the graphics driver."
        )
    return "A table of 8 bits, of the graphics card or of the monitor's picture settings, moves codes to others."


def _successive(greys: dict[int, Floats]) -> list[int]:
    """Return the longest run of codes that follow each other."""
    longest: list[int] = []
    run: list[int] = []
    for code in greys:
        run = [*run, code] if run and code == run[-1] + 1 else [code]
        longest = run if len(run) > len(longest) else longest
    return longest


LAST = Check(
    "last_codes",
    "Last three codes",
    0.3,
    "of the rise before them",
    "this project: a panel of 6 bits with frame rate control over four frames has 253 levels, and rises by 0; a gamma "
    "of 1.8 to 2.4 rises by 1.0",
    at_least=True,
)
_LAST_FROM, _LAST_LEVEL = 243, 252
_LARGEST_SHARE_ERROR = 0.2


def last_codes(measurements: Measurements) -> Diagnosis:
    """Judge how much light rises over codes 253, 254 and 255, against the slope from 243 to 252."""
    greys = cable_greys(measurements)
    before = [code for code in greys if _LAST_FROM <= code <= _LAST_LEVEL]
    last = [code for code in greys if code > _LAST_LEVEL]
    if len(before) < 4 or len(last) < 3 or _LAST_LEVEL not in before:
        return LAST.unjudged(NOT_MEASURED)
    light = {code: float(greys[code].mean()) for code in (*before, *last)}
    slope, level = np.polyfit(np.array(before, dtype=np.float64) - _LAST_LEVEL, [light[code] for code in before], 1)
    deviation = pooled_deviation([greys[code] for code in (*before, *last)])
    if not np.isfinite(deviation):
        return LAST.unjudged("Each code was read once: how sure a rise is, only repeats can say (--set cable).")
    count = min(len(greys[code]) for code in (*before, *last))
    usual = slope * float(np.mean([code - _LAST_LEVEL for code in last]))
    if usual <= 0 or 2 * slope * (_LAST_LEVEL - _LAST_FROM) < _SURE * deviation:
        return LAST.unjudged(f"Light does not rise from code {_LAST_FROM} to {_LAST_LEVEL} either: see Signal range.")
    error = deviation / np.sqrt(count) * np.sqrt(1 / len(last) + 1 / len(before)) / usual
    if error > _LARGEST_SHARE_ERROR:
        why = "a reading's noise hides it; let the instrument measure longer"
        return LAST.unjudged(f"The rise over the last codes is known to {error:.2g} of it only: {why}.")
    rise = (float(np.mean([light[code] for code in last])) - level) / usual
    words = f"Over codes 253 to 255 light rises by {rise:.2g} of what the slope before them gives."
    if rise < (LAST.limit or 0):
        words += (
            " The last codes are alike, as on panels of 6 bits with frame rate control, which have 253 levels. Their "
            "means are right elsewhere; keep full drive out of what is compared."
        )
    every = [*before, *last]
    panel = PlotAxes(
        "",
        "code (0–255)",
        "luminance, cd/m²",
        (
            Trace("read", numbers(every), numbers(light[code] for code in every), "ink", "points"),
            Trace(
                "slope before",
                numbers(every),
                numbers(level + slope * (c - _LAST_LEVEL) for c in every),
                "accent",
                "dashed",
            ),
        ),
    )
    return LAST.judged(float(rise), words, series=(panel,))


FRAMES = Check(
    "frame_rate_control",
    "Spread between a panel's levels",
    1.0,
    "times the spread on its levels (lower bound, 99.9 %)",
    "this project: by an F test of the repeats, corrected for the four places where levels of 6 bits can lie",
)
_CERTAIN = 1e-3
_STEP = 4


def frame_rate_control(measurements: Measurements) -> Diagnosis:
    """Judge whether readings of codes between levels of 6 bits differ more from repeat to repeat than those on them.

    The value is the lower bound of the ratio of the standard deviations.
    """
    greys = cable_greys(measurements)
    codes = [code for code in _successive(greys) if len(greys[code]) > 1]
    if len(codes) < _FEWEST_CODES:
        return FRAMES.unjudged(NOT_MEASURED)
    if min(float(greys[code].mean()) for code in codes) <= 0:
        return FRAMES.unjudged(f"Some code from {codes[0]} to {codes[-1]} gives no light.")
    from scipy.stats import f as f_distribution

    relative = {code: greys[code] / greys[code].mean() - 1 for code in codes}
    found = []
    for place in range(_STEP):
        on = [relative[code] for code in codes if code % _STEP == place]
        between = [relative[code] for code in codes if code % _STEP != place]
        freedom = [sum(len(group) - 1 for group in groups) for groups in (between, on)]
        largest = f_distribution.isf(_CERTAIN / _STEP, *freedom)
        own, others = pooled_deviation(on), pooled_deviation(between)
        found.append((others / own / float(np.sqrt(largest)) if own > 0 else 0.0, place, own, others))
    value, place, own, others = max(found)
    levels = f"{place}, {place + _STEP}, {place + 2 * _STEP} ..."
    words = f"Readings of codes {levels} vary by {100 * own:.2g} %, those of the codes between by {100 * others:.2g} %."
    if value > (FRAMES.limit or 0):
        words += (
            " The panel, or the graphics card, alternates between levels of 6 bits, and a reading catches part of it: "
            "let the instrument measure over more frames, and synchronise it."
        )
    else:
        words += " Dithering that is faster than a reading, with exact means, cannot be seen by an instrument."
    spread = [100 * float(np.sqrt((relative[code] ** 2).sum() / (len(relative[code]) - 1))) for code in codes]
    panel = PlotAxes(
        "",
        "code (0–255)",
        "standard deviation of a reading, %",
        (Trace("", numbers(codes), numbers(spread), "ink", "points"),),
    )
    return FRAMES.judged(value, words, series=(panel,))
