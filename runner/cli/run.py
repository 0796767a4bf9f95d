"""`cyclopean run`: a session with a person, or with simulated observers; and the experimenter's line meanwhile.

While an observer answers, a line of the terminal shows where the session stands. Below it the experimenter writes notes
and marks trials. This does not touch the session's window or its timing: a thread of its own sleeps until a line has
been typed.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
import threading
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import click

from documents.files import system_fault
from documents.platform import obeys_sequences, reads_terminal, wait_for_input
from documents.text import counted, own_stream, say, visible
from runner.cli.options import takes
from runner.session.options import SessionOptions

if TYPE_CHECKING:
    from runner.session.events import Event, Notes
    from runner.session.options import SessionResult
    from runner.session.picture_source import Progress
    from runner.session.status import SessionStatus


@click.command(short_help="Run a session with an observer.")
@click.argument("experiment", type=click.Path(path_type=Path))
@click.option("--observer", required=True, help="Code of the observer: letters and digits, such as 01.")
@takes(SessionOptions, leave_out={"progress", "notify", "listeners"})
@click.option(
    "--console/--no-console",
    default=None,
    help="Take notes and marks in this terminal during the session. Default: if a person answers.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def run_command(
    experiment: Path,
    observer: str,
    console: bool | None,
    as_json: bool,
    options: SessionOptions,
) -> None:
    """Run a session with an observer.

    EXPERIMENT is a file such as experiments/dynamic_range.yaml. Every answer is on disk before the next trial
    appears. The observer answers with the keys that the instructions name; Escape opens a menu: continue, repeat, note,
    stop. Meanwhile the experimenter can type notes at the terminal, and 'r' to have the last trial asked again.

    Exit status: 0 if the session is complete, also where a failed vision test ended it; 1 if it was stopped, closed,
    interrupted or failed, with the command that continues it; 2 if the input was wrong.
    """
    from runner.cli.output import progress_bar
    from runner.errors import UsedCodeError
    from runner.session.options import session_command
    from runner.session.run import run_session
    from runner.session.status import SessionStatus

    if options.simulate and Path(options.simulate).suffix == ".jsonl":
        options = replace(options, simulate=None, replay=options.simulate)
    if console is None:
        console = options.of_a_person and options.backend in (None, "window") and at_a_terminal()
    with ExitStack() as terminal:
        step = terminal.enter_context(progress_bar(quiet=as_json))
        shown = _Shown(observer, terminal, step, console and not options.replay, SessionStatus())
        options = replace(options, progress=step, notify=lambda line: click.echo(line, err=True), listeners=(shown,))
        try:
            done = run_session(experiment, observer, options)
        except UsedCodeError as error:
            if not options.of_a_person or as_json or not at_a_terminal():
                raise
            click.echo(error.what, err=True)
            if not click.confirm("Is this the same person, who sits once more?", err=True):
                raise
            options = replace(options, again=True)
            done = run_session(experiment, observer, options)
    begun = bool(shown.status.blocks)
    completed = done.ending == "completed" and done.folder is not None
    if as_json:
        click.echo(json.dumps(done.to_json()))
    elif completed and done.folder:
        click.echo(
            f"{counted(done.answered, 'answer is', 'answers are')} in {done.folder}\n"
            f"Score all observers with: cyclopean report {done.folder.parents[1]}"
        )
    else:
        saved = f"{done.answered} of {counted(done.trials, 'answer', 'answers')} saved"
        typed = session_command(
            experiment,
            observer,
            options,
            resume=begun,
            new=options.new and not begun,
            again=options.again and not begun,
        )
        more = "The recording ends here" if options.replay else f"{'Continue' if begun else 'Begin again'}: {typed}"
        click.echo(f"{_ENDINGS[done.ending]}; {saved}. {more}")
    if not as_json:
        _say_what_vision_failed(observer, done)
    if done.doubt:
        click.echo(f"warning: {done.doubt}", err=True)
    if not completed and not (options.replay and done.ending == "window closed"):
        sys.exit(1)


@dataclass(slots=True)
class _Shown:
    """Shows where the session stands after each answer: on the experimenter's line if ``has_console``, or by a bar."""

    observer: str
    terminal: ExitStack
    step: Progress
    has_console: bool
    status: SessionStatus
    console: Console | None = None

    def hear(self, event: Event) -> None:
        from analysis.kinds import Trial
        from analysis.records import WindowEvent
        from runner.session.events import Recorded, Replayed, SessionBegan

        self.status.hear(event)
        match event:
            case SessionBegan(session) if self.has_console:
                lines = Console(session, self.status.line, sys.stdin, own_stream(sys.stderr))
                self.console = self.terminal.enter_context(lines)
            case Recorded(Trial() | WindowEvent()) | Replayed(left=0):
                if self.console:
                    self.console.refresh()
                else:
                    self.step(f"Observer {self.observer}", self.status.answered, self.status.trials)


