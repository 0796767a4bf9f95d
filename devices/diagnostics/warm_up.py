"""When the light is stable after switching on, at one place of the screen or at several.

The curves are those of `devices.diagnostics.settling`. The thesis read three places along the middle of the screen
(Section 3.2.1.2, Figure 3.8 [Medina2016]). Each is fitted by itself; 1 of 100 screens that warm up alike everywhere is
called different.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from devices.diagnostics.diagnosis import Cell, Check, Colour, Diagnosis, PlotAxes, Readout, Trace, numbers
from devices.diagnostics.readings import by_code, patch_name, tagged, untagged
from devices.diagnostics.settling import FEWEST_TIMES, STABLE_SHARE, Settling, place_departures, settle
from devices.readings import Measurements
from documents.arrays import Floats

WARM_UP = Check(
    "warm_up",
    "Warm-up",
    None,
    "min until stable",
    "thesis Section 3.2.1.2: stable during several measurements, taken as within 1 % of the settled light from the "
    "third last reading on",
)
# Backlights settle over minutes to an hour (thesis Figure 3.8): what stands still for less time may not have begun to.
SHORTEST_S = 300.0


@dataclass(frozen=True, slots=True, eq=False)
class _Course:
    """The readings of one patch at one ``place`` (row and column of a grid, None for no place in particular)."""

    name: str
    place: tuple[int, int] | None
    time_s: Floats
    luminance: Floats
    fit: Settling

    @property
    def label(self) -> str:
        """The patch, or the place."""
        return self.name if self.place is None else f"row {self.place[0]}, column {self.place[1]}"

    @property
    def limit_s(self) -> float:
        """When the light must be stable: at the third last reading."""
        return float(self.time_s[-3])


def warm_up(measurements: Measurements) -> Diagnosis:
    """Judge when the most often read patch was stable; it has to be before its third last reading.

    Readings over less than five minutes can show that it was not stable, but not that it was.

    Readings named ``...@warm-up`` are judged alone where there are any; of those at places of the screen
    (``...@warm-up-r2c1``) each place by itself, and whether they differ.
    """
    if measurements.time_s is None:
        return WARM_UP.unjudged("The readings carry no times (column time_s).")
    start = float(measurements.time_s.min()) if len(measurements) else 0.0
    by_place: dict[tuple[int, int], list[int]] = {}
    names: dict[tuple[int, int], str] = {}
    for row, own in tagged(measurements, "warm-up"):
        if own.parts[0]:
            place = int(own.parts[0]), int(own.parts[1])
            by_place.setdefault(place, []).append(row)
            names[place] = own.base
    if by_place:
        placed = [row for rows in by_place.values() for row in rows]
        start = float(measurements.time_s[placed].min())
        enough = {place: rows for place, rows in sorted(by_place.items()) if _suffices(measurements.time_s[rows])}
        if len(enough) < len(by_place):
            lacks = ", ".join(f"row {r}, column {c}" for r, c in by_place if (r, c) not in enough)
            return WARM_UP.unjudged(f"Read every place at least five times; too few readings at {lacks}.")
        return _judged([_course(measurements, rows, names[place], place, start) for place, rows in enough.items()])
    alone = untagged(measurements, "warm-up")
    measurements = alone if len(alone) else measurements
    groups = by_code(measurements)
    readings = max(groups.values(), key=lambda rows: (len(rows), measurements.XYZ[rows, 1].mean()), default=[])
    if measurements.time_s is None or not _suffices(measurements.time_s[readings]):
        return WARM_UP.unjudged("Read one patch, such as gray120, at least five times from switching on.")
    start = float(measurements.time_s[readings].min())
    return _judged([_course(measurements, readings, patch_name(measurements.name[readings[0]]), None, start)])


def _suffices(time_s: Floats) -> bool:
    return len(time_s) >= FEWEST_TIMES and float(np.ptp(time_s)) > 0


def _course(
    measurements: Measurements, rows: Sequence[int], name: str, place: tuple[int, int] | None, start: float
) -> _Course:
    assert measurements.time_s is not None
    order = np.argsort(measurements.time_s[list(rows)], kind="stable")
    time = measurements.time_s[list(rows)][order] - start
    luminance = measurements.XYZ[list(rows), 1][order]
    # settle counts from its first reading; at other places that is a little later than the run's.
    fit = settle(time, luminance)
    late = float(time.min())
    if late > 0 and fit.tau_s is not None:
        excess = fit.excess * float(np.exp(late / fit.tau_s))
        fit = Settling(fit.settled, excess, fit.tau_s, fit.stable_s + late if fit.stable_s > 0 else 0.0)
    return _Course(name, place, time, luminance, fit)


def _judged(courses: Sequence[_Course]) -> Diagnosis:
    slowest = max(courses, key=lambda course: (course.fit.stable_s > course.limit_s, course.fit.stable_s))
    limit, stable = slowest.limit_s / 60, slowest.fit.stable_s / 60
    longest = max(float(course.time_s[-1]) for course in courses)
    series, table = (_panel(courses),), _table(courses)
    if longest < SHORTEST_S and stable <= limit:
        why = (
            f"It is not known whether the display was warm: {len(slowest.time_s)} readings of {slowest.label} "
            f"within {longest:.3g} s, and displays change over minutes. Read one patch for at least "
            f"{SHORTEST_S / 60:g} minutes from switching on "
            "(display measure --set warm-up)."
        )
        return WARM_UP.unjudged(why, series=series, table=table)
    words = " ".join(_words(course) for course in courses)
    if len(courses) > 1:
        words += f" {_difference(courses)}"
    return WARM_UP.judged(stable, words, limit=limit, series=series, table=table)


def _words(course: _Course) -> str:
    fit = course.fit
    if fit.tau_s is None:
        where = course.name if course.place is None else f"{course.name} at {course.label}"
        return f"No change is seen in {len(course.time_s)} readings of {where}."
    begun = 100 * fit.excess / fit.settled if fit.settled else float("inf")
    begins = course.label if course.place is None else f"{course.label[0].upper()}{course.label[1:]}"
    return (
        f"{begins} began {abs(begun):.2g} % {'above' if begun > 0 else 'below'} what it settles to "
        f"({fit.settled:.4g} cd/m²), with a time constant of {fit.tau_s / 60:.3g} min, and is within 1 % of it "
        f"from {fit.stable_s / 60:.3g} min on."
    )


def _difference(courses: Sequence[_Course]) -> str:
    """Say whether the places settle differently, against the one nearest to the middle of those that were read."""
    if any(np.any(course.luminance <= 0) for course in courses):
        return "Whether places differ cannot be judged where a reading has no light."
    places = np.array([course.place for course in courses], dtype=np.float64)
    middle = int(np.argmin(np.abs(places - places.mean(axis=0)).sum(axis=1)))
    order = [courses[middle], *(course for course in courses if course is not courses[middle])]
    departures = place_departures({course.label: (course.time_s, course.luminance) for course in order})
    if not departures:
        return "The places do not differ in it."
    named = " and ".join(f"{place} by up to {departure:+.2g} %" for place, departure in departures.items())
    return (
        f"The places differ: from the course of {order[0].label}, as shares of what they settle to, departed {named}. "
        "Measure evenness and gain map when all are stable."
    )


_PLACE_COLOURS: tuple[Colour, ...] = ("ink", "accent", "soft", "grey", "red", "green", "blue")


def _panel(courses: Sequence[_Course]) -> PlotAxes:
    lines = []
    several = len(courses) > 1
    for number, course in enumerate(courses):
        smooth = np.linspace(course.time_s[0], course.time_s[-1], 200)
        # Places are not equally bright: each as a share of what it settles to.
        scale = 100 / course.fit.settled if several and course.fit.settled else 1.0
        colour = _PLACE_COLOURS[number % len(_PLACE_COLOURS)]
        lines.append(
            Trace(course.label, numbers(course.time_s / 60), numbers(scale * course.luminance), colour, "points")
        )
        fit = "fit" if not several else f"{course.label}, fit"
        drawn = colour if several else "accent"
        lines.append(Trace(fit, numbers(smooth / 60), numbers(scale * course.fit.at(smooth)), drawn, "line"))
    settled = 100.0 if several else courses[0].fit.settled
    levels = (settled * (1 - STABLE_SHARE), settled * (1 + STABLE_SHARE))
    label = "luminance, % of what it settles to" if several else "luminance, cd/m²"
    return PlotAxes("", "time from the first reading, min", label, tuple(lines), levels)


def _table(courses: Sequence[_Course]) -> Readout:
    rows: list[tuple[Cell, ...]] = []
    for course in courses:
        fit = course.fit
        tau = None if fit.tau_s is None else fit.tau_s / 60
        name = course.label if course.place is None else f"{course.name}, {course.label}"
        rows.append((name, float(len(course.time_s)), tau, fit.settled, fit.stable_s / 60))
    return Readout(("patch", "readings", "time constant, min", "settles to, cd/m²", "stable from, min"), tuple(rows))
