"""What this machine can do: graphics, stereo modes, and where the packages are imported from."""

from __future__ import annotations

import importlib.util
import os
import platform
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, ClassVar

from analysis.kinds import KINDS
from analysis.records import SurfaceFacts
from analysis.report import PARTS, SCALE_PARTS
from analysis.scaling import LAWS
from devices.diagnostics import DIAGNOSTICS
from devices.display import CURVES, AskMonitor, Rig, panel_of_monitor, read_rig
from devices.readings import INSTRUMENTS, READERS
from devices.timing_marks import MARKS
from documents import InputError
from documents.extensions import Registry, installed
from documents.options import MONITOR, Typed
from documents.text import JsonResult
from runner.blocks.registry import BLOCKS
from runner.check.signal_path import SignalFact, examine_signal_path
from runner.commands import commands
from runner.presenter.counters import IntervalSummary
from runner.presenter.errors import PresentationError
from runner.presenter.modes.registry import MODES, available
from runner.presenter.surfaces.keyboard import Keyboard, examine_keyboard
from runner.presenter.surfaces.opening import BACKENDS, open_surface
from runner.presenter.surfaces.screens import Monitor, compositor, monitors
from runner.presenter.surfaces.surface import Buffer
from runner.reports.export import EXPORTERS
from runner.reports.scored import METHODS
from runner.session.events import LISTENERS
from runner.session.header import software
from runner.session.rig_part import Measured, parts_of
from runner.session.timing_record import explain, judge, swap_intervals, swaps_per_second
from runner.views.interface import KEYS
from stimuli.measures import MEASURES
from stimuli.recipes import RECIPES

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

    def told(self) -> Iterator[str]:
        """Yield what it can do, in lines."""
        facts, ten_bits = self.facts, self.ten_bits
        if facts is None or ten_bits is None:
            yield f"  not here: {self.problem}"
            return
        yield f"  {facts.renderer}, OpenGL {facts.gl_version}, display server {facts.display_server}"
        yield f"  colours computed in {facts.arithmetic}"
        for remark in facts.remarks:
            yield f"  {remark}"
        for mode, reason in self.modes.items():
            yield f"  {mode}: {'yes' if reason is None else f'no, {reason}'}"
        yield f"  codes of 10 bits: {'yes' if ten_bits.given else f'no, {ten_bits.problem}'}"


@dataclass(frozen=True, slots=True)
class MonitorReport(JsonResult):
    """A ``monitor``: what `--monitor` and a rig's ``monitor`` name it by, and what it reports of itself."""

    monitor: Monitor
    json_names: ClassVar = (
        "monitor.number monitor.name monitor.size_px size_mm monitor.refresh_hz monitor.position_px primary "
        "gamma_table size monitor.line"
    )
    json_keys: ClassVar = {"monitor.size_px": "resolution_px"}

    @property
    def size_mm(self) -> tuple[int, int] | None:
        """Its size; None where it does not report it."""
        return self.monitor.size_mm if all(self.monitor.size_mm) else None

    @property
    def primary(self) -> bool:
        """Whether it is the primary one."""
        return self.monitor.number == 1

    @property
    def gamma_table(self) -> str:
        """The gamma table on it, in words."""
        return self.monitor.gamma_table.sentence()

    @property
    def size(self) -> str:
        """The size that it reports, with the pixel pitch, or with why it cannot be true."""
        reported = self.monitor.reported
        size = f"{reported.size_mm[0]} x {reported.size_mm[1]} mm as it reports itself"
        try:
            return f"{size}: pixels of {panel_of_monitor(reported).pixel_pitch_mm:g} mm"
        except InputError as error:
            return f"{error.findings[0].message}; state the panel of a nominal display"


