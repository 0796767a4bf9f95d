"""The experimenter's line, at a pseudo-terminal."""

from __future__ import annotations

import os
import pty
import select
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import TextIO

import pytest

from runner.session.console import HELP, Console


@dataclass
class Notebook:
    """A session that keeps what the experimenter wants of it."""

    notes: list[str] = field(default_factory=list)
    marks: int = 0
    trouble: Exception | None = None

    def note(self, words: str, by: str) -> None:
        assert by == "experimenter"
        if self.trouble:
            raise self.trouble
        self.notes.append(words)

    def mark(self, by: str) -> tuple[int, int] | None:
        self.marks += 1
        return (1, 6) if self.marks == 1 else None


class Terminal:
    """A pseudo-terminal: what is typed at it, and what it has shown."""

    def __init__(self) -> None:
        try:
            self.keyboard, self.slave = pty.openpty()
        except OSError as error:
            pytest.skip(f"this machine gives no pseudo-terminals (is /dev/pts mounted?): {error}")
        self.source: TextIO = os.fdopen(os.dup(self.slave), "r")
        self.screen: TextIO = os.fdopen(os.dup(self.slave), "w")
        self.shown = ""

    def type(self, text: str | bytes) -> None:
        os.write(self.keyboard, text.encode() if isinstance(text, str) else text)

    def until(self, part: str, within_s: float = 20.0, *, times: int = 1) -> None:
        end = time.monotonic() + within_s
        while self.shown.count(part) < times:
            left = end - time.monotonic()
            assert left > 0, f"waited in vain for {part!r} in {self.shown!r}"
            if select.select([self.keyboard], [], [], left)[0]:
                self.shown += os.read(self.keyboard, 65536).decode("utf-8", "replace")

    def close(self) -> None:
        self.source.close()
        self.screen.close()
        os.close(self.keyboard)
        os.close(self.slave)


@pytest.fixture
def terminal() -> Iterator[Terminal]:
    """A terminal of its own; that it is nobody's controlling terminal does not matter to the console."""
    opened = Terminal()
    yield opened
    opened.close()


