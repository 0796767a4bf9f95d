"""An experimenter at the terminal while an observer sits at a real window."""

from __future__ import annotations

import os
import pty
import subprocess
import sys
import threading
from typing import Any

import numpy as np
import pytest

Person = Any  # tests/conftest.py


def _sit_down_at_a_terminal(person: Person) -> tuple[int, list[bytes]]:
    """Start the session with a terminal of its own; return the terminal's keyboard, and what it shows."""
    try:
        keyboard, slave = pty.openpty()
    except OSError as error:
        pytest.skip(f"this machine gives no pseudo-terminals (is /dev/pts mounted?): {error}")
    code = (
        "import fcntl, os, termios; fcntl.ioctl(0, termios.TIOCSCTTY, 0)\n"  # the terminal is this process's own
        "from runner.cli.main import main; main()"
    )
    person.process = subprocess.Popen(
        [sys.executable, "-c", code, "run", str(person.study.experiment), "--observer", "07"]
        + ["--results", str(person.study.results)],
        stdin=slave,
        stdout=slave,
        stderr=slave,
        text=True,
        start_new_session=True,
        env={**os.environ, "DISPLAY": person.screen, "WAYLAND_DISPLAY": "", "COLUMNS": "150", "TERM": "xterm"},
    )
    os.close(slave)
    shown: list[bytes] = []

    def watch() -> None:
        try:
            while piece := os.read(keyboard, 65536):
                shown.append(piece)
        except OSError:
            pass  # the terminal ends with its last process

    threading.Thread(target=watch, daemon=True).start()
    person.until(lambda: np.any(person.look()), "the window to draw something")
    return keyboard, shown


@pytest.mark.nightly
def test_notes_and_marks_are_typed_while_the_observer_answers(person: Person) -> None:
    keyboard, shown = _sit_down_at_a_terminal(person)

    def sees(words: str) -> None:
        person.until(lambda: words in b"".join(shown).decode("utf-8", "replace"), f"the terminal to show '{words}'")

    sees("?: this help")
    sees("trial 0 of 6 · block 1 of 2: instructions")
    person.turn("space")
    person.answer("Up", "Down")
    sees("trial 2 of 6 · block 2 of 2: all pairs")
    sees("last: first")
    os.write(keyboard, "leans back — too far\nr\n".encode())
    sees("noted: leans back — too far")
    sees("trial 2 of block 2 will be asked again")
    person.answer("Up", "Up")
    person.turn("space")  # the break
    person.answer("Up")
    person.press("Up")
    person.until(lambda: person.answers() == 6, "all pairs to be answered")
    person.until(lambda: len(person.log().answers) == 7, "the last answer to be on disk")
    person.press("Up")  # the marked one again
    person.until(lambda: person.log().complete, "the end to be on disk")
    person.press("space")  # the page that thanks
    person.process.wait(timeout=30)
    sees("6 answers are in")
    log = person.log()
    (note,) = log.notes
    assert (note.text, note.by, note.block, note.trial) == ("leans back — too far", "experimenter", 1, 2)
    assert [(mark.block, mark.trial, mark.by) for mark in log.marks] == [(1, 1, "experimenter")]
    again = [answer for answer in log.answers if answer.attempt]
    assert [(answer.place, answer.details()["answer"]) for answer in again] == [((1, 1), "first")]
    assert log.complete
    assert log.pending == ()
    os.close(keyboard)
