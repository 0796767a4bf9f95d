"""How a display's light drifted during a run, from patches that were read again and again, and readings put right.

The thesis measured black and white throughout its run for this (Section 3.2.1). Light above black is multiplied by
g(t), one number or one for each channel, and black by itself is what its own repeats show:

    XYZ(t) = B(t) + M · diag(g(t)) · M⁻¹ · (XYZ − B)

so that both a backlight, which takes black with it, and light that is added to everything are followed. Each of g, the
balance of the channels and B is a smooth function of time by `devices.diagnostics.time_trend`, and constant where that
finds no trend: with noise alone anything at all is corrected in 12 of 1000 simulated runs. Readings are brought to the
end of the run, which is nearest to what is shown afterwards.

The checks of it are here too: drift, and repeatability, which is taken from successive differences, so that a slow
drift does not count: their mean square is twice the variance of a single reading [Neumann1941].
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from devices.diagnostics.diagnosis import Check, Diagnosis, PlotAxes, Readout, Trace, numbers
from devices.diagnostics.readings import brightest, by_code, patch_name, primaries
from devices.diagnostics.time_trend import TimeTrend, trend_in_time
from devices.readings import Measurements
from documents.arrays import Floats

# How often noise alone may pass for a drift of light, of a channel's balance (of two), and of black: together 1 %. It
# did in 112 of 9000 simulated runs.
_LIGHT, _BALANCE, _BLACK = 0.005, 0.00125, 0.0025
# A patch shows drift if its readings are spread over this share of the run.
_LEAST_SPAN = 1.0 / 3.0
# Relative noise grows towards black: of the repeated patches those count that are this bright, else the brightest.
_BRIGHT_SHARE = 0.1
_LIT_SHARE = 0.05
_MOST_CONDITION = 1e4

BlackKind = Literal["measured", "constant", "with the light"]


@dataclass(frozen=True, slots=True, eq=False)
class Drift:
    """The drift of a run; ``light`` is of the logarithm of luminance above black, None where none is seen.

    ``balance``: of the logarithms of red's and blue's light to green's, each None where none is seen. ``black``: of X,
    Y and Z of black in the readings' unit, three or none. ``black_XYZ``: black at the end of the run. ``matrix``: XYZ
    of the channels at full drive above black, (3, 3), or None. ``repeats``: how many readings it rests on. ``timed``:
    whether the readings carry times; where not, their order stands for them.
    """

    light: TimeTrend | None
    balance: tuple[TimeTrend | None, TimeTrend | None]
    black: tuple[TimeTrend | None, ...]
    black_kind: BlackKind
    black_XYZ: Floats
    matrix: Floats | None
    repeats: int
    start: float
    end: float
    timed: bool

    @property
    def seen(self) -> bool:
        """Whether any drift is seen."""
        return self.light is not None or any(self.balance) or bool(self.black)

    @property
    def change_percent(self) -> float:
        """Light at the end of the run above that at its beginning, in % of the latter."""
        return 100.0 * float(1.0 / self.gains([self.start])[0] - 1.0)

    @property
    def range_percent(self) -> float:
        """The largest luminance during the run above the smallest, in % of the latter."""
        gains = self.gains(np.linspace(self.start, self.end, 201))
        return 100.0 * float(gains.max() / gains.min() - 1.0)

    def gains(self, time: ArrayLike) -> Floats:
        """Return light above black at times (n,) as a share of that at the end of the run, shape (n,)."""
        when = np.asarray(time, dtype=np.float64)
        if self.light is None:
            return np.ones_like(when)
        return np.asarray(np.exp(self.light.at(when) - self.light.at([self.end])[0]))

    def channel_gains(self, time: ArrayLike) -> Floats:
        """Return each channel's light at times (n,) as a share of that at the end, shape (n, 3)."""
        when = np.asarray(time, dtype=np.float64)
        shares = np.ones((len(when), 3))
        for channel, trend in zip((0, 2), self.balance, strict=True):
            if trend is not None:
                shares[:, channel] = np.exp(trend.at(when) - trend.at([self.end])[0])
        if self.matrix is not None:
            luminance = self.matrix[1] / self.matrix[1].sum()
            shares /= (shares @ luminance)[:, None]
        return shares * self.gains(when)[:, None]

    def black_at(self, time: ArrayLike) -> Floats:
        """Return what is added to light above black at times (n,), XYZ (n, 3)."""
        count = len(np.asarray(time))
        if self.black_kind == "with the light":
            return np.zeros((count, 3))
        if not self.black:
            return np.tile(self.black_XYZ, (count, 1))
        changes = [np.zeros(count) if t is None else t.at(time) - t.at([self.end])[0] for t in self.black]
        return np.stack(changes, axis=1) + self.black_XYZ

    def corrected(self, measurements: Measurements) -> Measurements:
        """Return ``measurements`` of the same run, XYZ and spectra as they would have been read at its end."""
        if not self.seen:
            return measurements
        time = _times(measurements)
        above = measurements.XYZ - self.black_at(time)
        if self.matrix is None or not any(self.balance):
            light = above / self.gains(time)[:, None]
        else:
            light = (above @ np.linalg.inv(self.matrix).T / self.channel_gains(time)) @ self.matrix.T
        XYZ = light + self.black_at([self.end])
        spectra = measurements.spectra
        if spectra is not None:
            lit = measurements.XYZ[:, 1] > 0
            share = np.where(lit, XYZ[:, 1] / np.where(lit, measurements.XYZ[:, 1], 1.0), 1.0)
            spectra = spectra * share[:, None]
        return replace(measurements, XYZ=XYZ, spectra=spectra)

    @property
    def words(self) -> str:
        """What was found and what it does to the error of repeated readings, in a sentence; empty without drift."""
        parts = []
        over = f"{(self.end - self.start) / 60:.3g} minutes" if self.timed else "the run (no times were kept)"
        if self.light is not None:
            change, most = self.change_percent, self.range_percent
            words = f"light {'rose' if change > 0 else 'fell'} by {abs(change):.2g} % over {over}"
            if most > 1.2 * abs(change):
                words += f", and was {most:.2g} % brighter at one time than at another"
            before, after = 100 * self.light.error_before, 100 * self.light.error_after
            parts.append(f"{words}: the error of repeated readings falls from {before:.2g} % to {after:.2g} %")
        if any(self.balance):
            shift = 100.0 * (self.channel_gains([self.start])[0] / self.gains([self.start])[0] - 1.0)
            names = ", ".join(
                f"{name} {value:+.2g} %" for name, value in zip(("red", "green", "blue"), -shift, strict=True)
            )
            parts.append(f"the channels' share of white changed ({names})")
        if self.black:
            change_cd = float(self.black_at([self.end])[0, 1] - self.black_at([self.start])[0, 1])
            parts.append(f"black {'rose' if change_cd > 0 else 'fell'} by {abs(change_cd):.2g} cd/m²")
        return "; ".join(parts)

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON: what was found, in numbers and in words."""
        return {
            "words": self.words,
            "change_percent": self.change_percent,
            "range_percent": self.range_percent,
            "repeated_readings": self.repeats,
            "repeat_error_percent": None if self.light is None else 100 * self.light.error_before,
            "repeat_error_corrected_percent": None if self.light is None else 100 * self.light.error_after,
        }


def estimate_drift(measurements: Measurements) -> Drift:
    """Return the drift that the plain readings of patches read more than once show.

    Parameters
    ----------
    measurements
        Readings of one run in the order in which they were taken, XYZ in any unit.

    Returns
    -------
    Drift
        What changed, with `Drift.seen` False where repeats are too few or agree within noise.
    """
    time = _times(measurements)
    start, end = (float(time.min()), float(time.max())) if len(time) else (0.0, 0.0)
    timed = measurements.time_s is not None
    groups = [rows for rows in by_code(measurements).values() if _spread(time[rows], end - start)]
    Y = measurements.XYZ[:, 1]
    dark_rows = [row for code, rows in by_code(measurements).items() if max(code) == 0 for row in rows]
    black = measurements.XYZ[dark_rows].mean(axis=0) if dark_rows else np.zeros(3)
    light_groups = [rows for rows in groups if np.all(Y[rows] > 2 * black[1])]
    most = max((float(Y[rows].mean()) for rows in light_groups), default=0.0)
    bright = [rows for rows in light_groups if Y[rows].mean() >= _BRIGHT_SHARE * most]
    nothing = Drift(None, (None, None), (), "with the light", black, None, 0, start, end, timed)
    if not bright:
        return nothing
    member = np.concatenate([np.full(len(rows), number) for number, rows in enumerate(bright)])
    row = np.concatenate([np.asarray(rows) for rows in bright])
    dark = next((rows for rows in groups if np.all(measurements.codes[rows] == 0)), None)

    def light_above(added: Floats) -> TimeTrend | None:
        return trend_in_time(time[row], np.log(Y[row] - added[:, 1]), member, _LIGHT)

    first = replace(nothing, light=light_above(np.zeros((len(row), 3))), repeats=len(row))
    found = _with_black(first, measurements, time, dark, black)
    if found.black_kind != "with the light":
        found = replace(found, light=light_above(found.black_at(time[row])))
    return _with_balance(found, measurements, time, bright)


def _with_black(drift: Drift, measurements: Measurements, time: Floats, dark: list[int] | None, black: Floats) -> Drift:
    """Return ``drift`` with black as its repeats show it: as it was read, constant, or in proportion to light."""
    if dark is None:
        return drift
    when, XYZ = time[dark], measurements.XYZ[dark]
    one_patch = np.zeros(len(dark), dtype=np.intp)
    scaled = XYZ[:, 1] / drift.gains(when)
    if trend_in_time(when, scaled, one_patch, _BLACK) is not None:
        trends = tuple(trend_in_time(when, XYZ[:, axis], one_patch, 1.0) for axis in range(3))
        at_end = [
            float(XYZ[:, axis].mean())
            if trend is None
            else float(np.mean(XYZ[:, axis] - trend.at(when)) + trend.at([drift.end])[0])
            for axis, trend in enumerate(trends)
        ]
        return replace(drift, black=trends, black_kind="measured", black_XYZ=np.array(at_end))
    if not XYZ[:, 1].mean() > 0.0:  # black without light, as of an OLED, says nothing
        return drift
    spread, spread_scaled = (float(np.std(values) / np.mean(values)) for values in (XYZ[:, 1], scaled))
    return replace(drift, black_kind="constant", black_XYZ=black) if spread < spread_scaled else drift


def _with_balance(drift: Drift, measurements: Measurements, time: Floats, bright: list[list[int]]) -> Drift:
    """Return ``drift`` with the trends of the channels' balance, where patches of all three were repeated."""
    matrix, _ = primaries(measurements)
    if matrix is None or not np.linalg.cond(matrix) < _MOST_CONDITION:
        return drift
    light = (measurements.XYZ - drift.black_XYZ) @ np.linalg.inv(matrix).T
    mixed = [rows for rows in bright if np.all(light[rows] > _LIT_SHARE * light[rows].max())]
    if not mixed:
        return drift
    rows = np.concatenate([np.asarray(group) for group in mixed])
    member = np.concatenate([np.full(len(group), number) for number, group in enumerate(mixed)])
    logs = np.log(light[rows])
    red, blue = (trend_in_time(time[rows], logs[:, i] - logs[:, 1], member, _BALANCE) for i in (0, 2))
    return replace(drift, balance=(red, blue), matrix=matrix)


