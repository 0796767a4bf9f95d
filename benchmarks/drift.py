"""A drift of 13 % during a run taken off by the repeated patches: run time against what is left of it.

The plain ways are beside it: a straight line through the whites' luminance, and interpolation from white to white.
Noise is 0.2 %, so that 0.2 % is what a perfect correction leaves.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from curves import program, seconds, sized
from promises import Promise

from devices.characterise import table_c1_codes, thesis_display
from devices.diagnostics import estimate_drift
from devices.readings import Measurements
from documents.arrays import Floats

RUNS = sized(50, 1)
COURSES: Mapping[str, Callable[[Floats], Floats]] = {
    "no drift": np.ones_like,
    "a line of 13 %": lambda t: 1 + 0.13 * t,
    "settling by 13 %": lambda t: 1 - 0.13 * np.exp(-t / 0.2),
    "a wave of 6 %": lambda t: 1 + 0.03 * np.sin(5 * t),
}


def readings(course: Callable[[Floats], Floats], seed: int) -> tuple[Measurements, Floats]:
    """Return Table C.1 in random order, white and black after every twelve patches, and luminance as at the end."""
    noise = np.random.default_rng(seed)
    order = noise.permutation(table_c1_codes())
    codes = np.concatenate([np.concatenate([np.ones((1, 3)), np.zeros((1, 3)), p]) for p in np.split(order, 10)])
    codes = np.concatenate([codes, np.ones((1, 3)), np.zeros((1, 3))])
    time = np.linspace(0.0, 1.0, len(codes))
    exact = thesis_display().xyz(codes) + 0.02
    scatter = 1 + 0.002 * noise.standard_normal((len(codes), 1))
    XYZ = exact * course(time)[:, None] * scatter
    return Measurements(codes, XYZ, time_s=1800 * time), exact[:, 1] * course(np.ones(1))


def straight(table: Measurements) -> Measurements:
    """Return ``table`` divided by a straight line through the whites."""
    return _divided(table, lambda when, time, light: np.polyval(np.polyfit(when, light, 1), time))


def interpolated(table: Measurements) -> Measurements:
    """Return ``table`` divided by the whites, interpolated in time."""
    return _divided(table, lambda when, time, light: np.interp(time, when, light))


def _divided(table: Measurements, curve: Callable[[Floats, Floats, Floats], Floats]) -> Measurements:
    assert table.time_s is not None
    white = np.flatnonzero(np.all(table.codes == 1, axis=1))
    light = curve(table.time_s[white], table.time_s, table.XYZ[white, 1])
    return replace(table, XYZ=table.XYZ * (light[-1] / light)[:, None])


def smooth(table: Measurements) -> Measurements:
    """Return ``table`` corrected by the drift that cross-validation prefers."""
    return estimate_drift(table).corrected(table)


def _beside(ours: Floats, theirs: Floats) -> tuple[float, float]:
    """Return the ratio of the mean errors (runs,) of the same runs, and its standard error."""
    ratio = ours.mean() / theirs.mean()
    scatter = (ours - ratio * theirs).std(ddof=1) if len(ours) > 1 else 0.0
    return float(ratio), float(scatter / np.sqrt(len(ours)) / theirs.mean())


def run() -> dict[str, object]:
    """Return for each course and way the time and the root mean square error of luminance left, in %."""
    rows: list[dict[str, object]] = []
    left: dict[tuple[str, str], Floats] = {}
    ways: Mapping[str, Callable[[Measurements], Measurements]] = {
        "none": lambda table: table,
        "a line through the whites": straight,
        "from white to white": interpolated,
        "cross-validated": smooth,
    }
    for name, course in COURSES.items():
        tables = [readings(course, seed) for seed in range(RUNS)]
        for way, correct in ways.items():
            errors: list[float] = []
            for table, truth in tables:
                found = correct(table).XYZ[:, 1]
                errors.append(100 * float(np.sqrt(np.mean((found / truth - 1) ** 2))))
            one = tables[0][0]
            rows.append(
                {
                    "series": name,
                    "parameter": way,
                    "seconds": seconds(lambda one=one, correct=correct: correct(one), repeats=5),
                    "error": float(np.mean(errors)),
                    "note": f"largest of {RUNS} runs {max(errors):.2f} %",
                }
            )
            left[name, way] = np.array(errors)
    beside = {name: _beside(left[name, "cross-validated"], left[name, "from white to white"]) for name in COURSES}
    what = "what is left of a drift, beside interpolation from white to white"
    promises = [
        Promise(what, float(np.mean([ratio for ratio, _ in beside.values()])), 1.0, "share", unit="×"),
        Promise(
            "the same in the worst of the courses, two standard errors off",
            max(ratio - 2 * error for ratio, error in beside.values()),
            1.0,
            "share",
            unit="×",
        ),
    ]
    return {
        "title": "Drift during a run: run time against luminance's error, in %",
        "rows": rows,
        "promises": promises,
    }


if __name__ == "__main__":
    program("drift", run)
