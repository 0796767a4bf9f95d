"""Running sessions from Python: with a person, with simulated observers, or from a recorded session."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeAlias

from analysis.records import Trial
from runner.errors import SessionError, SessionStoppedError
from runner.observers.observer_file import ObserverSpec, read_observer
from runner.observers.presses import Person, read_recording
from runner.ports import WindowClosed
from runner.presenter.counters import Counters
from runner.protocol.experiment import Experiment, check_observer, read_experiment
from runner.session.folders import to_resume, unfinished
from runner.session.picture_source import Progress, build_stimuli, no_progress
from runner.session.session import Left, Session
from runner.session.station import Station
from runner.session.status import SessionStatus
from stimuli.build import StimulusSet

Ending: TypeAlias = Literal["completed", "left", "window closed", "interrupted"]
Backend: TypeAlias = Literal["window", "egl", "null"]


@dataclass(frozen=True, slots=True)
class SessionOptions:
    """How a session is run, and what is called while it runs.

    Parameters
    ----------
    results
        Folder that the session is written below.
    resume
        Whether to resume this observer's unfinished session where it stopped.
    accept_gamma_table
        Whether to show pictures although the graphics card's gamma table is not the one that the display was measured
        with, or changes meanwhile; the record says so.
    accept_changes
        Whether to resume or replay although the experiment, the stimuli or the display changed; the record says so.
    mode
        Stereo mode in place of the rig's.
    allow_uncharacterised
        Whether to use another mode's characterisation if the mode has none; every record says so.
    backend
        Where to draw: ``window``, ``egl`` (offscreen) or ``null`` (a window without a screen). If None: ``window`` for
        a person, ``egl`` for others.
    windowed
        Whether to use a window in place of the full screen.
    simulate
        File of simulated observers who answer in place of a person.
    replay
        Recorded ``session.jsonl``, or a folder with one, whose key presses are repeated.
    progress
        Called with what is being done, how much of it is done, and of how much.
    notify
        Called with each line that the experimenter should read before the session.
    on_begin
        Called before the first scene with the session, which takes notes and marks, and its status.
    on_trial
        Called after each trial, also one that is read from the log of a resumed session.
    """

    results: str | Path = Path("results")
    resume: bool = False
    accept_changes: bool = False
    accept_gamma_table: bool = False
    mode: str | None = None
    allow_uncharacterised: bool = False
    backend: Backend | None = None
    windowed: bool = False
    simulate: str | Path | None = None
    replay: str | Path | None = None
    progress: Progress = no_progress
    notify: Callable[[str], None] = lambda line: None
    on_begin: Callable[[Session, SessionStatus], None] = lambda session, status: None
    on_trial: Callable[[SessionStatus], None] = lambda status: None


@dataclass(frozen=True, slots=True)
class SessionResult:
    """How a session ended: ``answered`` of ``trials`` scored trials are on disk; ``folder`` is None if it stopped."""

    ending: Ending
    answered: int
    trials: int
    folder: Path | None

    def to_json(self) -> dict[str, Any]:
        """Return all of it as plain JSON."""
        folder = str(self.folder) if self.folder else None
        return {"ending": self.ending, "answered": self.answered, "trials": self.trials, "folder": folder}


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
        If a file is wrong, the surface cannot show the mode, or the session cannot be begun or resumed.
    GraphicsError
        If the graphics driver failed; every answer before that is on disk.
    SessionStoppedError
        If an answer could not be written, or the gamma table changed; every answer before it is on disk.

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
    if options.replay and (options.resume or options.simulate):
        raise SessionError("a session cannot be replayed and also resumed or simulated: give only one of these options")
    check_observer(observer)
    design = read_experiment(experiment, options.mode, allow_uncharacterised=options.allow_uncharacterised)
    law = _law(options.simulate, design) if options.simulate else None
    recording = read_recording(Path(options.replay)) if options.replay else None
    results = Path(options.results)
    if options.resume:
        to_resume(results, design.spec.name, observer)
    elif unfinished(results, design.spec.name, observer):
        options.notify(
            f"note: observer {observer} has an unfinished session. To resume it, stop this one before it asks "
            "anything, and give --resume"
        )
    backend = options.backend or ("egl" if law or recording else "window")
    stimuli = build_stimuli(design, options.progress)
    folder: Path | None = None
    ending: Ending = "completed"
    status: SessionStatus | None = None
    with Station.open(
        design,
        stimuli,
        results,
        backend,
        windowed=options.windowed,
        accept_gamma_table=options.accept_gamma_table,
    ) as station:
        for remark in station.remarks:
            options.notify(f"warning: {remark}")

        def on_begin(session: Session) -> None:
            nonlocal status
            status = _status(session, station)
            options.on_begin(session, status)

        def on_trial(trial: Trial) -> None:
            if status is not None:
                status.update(trial)
                options.on_trial(status)

        person = Person(station.surface.wait_key, station.presenter.point)
        try:
            if recording:
                folder = station.replay(
                    recording,
                    observer,
                    accept_changes=options.accept_changes,
                    on_trial=on_trial,
                    on_session=on_begin,
                )
            else:
                folder = station.run(
                    observer,
                    station.simulated(law, observer) if law else person,
                    simulated=law is not None,
                    resume=options.resume,
                    accept_changes=options.accept_changes,
                    on_trial=on_trial,
                    on_session=on_begin,
                )
        except Left:
            ending = "left"
        except WindowClosed:
            ending = "window closed"
        except KeyboardInterrupt:
            ending = "interrupted"
        except OSError as error:
            raise SessionStoppedError(f"the session stopped: {error}; every answer before this is saved") from error
    if status is None:  # interrupted before it began
        return SessionResult(ending, 0, sum(block.trials for block in design.example_blocks), folder)
    return SessionResult(ending, status.answered, status.trials, folder)


@dataclass(frozen=True, slots=True)
class Simulation:
    """The sessions of simulated observers: one folder each, and the presenter's work for all of them together."""

    folders: tuple[Path, ...]
    work: Counters
    experiment: Experiment
    stimuli: StimulusSet


