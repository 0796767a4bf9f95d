"""What becomes of the window while a session runs is in its record; and sessions that end before they are complete."""

from __future__ import annotations

import os
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from analysis.records import read_session, session_files

Person = Any  # tests/conftest.py
pytestmark = pytest.mark.window

# Without a window manager nobody minimises a window: what one says of it is written to its property.
MINIMISE = """
import ctypes, sys
x11 = ctypes.CDLL("libX11.so.6")
x11.XOpenDisplay.restype = ctypes.c_void_p
x11.XInternAtom.restype = ctypes.c_ulong
x11.XInternAtom.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int]
pointer, long, int_ = ctypes.c_void_p, ctypes.c_ulong, ctypes.c_int
x11.XChangeProperty.argtypes = [pointer, long, long, long, int_, int_, pointer, int_]
x11.XCloseDisplay.argtypes = [ctypes.c_void_p]
display = x11.XOpenDisplay(None)
state = x11.XInternAtom(display, b"WM_STATE", 0)
values = (ctypes.c_long * 2)(int(sys.argv[2]), 0)
x11.XChangeProperty(display, int(sys.argv[1]), state, state, 32, 0, values, 2)
x11.XCloseDisplay(display)
"""
NORMAL, MINIMISED = "1", "3"


def minimise(person: Person, state: str) -> None:
    window = person._xdotool("search", "--name", "^cyclopean$").split()[-1]
    environment = {**os.environ, "DISPLAY": person.screen}
    subprocess.run([sys.executable, "-c", MINIMISE, window, state], env=environment, check=True)


def events(person: Person) -> list[str]:
    return [event.what for event in person.log().windows]


def test_focus_and_minimising_are_recorded_and_marked_in_their_trials(person: Person) -> None:
    person.sit_down("--windowed")
    person.turn("space", "the first pair")
    person.answer("Up")
    minimise(person, MINIMISED)
    person.until(lambda: events(person) == ["minimised"], "the minimised window in the record")
    minimise(person, NORMAL)
    person.until(lambda: events(person)[1:] == ["restored"], "the window back in the record")
    person.answer("Up", "Up")
    person.window("windowsize", "500", "400")
    person.until(lambda: events(person)[2:] == ["resized"], "the new size in the record")
    log = person.log()
    lost = [bool(trial.details().get("window_lost")) for trial in log.trials if trial.kind == "all_pairs"]
    assert lost == [False, True, False]
    assert [(event.block, event.trial) for event in log.windows] == [(1, 1), (1, 1), (1, 3)]
    assert log.windows[2].size_px == (500, 400)
    assert person.process is not None
    person.process.send_signal(signal.SIGTERM)
    told = person.leave()
    assert "3 of 6 answers saved" in told
    assert person.process.returncode == 1
    person.study.cyclopean("report", person.study.results, "--no-thumbnails")
    page_of_results = " ".join((person.study.results / "report.html").read_text().split())
    assert "minimised 1 time and changed its size 1 time" in page_of_results


@pytest.fixture
def mortal(person: Person) -> Iterator[subprocess.Popen[bytes]]:
    """An X server of the person's own, which may be killed."""
    read, write = os.pipe()
    options = ["-screen", "0", "640x480x24", "-nolisten", "tcp", "-noreset"]
    server = subprocess.Popen(["Xvfb", "-displayfd", str(write), *options], pass_fds=[write], stderr=subprocess.DEVNULL)
    os.close(write)
    with os.fdopen(read) as told:
        person.screen = f":{told.readline().strip()}"
    yield server
    server.kill()
    server.wait()


@pytest.mark.nightly
def test_a_dead_x_server_ends_in_one_line_that_says_how_to_continue(
    person: Person, mortal: subprocess.Popen[bytes], xvfb: str
) -> None:
    person.sit_down()
    person.turn("space", "the first pair")
    person.answer("Up", "Down")
    mortal.kill()
    assert person.process is not None
    told, _ = person.process.communicate(timeout=60)
    assert person.process.returncode == 1
    last = told.strip().splitlines()[-1]
    assert "the X server was lost" in last
    assert "XIO" not in told
    assert "Traceback" not in told
    again = last.partition("Continue: cyclopean run ")[2]
    assert shlex.split(again) == [*person.words, "--resume"]
    (file,) = session_files(Path(person.study.results))
    assert sum(trial.kind == "all_pairs" for trial in read_session(file).trials) == 2
    person.screen = xvfb
    person.sit_down("--resume")
    person.answer("Up")
    time.sleep(0.3)
    person.turn("Escape")
    person.press("s")
    assert "3 of 6 answers saved" in person.leave()
    assert person.process.returncode == 1
