"""What is fitted to readings of a display: models, drift, the cable's path, gamma tables, profiles, thesis's methods.

Display models fitted to 120 patches: run time against held-out error, on three displays.

A drift of 13 % during a run taken off by the repeated patches: run time against what is left of it.

The plain ways are beside it: a straight line through the whites' luminance, and interpolation from white to white.
Noise is 0.2 %, so that 0.2 % is what a perfect correction leaves.

What stands between codes and light, found from the set ``cable``, beside plain rules.

Dynamic contrast: a backlight that adds 0 or 5 % to patches on white, with up to 1 % of the surround's light as stray
light; the error is that of the change found, in % of a patch's own light. The plain rule is the largest change of any
patch. Successive codes: panels of 8 and of 6 bits, read with noise; the error is how many of the 16 steps are taken for
what they are not. The plain rule calls two codes alike that differ by less than three standard errors.

Whether two gamma tables are the same, when drivers round them: wrong verdicts beside those of simpler rules.

A table is drawn (the identity, a power, a night light, a calibration with ripples) and read back by a driver of 256,
1024 or 4096 entries of 8, 10, 12 or 16 bits, cut or rounded, and written to 16 bits in one of three ways. The error is
the share of wrong verdicts: tables refused that another driver returned of the same, or changes of 1, 2 or 4 codes of 8
bits missed. What is wrongly refused is read by drivers of one size and number of bits: one cuts, the other rounds.
Under Xvfb it also times what a session does at each answer: to read the table of its monitor.

ICC profiles and `.cube` tables of a display: time to make one against the error of its light, by LittleCMS.

Two of the thesis's own methods beside plain libraries: the curves of a display, and contrast over exposure.

Curves: the second method's GOG of three channels from the ramps of Table C.1 with 0.2 % of noise, beside SciPy's
``curve_fit``; the error is the mean one of gamma over 20 noises. Contrast: sparkles of known contrast on a background
that falls off across the picture, at three exposures, beside a median filter over every pixel (SciPy); the error is
that of the mean Weber contrast of the shortest exposure.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from curves import Row, answer_and_seconds, is_quick, program, row, seconds, sized, times_faster
from numpy.typing import NDArray
from promises import Promise, worst
from scipy.ndimage import median_filter
from scipy.optimize import curve_fit

from devices.characterise import parametric
from devices.characterise.channel_fit import fit_channels
from devices.characterise.choose import characterise
from devices.characterise.cross_validation import PARAMETRIC
from devices.characterise.parametric import fit_parametric
from devices.characterise.patches import patches
from devices.characterise.residual_fit import fit_residual
from devices.characterise.table_fit import fit_plvc, fit_table
from devices.characterise.thesis import THESIS_CURVES, table_c1_codes, thesis_display
from devices.colour import delta_e_2000, lab_to_xyz, xyz_to_lab
from devices.diagnostics import estimate_drift
from devices.diagnostics.content import dynamic_contrast
from devices.diagnostics.panel import pixel_independence
from devices.diagnostics.signal_path import cable_greys, code_steps
from devices.display import GammaTable
from devices.display.curves import ToneCurve
from devices.display.model import DisplayModel
from devices.profiles import model_of_profile
from devices.profiles.colour_table import between
from devices.profiles.profile import profile_of
from devices.profiles.tag_table import parse_profile_file
from devices.readings import Measurements, PatchOnScreen, find_sets, read_csv, steps
from devices.readings.simulated import Faults, Simulated
from documents.arrays import Floats
from extensions.profiles import CubeInput, ProfileKind, WrittenProfile, cube_of_model, profile_of_model
from extensions.sparkle import contrast_over_exposure
from stimuli.pictures import StereoImage
from tests.devices.profiles.little_cms import through
from tests.devices.profiles.profile_bytes import plvc_display
from tests.example_displays import liquid_crystal_XYZ, noisy

CRT = Path(os.environ.get("CYCLOPEAN_SHARED_DATA", "")) / "data" / "displays" / "apple17_crt_2000.csv"


def models() -> dict[str, object]:
    """Time each fit by itself, and the whole choice; the error is the mean held-out ΔE00."""
    codes = table_c1_codes()
    displays = {
        "the thesis's": Measurements(codes, noisy(thesis_display().xyz(codes), 0.002, 1)),
        "a liquid crystal one": Measurements(codes, noisy(liquid_crystal_XYZ(codes), 0.002, 1)),
    }
    if CRT.exists() and not is_quick():
        displays["a real CRT"] = read_csv(CRT)
    if is_quick():
        displays = {name: displays[name] for name in ("a liquid crystal one",)}
    rows = [row for display, readings in displays.items() for row in _model_rows(display, readings)]
    rows += _solver_rows(displays["a liquid crystal one"])
    simulated = [row for row in rows if "chosen" in row and row["series"] != "a real CRT"]
    whole_s = worst(rows, "seconds", parameter="all, cross-validated")
    promises = [
        Promise("mean held-out ΔE00 of the chosen model", worst(simulated, "chosen"), 0.5, "error"),
        Promise("95th percentile of it", worst(simulated, "p95"), 1.0, "error"),
        Promise("six models of 120 patches, cross-validated", whole_s, 2.0, "seconds", unit="s"),
    ]
    return {"title": "Display models: run time against held-out ΔE00", "rows": rows, "promises": promises}


def _model_rows(display: str, readings: Measurements) -> list[dict[str, object]]:
    found, whole_s = answer_and_seconds(lambda: characterise(readings), repeats=5)
    data = found.patches
    begin, _ = fit_parametric(data, "gogo")
    tables = fit_table(data, begin.model)
    fits: dict[str, Callable[[], object]] = {kind: partial(fit_parametric, data, kind) for kind in PARAMETRIC}
    fits |= {"table": partial(fit_table, data, begin.model), "plvc": partial(fit_plvc, data, tables)}
    plvc, count, _ = fit_plvc(data, tables)
    fits["residual"] = partial(fit_residual, data, plvc, count)
    rows: list[dict[str, object]] = []
    for candidate in found.candidates:
        held = candidate.held_out
        chosen = "chosen; " if candidate is found.chosen else ""
        rows.append(
            row(
                display,
                candidate.name,
                seconds(fits[candidate.name], repeats=5),
                held.mean,
                p95=held.p95 if chosen else 0.0,
                chosen=held.mean if chosen else 0.0,
                note=f"{chosen}p95 {held.p95:.2f}, largest {held.max:.2f}, dark third {held.dark_mean:.2f}",
            )
        )
    rows.append(
        row(
            display,
            "all, cross-validated",
            whole_s,
            found.chosen.held_out.mean,
            note=f"{len(data)} patches, {len(found.candidates)} models, {found.folds} folds",
        )
    )
    return rows


def _solver_rows(readings: Measurements) -> list[dict[str, object]]:
    """Time the solver of the GOGO fit beside SciPy's; the error is the largest difference of a number."""
    from scipy.optimize import least_squares

    data = patches(readings.codes, readings.XYZ)
    problem = parametric._Problem(data, "gogo")
    exact = {"xtol": 1e-14, "ftol": 1e-14, "gtol": 1e-14}

    def slow() -> NDArray[np.float64]:
        found = least_squares(
            problem.residuals,
            problem.start(),
            jac=problem.jacobian,
            bounds=problem.bounds(),
            x_scale="jac",
            loss="soft_l1",
            **exact,
        )
        return np.asarray(found.x)

    off = float(np.abs(fit_parametric(data, "gogo")[1] - slow()).max())
    ours, theirs = seconds(lambda: fit_parametric(data, "gogo")), seconds(slow)
    made = "" if is_quick() else f"; all choices make {characterise(readings).fits_made} fits of every model"
    note = f"{theirs / ours:.1f} × as fast{made}"
    return [
        row("solver of gogo", "descend", ours, off, note=note),
        row("solver of gogo", "SciPy's least_squares", theirs),
    ]


