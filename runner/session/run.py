"""Running sessions from Python: with a person, with simulated observers, or from a recorded session."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Any

from analysis.errors import ResultsError
from analysis.observers import FastAnswers, failed_tests
from analysis.records import FILE_NAME, SessionLog, read_session
from analysis.seals import check_log
from documents import Finding
from documents.files import LogDisturbedError, in_use
from documents.options import made, taking
from documents.text import counted
from runner.errors import SessionError, SessionStoppedError
from runner.observers.observer_file import ObserverSpec, read_observer
from runner.observers.presses import Person, read_recording
from runner.ports import ObserverLeft, WindowClosed
from runner.presenter.counters import Counters
from runner.presenter.errors import GraphicsError
from runner.presenter.surfaces.x11 import LOST
from runner.protocol.experiment import Experiment, check_observer, read_experiment
from runner.session.earlier import changed_since_earlier
from runner.session.events import listeners_named
from runner.session.folders import (
    LOCK,
    answered,
    near_codes,
    only_session,
    refuse_running,
    refuse_used,
    running_now,
    to_resume,
    unfinished,
)
from runner.session.options import Ending, SessionOptions, SessionResult, session_command
from runner.session.picture_source import build_stimuli
from runner.session.station import Station
from stimuli.build import StimulusSet


class Terminated(KeyboardInterrupt):
    """The process was asked to end, by SIGTERM or by its terminal's closing."""

    @classmethod
    @contextmanager
    def raised(cls) -> Iterator[None]:
        """Raise it in place of dying at once, where nobody else handles these signals; in the main thread only."""

        def handle(number: int, frame: FrameType | None) -> None:
            raise cls

        if threading.current_thread() is not threading.main_thread():
            yield
            return
        numbers = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
        ours = [number for number in numbers if signal.getsignal(number) == signal.SIG_DFL]
        try:
            for number in ours:
                signal.signal(number, handle)
            yield
        finally:
            for number in ours:
                signal.signal(number, signal.SIG_DFL)


def run_session(experiment: str | Path, observer: str, options: SessionOptions | None = None) -> SessionResult:
    """Run one observer's session of an experiment; every answer is on disk before the next trial appears.

    Parameters
    ----------
    experiment
        Experiment file.
    observer
        Code of the observer: letters and digits, such as ``01``.
    options
        How it is run; a person at a full screen if None.

    Returns
    -------
    SessionResult
        How it ended. A session that stopped early can be resumed with ``resume=True``.

    Raises
    ------
    InputError
        If a file is wrong, the surface cannot show the mode, or the session cannot be begun or resumed; if the observer
        has an unfinished session, unless ``options`` say ``resume`` or ``new``.
    GraphicsError
        If the graphics driver failed; every answer before that is on disk.
    SessionStoppedError
        If an answer could not be written, another program removed or changed the log, or the gamma table changed; every
        answer before it is on disk, where it says.

    Examples
    --------
    A session in a window begins with ``run_session("experiments/dynamic_range.yaml", "01")``. Wrong input is refused:

    >>> run_session("experiments/dynamic_range.yaml", "Ann B.")
    Traceback (most recent call last):
    ...
    runner.errors.SessionError: the observer id 'Ann B.' is no BIDS label (use up to 64 letters and digits only, such as
    'AnnB')
    """
    options = options or SessionOptions()
    _refuse_contradictions(options)
    check_observer(observer)
    options = replace(options, listeners=(*options.listeners, *listeners_named(options.listen)))
    design = read_experiment(
        experiment,
        options.mode,
        allow_uncharacterised=options.allow_uncharacterised,
        monitors=tuple(options.monitors),
    )
    if not (options.resume or options.replay):
        design.refuse_name_clashes()
    law = _law(options.simulate, design) if options.simulate else None
    recording = read_recording(Path(options.replay)) if options.replay else None
    stopped = _stopped(experiment, observer, design, options, simulated=bool(law))
    stimuli = build_stimuli(design, options.progress)
    remarks: tuple[str, ...] = ()
    if not (options.resume or options.replay):
        remarks = _changes(design, stimuli, options, simulated=bool(law))
    _warn(options, *remarks)
    typed = session_command(experiment, observer, options, resume=True, new=False, again=False)

    def on_lost() -> None:
        begun = bool(station.status.blocks)
        again = session_command(
            experiment, observer, options, resume=begun, new=False, again=options.again and not begun
        )
        sys.stderr.write(f"\ncyclopean: {LOST}. Every answer before this is saved. Continue: {again}\n")

    with (
        Terminated.raised(),
        only_session(options.folder, design.spec.name, observer),
        Station.open(design, stimuli, options) as station,
    ):
        _warn(options, *station.remarks)
        station.surface.on_lost = on_lost
        folder, ending = _until_it_ends(
            station, typed, partial(_sit, station, observer, law, recording, stopped, remarks)
        )
        file = _read_back(station, typed)  # before others may resume the session
    del stopped  # a long log would be in memory twice
    done = _result(station, ending, folder, file, observer)
    return replace(
        done,
        observer=observer,
        further=_further(experiment, observer, options, begun=bool(station.status.blocks)),
        was_replayed=bool(options.replay),
    )


