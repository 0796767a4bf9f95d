"""What this machine can do: graphics, stereo modes, and where the packages are imported from."""

from __future__ import annotations

import importlib
import os
import platform
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

from analysis.kinds import KINDS
from analysis.records import SurfaceFacts
from devices.display import Rig, panel_of_monitor
from devices.readings import INSTRUMENTS
from documents import InputError
from documents.extensions import Registry, installed
from runner.blocks.registry import BLOCKS
from runner.check.signal_path import SignalFact, examine_signal_path
from runner.check.timing_marks import MarkLatency, measure_marks
from runner.commands import commands
from runner.presenter.counters import IntervalSummary
from runner.presenter.errors import PresentationError
from runner.presenter.modes.registry import MODES, available
from runner.presenter.surfaces.keyboard import Keyboard, examine_keyboard
from runner.presenter.surfaces.opening import BACKENDS, open_surface
from runner.presenter.surfaces.screens import Monitor, compositor, monitors
from runner.presenter.surfaces.surface import Buffer
from runner.session.header import software
from runner.session.timing_record import explain, judge, swap_intervals, swaps_per_second
from runner.views.interface import KEYS
from stimuli.measures import MEASURES

_SIZE_PX = (640, 480)
ANY_KEYS = (*KEYS, "escape", "backspace")
_PACKAGES = ("documents", "devices", "stimuli", "analysis", "runner", "extensions")


@dataclass(frozen=True, slots=True)
class PackageReport:
    """The folder that a package is imported from; ``problem`` says that another distribution hides ours."""

    folder: str
    problem: str | None


@dataclass(frozen=True, slots=True)
class TenBits:
    """Whether a surface gives codes of 10 bits, and if not, why not."""

    given: bool
    problem: str | None


@dataclass(frozen=True, slots=True)
class SurfaceReport:
    """What one kind of surface can do here.

    ``modes`` gives for each stereo mode why it cannot be shown, None if it can. If the surface cannot be opened,
    ``problem`` says why, and the rest is empty.
    """

    problem: str | None = None
    facts: SurfaceFacts | None = None
    modes: Mapping[str, str | None] = field(default_factory=dict)
    ten_bits: TenBits | None = None


@dataclass(frozen=True, slots=True)
class MonitorReport:
    """A monitor: what `--monitor` and a rig's ``monitor`` name it by, what it reports, and the gamma table on it.

    ``size_mm`` is None where the monitor does not report its size, ``refresh_hz`` where it does not report its rate;
    ``line`` is all of it but the gamma table in a line. ``size`` says whether the panel of a nominal display can be
    taken from what it reports.
    """

    number: int
    name: str
    resolution_px: tuple[int, int]
    size_mm: tuple[int, int] | None
    refresh_hz: float | None
    position_px: tuple[int, int]
    primary: bool
    gamma_table: str
    size: str
    line: str


@dataclass(frozen=True, slots=True)
class MachineReport:
    """The versions of the software, where its packages are, and what surfaces, monitors and signal path are like.

    ``extensions`` are other packages that add to this one, by name and version, with what each adds or why it cannot.
    ``measures`` are those of two pictures by name, with what to install, None where nothing is missing. ``keyboard`` is
    None without a display server.
    """

    software: Mapping[str, str]
    packages: Mapping[str, PackageReport]
    extensions: Mapping[str, tuple[str, ...]]
    measures: Mapping[str, str | None]
    surfaces: Mapping[str, SurfaceReport]
    monitors: tuple[MonitorReport, ...]
    signal_path: tuple[SignalFact, ...]
    keyboard: Keyboard | None
    processors: int | None
    machine: str


@dataclass(frozen=True, slots=True)
class TimingReport:
    """How evenly a window's frames come, and in ``meaning`` what that means, sentence by sentence.

    ``timing_marks`` say how soon after a swap the rig's marks go.
    """

    display_server: str
    renderer: str
    compositor: str
    swap_intervals: IntervalSummary
    verification: str
    meaning: tuple[str, ...]
    timing_marks: tuple[MarkLatency, ...] = ()


