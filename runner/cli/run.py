"""`cyclopean run`: a session with a person, or with simulated observers.

While an observer sits at the screen, one line of the terminal shows where the session stands; below it the experimenter
writes notes and marks trials. This does not touch the session's window or its timing: a thread of its own sleeps until
a line has been typed.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TextIO

import click

from documents.platform import obeys_sequences, reads_terminal, wait_for_input
from documents.text import counted, visible
from runner.cli.monitor_option import monitor_option

if TYPE_CHECKING:
    from runner.session.options import Backend


@click.command(short_help="Run a session with an observer.")
@click.argument("experiment", type=click.Path(path_type=Path))
@click.option("--observer", required=True, help="Code of the observer: letters and digits, such as 01.")
@click.option("--resume", is_flag=True, help="Resume this observer's last session exactly where it stopped.")
@click.option("--new", is_flag=True, help="Begin another session although this observer has an unfinished one.")
@click.option(
    "--accept-changes",
    is_flag=True,
    help="With --resume or --replay: continue although experiment, stimuli or display changed.",
)
@click.option(
    "--accept-gamma-table",
    is_flag=True,
    help="Show pictures although the graphics card's gamma table is not the measured one, or changes; the record "
    "states it.",
)
@click.option(
    "--results",
    type=click.Path(path_type=Path),
    default=Path("results"),
    show_default=True,
    help="Folder that the sessions are written to.",
)
@click.option("--mode", help="Stereo mode to use instead of the rig's.")
@click.option("--windowed", is_flag=True, help="Use a window instead of the full screen.")
@monitor_option
@click.option(
    "--wrong-screen",
    is_flag=True,
    help="Go on although the rig's panel is larger than the screen and a part is not seen; every record states it.",
)
@click.option(
    "--simulate",
    type=click.Path(path_type=Path),
    help="File of simulated observers who answer instead of a person, without a window.",
)
@click.option(
    "--replay",
    type=click.Path(path_type=Path),
    help="Recorded session.jsonl whose key presses are repeated, without a window.",
)
@click.option(
    "--backend",
    type=click.Choice(["window", "egl", "null"]),
    help="Where to draw: 'window' for a person, 'egl' for a simulation.",
)
@click.option(
    "--allow-uncharacterised",
    is_flag=True,
    help="Use another mode's characterisation if this mode has none; every record states it.",
)
@click.option(
    "--console/--no-console",
    default=None,
    help="Take notes and marks in this terminal during the session. Default: if a person answers.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    experiment: Path,
    observer: str,
    resume: bool,
    new: bool,
    accept_changes: bool,
    accept_gamma_table: bool,
    results: Path,
    mode: str | None,
    windowed: bool,
    monitors: tuple[str, ...],
    wrong_screen: bool,
    simulate: Path | None,
    replay: Path | None,
    backend: Backend | None,
    allow_uncharacterised: bool,
    console: bool | None,
    as_json: bool,
) -> None:
    """Run a session with an observer.

    EXPERIMENT is a file such as experiments/dynamic_range.yaml. Every answer is on disk before the next trial
    appears. The observer answers with the keys that the instructions name; Escape opens a menu: continue, repeat, note,
    stop. Meanwhile the experimenter can type notes at the terminal, and 'r' to have the last trial asked again.
    """
    from contextlib import ExitStack

    from runner.cli.main import WorkError
    from runner.cli.progress import progress_bar
    from runner.errors import SessionStoppedError
    from runner.session.options import SessionOptions, session_command
    from runner.session.run import run_session
    from runner.session.session import Session
    from runner.session.status import SessionStatus

    if simulate and simulate.suffix == ".jsonl":
        simulate, replay = None, simulate
    if replay and (resume or simulate):
        raise click.UsageError("--replay goes neither with --resume nor with another --simulate")
    if resume and new:
        raise click.UsageError("--resume goes on with the unfinished session, --new begins another: give one of them")
    of_a_person = not (simulate or replay)
    if console is None:
        console = of_a_person and backend in (None, "window") and at_a_terminal()
    shown: Console | None = None
    begun = False
    with ExitStack() as terminal:
        step = terminal.enter_context(progress_bar(quiet=as_json))

        def on_begin(session: Session, status: SessionStatus) -> None:
            nonlocal shown, begun
            begun = True
            if console and not replay:
                shown = terminal.enter_context(Console(session, status.line, sys.stdin, sys.stderr))

        def on_trial(status: SessionStatus) -> None:
            if shown:
                shown.refresh()
            else:
                step(f"Observer {observer}", status.answered, status.trials)

        options = SessionOptions(
            results=results,
            resume=resume,
            new=new,
            accept_changes=accept_changes,
            accept_gamma_table=accept_gamma_table,
            mode=mode,
            allow_uncharacterised=allow_uncharacterised,
            backend=backend,
            windowed=windowed,
            monitors=monitors,
            wrong_screen=wrong_screen,
            simulate=simulate,
            replay=replay,
            progress=step,
            notify=lambda line: click.echo(line, err=True),
            on_begin=on_begin,
            on_trial=on_trial,
        )
        try:
            done = run_session(experiment, observer, options)
        except SessionStoppedError as error:
            raise WorkError(str(error)) from error
    if as_json:
        click.echo(json.dumps(done.to_json()))
    elif done.ending == "completed" and done.folder:
        click.echo(
            f"{counted(done.answered, 'answer is', 'answers are')} in {done.folder}\n"
            f"Score all observers with: cyclopean report {done.folder.parents[1]}"
        )
    else:
        saved = f"{done.answered} of {counted(done.trials, 'answer', 'answers')} saved"
        again = session_command(experiment, observer, options, resume=begun, new=options.new and not begun)
        more = "The recording ends here" if replay else f"{'Continue' if begun else 'Begin again'}: {again}"
        click.echo(f"{_ENDINGS[done.ending]}; {saved}. {more}")


_ENDINGS = {
    "left": "Stopped by the observer",
    "window closed": "The window was closed",
    "interrupted": "Interrupted by Ctrl-C",
}
HELP = (
    "n WORDS, or just words: a note, kept with its place in the session · "
    "r: ask the last trial again after its block · ?: this help"
)
_ABOVE = "\x1b7\x1b[1A\r\x1b[2K{}\x1b8"  # save the place, go up, clear the line, write, go back to what is being typed
_LONGEST_LINE = 4096
_LAST_WAIT_S = 0.5


class Notes(Protocol):
    """What the console does to a session; may be called from any thread."""

    def note(self, words: str, by: str) -> None:
        """Keep a note."""

    def mark(self, by: str) -> tuple[int, int] | None:
        """Mark the last trial to be asked again, and return its place."""


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
            return f"this could not be kept: {error.strerror or error}"
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