def _further(experiment: str | Path, observer: str, options: SessionOptions, *, begun: bool) -> str:
    """Return how a session is continued, if it has ``begun``, or else begun again."""
    if options.replay:
        return "The recording ends here"
    new, again = options.new and not begun, options.again and not begun
    typed = session_command(experiment, observer, options, resume=begun, new=new, again=again)
    return f"{'Continue' if begun else 'Begin again'}: {typed}"


def _refuse_contradictions(options: SessionOptions) -> None:
    if options.replay and (options.resume or options.simulate):
        raise SessionError("a session cannot be replayed and also resumed or simulated: give only one of these options")
    if options.resume and options.new:
        raise SessionError("a session is either resumed or new: give only one of these options")


def _stopped(
    experiment: str | Path, observer: str, design: Experiment, options: SessionOptions, *, simulated: bool
) -> SessionLog | None:
    """Return the session that is resumed, None for a new one; raise SessionError if it cannot be begun or resumed."""
    name, results = design.spec.name, options.folder
    stopped: SessionLog | None = None
    if options.resume:
        stopped = to_resume(results, name, observer)
        if stopped.header.simulated != simulated:
            who, remedy = ("a person", "") if simulated else ("a simulated observer", "give --simulate FILE")
            what = f"this session is of {who}, and is resumed as such only"
            raise SessionError(
                Finding(what, str(stopped.file), remedy=f"{remedy}, or begin another with --new".lstrip(", "))
            )
    elif not options.replay:
        if not options.new:
            _refuse_unfinished(experiment, observer, design, options)
        beside = unfinished(results, name, observer) if options.new else None
        if not (options.again or (beside and answered(beside))):
            typed = session_command(experiment, observer, options, again=True)
            way = f"if it is the same person, who sits once more, type: {typed}"
            refuse_used(results, name, observer, way, simulated=simulated)
        _warn(options, *near_codes(results, name, observer))
    refuse_running(results, name, observer)
    if stopped and (held := in_use(stopped.file.parent / LOCK)):  # by an older version, or from Python
        raise running_now(stopped.file.parent, held)
    return stopped


def _warn(options: SessionOptions, *remarks: str) -> None:
    for remark in remarks:
        options.notify(f"warning: {remark}")


def _sit(
    station: Station,
    observer: str,
    law: ObserverSpec | None,
    recording: SessionLog | None,
    stopped: SessionLog | None,
    remarks: tuple[str, ...],
) -> Path:
    """Run the session of a person, of a simulated observer, or of a recording."""
    if recording:
        return station.replay(recording, observer)
    person = Person(station.surface.wait_key, station.presenter.point)
    answers = station.simulated(law, observer) if law else person
    return station.run(observer, answers, simulated=law is not None, resume=stopped, remarks=remarks)


def _until_it_ends(station: Station, again: str, sit: Callable[[], Path]) -> tuple[Path | None, Ending]:
    """Let ``sit`` run a session, and return its folder if it is complete, and how it ended."""
    try:
        with _stops(again):
            return sit(), "completed"
    except ObserverLeft:
        return None, "left"
    except WindowClosed:
        return None, "window closed"
    except KeyboardInterrupt as stop:
        return None, "terminated" if isinstance(stop, Terminated) else "interrupted"
    finally:
        stopping = sys.exception() is not None  # else it is told at the end
        lost = (words for part in station.parts for words in part.lost())
        faults = (station.end_mirror(), *lost, _configuration(station) if stopping else None)
        _warn(station.options, *filter(None, faults))