def _times(measurements: Measurements) -> Floats:
    if measurements.time_s is not None:
        return np.asarray(measurements.time_s)
    return np.arange(float(len(measurements)))


def _spread(times: Floats, run: float) -> bool:
    return len(times) > 1 and run > 0 and float(np.ptp(times)) >= _LEAST_SPAN * run


REPEATABILITY = Check(
    "repeatability",
    "Repeatability",
    0.5,
    "% of luminance",
    "this project: 0.5 % is ΔE00 0.1 at white, a fifth of what a fitted model may err by on average",
)
_FEWEST_DIFFERENCES = 3
_DARKEST_SHARE = 0.01


def repeatability(measurements: Measurements) -> Diagnosis:
    """Judge the standard deviation of luminance between readings of one code, in % of it, pooled over codes.

    Codes darker than 1 % of the brightest reading are left out; three differences are the least to judge by.
    """
    bright = brightest(measurements)
    squares: list[float] = []
    lines, rows = [], []
    for code, readings in by_code(measurements).items():
        luminance = measurements.XYZ[readings, 1]
        if len(readings) < 2 or luminance.mean() <= _DARKEST_SHARE * bright:
            continue
        relative = 100 * (luminance / luminance.mean() - 1)
        steps = np.diff(relative)
        squares += list(steps**2 / 2)
        name = patch_name(measurements.name[readings[0]])
        lines.append(Trace(name, numbers(range(2, len(readings) + 1)), numbers(steps), "ink", "points"))
        words = " ".join(f"{round(255 * part)}" for part in code)
        rows.append((name, words, float(len(readings)), float(np.sqrt(np.mean(steps**2) / 2))))
    if len(squares) < _FEWEST_DIFFERENCES:
        return REPEATABILITY.unjudged("Read a bright patch such as white at least four times in the course of a run.")
    value = float(np.sqrt(np.mean(squares)))
    panel = PlotAxes("", "reading of the patch", "change from the reading before, %", tuple(lines))
    rows.sort(key=lambda row: -float(row[3]))
    table = Readout(("patch", "code (0–255)", "readings", "standard deviation, %"), tuple(rows[:12]))
    words = (
        f"Readings of one patch differ with a standard deviation of {value:.2g} %, from {len(squares)} repeats of "
        f"{len(rows)} patch{'' if len(rows) == 1 else 'es'}."
    )
    return REPEATABILITY.judged(value, words, series=(panel,), table=table)


