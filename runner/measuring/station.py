"""A display measured: the screen in its stereo mode, the instrument and the log, opened, used and closed."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any, ClassVar

from devices.compensation import Correction
from devices.display import EYES, Eye, GammaTable
from devices.errors import MeasuringError
from devices.readings import (
    MeasurementLog,
    PatchEye,
    PatchSet,
    PatchTurn,
    ReadingRun,
    Wiring,
    open_instrument,
    read_session,
    recorded_name,
    step_facts,
    steps,
    write_measurements,
)
from documents import Finding, WorkError, counted, sha256_of_file
from documents.arrays import Floats
from documents.text import JsonResult, did_you_mean
from runner.measuring.code_screen import CodeScreen
from runner.measuring.judge import Judge
from runner.measuring.options import Dialogue, InstrumentOptions, MeasureOptions, ShowPatches
from runner.measuring.patch_screen import AskedScreen, PatchScreen
from runner.measuring.take_readings import TakenReadings, take_readings
from runner.measuring.target import Target, read_target, wiring_of
from runner.presenter.gamma_check import GammaWatch
from runner.presenter.surfaces.gamma_tables import LoadedTable
from runner.presenter.surfaces.opening import open_surface

# What a resumed measurement must have in common with how it began.
_KEPT_ALIKE = ("display", "mode", "mode_options", "eye", "set", "seed", "repeat_every", "highest_code", "steps")


@dataclass(frozen=True, slots=True)
class Order:
    """What is to be shown to whom, and how: ``eye`` is left, right or both."""

    sets: tuple[PatchSet, ...]
    show: ShowPatches
    notes: str = ""
    facts: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class MeasurementReport(JsonResult):
    """A measurement as far as it went: its log ``file``, the ``tables`` written, and what it holds."""

    file: Path
    tables: tuple[Path, ...]
    outcome: TakenReadings
    session: ReadingRun
    json_keys: ClassVar = {"file": "measurement", "session.readings": "readings", "outcome": "*"}
    json_names: ClassVar = "file tables readings missing session.accepted outcome"

    @property
    def readings(self) -> int:
        """How many readings there are."""
        return len(self.session.readings)

    @property
    def missing(self) -> list[str]:
        """The steps that were not read."""
        return [step.label for step in self.session.missing]

    @property
    def failure(self) -> WorkError | None:
        """What to raise where patches are missing, with how to resume."""
        return self.outcome.failure(self.file)

    def told(self) -> Iterator[str]:
        """Yield how many readings there are, and where, if none is missing."""
        if not self.failure:
            readings = counted(self.readings, "reading is", "readings are")
            yield f"{readings} in {' and '.join(map(str, self.tables))}"


def measure_display(
    rig_or_display: Path, options: MeasureOptions, dialogue: Dialogue | None = None
) -> MeasurementReport:
    """Show patches and read each with an instrument.

    Readings go to NAME.jsonl one by one, and to a table at the end, for `display fit` and `display report`. Space
    pauses, Escape stops after the reading; --resume continues. Close the blinds, and let the display warm up first,
    unless the warm-up is measured. Where the instrument or the glasses must be moved, the run says so and waits.

    Parameters
    ----------
    rig_or_display
        A rig file, or a display file, which needs a mode.
    options
        The log and the tables to write, the patches, how they are shown, and the instrument. Every reading is in the
        log on disk before the next patch appears.
    dialogue
        How to talk with the person beside it; None: not at all.

    Returns
    -------
    MeasurementReport
        What was read, what was not, and the files.

    Raises
    ------
    InputError
        If it cannot begin, or a table cannot be written.
    """
    unknown = [str(table) for table in options.tables if table.suffix.lower() not in (".csv", ".ti3")]
    if unknown:
        raise MeasuringError(Finding(f"--table is {unknown[0]}", remedy="name it *.csv or *.ti3"))
    dialogue, show, instrument = dialogue or Dialogue(), options.show, options.instrument
    target = read_target(rig_or_display, options.mode)
    dialogue.note(target.check_eye(show.eye))
    sets, remark = target.sets(options.patches, show.eye)
    dialogue.note(remark)
    wiring = wiring_of(target, show, instrument, dialogue)
    order, again = Order(sets, show, options.notes), options.again
    with open_screen(target, show) as screen:
        for warning in screen.surface.facts.remarks:
            dialogue.warn(warning)
        outcome, session = measure(
            options.output, target, order, screen, instrument, wiring, dialogue, resume=options.resume, again=again
        )
    tables = options.tables or (options.output.with_suffix(".csv"),)
    for table in tables if session.readings else ():
        write_measurements(session, table)
    return MeasurementReport(options.output, tables, outcome, session)


@contextmanager
def open_screen(
    target: Target, show: ShowPatches, *, asked: Mapping[str, Floats] | None = None
) -> Iterator[PatchScreen]:
    """Open a screen on ``target``, and close it: of device codes, or of colours ``asked`` in XYZ by patch name.

    Raises
    ------
    InputError
        If it cannot be opened, or colours are asked of a display that was not characterised in this mode.
    """
    mode, panel = target.mode, target.panel
    with ExitStack() as opened:
        surface = opened.enter_context(
            open_surface(
                show.backend,
                panel.resolution_px,
                stereo=mode.needs_stereo,
                windowed=show.windowed,
                windows=mode.windows,
                bits=panel.code_bits,
                identity=target.identity,
                monitors=show.monitors or target.monitors,
            )
        )
        if asked is None:
            yield opened.enter_context(CodeScreen(surface, mode))
        else:
            models = target.characterised().models
            correction = Correction(target.crosstalk, target.gain_map)
            yield opened.enter_context(AskedScreen(surface, mode, models, correction, asked))


def measure(
    file: Path,
    target: Target,
    order: Order,
    screen: PatchScreen,
    instrument: InstrumentOptions,
    wiring: Wiring,
    dialogue: Dialogue,
    *,
    resume: bool = False,
    again: Sequence[str] = (),
) -> tuple[TakenReadings, ReadingRun]:
    """Measure, with the readings in ``file``, and return how it went and all readings there are.

    With ``resume``, the measurement in ``file`` is resumed; ``again`` are labels of steps to read once more.
    Readings that make no sense stop it, unless the ``instrument``'s are accepted.

    Raises
    ------
    InputError
        If it cannot begin: with a finding each.
    """
    sets = [patch_set.rounded(screen.highest) for patch_set in order.sets]
    planned = steps(sets, order.show.seed, order.show.repeat_every, eye=order.show.eye)
    watch = GammaWatch(screen.surface.gamma_tables, every_s=0.0)
    gamma_table = table_read_with(watch.loaded, order.show.eye)
    facts = _facts(target, order, screen, planned) | {"gamma_table": gamma_table.to_json()}
    log: MeasurementLog | None = None
    judge = Judge()
    begun = datetime.now(UTC)
    wanted: tuple[PatchTurn, ...] = planned
    if resume or again:
        log, session = MeasurementLog.reopen(file)
        try:
            _check_alike(session, facts)
            _check_table(session, gamma_table)
            begun = datetime.fromisoformat(str(session.header["begun_utc"]))
            wanted = _chosen(session, again) if again else session.missing
            trusted = session.readings.keys() - {step.position for step in wanted}
            judge = Judge([session.readings[position] for position in trusted], session.steps)
        except BaseException:
            log.close()
            raise
    elif file.exists():
        remedy = "resume it with --resume, or choose another name"
        raise MeasuringError(Finding("this measurement exists already", str(file), remedy=remedy))
    try:
        opened = open_instrument(instrument.instrument, wiring)
        name = recorded_name(instrument.instrument, opened)
        try:
            if log is None:
                log = MeasurementLog.create(file, {"begun_utc": begun.isoformat(), "instrument": name, **facts})
            else:
                before = session.header["instrument"]
                if name != before:
                    dialogue.say(f"warning: the measurement began with {before} and is resumed with {name}")
                log.note(resumed_utc=datetime.now(UTC).isoformat(), instrument=name, again=list(again))
            elapsed_s = _clock(begun)
            outcome = take_readings(
                screen,
                opened,
                log,
                wanted,
                order.show.eye,
                order.show.settle_s,
                elapsed_s,
                dialogue.say,
                _ready(instrument, order.show, dialogue),
                watch.change,
                judge,
                accept=instrument.accept_readings,
            )
        finally:
            opened.close()
        session = read_session(file)  # while nobody else may write it
    finally:
        if log is not None:
            log.close()
    return outcome, session


def _ready(instrument: InstrumentOptions, show: ShowPatches, dialogue: Dialogue) -> Callable[[str], bool] | None:
    """Return what waits until the person has moved what must be moved; None for a key in the window."""

    def note(request: str) -> bool:
        dialogue.note(request)
        return True

    def ask(request: str) -> bool:
        return dialogue.ask(f"{request} Then press Enter: ") is not None

    return note if instrument.unattended else None if show.backend == "window" else ask


def table_read_with(loaded: Mapping[Eye, LoadedTable], eye: PatchEye) -> GammaTable:
    """Return the gamma table of those ``loaded`` that ``eye`` is read with.

    Raises
    ------
    MeasuringError
        If both eyes are read at once, and each has a monitor with a table of its own.
    """
    left, right = (loaded[each].table for each in EYES)
    if eye == "both" and left.same_as(right) is False:
        what = f"the left eye's gamma table is {left.sentence()}, the right eye's {right.sentence()}"
        raise MeasuringError(Finding(what, remedy="load the same on both monitors, or measure --eye left and right"))
    return right if eye == "right" else left


def _check_table(session: ReadingRun, now: GammaTable) -> None:
    """Refuse to resume a measurement that began with another gamma table."""
    before = GammaTable.from_json(session.header.get("gamma_table", {"unknown": "the readings do not state it"}))
    if before.same_as(now) is False:
        what = f"the measurement began with another gamma table: {before.sentence()}; now it is {now.sentence()}"
        remedy = "load that table again, or begin a new measurement; see docs/modes.md"
        raise MeasuringError(Finding(what, str(session.file), remedy=remedy))


def _clock(begun: datetime) -> Callable[[], float]:
    """Return a function of the seconds since ``begun``: steady from now on, whatever is done to the system's clock."""
    already_s = max(0.0, (datetime.now(UTC) - begun).total_seconds())
    now_s = time.monotonic()
    return lambda: already_s + time.monotonic() - now_s