def simulate(
    experiment: str | Path,
    observer_file: str | Path,
    observers: int | Sequence[str] = 1,
    *,
    results: str | Path = Path("results"),
    seed: int | None = None,
    mode: str | None = None,
    allow_uncharacterised: bool = False,
    backend: Backend = "egl",
    progress: Progress = no_progress,
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
    results
        Folder that the sessions are written below.
    seed
        Random seed for the answers; that of the experiment if None. The order of trials does not depend on it.
    mode, allow_uncharacterised
        As in `SessionOptions`.
    backend
        Where to draw.
    progress
        Called with what is being done, how much of it is done, and of how much.

    Returns
    -------
    Simulation
        The session folders, in the order of the observers, and the work of drawing them.

    Raises
    ------
    InputError
        If a file is wrong, the observers cannot judge every stimulus, or the results cannot be written.

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
    design = read_experiment(experiment, mode, allow_uncharacterised=allow_uncharacterised)
    law = _law(observer_file, design)
    stimuli = build_stimuli(design, progress)
    folders = []
    with Station.open(design, stimuli, Path(results), backend, windowed=True) as station:
        for done, code in enumerate(codes, start=1):
            folders.append(station.run(code, station.simulated(law, code, seed), simulated=True))
            progress("Running simulated observers", done, len(codes))
        work = station.presenter.counters
    return Simulation(tuple(folders), work, design, stimuli)


def _law(file: str | Path, design: Experiment) -> ObserverSpec:
    return read_observer(Path(file), design.stimulus_names, design.stimuli.reference)


def _status(session: Session, station: Station) -> SessionStatus:
    kinds = [block.kind for block in station.experiment.spec.blocks]
    return SessionStatus(session.blocks, kinds, time.monotonic, lambda: station.presenter.counters.frames_missed)