DRIFT_RUNS = sized(50, 1)
COURSES: Mapping[str, Callable[[Floats], Floats]] = {
    "no drift": np.ones_like,
    "a line of 13 %": lambda t: 1 + 0.13 * t,
    "settling by 13 %": lambda t: 1 - 0.13 * np.exp(-t / 0.2),
    "a wave of 6 %": lambda t: 1 + 0.03 * np.sin(5 * t),
}


def drifting_readings(course: Callable[[Floats], Floats], seed: int) -> tuple[Measurements, Floats]:
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


def drift() -> dict[str, object]:
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
        tables = [drifting_readings(course, seed) for seed in range(DRIFT_RUNS)]
        for way, correct in ways.items():
            errors: list[float] = []
            for table, truth in tables:
                found = correct(table).XYZ[:, 1]
                errors.append(100 * float(np.sqrt(np.mean((found / truth - 1) ** 2))))
            one = tables[0][0]
            rows.append(
                row(
                    name,
                    way,
                    seconds(lambda one=one, correct=correct: correct(one), repeats=5),
                    float(np.mean(errors)),
                    note=f"largest of {DRIFT_RUNS} runs {max(errors):.2f} %",
                )
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


RUNS = sized(25, 1)
CODES = range(120, 137)
ORDER = steps(find_sets(("cable",)), 1)
PRIMARIES = np.array([[54.0, 48.0, 28.0], [28.0, 93.0, 11.0], [2.7, 8.0, 146.0]])


def cable_readings(seed: int, faults: Faults) -> Measurements:
    """Return the set read on a display of gamma 1.9 to 2.4 with ``faults``."""
    curve = ToneCurve(gamma=float(np.random.default_rng(seed).uniform(1.9, 2.4)))
    display = DisplayModel(PRIMARIES.sum(axis=1) / 1000, PRIMARIES, (curve, curve, curve))
    instrument = Simulated(display, seed, faults)
    shown = [PatchOnScreen(s.label, s.patch.codes, s.position, 0.0, s.patch.codes, s.patch) for s in ORDER]
    return Measurements(
        np.array([step.patch.codes for step in ORDER]),
        np.array([instrument.read(showing).XYZ_cd_m2 for showing in shown]),
        tuple(step.label for step in ORDER),
        area=np.array([step.patch.filled for step in ORDER]),
        surround=np.array([step.patch.surround for step in ORDER]),
    )


def alike_by_slope(table: Measurements) -> list[bool]:
    """Return which steps `code_steps` finds missing."""
    judged = code_steps(table)
    assert judged.table is not None, judged.words
    return [float(str(row[1])) < 0.5 for row in judged.table.rows]


def alike_by_noise(table: Measurements) -> list[bool]:
    """Return which steps are less than three standard errors of the two codes' own readings."""
    greys = cable_greys(table)
    pairs = pairwise(greys[code] for code in CODES)
    return [abs(b.mean() - a.mean()) < 3 * np.sqrt(a.var(ddof=1) / len(a) + b.var(ddof=1) / len(b)) for a, b in pairs]


def largest_change(table: Measurements) -> float:
    """Return the largest change of a patch with its surround, in %."""
    return float(pixel_independence(table).value or 0.0)


def own_light(table: Measurements) -> float:
    """Return the change of a patch's own light with its surround, in %."""
    return float(dynamic_contrast(table).value or 0.0)


def code_path() -> dict[str, object]:
    """Return for each case and way the time and the error."""
    rows: list[dict[str, object]] = []
    ways: dict[str, Callable[[Measurements], float]] = {
        "largest change of a patch": largest_change,
        "slope over three patches": own_light,
    }
    for stray in (0.0, 0.002, 0.01):
        cases = [(gain, cable_readings(seed, Faults(noise=0.002, surround_gain=gain, stray_light=stray)))
                 for seed in range(RUNS) for gain in (0.0, 0.05)]  # fmt: skip
        for way, change in ways.items():
            errors = [abs(change(table) - 100 * gain) for gain, table in cases]
            rows.append(_row(f"dynamic contrast, {100 * stray:g} % of stray light", way, errors, change, cases[0][1]))
    judges = {"alike within the noise": alike_by_noise, "over the slope of all": alike_by_slope}
    for noise in (0.001, 0.002, 0.003):
        for bits in (8, 6):
            tables = [cable_readings(seed, Faults(noise=noise, panel_bits=bits)) for seed in range(RUNS)]
            tables = [table for table in tables if code_steps(table).passed is not None]
            truth = [bits == 6 and code % 4 != 3 for code in CODES][:-1]
            for way, judge in judges.items():
                errors = [float(sum(a != b for a, b in zip(judge(t), truth, strict=True))) for t in tables]
                name = f"successive codes, {bits} bits, {100 * noise:g} % of noise"
                rows.append(_row(name, way, errors, judge, tables[0]))
    promises = [
        Promise("steps of successive codes taken for another", worst(rows, parameter="over the slope"), 0, "count"),
        Promise(
            "a backlight's change, whatever the stray light",
            worst(rows, parameter="slope over"),
            0.3,
            "error",
            unit="%",
        ),
    ]
    title = "What codes pass on their way to the light: run time against error"
    return {"title": title, "rows": rows, "promises": promises}


def _row(
    series: str, way: str, errors: list[float], work: Callable[[Measurements], object], table: Measurements
) -> dict[str, object]:
    took_s = seconds(lambda: work(table), repeats=3)
    note = f"largest of {len(errors)} displays {max(errors):.2g}"
    return row(series, way, took_s, float(np.mean(errors)), note=note)


TABLES = sized(400, 8)
RULES = ("steps of the table's bits", "equal bytes", "within half a code of 8 bits", "within two codes of 8 bits")


def drawn(rng: np.random.Generator, size: int) -> Floats:
    """Return a table of ``size`` entries, shape (size, 3), as calibrations and night lights load them."""
    at = np.linspace(0.0, 1.0, size)[:, None]
    kind = rng.integers(4)
    if kind == 0:
        return np.repeat(at, 3, axis=1)
    if kind == 1:
        return np.asarray(at ** rng.uniform(0.8, 1.3, 3))
    if kind == 2:
        return at * np.array([1.0, rng.uniform(0.6, 1.0), rng.uniform(0.4, 1.0)])
    ripple = rng.uniform(-0.02, 0.02, 3) * np.sin(2 * np.pi * rng.integers(1, 4, 3) * at)
    return np.clip(at ** rng.uniform(0.9, 1.1, 3) * rng.uniform(0.9, 0.97, 3) + ripple, 0.0, 1.0)


def read_back(rng: np.random.Generator, shares: Floats, bits: int) -> GammaTable:
    """Return ``shares`` as a driver with hardware of ``bits`` bits returns them."""
    highest = 2**bits - 1
    value = np.floor(shares * highest + (0.5 if rng.integers(2) else 1e-9)).astype(np.int64)
    ways = (value << (16 - bits), value << (16 - bits) | value >> (2 * bits - 16), np.rint(value * (65535 / highest)))
    return GammaTable(ways[rng.integers(3)].astype(np.uint16))


def same(rule: str, one: GammaTable, two: GammaTable) -> bool:
    """Return what ``rule`` says of two tables."""
    if rule == RULES[0]:
        return bool(one.same_as(two))
    if rule == RULES[1]:
        return np.array_equal(np.asarray(one.entries), np.asarray(two.entries))
    return one.difference_codes(two) < (0.5 if rule == RULES[2] else 2.0)


def wrong(rule: str, change_codes: float, tables: int, seed: int = 1) -> float:
    """Return the share of wrong verdicts of ``rule`` on ``tables`` that changed by so many codes, or not at all.

    Unchanged tables come from any two drivers; changed ones are read by the driver that read them before.
    """
    rng = np.random.default_rng(seed)
    errors = 0
    for _ in range(tables):
        sizes, bits = rng.choice([256, 1024, 4096], 2), rng.choice([8, 10, 12, 16], 2)
        shape = np.random.default_rng(rng.integers(2**32))
        state = shape.bit_generator.state
        before = drawn(shape, int(sizes[0]))
        if change_codes:
            after = before + change_codes / 255.0 * np.where(before.max(axis=0) > 0.5, -1.0, 1.0) * before.clip(0, 1)
            verdict = same(rule, *(read_back(rng, shares.clip(0, 1), int(bits[0])) for shares in (before, after)))
            errors += verdict
        else:
            shape.bit_generator.state = state
            again = drawn(shape, int(sizes[1]))
            errors += not same(rule, read_back(rng, before, int(bits[0])), read_back(rng, again, int(bits[1])))
    return errors / tables


def gamma_tables() -> dict[str, object]:
    """Judge tables by each rule, and read a monitor's."""
    rows: list[Row] = []
    one, two = (GammaTable.from_shares(np.linspace(0, 1, 1024) ** power) for power in (1.2, 1.21))
    for rule in RULES:
        taken = seconds(lambda rule=rule: same(rule, one, two))
        for change in (0.0, 1.0, 2.0, 4.0):
            what = "unchanged, another driver" if not change else f"changed by {change:g} codes"
            line: Row = row(rule, what, taken, wrong(rule, change, TABLES))
            rows.append(line)
    rows += _read_times()
    changed = [row for row in rows if row["series"] == RULES[0] and str(row["parameter"]).startswith("changed")]
    promises = [Promise("share of changes by a code or more that are missed", worst(changed), 0.0, "error", "exactly")]
    return {"promises": promises, "title": "Gamma tables: the same, or another?", "rows": rows}


def _read_times() -> list[Row]:
    if shutil.which("Xvfb") is None or is_quick():
        return []
    read, write_to = os.pipe()
    command = ["Xvfb", "-displayfd", str(write_to), "-screen", "0", "640x480x24", "-nolisten", "tcp", "-noreset"]
    with subprocess.Popen(command, pass_fds=[write_to], stderr=subprocess.DEVNULL) as server:
        os.close(write_to)
        try:
            with os.fdopen(read) as told:
                os.environ["DISPLAY"] = f":{told.readline().strip()}"
            os.environ.pop("WAYLAND_DISPLAY", None)
            from runner.presenter.surfaces.opening import open_surface

            with open_surface("window", (320, 240), windowed=True) as surface:
                taken = seconds(surface.gamma_tables, repeats=50)
        finally:
            server.terminate()
    return [row("read the table of the window's monitor", "256", taken, 0.0)]


PROFILE_COLOURS = sized(4000, 100)
FORMS: tuple[tuple[ProfileKind, int | None], ...] = (
    ("matrix", None),
    ("table", 5),
    ("table", 9),
    ("table", 17),
    ("table", 33),
    ("table", 45),
    ("table", 65),
)


def _profile_error(model: DisplayModel, found: Floats, wanted: Floats) -> tuple[float, float]:
    """Return the mean and the largest ΔE00."""
    white = model.shown_white_XYZ_cd_m2
    off = delta_e_2000(xyz_to_lab(found, white), xyz_to_lab(wanted, white))
    return float(off.mean()), float(off.max())


def _profile_rows(name: str, model: DisplayModel) -> list[dict[str, object]]:
    codes = np.random.default_rng(2).random((PROFILE_COLOURS, 3)) ** 1.5
    wanted = model.xyz(codes)
    rows: list[dict[str, object]] = []
    for kind, points in sized(FORMS, (FORMS[0], FORMS[4])):
        if kind == "matrix" and not model.additive:
            continue
        make = partial(profile_of_model, model, "benchmark", kind=kind, points=points)
        made: WrittenProfile = make()
        profile = profile_of(parse_profile_file(made.data, "made"))
        luminance = profile.white_cd_m2(None)
        seen = profile.absolute(through(made.data, codes), luminance)
        relative = wanted @ profile.adaptation.T / luminance
        back = model.xyz(np.clip(through(made.data, relative, back=True), 0.0, 1.0))
        error, back_error = _profile_error(model, seen, wanted), _profile_error(model, back, wanted)
        rows.append(
            row(
                f"{name}: {kind}",
                f"{points} points a side" if points else "",
                seconds(make, repeats=3),
                error[0],
                largest=error[1],
                note=f"at most {error[1]:.2g}; back {back_error[0]:.2g}, at most {back_error[1]:.2g}; "
                f"{len(made.data) / 1000:.0f} kB",
            )
        )
    for points in sized((9, 17, 33), (9,)):
        plain = partial(_plain_table, model, points)
        error = _profile_error(model, lab_to_xyz(between(plain(), codes), model.shown_white_XYZ_cd_m2), wanted)
        rows.append(
            row(
                f"{name}: a plain table of Lab over codes",
                f"{points} points a side",
                seconds(plain, repeats=3),
                error[0],
                note=f"at most {error[1]:.2g}; not written, in 64 bits",
            )
        )
    forms: tuple[tuple[CubeInput, int], ...] = (
        ("srgb", 17),
        ("srgb", 33),
        ("srgb", 65),
        ("light", 1024),
        ("light", 4096),
    )
    for given, points in forms[:: sized(1, 3)]:
        if given == "light" and not model.additive:
            continue
        cube = cube_of_model(model, "benchmark", given, points=points)
        rows.append(
            row(
                f"{name}: .cube from {given}",
                f"{points} points",
                seconds(partial(cube_of_model, model, "benchmark", given, points=points), repeats=1),
                cube.mean,
                note=f"at most {cube.largest:.2g}; {len(cube.text) / 1000:.0f} kB",
            )
        )
    return rows


def _plain_table(model: DisplayModel, points: int) -> Floats:
    """Return Lab on a grid of codes, as a table without curves has it."""
    axis = np.linspace(0.0, 1.0, points)
    codes = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)
    return xyz_to_lab(model.xyz(codes), model.shown_white_XYZ_cd_m2)


