"""A person's session: a real window on a real X server, real key presses sent by xdotool."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analysis.records import SessionLog, read_session, session_files
from devices.display_file import read_display
from stimuli.exr import read_exr

Study = Any  # tests/conftest.py
pytestmark = pytest.mark.window


class Person:
    """Someone at the keyboard of the display ``screen``."""

    def __init__(self, screen: str, study: Study) -> None:
        self.screen = screen
        self.study = study
        self.process: subprocess.Popen[str] | None = None

    def sit_down(self, *more: str) -> None:
        """Start the session and wait for its window to have drawn."""
        code = "from runner.cli.main import main; main()"
        command = [sys.executable, "-c", code, "run", str(self.study.experiment), "--observer", "07"]
        environment = {**os.environ, "DISPLAY": self.screen}
        environment.pop("WAYLAND_DISPLAY", None)
        self.process = subprocess.Popen(
            [*command, "--results", str(self.study.results), *more],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env=environment,
        )
        self.until(lambda: np.any(self.look()), "the window to draw something")

    def press(self, *keys: str) -> None:
        """Press keys one after the other."""
        for key in keys:
            self._xdotool("key", key)
            time.sleep(0.05)

    def close_the_window(self) -> None:
        """Ask the window to close, as a window manager does."""
        window = self._xdotool("search", "--name", "^cyclopean$").split()[-1]
        self._xdotool("windowclose", window)

    def look(self) -> np.ndarray:
        """Return what is on the screen, (height, width, 3)."""
        from PIL import ImageGrab

        return np.asarray(ImageGrab.grab(xdisplay=self.screen).convert("RGB"))

    def log(self) -> SessionLog:
        """Return the session's log."""
        (file,) = session_files(self.study.results)
        return read_session(file)

    def answers(self) -> int:
        """Return how many pairs are on disk."""
        files = list(session_files(self.study.results)) if self.study.results.exists() else []
        return sum(trial.kind == "all_pairs" for file in files for trial in read_session(file).trials)

    def until(self, come_true: Callable[[], object], what: str, within_s: float = 30.0) -> None:
        """Wait for something to come true."""
        end = time.monotonic() + within_s
        while time.monotonic() < end:
            if come_true():
                return
            if self.process is not None and self.process.poll() is not None:
                break
            time.sleep(0.02)
        if come_true():
            return
        told = self.leave()
        pytest.fail(f"waited in vain for {what}; the program said: {told}")

    def leave(self) -> str:
        """Wait for the program to end and return what it said."""
        assert self.process is not None
        try:
            told, _ = self.process.communicate(timeout=20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            told, _ = self.process.communicate()
        return told

    def _xdotool(self, *words: str) -> str:
        environment = {**os.environ, "DISPLAY": self.screen}
        return subprocess.run(["xdotool", *words], env=environment, check=True, capture_output=True, text=True).stdout


@pytest.fixture
def person(xvfb: str, study: Study) -> Any:
    if shutil.which("xdotool") is None:
        pytest.skip("xdotool is not installed (package xdotool)")
    someone = Person(xvfb, study)
    yield someone
    if someone.process is not None and someone.process.poll() is None:
        someone.process.kill()
        someone.process.communicate()


def _answer(person: Person, *keys: str) -> None:
    """Answer pairs, each pressed once the one before is on disk and the next is on the screen."""
    for key in keys:
        before, seen = person.answers(), person.look()
        person.press(key)
        person.until(partial(_more_than, person, before), f"the answer '{key}' to be on disk")
        person.until(partial(_changed, person, seen), "the next screen", within_s=5)


def _more_than(person: Person, answers: int) -> bool:
    return person.answers() > answers


def _changed(person: Person, seen: np.ndarray) -> bool:
    return bool(np.any(person.look() != seen))


def test_a_session_with_real_keys(person: Person) -> None:
    person.sit_down()
    page = person.look()
    person.press("Up", "q")  # mean nothing on a page of words
    assert person.answers() == 0
    person.press("space")
    person.until(lambda: np.any(person.look() != page), "the first pair")
    _answer(person, "Up", "Down", "Down")
    person.press("Escape")
    time.sleep(0.3)
    person.press("n")
    time.sleep(0.3)
    _answer(person, "Up")
    person.press("space")  # the break after four
    time.sleep(0.3)
    _answer(person, "Down")
    person.press("Up")
    told = person.leave()
    assert "6 answers are in" in told
    log = person.log()
    assert log.complete
    assert not log.header.simulated
    assert log.header.presentation["backend"] == "window"
    pairs = [trial for trial in log.trials if trial.kind == "all_pairs"]
    assert [trial.data["answer"] for trial in pairs] == ["first", "second", "second", "first", "second", "first"]
    assert all(0.0 < trial.response_time_s < 30.0 for trial in pairs)


def test_what_the_window_shows_is_the_float64_reference(person: Person) -> None:
    person.sit_down()
    page = person.look()
    person.press("space")
    person.until(lambda: np.any(person.look() != page), "the first pair")
    time.sleep(0.3)
    screen = person.look()
    person.press("Up")
    person.until(lambda: person.answers() == 1, "the answer")
    first = person.log().trials[1].data["first"]
    model = read_display(person.study.folder / "display.yaml").models("side-by-side").left
    image = read_exr(person.study.folder / f"{first}.exr")
    # 20 × 10 mm at 0.25 mm: 80 × 40 px; the upper picture's middle is 30 px above the middle of each half.
    for eye, middle in (("left", 160), ("right", 480)):
        shown = screen[240 - 30 - 20 : 240 - 30 + 20, middle - 40 : middle + 40]
        reference = model.code(image.eye(eye)) * 255  # type: ignore[arg-type]
        assert np.abs(shown - reference).max() <= 0.501


def test_escape_twice_leaves_and_resume_goes_on(person: Person) -> None:
    person.sit_down()
    page = person.look()
    person.press("space")
    person.until(lambda: np.any(person.look() != page), "the first pair")
    _answer(person, "Up", "Up")
    person.press("Escape")
    time.sleep(0.3)
    person.press("y")
    assert "Stopped (left) after 2 of 6 answers, all saved" in person.leave()
    person.sit_down("--resume")
    _answer(person, "Down", "Down")
    person.press("space")
    time.sleep(0.3)
    _answer(person, "Down")
    person.press("Down")
    assert "6 answers are in" in person.leave()
    answers = [trial.data["answer"] for trial in person.log().trials if trial.kind == "all_pairs"]
    assert answers == ["first"] * 2 + ["second"] * 4


def test_waiting_for_an_answer_sleeps(person: Person) -> None:
    person.sit_down()
    time.sleep(0.5)
    assert person.process is not None

    def processor_s() -> float:
        fields = Path(f"/proc/{person.process.pid}/stat").read_text().rsplit(")", 1)[1].split()  # type: ignore[union-attr]
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    before = processor_s()
    time.sleep(3)
    assert processor_s() - before < 0.1
    person.press("Escape")
    time.sleep(0.2)
    person.press("y")
    person.leave()


def test_closing_the_window_keeps_everything(person: Person) -> None:
    person.sit_down()
    page = person.look()
    person.press("space")
    person.until(lambda: np.any(person.look() != page), "the first pair")
    _answer(person, "Up")
    person.press("alt+F4")
    time.sleep(0.2)
    person.close_the_window()
    person.leave()
    assert person.answers() == 1


def test_timed_scenes_in_a_real_window(person: Person) -> None:
    """A cross, a pair for a fifth of a second, then the question alone; keys pressed before it are no answers."""
    person.study.edit(
        "small.yaml", "break_every: 4", "break_every: 4, fixation_s: 0.3, exposure_s: 0.2, stimuli: [one, two]"
    )
    person.sit_down()
    page = person.look()
    person.press("space")
    person.press("Up", "Up")  # during the cross
    person.until(lambda: np.any(person.look() != page), "the cross")
    time.sleep(1.0)
    assert person.answers() == 0
    person.press("Down")
    assert "1 answers are in" in person.leave()
    (trial,) = (trial for trial in person.log().trials if trial.kind == "all_pairs")
    assert trial.data["answer"] == "second"
    cross, pair = trial.data["timed"]
    assert (cross["what"], cross["frames"]) == ("fixation", 18)
    assert (pair["what"], pair["frames"]) == ("pair", 12)
    for held in (cross, pair):
        # A virtual screen does not pace the swaps and this machine is shared: late is counted, early would be a fault.
        assert held["shown_ms"] >= held["asked_ms"] - 1.0
        assert held["missed_frames"] == max(0, round(held["shown_ms"] / (1000 / 60)) - held["frames"])


def test_ctrl_c_wakes_the_sleeping_session_and_keeps_everything(person: Person) -> None:
    person.sit_down()
    page = person.look()
    person.press("space")
    person.until(lambda: np.any(person.look() != page), "the first pair")
    _answer(person, "Up")
    time.sleep(0.5)
    assert person.process is not None
    person.process.send_signal(signal.SIGINT)
    assert "Stopped (interrupted) after 1 of 6 answers, all saved" in person.leave()
    assert person.answers() == 1