_ENDINGS = {
    "left": "Stopped by the observer",
    "window closed": "The window was closed",
    "interrupted": "Interrupted by Ctrl-C",
    "terminated": "Ended by a signal",
}


def _say_what_vision_failed(observer: str, done: SessionResult) -> None:
    """Print which vision tests the observer failed, what that means, and what to type."""
    for outcome in done.failed_tests:
        say((f"Observer {observer} failed a vision test: {outcome.words}.", "bold"))
    if not done.failed_tests:
        return
    click.echo("It is a screen, no diagnosis: advise the observer at most to see an optometrist.")
    if done.screened_out:
        click.echo("The session ended there, as the experiment says (on_fail: stop), and is complete.")
    tests = " ".join(f"--passed {outcome.test}" for outcome in done.failed_tests)
    click.echo(f"A report includes the answers and names the observer; to leave them out, add {tests} to `report`.")


HELP = (
    "n WORDS, or just words: a note, kept with its place in the session · "
    "r: ask the last trial again after its block · ?: this help"
)
_ABOVE = "\x1b7\x1b[1A\r\x1b[2K{}\x1b8"  # save the place, go up, clear the line, write, go back to what is being typed
_LONGEST_LINE = 4096
_LAST_WAIT_S = 0.5


def at_a_terminal() -> bool:
    """Return whether someone sits at a terminal that this process reads."""
    try:
        return sys.stderr.isatty() and reads_terminal(sys.stdin.fileno())
    except (OSError, ValueError, AttributeError):  # a closed stream is None
        return False


class Console:
    """Reads commands from ``source`` and writes to ``screen`` until closed; use as a context manager."""

    def __init__(self, session: Notes, status: Callable[[], str], source: TextIO, screen: TextIO) -> None:
        self._session = session
        self._status = status
        self._source = source.fileno()
        self._screen = screen
        self._is_terminal = screen.isatty() and obeys_sequences(screen.fileno())
        self._over = False
        self._turn = threading.Lock()
        self._woken, self._wake = os.pipe()
        self._reader = threading.Thread(target=self._read, name="console", daemon=True)

    def __enter__(self) -> Console:
        self._say(HELP)
        self._reader.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over = True
        os.close(self._wake)
        self._reader.join(timeout=_LAST_WAIT_S)  # where nothing ends its wait, as on Windows, it ends with the process
        os.close(self._woken)
        with self._turn:
            if self._is_terminal:
                self._put("\n")

    def refresh(self) -> None:
        """Show the status again, above what is being typed."""
        with self._turn:
            self._put(_ABOVE.format(self._fitting()) if self._is_terminal else f"{self._fitting()}\n")

    def _read(self) -> None:
        """Hand on each line until the session ends, or the terminal does."""
        waiting, encoding = b"", os.device_encoding(self._source) or "utf-8"
        while wait_for_input(self._source, self._woken) and _ours(self._source):
            try:
                read = os.read(self._source, _LONGEST_LINE)
            except OSError:
                return
            if not read or self._over:
                return
            *lines, waiting = (waiting + read).split(b"\n")
            waiting = waiting[-_LONGEST_LINE:]
            for line in lines:
                self._say(self._obey(visible(line.decode(encoding, "replace")).strip()))

    def _obey(self, words: str) -> str:
        try:
            if words == "r":
                return _marked(self._session.mark("experimenter"))
            note = words.removeprefix("n ").strip() if words != "n" else ""
            if words == "?" or not note:
                return HELP
            self._session.note(note, "experimenter")
        except OSError as error:
            return f"this could not be kept: {system_fault(error) or error.strerror or error}"
        except ValueError:
            return "the session is over"
        return f"noted: {note}"

    def _say(self, words: str) -> None:
        """Write a line that stays, the status below it, and leave the line below that for typing."""
        with self._turn:
            self._put(f"\r\x1b[2K{words}\n{self._fitting()}\n" if self._is_terminal else f"{words}\n")

    def _fitting(self) -> str:
        status = self._status()
        width = shutil.get_terminal_size().columns - 1
        return status if not self._is_terminal or len(status) <= width else f"{status[: width - 1]}…"

    def _put(self, text: str) -> None:
        try:
            self._screen.write(text)
            self._screen.flush()
        except (OSError, ValueError):
            pass  # nobody looks any more; the session continues


def _ours(source: int) -> bool:
    """Return whether reading ``source`` would not stop the process, as it does in the background of a terminal."""
    return not os.isatty(source) or reads_terminal(source)


def _marked(place: tuple[int, int] | None) -> str:
    if place is None:
        return "there is no answered trial to ask again, or it is marked already"
    return f"trial {place[1] + 1} of block {place[0] + 1} will be asked again"