def profiles() -> dict[str, object]:
    """Time each form on an additive display and on one whose channels act on each other."""
    additive, acting = thesis_display(), plvc_display(0.15)
    rows = [*_profile_rows("additive", additive), *_profile_rows("PLVC", acting)]
    data = profile_of_model(additive, "benchmark").data
    codes = np.random.default_rng(3).random((sized(100_000, 1000), 3))
    for series, work in (
        ("a matrix profile read as a display model", lambda: _profile_model(data)),
        ("100,000 codes to XYZ by the model", lambda: additive.xyz(codes)),
        ("100,000 codes to XYZ by LittleCMS", lambda: through(data, codes)),
    ):
        rows.append(row(series, "", seconds(work, repeats=3)))
    table = {"series": "PLVC: table", "parameter": "33 points"}
    promises = [
        Promise("PLVC by a table of 33 points, mean ΔE00", worst(rows, **table), 0.1, "error"),
        Promise("largest ΔE00 of it", worst(rows, "largest", **table), 0.5, "error"),
        Promise("a matrix profile, largest ΔE00", worst(rows, "largest", series="additive: matrix"), 0.01, "error"),
    ]
    title = f"ICC profiles and .cube tables; ΔE00 of {PROFILE_COLOURS:,} colours by LittleCMS"
    return {"title": title, "rows": rows, "promises": promises}


