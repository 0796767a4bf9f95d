"""The experimenter's line while an observer answers: it shows where the session stands, and takes notes and marks.

This does not touch the session's window or its timing: a thread of its own sleeps until a line has been typed.
"""

from __future__ import annotations

import os
import shutil
import sys
import threading
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import TextIO

from analysis.kinds import Trial
from analysis.records import WindowEvent
from documents.files import system_fault
from documents.platform import obeys_sequences, reads_terminal, wait_for_input
from documents.text import own_stream, visible
from runner.session.events import Event, Notes, Recorded, Replayed, SessionBegan
from runner.session.picture_source import Progress
from runner.session.status import SessionStatus

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


@dataclass(slots=True)
class ConsoleStatus:
    """Shows where the session stands after each answer: on the experimenter's line if ``has_console``, or by a bar."""

    observer: str
    progress: Progress
    has_console: bool
    status: SessionStatus = field(default_factory=SessionStatus)
    console: Console | None = None
    _terminal: ExitStack = field(default_factory=ExitStack)

    def __enter__(self) -> ConsoleStatus:
        return self

    def __exit__(self, *_: object) -> None:
        self._terminal.close()

    def hear(self, event: Event) -> None:
        """Show where the session stands after an event."""
        self.status.hear(event)
        match event:
            case SessionBegan(session) if self.has_console:
                lines = Console(session, self.status.line, sys.stdin, own_stream(sys.stderr))
                self.console = self._terminal.enter_context(lines)
            case Recorded(Trial() | WindowEvent()) | Replayed(left=0):
                if self.console:
                    self.console.refresh()
                else:
                    self.progress(f"Observer {self.observer}", self.status.answered, self.status.trials)
