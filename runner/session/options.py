"""How a session is run, what became of it, and what to type to run it again."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Literal, TypeAlias

from analysis.observers import Outcome
from documents.platform import command_to_type
from runner.session.picture_source import Progress, no_progress
from runner.session.session import Session
from runner.session.status import SessionStatus

Ending: TypeAlias = Literal["completed", "left", "window closed", "interrupted", "terminated"]
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
    new
        Whether to begin another session although this observer has an unfinished one, which stays as it is.
    again
        Whether this observer, who finished a session before, sits once more; the record says so.
    accept_gamma_table
        Whether to show pictures although the graphics card's gamma table is not the one that the display was measured
        with, or changes meanwhile; the record says so.
    accept_changes
        Whether to begin, resume or replay a session although the experiment, the stimuli, the display or the rig
        changed since it, or since the sessions before it in the folder; the record says so.
    mode
        Stereo mode in place of the rig's.
    allow_uncharacterised
        Whether to use another mode's characterisation if the mode has none; every record says so.
    backend
        Where to draw: ``window``, ``egl`` (offscreen) or ``null`` (a window without a screen). If None: ``window`` for
        a person, ``egl`` for others.
    windowed
        Whether to use a window in place of the full screen.
    monitors
        The monitor for the window, by name or number, in place of the rig's; two for a window for each eye.
    wrong_screen
        Whether to go on although the rig's panel is larger than the screen; every record then says so.
    simulate
        File of simulated observers who answer in place of a person.
    replay
        Recorded ``session.jsonl``, or a folder with one, whose key presses are repeated.
    marks
        Whether the rig's timing marks are sent; None: if a person answers.
    progress
        Called with what is being done, how much of it is done, and of how much.
    notify
        Called with each line that the experimenter should read before the session.
    on_begin
        Called before the first scene with the session, which takes notes and marks, and its status.
    on_trial
        Called after each trial; of those that a resumed session reads from its log, after the last. Also when the
        window lost the focus, was minimised, or came back.
    """

    results: str | Path = Path("results")
    resume: bool = False
    new: bool = False
    again: bool = False
    accept_changes: bool = False
    accept_gamma_table: bool = False
    mode: str | None = None
    allow_uncharacterised: bool = False
    backend: Backend | None = None
    windowed: bool = False
    monitors: tuple[str, ...] = ()
    wrong_screen: bool = False
    simulate: str | Path | None = None
    replay: str | Path | None = None
    marks: bool | None = None
    progress: Progress = no_progress
    notify: Callable[[str], None] = lambda line: None
    on_begin: Callable[[Session, SessionStatus], None] = lambda session, status: None
    on_trial: Callable[[SessionStatus], None] = lambda status: None


@dataclass(frozen=True, slots=True)
class SessionResult:
    """How a session ended: ``answered`` of ``trials`` scored trials are on disk; ``folder`` is None if it stopped.

    ``failed_tests`` are the vision tests that the observer failed; ``screened_out`` is whether the session ended there.
    ``doubt`` says why its answers may be none, empty if nothing is striking. ``work`` counts what was done for it, as
    the session's log has it, and the pictures that were rendered before.
    """

    ending: Ending
    answered: int
    trials: int
    folder: Path | None
    failed_tests: tuple[Outcome, ...] = ()
    screened_out: bool = False
    doubt: str = ""
    work: Mapping[str, int] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Return all of it as plain JSON."""
        folder = str(self.folder) if self.folder else None
        counts = {"ending": self.ending, "answered": self.answered, "trials": self.trials, "folder": folder}
        failed = [{"test": outcome.test, "words": outcome.words} for outcome in self.failed_tests]
        told = {"failed_tests": failed, "screened_out": self.screened_out, "doubt": self.doubt}
        return {**counts, **told, "work": dict(self.work)}


def session_command(experiment: str | Path, observer: str, options: SessionOptions, **changed: bool) -> str:
    """Return what to type to run a session with ``options`` and those ``changed``, such as ``resume=True``."""
    words = ["run", str(experiment), "--observer", observer]
    standard = SessionOptions()
    for name in sorted((each.name for each in fields(options)), key=("again", "new", "resume").__contains__):
        value = changed.get(name, getattr(options, name))
        if name == "accept_changes" and changed.get("resume") and not options.resume:
            continue  # a session that began so has them
        if value != getattr(standard, name) and isinstance(value, bool | str | Path):
            no = "no-" if value is False else ""
            words += [f"--{no}{name.replace('_', '-')}", *([] if isinstance(value, bool) else [str(value)])]
        elif name == "monitors":
            words += [word for monitor in value for word in ("--monitor", monitor)]
    return command_to_type(*words)