def _profile_model(data: bytes) -> object:
    return model_of_profile(profile_of(parse_profile_file(data, "made")))


NOISES = sized(20, 2)
SIZES_PX = sized((192, 384, 1024), (96,))
# A median about each pixel takes minutes on more.
MOST_FILTERED_PX = 192
FULL_CD_S_M2, CONTRAST, WINDOW_PX = 10.0, 6.0, sized(65, 15)


def _ramps(seed: int) -> list[tuple[Floats, Floats]]:
    codes, display = table_c1_codes(), thesis_display()
    light = noisy(display.xyz(codes), 0.002, seed) @ np.linalg.inv(display.primaries_XYZ_cd_m2).T
    alone = [np.all(np.delete(codes, channel, axis=1) == 0, axis=1) for channel in range(3)]
    return [(codes[rows, channel], light[rows, channel]) for channel, rows in enumerate(alone)]


def _gog(code: Floats, gain: float, offset: float, gamma: float) -> Floats:
    return np.asarray(np.maximum(gain * code + offset, 0.0) ** gamma)


def _by_scipy(ramps: list[tuple[Floats, Floats]]) -> list[float]:
    start, bounds = (1.0, 0.01, 2.0), ((0.05, -0.9, 0.1), (4.0, 0.9, 10.0))
    return [float(curve_fit(_gog, code, light, p0=start, bounds=bounds)[0][2]) for code, light in ramps]