def _result(station: Station, ending: Ending, folder: Path | None, file: Path | None, observer: str) -> SessionResult:
    """Return how a session ended, and what its log in ``file`` says of the observer's vision."""
    spec, status = station.experiment.spec, station.status
    if not status.blocks:  # interrupted before it began
        return SessionResult(ending, 0, sum(block.trials for block in station.experiment.example_blocks), folder)
    if file is None:
        return SessionResult(ending, status.answered, status.trials, folder)
    work = {"pictures_rendered": station.stimuli.rendered, **station.work}
    if not any(block.tests_observers for block in spec.blocks):
        return SessionResult(ending, status.answered, status.trials, folder, work=work)
    log = read_session(file)
    failed = failed_tests([log]).get(observer, ())
    haste = FastAnswers.of(log.trials)
    doubt = haste.words if haste.striking and not log.header.simulated else ""
    return SessionResult(ending, status.answered, status.trials, folder, failed, log.screened_out, doubt, work)


@dataclass(frozen=True, slots=True)
class Simulation:
    """The sessions of simulated observers: one folder each, and the presenter's work for all of them together."""

    folders: tuple[Path, ...]
    work: Counters
    experiment: Experiment
    stimuli: StimulusSet


@taking(SessionOptions, "resume", "new", "accept_gamma_table", "simulate", "replay", "windowed", "wrong_screen")
def simulate(
    experiment: str | Path,
    observer_file: str | Path,
    observers: int | Sequence[str] = 1,
    *,
    seed: int | None = None,
    **options: Any,
) -> Simulation:
    """Run a session with each of some simulated observers, without waiting; every trial is drawn and recorded.

    Parameters
    ----------
    experiment
        Experiment file.
    observer_file
        File that says how the simulated observers judge, such as ``configs/observers/table_4_4.yaml``.
    observers
        How many there are, called ``01``, ``02``, and so on; or their codes.
    seed
        Random seed for the answers; that of the experiment if None. The order of trials does not depend on it.
    **options
        Those of `SessionOptions` by their names, such as ``results``, ``mode`` and ``progress``; with ``again``,
        observers who finished a session in ``results`` have another sitting.

    Returns
    -------
    Simulation
        The session folders, in the order of the observers, and the work of drawing them.

    Raises
    ------
    InputError
        If a file is wrong, the observers cannot judge every stimulus, one of them has an unfinished session in
        ``results`` or, unless ``again``, a finished one, or the results cannot be written.
    SessionStoppedError
        If an answer could not be written, or another program removed or changed a log; the sessions before are whole.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> experiment, observers = "experiments/dynamic_range.yaml", "configs/observers/table_4_4.yaml"
    >>> with TemporaryDirectory() as folder:
    ...     done = simulate(experiment, observers, 1, results=folder)
    >>> [session.parent.name for session in done.folders], done.work.uploads
    (['sub-01'], 15)
    """
    codes = [f"{number:02d}" for number in range(1, observers + 1)] if isinstance(observers, int) else list(observers)
    for code in codes:
        check_observer(code)
    asked = made(SessionOptions, {**options, "simulate": observer_file, "windowed": True, "wrong_screen": True})
    if asked.resume or asked.new or asked.replay:
        raise SessionError("simulated observers begin sessions of their own: leave out resume, new and replay")
    asked = replace(asked, listeners=(*asked.listeners, *listeners_named(asked.listen)))
    results = asked.folder
    design = read_experiment(experiment, asked.mode, allow_uncharacterised=asked.allow_uncharacterised)
    design.refuse_name_clashes()
    law = _law(observer_file, design)
    stopped = [code for code in codes if (log := unfinished(results, design.spec.name, code)) and answered(log)]
    resumed = SessionOptions(
        results,
        resume=True,
        mode=asked.mode,
        simulate=observer_file,
        allow_uncharacterised=asked.allow_uncharacterised,
    )
    if stopped:
        what = f"{'these observers have' if len(stopped) > 1 else 'this observer has'} an unfinished session of "
        what += f"'{design.spec.name}': {', '.join(stopped)}"
        typed = session_command(experiment, stopped[0], resumed)
        raise SessionError(Finding(what, str(results), remedy=f"choose another folder, or resume each: {typed}"))
    for code in () if asked.again else codes:
        refuse_used(results, design.spec.name, code, _AGAIN, simulated=True)
    stimuli = build_stimuli(design, asked.progress)
    folders = []
    remarks = _changes(design, stimuli, asked, simulated=True)
    with Station.open(design, stimuli, asked) as station:
        for done, code in enumerate(codes, start=1):
            typed = session_command(experiment, code, resumed)
            with only_session(results, design.spec.name, code):
                with _stops(typed):
                    answers = station.simulated(law, code, seed)
                    folders.append(station.run(code, answers, simulated=True, remarks=remarks))
                _read_back(station, typed)
            asked.progress("Running simulated observers", done, len(codes))
        work = station.presenter.counters
    return Simulation(tuple(folders), work, design, stimuli)