def _facts(target: Target, order: Order, screen: PatchScreen, planned: tuple[PatchTurn, ...]) -> dict[str, Any]:
    return {
        "display": target.display_file.name,
        "display_sha256": sha256_of_file(target.display_file),
        "panel": target.panel.text,
        "mode": target.mode.name,
        "mode_options": target.mode_options,
        **({"monitor_settings": target.monitor_settings.to_text()} if target.monitor_settings else {}),
        "eye": order.show.eye,
        "set": " + ".join(patch_set.name for patch_set in order.sets),
        "set_source": "; ".join(patch_set.source for patch_set in order.sets if patch_set.source),
        "seed": order.show.seed,
        "repeat_every": order.show.repeat_every,
        "settle_s": order.show.settle_s,
        "notes": order.notes,
        "highest_code": screen.highest,
        "surface": screen.surface.facts.to_json(),
        "software": version("cyclopean"),
        **order.facts,
        "steps": step_facts(planned),
    }


def _check_alike(session: ReadingRun, facts: Mapping[str, Any]) -> None:
    import json

    now = json.loads(json.dumps(facts))
    findings = []
    for key in _KEPT_ALIKE:
        if session.header.get(key) != now[key]:
            was = "" if key == "steps" else f": it was {session.header.get(key)!r}, not {now[key]!r}"
            findings.append(Finding(f"the measurement began with other '{key}'{was}", str(session.file)))
    if findings:
        raise MeasuringError(findings)


def _chosen(session: ReadingRun, labels: Sequence[str]) -> tuple[PatchTurn, ...]:
    known = {step.label: step for step in session.steps}
    findings = []
    for label in labels:
        if label not in known:
            remedy = did_you_mean(label, known, "")
            findings.append(Finding(f"there is no patch '{label}'", str(session.file), remedy=remedy))
    if findings:
        raise MeasuringError(findings)
    chosen = {known[label].position for label in labels}
    return tuple(step for step in session.steps if step.position in chosen)