def _keys_told(report: MachineReport, meanings: Mapping[str, str]) -> Iterator[str]:
    yield "\nKeyboard"
    if report.keyboard is None:
        yield "  not looked at: there is no display server"
        return
    labels = ", ".join(f"{key.upper()} ({label})" for key, label in report.keyboard.labels.items())
    if labels:
        yield f"  keys that print something else and count by their place: {labels}"
    asked = "of the experiment" if meanings else "of any experiment"
    missing = [f"'{key}'" + (f" ({meanings[key]})" if meanings else "") for key in report.keyboard.cannot_send]
    if missing:
        yield f"  ! keys {asked} that it cannot send: {', '.join(missing)}"
    else:
        yield f"  sends all keys {asked}"


def told_of(report: MachineReport, meanings: Mapping[str, str] = MappingProxyType({})) -> Iterator[str]:
    """Yield what this machine can do; ``meanings`` are what the keys of an experiment mean."""
    yield "Packages"
    for name, package in report.packages.items():
        yield f"  {name}: {package.problem or 'from ' + package.folder}"
    for name, version in report.software.items():
        yield f"  {name} {version}"
    if report.extensions:
        yield "\nExtensions"
    for extension, adds in report.extensions.items():
        yield f"  {extension}: {'; '.join(adds)}"
    there = [name for name, missing in report.measures.items() if missing is None]
    yield f"\nMeasures of pictures\n  installed: {', '.join(there)}"
    for name, missing in report.measures.items():
        if missing is not None:
            yield f"  {name}: {missing}"
    yield "\nMonitors, by number and name" if report.monitors else "\nNo monitor"
    for monitor in report.monitors:
        yield f"  {monitor.line}\n    gamma table: {monitor.gamma_table}"
        yield f"    size: {monitor.size}"
    yield from _keys_told(report, meanings)
    yield "\nFrom the framebuffer to the panel, as far as the system tells"
    for fact in report.signal_path:
        yield f"  {'! ' if fact.doubt else ''}{fact.title}: {fact.words}"
    for backend, surface in report.surfaces.items():
        yield f"\nSurface '{backend}'"
        facts, ten_bits = surface.facts, surface.ten_bits
        if facts is None or ten_bits is None:
            yield f"  not here: {surface.problem}"
            continue
        yield f"  {facts.renderer}, OpenGL {facts.gl_version}, display server {facts.display_server}"
        yield f"  colours computed in {facts.arithmetic}"
        for remark in facts.remarks:
            yield f"  {remark}"
        for mode, reason in surface.modes.items():
            yield f"  {mode}: {'yes' if reason is None else f'no, {reason}'}"
        yield f"  codes of 10 bits: {'yes' if ten_bits.given else f'no, {ten_bits.problem}'}"


def examine_machine(keys: Iterable[str] = ANY_KEYS) -> MachineReport:
    """Open each kind of surface, try each stereo mode on it, and return what this machine can do.

    Parameters
    ----------
    keys
        The keys of which to say whether the keyboard can send them; if left out, those of any experiment.

    Returns
    -------
    MachineReport
        Each ``problem`` in it is a sentence, or None.

    Examples
    --------
    >>> report = examine_machine()
    >>> report.packages["runner"].problem is None
    True
    >>> sorted(report.surfaces)
    ['egl', 'null', 'window']
    """
    return MachineReport(
        software=software(),
        packages={name: _package(name) for name in _PACKAGES},
        extensions=_extensions(),
        measures={name: MEASURES[name]().missing for name in MEASURES.names()},
        surfaces={backend: _surface(backend) for backend in BACKENDS},
        monitors=_monitors(),
        signal_path=examine_signal_path(),
        keyboard=_keyboard(keys),
        processors=os.cpu_count(),
        machine=platform.machine(),
    )


def examine_timing(
    seconds: float, progress: Callable[[float], None], rig: Rig | None = None, monitors: tuple[str, ...] = ()
) -> TimingReport:
    """Open a window, swap its frames for ``seconds``, and return the intervals with what they mean.

    With ``rig``, the report also says whether the rig's record of a photodiode's verification holds here, and how soon
    after a swap its timing marks are sent: they are sent on its ports. The window is on the monitor that ``monitors``
    or the rig names by name or number, else on the primary one.

    Raises
    ------
    InputError
        If there is no screen, or no such monitor.
    """
    chosen = (monitors or (rig.monitors if rig else ()))[:1]
    with open_surface("window", _SIZE_PX, windowed=True, monitors=chosen) as surface:
        facts = surface.facts

        def frame() -> None:
            surface.target(Buffer.BACK).clear()
            surface.swap()

        intervals = swap_intervals(frame, seconds, progress, facts.refresh_hz)
        marks = measure_marks(rig, frame) if rig else ()
    judgement = judge(rig.verification if rig else None, rig.mode if rig else "", facts, swaps_per_second(intervals))
    return TimingReport(
        facts.display_server,
        facts.renderer,
        compositor(),
        intervals,
        judgement.words,
        (*explain(intervals, bool(facts.vsync), judgement), *(words for each in marks for words in each.sentences)),
        marks,
    )