_AGAIN = "choose another folder of results or, for a further sitting of each, give again=True"


def _refuse_unfinished(experiment: str | Path, observer: str, design: Experiment, options: SessionOptions) -> None:
    """Raise SessionError, with what to type, if the observer has a session that stopped after an answer."""
    log = unfinished(options.folder, design.spec.name, observer)
    if log is None or not answered(log):
        return
    given = counted(answered(log), "answer", "answers")
    what = f"observer {observer} has an unfinished session of '{design.spec.name}', with {given}"
    what += f", begun {log.header.started_utc[:16].replace('T', ' ')} UTC"
    if held := in_use(log.file.parent / LOCK):
        raise SessionError(Finding(f"{what}, which another process is running now{held.who}", str(log.file)))
    by_type = {
        "resume it, type": session_command(experiment, observer, options, resume=True),
        "begin another beside it (a report counts the answers of both), type": session_command(
            experiment, observer, options, new=True
        ),
    }
    ways = [Finding(f"to {way}: {command}") for way, command in by_type.items()]
    raise SessionError([Finding(what, str(log.file)), *ways])


@contextmanager
def _stops(again: str) -> Iterator[None]:
    """Say of what stops a session what is saved of it, and how it is continued: by typing ``again``."""
    try:
        yield
    except (SessionStoppedError, GraphicsError, OSError) as error:
        why = f"the session stopped: {error}" if isinstance(error, OSError) else str(error)
        kind = GraphicsError if isinstance(error, GraphicsError) else SessionStoppedError
        raise kind(f"{why}. {_what_next(error, again)}") from error


def _changes(design: Experiment, stimuli: StimulusSet, options: SessionOptions, *, simulated: bool) -> tuple[str, ...]:
    """Return what the record says of files that changed since an earlier session; a person's session is refused.

    And of earlier sessions that could not be compared.
    """
    unread: list[Finding] = []
    found = changed_since_earlier(design, stimuli, options.folder, unread.append, simulated=simulated)
    if found and not simulated and not options.accept_changes:
        raise SessionError([each.finding for each in found])
    by_option = " (--accept-changes)" if options.accept_changes else ""
    return (*(f"{each.words}{by_option}" for each in found), *map(str, unread))


def _what_next(error: Exception, again: str) -> str:
    """Say what is saved of a session that ``error`` stopped, and how it is continued."""
    if not isinstance(error, LogDisturbedError):
        return f"Every answer before this is saved. Continue: {again}"
    if error.complete:
        return "The session was complete"
    if error.taken:
        return "The other process continues the session"
    return f"{'Continue' if error.in_place else 'Then continue'}: {again}" if error.saved else "It cannot be resumed"


def _configuration(station: Station) -> str | None:
    try:
        return station.configuration_again()
    except SessionError as error:
        return str(error)


def _read_back(station: Station, again: str) -> Path | None:
    """Return the log's file, if it has all that was recorded, and each line fits; else raise SessionStoppedError.

    Also if the files that the session was made with cannot be kept beside it. None if no session was begun.
    """
    recorder = station.recorder
    if recorder is None:
        return None
    with _stops(again):
        recorder.check()
    file = recorder.folder / FILE_NAME
    try:
        wrong = check_log(file).findings
    except ResultsError as error:
        wrong = error.findings
    if own := [finding for finding in wrong if finding.file == str(file)]:  # of its mirror was told before
        raise SessionStoppedError(f"the log was read back, and it is not as it was recorded: {own[0]}")
    try:
        if words := station.configuration_again():
            _warn(station.options, words)
    except SessionError as error:
        raise SessionStoppedError(f"{error}. Every answer is saved: {file}") from error
    station.recorder = None
    return file


def _law(file: str | Path, design: Experiment) -> ObserverSpec:
    return read_observer(Path(file), design.scored_names, design.stimuli.reference)