def _by_us(ramps: list[tuple[Floats, Floats]]) -> list[float]:
    return [float(fit.coefficients[2]) for fit in fit_channels(ramps, "gog")]


def curve_rows() -> list[Row]:
    """Fit the ramps of the thesis's display both ways."""
    true = np.array([gamma for _, _, gamma in THESIS_CURVES])
    every = [_ramps(seed) for seed in range(NOISES)]
    ratio = times_faster(partial(_by_us, every[0]), partial(_by_scipy, every[0]))
    rows: list[Row] = []
    for series, fit in (("three curves", _by_us), ("three curves, SciPy", _by_scipy)):
        error = float(np.mean([np.abs(np.array(fit(ramps)) - true) for ramps in every]))
        row: dict[str, Any] = {"series": series, "parameter": "gamma", "seconds": seconds(partial(fit, every[0]))}
        note = f"{ratio:.1f} × as fast as SciPy, timed in turn; with standard errors" if fit is _by_us else ""
        rows.append({**row, "error": error, "note": note})
    return rows


def _photographs(side: int) -> list[tuple[str, float, StereoImage]]:
    base = 2.0 + np.linspace(0, 1, side)[:, None] * np.linspace(0.5, 1, side)
    places = np.random.default_rng(1).choice(np.arange(8, side - 8, 16), (2, side * side // 2000))
    luminance = base.copy()
    luminance[tuple(places)] *= 1 + CONTRAST
    return [
        (f"{time:g} s", time, StereoImage.flat(np.repeat(np.minimum(luminance, full)[..., None], 3, 2).astype("f4")))
        for time, full in ((time, FULL_CD_S_M2 / time) for time in (1 / 15, 1 / 2, 2.0))
    ]


def _by_filter(pictures: list[tuple[str, float, StereoImage]]) -> list[float]:
    first = pictures[0][2].left[..., 1]
    sparkles = first > 2 * median_filter(first, WINDOW_PX)
    found = []
    for _, _, image in pictures:
        luminance = image.left[..., 1]
        background = median_filter(luminance, WINDOW_PX)[sparkles]
        found.append(float(np.mean(luminance[sparkles] / background - 1)))
    return found


def _by_windows(pictures: list[tuple[str, float, StereoImage]]) -> list[float]:
    return [row.as_photographed.contrast.value for row in contrast_over_exposure(pictures).rows]


def contrast_rows() -> list[Row]:
    """Measure three exposures both ways."""
    rows: list[Row] = []
    for side in SIZES_PX:
        pictures = _photographs(side)
        for series, way in (("contrast, windows", _by_windows), ("contrast, median about each pixel", _by_filter)):
            if way is _by_filter and side > MOST_FILTERED_PX:
                continue
            began = perf_counter()
            found = way(pictures)
            taken = perf_counter() - began if way is _by_filter else seconds(partial(way, pictures), repeats=5)
            row: dict[str, Any] = {"series": series, "parameter": f"{side} × {side} px"}
            note = "contrast " + ", ".join(f"{value:.3f}" for value in found) + " at 1/15, 1/2 and 2 s"
            rows.append({**row, "seconds": taken, "error": abs(found[0] - CONTRAST) / CONTRAST, "note": note})
    return rows


def thesis_methods() -> dict[str, Any]:
    """Fit and measure."""
    rows = [*curve_rows(), *contrast_rows()]
    ours, theirs = (worst(rows[place : place + 1]) for place in (0, 1))
    promises = [
        Promise("error of γ beside SciPy's curve_fit", ours / theirs, 1.01, "error", unit="×"),
        Promise("contrast of sparkles, relative", worst(rows, series="contrast, windows"), 5e-3, "error"),
    ]
    return {"title": "The thesis's own methods", "rows": rows, "promises": promises}


if __name__ == "__main__":
    program("display_fits", models, drift, code_path, gamma_tables, profiles, thesis_methods)