DRIFT = Check(
    "drift",
    "Drift during the run",
    1.0,
    "% of luminance",
    "this project: 1 % is ΔE00 0.2 at white; readings of one colour must not depend on when they were taken",
)
_FEWEST_CODES = 4
_FEWEST_READINGS = 3


def drift(measurements: Measurements) -> Diagnosis:
    """Judge how much luminance changed during the run, in %, by the smooth drift that repeated readings show.

    Where none is seen beyond noise, by one slope for all codes from the first to the last repeated reading. Codes
    darker than 1 % of the brightest are left out. Where no times were kept, the order of the readings counts.
    """
    groups = by_code(measurements)
    if len(groups) < _FEWEST_CODES:
        return DRIFT.unjudged("These readings are no characterisation: fewer than four colours were read.")
    timed = measurements.time_s is not None
    time = measurements.time_s / 60 if measurements.time_s is not None else np.arange(1.0, len(measurements) + 1)
    bright = brightest(measurements)
    ahead, beyond, change = [], [], []
    lines = []
    for readings in groups.values():
        luminance = measurements.XYZ[readings, 1]
        if len(readings) < 2 or luminance.mean() <= _DARKEST_SHARE * bright:
            continue
        when = time[readings]
        relative = 100 * (luminance / luminance.mean() - 1)
        ahead += list(when)
        beyond += list(when - when.mean())
        change += list(relative)
        lines.append(
            Trace(patch_name(measurements.name[readings[0]]), numbers(when), numbers(relative), "ink", "points")
        )
    span = float(np.ptp(ahead)) if ahead else 0.0
    if len(ahead) < _FEWEST_READINGS or span <= 0:
        return DRIFT.unjudged("Read white at least three times in the course of a run, the first and last far apart.")
    slope = float(np.dot(beyond, change) / np.dot(beyond, beyond))
    total = slope * span
    middle = (min(ahead) + max(ahead)) / 2
    ends = np.array([min(ahead), max(ahead)])
    trend = Trace("trend", numbers(ends), numbers(slope * (ends - middle)), "accent", "line")
    label = "time, min" if timed else "reading"
    panel = PlotAxes("", label, "luminance from its mean, %", (*lines, trend), (-0.5, 0.5))
    over = f"{span:.3g} minutes" if timed else f"{span:.0f} readings (no times were kept)"
    words = f"Repeated patches {'rose' if total > 0 else 'fell'} by {abs(total):.2g} % over {over}."
    found = estimate_drift(measurements)
    if not found.seen:
        return DRIFT.judged(abs(total), words, series=(panel,))
    smooth = np.linspace(found.start, found.end, 200)
    course = 100 * (found.gains(smooth) / found.gains(smooth).mean() - 1)
    curve = Trace("trend", numbers(smooth / 60 if timed else smooth + 1), numbers(course), "accent", "line")
    panel = PlotAxes("", label, "luminance from its mean, %", (*lines, curve), (-0.5, 0.5))
    value = found.range_percent if found.light is not None else abs(total)
    words = f"{found.words[0].upper()}{found.words[1:]}. display fit corrects the readings by this."
    return DRIFT.judged(value, words, series=(panel,))