@dataclass(frozen=True, slots=True)
class MachineReport(JsonResult):
    """The versions of the software, where its packages are, and what surfaces, monitors and signal path are like.

    ``extensions`` are other packages that add to this one, by name and version, with what each adds or why it cannot.
    ``measures`` are those of two pictures by name, with what to install, None where nothing is missing. ``keyboard`` is
    None without a display server. ``rig_not_measured`` is what of the ``rig``, if one was named, was not measured;
    ``meanings`` are what the keys of an experiment mean.
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
    rig_not_measured: tuple[str, ...] | None = None
    rig: Path | None = None
    meanings: Mapping[str, str] = field(default_factory=dict)
    json_keys: ClassVar = {"rig": None, "meanings": None}
    json_optional: ClassVar = ("rig_not_measured",)

    def told(self) -> Iterator[str]:
        """Yield what this machine can do, and what of the rig was not measured."""
        yield "Packages"
        for name, package in self.packages.items():
            yield f"  {name}: {package.problem or 'from ' + package.folder}"
        for name, version in self.software.items():
            yield f"  {name} {version}"
        if self.extensions:
            yield "\nExtensions"
        for extension, adds in self.extensions.items():
            yield f"  {extension}: {'; '.join(adds)}"
        there = [name for name, missing in self.measures.items() if missing is None]
        yield f"\nMeasures of pictures\n  installed: {', '.join(there)}"
        for name, missing in self.measures.items():
            if missing is not None:
                yield f"  {name}: {missing}"
        yield "\nMonitors, by number and name" if self.monitors else "\nNo monitor"
        for monitor in self.monitors:
            yield f"  {monitor.monitor.line}\n    gamma table: {monitor.gamma_table}"
            yield f"    size: {monitor.size}"
        yield from self._keys_told()
        yield "\nFrom the framebuffer to the panel, as far as the system tells"
        for fact in self.signal_path:
            yield f"  {'! ' if fact.doubt else ''}{fact.title}: {fact.words}"
        for backend, surface in self.surfaces.items():
            yield f"\nSurface '{backend}'"
            yield from surface.told()
        if self.rig_not_measured is not None:
            yield f"\nRig '{self.rig}'\n  not measured: {', '.join(self.rig_not_measured)}"

    def _keys_told(self) -> Iterator[str]:
        yield "\nKeyboard"
        if self.keyboard is None:
            yield "  not looked at: there is no display server"
            return
        labels = ", ".join(f"{key.upper()} ({label})" for key, label in self.keyboard.labels.items())
        if labels:
            yield f"  keys that print something else and count by their place: {labels}"
        meanings = self.meanings
        asked = "of the experiment" if meanings else "of any experiment"
        missing = [f"'{key}'" + (f" ({meanings[key]})" if meanings else "") for key in self.keyboard.cannot_send]
        if missing:
            yield f"  ! keys {asked} that it cannot send: {', '.join(missing)}"
        else:
            yield f"  sends all keys {asked}"


@dataclass(frozen=True, slots=True)
class TimingReport(JsonResult):
    """How evenly a window's frames come, and in ``meaning`` what that means, sentence by sentence.

    ``timing_marks`` say how soon after a swap the rig's marks go.
    """

    display_server: str
    renderer: str
    compositor: str
    swap_intervals: IntervalSummary
    verification: str
    meaning: tuple[str, ...]
    timing_marks: tuple[Measured, ...] = ()

    def told(self) -> Iterator[str]:
        """Yield where the frames were shown, and what their intervals mean."""
        yield f"{self.renderer}; {self.display_server}; {self.compositor}"
        yield from self.meaning


def examine_machine(
    *,
    timing: bool = False,
    seconds: Annotated[float, Typed(least=0.5, most=600)] = 20.0,
    rig: Path | None = None,
    experiment: Path | None = None,
    monitors: Annotated[tuple[str, ...], MONITOR] = (),
    ask_monitor: AskMonitor | None = None,
    progress: Callable[[str, int, int], None] = lambda what, done, of: None,
) -> MachineReport | TimingReport:
    """Report what this machine can do.

    Opens each kind of surface, tries each stereo mode and codes of 10 bits on it, and gives the reason if one cannot
    be shown. Lists the monitors with the number and name by which --monitor and a rig file choose them, and their gamma
    tables, and what else the system tells of what may change codes on their way to the panel; '!' marks what may change
    them. Lists keys that this keyboard cannot send. With --timing it measures the intervals between frames instead.

    Parameters
    ----------
    timing
        Measure how evenly the frames of a window come, and explain.
    seconds
        Duration of --timing.
    rig
        Rig to report what of it was not measured; with --timing, whether its photodiode record holds here, and how soon
        after a swap its timing marks are sent, which sends them.
    experiment
        Experiment of whose keys to list those that the keyboard cannot send. Default: the keys of any experiment.
    monitors
        Monitor for the window, as `cyclopean doctor` lists them; twice for dual-window, the left eye's first. Default:
        the rig's, else the first of the panel's resolution.
    ask_monitor
        Called for what the monitor reports of itself, where the rig's display has no panel.
    progress
        Called with what is being done, how much of it is done, and of how much.

    Returns
    -------
    MachineReport or TimingReport
        Each ``problem`` in it is a sentence, or None.

    Raises
    ------
    InputError
        If options do not go together or a file is wrong; with ``timing``, if there is no screen, or no such monitor.

    Examples
    --------
    >>> report = examine_machine()
    >>> report.packages["runner"].problem is None
    True
    >>> sorted(report.surfaces)
    ['egl', 'null', 'window']
    """
    if timing and experiment:
        raise InputError("--experiment is about the keyboard, which --timing does not look at")
    if monitors and not timing:
        raise InputError("--monitor needs --timing: without it, all monitors are listed")
    # Only now: the models of all kinds of blocks, which a program that imports this does not need.
    from runner.check.display_facts import not_measured
    from runner.check.experiment import keys_of
    from runner.protocol.experiment import read_experiment

    its_rig = read_rig(rig, ask_monitor=ask_monitor) if rig else None
    if timing:
        return _timing(seconds, its_rig, monitors, progress)
    meanings = keys_of(read_experiment(experiment)) if experiment else {}
    return MachineReport(
        software=software(),
        packages={name: _package(name) for name in _PACKAGES},
        extensions=_extensions(),
        measures={name: MEASURES[name]().missing for name in MEASURES.names()},
        surfaces={backend: _surface(backend) for backend in BACKENDS},
        monitors=_monitors(),
        signal_path=examine_signal_path(),
        keyboard=_keyboard(meanings or ANY_KEYS),
        processors=os.cpu_count(),
        machine=platform.machine(),
        rig_not_measured=not_measured(its_rig) if its_rig else None,
        rig=rig,
        meanings=meanings,
    )


def _timing(
    seconds: float, rig: Rig | None, monitors: tuple[str, ...], progress: Callable[[str, int, int], None]
) -> TimingReport:
    """Open a window, swap its frames for ``seconds``, and return the intervals with what they mean.

    It is on the monitor that ``monitors`` or the rig names by name or number, else on the primary one. The rig's timing
    marks are sent on its ports.
    """
    chosen = (monitors or (rig.monitors if rig else ()))[:1]

    def done(done_s: float) -> None:
        progress("Swapping frames", round(done_s), round(seconds))

    with open_surface("window", _SIZE_PX, windowed=True, monitors=chosen) as surface:
        facts = surface.facts

        def frame() -> None:
            surface.target(Buffer.BACK).clear()
            surface.swap()

        intervals = swap_intervals(frame, seconds, done, facts.refresh_hz)
        marks = tuple(each for part in (parts_of(rig) if rig else ()) for each in part.measured(frame))
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
    if importlib.util.find_spec(name) is None:  # the extensions alone can be left out
        return PackageReport("", "not installed: what needs one of them says so")
    file = importlib.import_module(name).__file__
    folder = Path(file).resolve().parents[1] if file else None
    problem = None if folder == root else f"imported from {folder}, not from {root}: another distribution hides it"
    return PackageReport(str(folder), problem)


# Of each group of entry points that other packages can add to.
REGISTRIES: tuple[Registry[Any], ...] = (
    BLOCKS,
    KINDS,
    PARTS,
    SCALE_PARTS,
    RECIPES,
    MEASURES,
    LAWS,
    METHODS,
    CURVES,
    READERS,
    INSTRUMENTS,
    DIAGNOSTICS,
    MARKS,
    LISTENERS,
    EXPORTERS,
    commands(),
)


def _extensions() -> dict[str, tuple[str, ...]]:
    """Return what each extension adds, and what of it cannot be used."""
    known = {registry.group: list(registry.problems()) for registry in REGISTRIES}
    wrong = {problem.offer: problem.reason for problems in known.values() for problem in problems}
    told: dict[str, list[str]] = {}
    for offer in dict.fromkeys([*installed(), *wrong]):
        what = f"{offer.shown} ({offer.group.rpartition('.')[2]})"
        reason = wrong.get(offer) if offer.group in known else f"this version has no {offer.group}"
        told.setdefault(str(offer), []).append(f"! {what} cannot be used: {reason}" if reason else what)
    return {package: tuple(words) for package, words in told.items()}


def _monitors() -> tuple[MonitorReport, ...]:
    try:
        return tuple(map(MonitorReport, monitors()))
    except PresentationError:
        return ()  # without a display server there are none


def _keyboard(keys: Iterable[str]) -> Keyboard | None:
    try:
        return examine_keyboard(keys)
    except PresentationError:
        return None


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