def _package(name: str) -> PackageReport:
    """Flat package names can be taken by others: report where each is imported from."""
    root = Path(__file__).resolve().parents[2]
    file = importlib.import_module(name).__file__
    folder = Path(file).resolve().parents[1] if file else None
    problem = None if folder == root else f"imported from {folder}, not from {root}: another distribution hides it"
    return PackageReport(str(folder), problem)


# Of each group of entry points that other packages can add to.
REGISTRIES: tuple[Registry[Any], ...] = (BLOCKS, KINDS, MEASURES, INSTRUMENTS, commands())


def _extensions() -> dict[str, tuple[str, ...]]:
    """Return what each extension adds, and what of it cannot be used."""
    known = {registry.group: list(registry.problems()) for registry in REGISTRIES}
    wrong = {problem.offer: problem.reason for problems in known.values() for problem in problems}
    told: dict[str, list[str]] = {}
    for offer in dict.fromkeys([*installed(), *wrong]):
        what = f"{offer.name} ({offer.group.rpartition('.')[2]})"
        reason = wrong.get(offer) if offer.group in known else f"this version has no {offer.group}"
        told.setdefault(str(offer), []).append(f"! {what} cannot be used: {reason}" if reason else what)
    return {package: tuple(words) for package, words in told.items()}


def _monitors() -> tuple[MonitorReport, ...]:
    try:
        there = monitors()
    except PresentationError:
        return ()  # without a display server there are none
    return tuple(
        MonitorReport(
            each.number,
            each.name,
            each.size_px,
            each.size_mm if all(each.size_mm) else None,
            each.refresh_hz,
            each.position_px,
            each.number == 1,
            each.gamma_table.sentence(),
            _size(each),
            each.line,
        )
        for each in there
    )


def _keyboard(keys: Iterable[str]) -> Keyboard | None:
    try:
        return examine_keyboard(keys)
    except PresentationError:
        return None


def _size(monitor: Monitor) -> str:
    """Return the size that a monitor reports, with the pixel pitch, or with why it cannot be true."""
    reported = monitor.reported
    size = f"{reported.size_mm[0]} x {reported.size_mm[1]} mm as it reports itself"
    try:
        return f"{size}: pixels of {panel_of_monitor(reported).pixel_pitch_mm:g} mm"
    except InputError as error:
        return f"{error.findings[0].message}; state the panel of a nominal display"


def _surface(backend: str) -> SurfaceReport:
    """Open a small surface, and once more asking for stereo where it may have it, and for codes of 10 bits."""
    try:
        with open_surface(backend, _SIZE_PX, stereo=False, windowed=True) as surface:
            facts = surface.facts
            modes = available(surface)
    except Exception as error:
        return SurfaceReport(problem=str(error))
    if backend == "window":
        try:
            with open_surface(backend, _SIZE_PX, stereo=True, windowed=True) as surface:
                modes = available(surface)
        except Exception as error:
            modes["quad-buffered"] = str(error)
    for name in [name for name, mode in MODES.items() if mode.windows > 1]:
        try:
            with open_surface(backend, _SIZE_PX, windows=MODES[name].windows, windowed=True) as surface:
                modes[name] = available(surface)[name]
        except Exception as error:
            modes[name] = str(error)
    return SurfaceReport(facts=facts, modes=modes, ten_bits=_ten_bits(backend))


def _ten_bits(backend: str) -> TenBits:
    try:
        with open_surface(backend, _SIZE_PX, windowed=True, bits=10) as surface:
            facts = surface.facts
    except Exception as error:
        return TenBits(False, str(error))
    given = facts.bits == 10
    return TenBits(given, None if given else "; ".join(facts.remarks) or f"codes have {facts.bits} bits")
