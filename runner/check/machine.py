"""Check the machine: whether its screen is the rig's and can show the mode, and whether results can be written."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from analysis.errors import ResultsError
from analysis.records import SurfaceFacts
from devices.display import EYES, GammaTable, Rig
from documents import Finding, InputError
from runner.check.report import CheckOptions, CheckReport
from runner.presenter.errors import GraphicsError, PresentationError
from runner.presenter.gamma_check import REMEDY, compare_tables
from runner.presenter.modes.options import ModeOptions
from runner.presenter.modes.registry import find_mode
from runner.presenter.surfaces.gamma_tables import LoadedTable
from runner.presenter.surfaces.opening import open_surface
from runner.presenter.surfaces.screens import (
    Monitor,
    compositor,
    has_display,
    monitors,
    place_two_windows,
    place_window,
)
from runner.protocol.experiment import Experiment
from runner.session.folders import is_running, unfinished
from runner.session.pooling import ResultsPool, pooled_blocks
from runner.session.rig_part import parts_of

NO_DISPLAY = "not looked at: there is no display here"
_TRIED_PX = (320, 240)


def check_screen(report: CheckReport, rig: Rig, options: CheckOptions) -> None:
    """Open a small window for a moment and compare the screen with the rig.

    What does not fit is a warning, since a file may be checked away from its rig, or an error if the screen must do.
    """
    mode = find_mode(rig.mode, ModeOptions.parse(rig.spec.mode_options))  # wrong options are wrong on every machine
    if options.screen is False:
        return
    faults = report.errors if options.screen else report.warnings
    if not has_display():
        report.facts["screen"] = NO_DISPLAY
        if options.screen:
            faults.append(Finding("there is no display here", rig.file, remedy="check at the rig"))
        return
    panel = rig.display.panel
    try:
        with open_surface(
            "window",
            _TRIED_PX,
            stereo=mode.needs_stereo,
            windowed=True,
            windows=mode.windows,
            bits=rig.output_bits,
            monitors=rig.monitors[:1],
        ) as surface:
            facts = surface.facts
            reason = mode.unavailable(panel.resolution_px, stereo=surface.stereo, windows=surface.windows)
        there = monitors()  # once the window has restored what a killed session left
    except (GraphicsError, InputError) as error:
        report.facts["screen"] = f"not looked at: {error}"
        faults.append(Finding(f"no window can be opened: {error}", rig.file))
        return
    report.facts["screen"] = {
        "monitors": [str(monitor) for monitor in there],
        "renderer": facts.renderer,
        "compositor": compositor(),
        "bits": facts.bits,
        "mode_possible": reason is None,
        "gamma_tables": {monitor.name: monitor.gamma_table.sentence() for monitor in there},
    }
    problems = (
        [] if reason is None else [(f"the mode '{rig.mode}' cannot be shown here: {reason}", "see cyclopean doctor")]
    )
    filled, misplaced = _place(there, rig, mode.windows)
    problems += misplaced + _surface_faults(facts, rig)
    faults += [Finding(message, rig.file, remedy=remedy) for message, remedy in problems]
    restored = [Finding(remark, rig.file) for remark in facts.remarks if "gamma table" in remark]
    report.warnings.extend(restored)
    if filled:
        check_gamma_table(report, rig, filled, accept=options.accept_gamma_table)


def check_rig_parts(report: CheckReport, rig: Rig, options: CheckOptions) -> None:
    """Report the rig's parts, such as where marks go, and open each for a moment.

    One that cannot be opened is a warning, since a file may be checked away from its rig, or an error if the screen
    must do, which is that of the rig. A doubt, such as a stream that nobody receives, is a warning.
    """
    faults = report.errors if options.screen else report.warnings
    for part in parts_of(rig):
        report.facts.setdefault("timing_marks", []).extend(part.described())
        for fault, is_doubt in part.faults() if options.screen is not False else ():
            (report.warnings if is_doubt else faults).append(fault)


def check_gamma_table(report: CheckReport, rig: Rig, filled: tuple[Monitor, ...], *, accept: bool) -> None:
    """Compare the gamma tables of the monitors that a session fills with those that the display was measured with.

    Where the rig sets the identity, that is compared. An error if it is another, unless to ``accept``.
    """
    loaded = {eye: _loaded(filled[min(number, len(filled) - 1)], rig) for number, eye in enumerate(EYES)}
    verdict = compare_tables(rig.measured_gamma_tables, loaded)
    if verdict.refusal:
        (report.warnings if accept else report.errors).append(Finding(verdict.refusal, rig.file, remedy=REMEDY))
    if verdict.warning:
        report.warnings.append(Finding(verdict.warning, rig.file, remedy="see docs/modes.md"))


def _loaded(monitor: Monitor, rig: Rig) -> LoadedTable:
    """Return the table that a session would have on ``monitor``."""
    table = monitor.gamma_table
    if rig.spec.gamma_table == "identity" and table.known:
        table = GammaTable.identity(table.size)
    return LoadedTable(monitor.name, table)


def _place(there: tuple[Monitor, ...], rig: Rig, windows: int) -> tuple[tuple[Monitor, ...], list[tuple[str, str]]]:
    """Return the monitors that a session would fill, and what is wrong with where its window would be."""
    panel = rig.display.panel
    place = place_two_windows if windows > 1 else place_window
    try:
        placement = place(panel.resolution_px, there, rig.monitors)
    except PresentationError as error:
        remedy = "set the screen to the panel's resolution, without scaling"
        return (), [(finding.message, finding.remedy or remedy) for finding in error.findings]
    if placement.remark:
        what, remedy = placement.remark.partition(";")[0], "set the screen to it, without scaling"
        if placement.too_large:
            what, remedy = f"{what}: a session is refused here", f"{remedy}; `run --wrong-screen` goes on all the same"
        return (), [(what, remedy)]
    rates = [monitor.refresh_hz for monitor in placement.monitors]
    if any(rate is None or abs(rate - panel.refresh_hz) <= 0.01 * panel.refresh_hz + 0.5 for rate in rates):
        return placement.monitors, []
    what = f"the screen refreshes at {rates[0]:g} Hz, the panel of the rig at {panel.refresh_hz:g} Hz"
    return placement.monitors, [(what, "set the screen's rate, or correct refresh_hz in the display file")]


def _surface_faults(facts: SurfaceFacts, rig: Rig) -> list[tuple[str, str]]:
    problems = []
    between = compositor()
    if "with a compositing" in between or "Wayland" in between:
        problems.append((f"a compositor stands between window and screen: {between}", "switch it off for timed scenes"))
    if rig.output_bits > facts.bits:
        problems.append(
            (f"the panel takes {rig.output_bits} bits, and the driver gives {facts.bits}", "see docs/modes.md")
        )
    if "llvmpipe" in facts.renderer:
        problems.append((f"pictures are drawn without a graphics card ({facts.renderer})", "install its driver"))
    return problems


def check_pool(report: CheckReport, design: Experiment, results: Path) -> None:
    """Report the answers by which pairs will be chosen, and logs in ``results`` that are of another experiment."""
    blocks = pooled_blocks(design)
    if not blocks:
        return
    pool = ResultsPool(design, results)
    pool.look()
    foreign = pool.foreign()
    report.errors.extend(foreign)
    report.warnings.extend(finding for finding in pool.left_out() if finding not in foreign)
    report.facts["pooled_answers"] = sum(
        sum(pool.answers(index, stimuli).sessions.values()) for index, (stimuli, _) in blocks.items()
    )


# A session of a thousand trials takes about a megabyte.
LITTLE_ROOM_BYTES = 100_000_000


def check_results(report: CheckReport, experiment: str, results: Path) -> None:
    """Report whether ``results`` can be written, and which observers' sessions are unfinished or run now."""
    there = next(folder for folder in (results.absolute(), *results.absolute().parents) if folder.exists())
    report.facts["results"] = str(results)
    if not there.is_dir():
        report.errors.append(Finding("a file stands where the results should go", str(there), remedy="move it away"))
        return
    if not os.access(there, os.W_OK | os.X_OK):
        report.errors.append(Finding("the results folder cannot be written", str(there), remedy="choose another"))
        return
    free_bytes = shutil.disk_usage(there).free
    if free_bytes < LITTLE_ROOM_BYTES:
        what = f"the disk has only {free_bytes / 1e6:.0f} MB left"
        report.warnings.append(Finding(what, str(there), remedy="make room"))
    begun: list[str] = []
    running: list[str] = []
    for person in sorted((results / experiment).glob("sub-*")):
        observer = person.name.removeprefix("sub-")
        try:
            stopped = unfinished(results, experiment, observer)
        except ResultsError as error:
            named = {finding.file for finding in report.warnings}
            report.warnings.extend(finding for finding in error.findings if finding.file not in named)
            continue
        if stopped is not None:
            (running if is_running(stopped.file.parent) else begun).append(observer)
    if begun:
        report.facts["unfinished_sessions_of"] = begun
    if running:
        report.facts["sessions_running_of"] = running