@pytest.fixture(autouse=True)
def ours(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the console believe that the pseudo-terminal is the process's own."""
    monkeypatch.setattr(os, "tcgetpgrp", lambda descriptor: os.getpgrp())


def test_words_are_notes_and_r_marks(terminal: Terminal) -> None:
    session = Notebook()
    with Console(session, lambda: "trial 3 of 45", terminal.source, terminal.screen):
        terminal.until("trial 3 of 45")
        assert HELP in terminal.shown
        terminal.type("n the lamp flickered\n")
        terminal.until("noted: the lamp flickered")
        terminal.type("  looks tired — ä  \n")
        terminal.until("noted: looks tired — ä")
        terminal.type("r\n")
        terminal.until("trial 7 of block 2 will be asked again")
        terminal.type("r\n")
        terminal.until("no answered trial to ask again")
        before = terminal.shown.count(HELP)
        terminal.type("?\n\nn\n")
        terminal.until(HELP, times=before + 3)
    assert session.notes == ["the lamp flickered", "looks tired — ä"]
    assert session.marks == 2


def test_the_status_stands_above_what_is_being_typed(terminal: Terminal) -> None:
    status = ["trial 3 of 45"]
    session = Notebook()
    with Console(session, lambda: status[-1], terminal.source, terminal.screen) as console:
        terminal.until("trial 3 of 45")
        terminal.type("half a no")
        terminal.until("half a no")
        status.append("trial 4 of 45")
        console.refresh()
        terminal.until("\x1b7\x1b[1A\r\x1b[2Ktrial 4 of 45\x1b8")
        terminal.type("te\n")
        terminal.until("noted: half a note")
    assert session.notes == ["half a note"]


def test_a_status_wider_than_the_terminal_is_cut(terminal: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    with Console(Notebook(), lambda: "x" * 200, terminal.source, terminal.screen):
        terminal.until("x" * 38 + "…")
    assert "x" * 39 not in terminal.shown


def test_what_is_typed_can_neither_hide_nor_steer_the_terminal(terminal: Terminal) -> None:
    session = Notebook()
    with Console(session, lambda: "", terminal.source, terminal.screen):
        terminal.type(b"a\x1b]0;owned\x07b \xe2\x80\xae\xff\xfe c\n")
        terminal.until("noted: ")
    (note,) = session.notes
    assert note == "a]0;ownedb \ufffd\ufffd c"
    note.encode()


@pytest.mark.parametrize(
    ("trouble", "words"),
    [
        (OSError(28, "No space left on device"), "this could not be kept: the disk is full (ENOSPC)"),
        (ValueError("write to closed file"), "the session is over"),
    ],
)
def test_a_note_that_cannot_be_kept_is_reported_and_the_console_continues(
    terminal: Terminal, trouble: Exception, words: str
) -> None:
    session = Notebook(trouble=trouble)
    with Console(session, lambda: "", terminal.source, terminal.screen):
        terminal.type("lost\n")
        terminal.until(words)
        session.trouble = None
        terminal.type("kept\n")
        terminal.until("noted: kept")
    assert session.notes == ["kept"]


def test_it_ends_with_the_session_at_once_and_leaves_no_thread(terminal: Terminal) -> None:
    threads = threading.active_count()
    with Console(Notebook(), lambda: "", terminal.source, terminal.screen):
        assert threading.active_count() == threads + 1
        ended_s = time.monotonic()
    assert time.monotonic() - ended_s < 5
    assert threading.active_count() == threads


def test_it_sleeps_while_nobody_types(terminal: Terminal) -> None:
    with Console(Notebook(), lambda: "", terminal.source, terminal.screen) as console:
        reader = console._reader.ident
        assert reader is not None
        clock = time.pthread_getcpuclockid(reader)  # its own, since other threads of the process may work meanwhile
        time.sleep(0.1)
        worked_s = time.clock_gettime(clock)
        time.sleep(1.0)
        # One that waits in a loop takes what it gets of a second: half of it where three share two processors.
        assert time.clock_gettime(clock) - worked_s < 0.2


def test_a_process_in_the_background_of_its_terminal_leaves_it_alone(
    terminal: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "tcgetpgrp", lambda descriptor: os.getpgrp() + 1)
    session = Notebook()
    with Console(session, lambda: "", terminal.source, terminal.screen) as console:
        terminal.type("for the shell\n")
        console._reader.join(timeout=10)
        assert not console._reader.is_alive()
    assert session.notes == []


def test_the_end_of_a_pipe_ends_the_reading_only() -> None:
    read, write = os.pipe()
    session = Notebook()
    with os.fdopen(read) as source, open(os.devnull, "w") as screen, Console(session, lambda: "", source, screen):
        os.write(write, b"one\ntwo\nunfinished")
        os.close(write)
        _until(lambda: len(session.notes) == 2)
    assert session.notes == ["one", "two"]


def _until(come_true: Callable[[], bool], within_s: float = 20.0) -> None:
    end = time.monotonic() + within_s
    while not come_true():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_on_windows_the_line_works_and_does_not_hold_up_the_end(
    terminal: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing ends the wait for a line there; one that comes after the session is dropped."""
    monkeypatch.setattr("documents.platform.sys", SimpleNamespace(platform="win32"))
    monkeypatch.setattr("runner.session.console.obeys_sequences", lambda descriptor: False)
    monkeypatch.setattr("runner.session.console._LAST_WAIT_S", 0.05)
    session = Notebook()
    with Console(session, lambda: "trial 3 of 45", terminal.source, terminal.screen):
        terminal.until(HELP)
        terminal.type("looks tired\r\n")
        terminal.until("noted: looks tired")
    terminal.type("too late\n")
    time.sleep(0.2)
    assert session.notes == ["looks tired"]
    assert "\x1b" not in terminal.shown
