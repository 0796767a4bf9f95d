"""How a session is run, what became of it, and what to type to run it again."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, TypeAlias

from documents.options import MONITOR
from documents.platform import command_to_type
from documents.text import JsonResult, counted

if TYPE_CHECKING:
    from analysis.kinds import OutcomeRecord
    from runner.session.events import Listener
    from runner.session.picture_source import Progress

Ending: TypeAlias = Literal["completed", "left", "window closed", "interrupted", "terminated"]
Backend: TypeAlias = Literal["window", "egl", "null"]


@dataclass(frozen=True, slots=True)
class SessionOptions:
    """How a session is run, and what is called while it runs.

    Attributes
    ----------
    results
        Folder that the sessions are written to.
    resume
        Resume this observer's last session exactly where it stopped.
    new
        Begin another session although this observer has an unfinished one.
    again
        Let an observer who finished a session sit once more; the record states it.
    accept_changes
        Run although experiment, stimuli, display or rig changed since the sessions before it in the folder, or, with
        --resume or --replay, since it; the record states it.
    accept_gamma_table
        Show pictures although the graphics card's gamma table is not the measured one, or changes; the record states
        it.
    mode
        Stereo mode to use instead of the rig's.
    windowed
        Use a window instead of the full screen.
    monitors
        Monitor for the window, as `cyclopean doctor` lists them; twice for dual-window, the left eye's first. Default:
        the rig's, else the first of the panel's resolution.
    wrong_screen
        Go on although the rig's panel is larger than the screen and a part is not seen; every record states it.
    simulate
        File of simulated observers who answer instead of a person, without a window.
    replay
        Recorded session.jsonl whose key presses are repeated, without a window.
    backend
        Where to draw: 'window' for a person, 'egl' for a simulation, 'null' for a window without a screen.
    allow_uncharacterised
        Use another mode's characterisation if this mode has none; every record states it.
    marks
        Send the rig's timing marks to other machines. Default: if a person answers.
    progress
        Called with what is being done, how much of it is done, and of how much.
    notify
        Called with each line that the experimenter should read before the session.
    listen
        Name of another package's listener that hears what happens in the session; repeat for each.
    listeners
        What hears of each event of the session; see `runner.session.events`.
    """

    results: str | Path = Path("results")
    resume: bool = False
    new: bool = False
    again: bool = False
    accept_changes: bool = False
    accept_gamma_table: bool = False
    mode: str | None = None
    windowed: bool = False
    monitors: Annotated[tuple[str, ...], MONITOR] = ()
    wrong_screen: bool = False
    simulate: str | Path | None = None
    replay: str | Path | None = None
    backend: Backend | None = None
    allow_uncharacterised: bool = False
    marks: bool | None = None
    progress: Progress = lambda what, done, of: None
    notify: Callable[[str], None] = lambda line: None
    listen: tuple[str, ...] = ()
    listeners: tuple[Listener, ...] = ()

    @property
    def folder(self) -> Path:
        """The folder of the results."""
        return Path(self.results)

    @property
    def of_a_person(self) -> bool:
        """Whether a person answers."""
        return not (self.simulate or self.replay)

    @property
    def surface(self) -> Backend:
        """Where to draw."""
        return self.backend or ("window" if self.of_a_person else "egl")

    @property
    def sends_marks(self) -> bool:
        """Whether the rig's timing marks are sent."""
        return self.of_a_person if self.marks is None else self.marks


@dataclass(frozen=True, slots=True)
class SessionResult(JsonResult):
    """How a session of an ``observer`` ended: ``answered`` of ``trials`` scored trials are on disk.

    ``folder`` is None if it stopped. ``failed_tests`` are the vision tests that the observer failed; ``screened_out``
    is whether the session ended there. ``doubt`` says why its answers may be none, empty if nothing is striking.
    ``work`` counts what was done for it, as the session's log has it, and the pictures that were rendered before.
    ``further`` says how it is continued, ``was_replayed`` whether a recording's key presses were repeated.
    """

    ending: Ending
    answered: int
    trials: int
    folder: Path | None
    failed_tests: tuple[OutcomeRecord, ...] = ()
    screened_out: bool = False
    doubt: str = ""
    work: Mapping[str, int] = field(default_factory=dict)
    observer: str = ""
    further: str = ""
    was_replayed: bool = False
    json_names: ClassVar = "ending answered trials folder failed screened_out doubt work"
    json_keys: ClassVar = {"failed": "failed_tests"}

    @property
    def failed(self) -> list[dict[str, str]]:
        """The vision tests that the observer failed, each with what that means."""
        return [{"test": outcome.test, "words": outcome.words} for outcome in self.failed_tests]

    @property
    def completed(self) -> bool:
        """Whether it came to its end, and is on disk."""
        return self.ending == "completed" and self.folder is not None

    @property
    def exit_status(self) -> int:
        """0 if it was completed, or a replay's window was closed; else 1."""
        return int(not self.completed and not (self.was_replayed and self.ending == "window closed"))

    def told(self) -> Iterator[str | tuple[tuple[str, str], ...]]:
        """Yield what is saved, how the session is continued, and what failed vision tests mean."""
        if self.completed and self.folder:
            yield f"{counted(self.answered, 'answer is', 'answers are')} in {self.folder}"
            yield f"Score all observers with: cyclopean report {self.folder.parents[1]}"
        else:
            saved = f"{self.answered} of {counted(self.trials, 'answer', 'answers')} saved"
            yield f"{_ENDINGS[self.ending]}; {saved}. {self.further}"
        for outcome in self.failed_tests:
            yield ((f"Observer {self.observer} failed a vision test: {outcome.words}.", "bold"),)
        if not self.failed_tests:
            return
        yield "It is a screen, no diagnosis: advise the observer at most to see an optometrist."
        if self.screened_out:
            yield "The session ended there, as the experiment says (on_fail: stop), and is complete."
        tests = " ".join(f"--passed {outcome.test}" for outcome in self.failed_tests)
        yield f"A report includes the answers and names the observer; to leave them out, add {tests} to `report`."

    def apart(self, as_json: bool) -> Iterator[str]:
        """Yield why the answers may be none, as JSON says too."""
        if self.doubt:
            yield f"warning: {self.doubt}"


_ENDINGS: Mapping[Ending, str] = {
    "left": "Stopped by the observer",
    "window closed": "The window was closed",
    "interrupted": "Interrupted by Ctrl-C",
    "terminated": "Ended by a signal",
}


_REPEATED = {"monitors": "--monitor", "listen": "--listen"}


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
        elif name in _REPEATED:
            words += [word for each in value for word in (_REPEATED[name], each)]
    return command_to_type(*words)
