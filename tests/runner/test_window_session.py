"""A person's session: a real window on a real X server, real key presses sent by xdotool."""

from __future__ import annotations

import os
import shlex
import signal
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from devices.display import read_display
from stimuli.pictures import read_exr

Person = Any  # tests/conftest.py
pytestmark = pytest.mark.window


def test_a_session_with_real_keys(person: Person) -> None:
    person.timed_s = None
    person.sit_down()
    person.press("Up", "q")  # mean nothing on a page of words
    assert person.answers() == 0
    person.turn("space", "the first pair")
    person.answer("Up", "Down", "Down")
    person.turn("Escape")
    person.turn("c")
    person.answer("Up")
    person.turn("space")  # the break after four
    person.answer("Down")
    person.press("Up")
    told = person.leave()
    assert "6 answers are in" in told
    log = person.log()
    assert log.complete
    assert not log.header.simulated
    assert log.header.presentation.backend == "window"
    assert log.header.presentation.arithmetic.startswith(("doubles: ", "two-floats"))
    swaps = log.header.presentation.timing.swap_intervals
    assert swaps.frames * swaps.longest_ms >= 900.0  # timed for a second
    pairs = [trial for trial in log.trials if trial.kind == "all_pairs"]
    assert [trial.details()["answer"] for trial in pairs] == ["first", "second", "second", "first", "second", "first"]
    assert all(0.0 < trial.response_time_s < 30.0 for trial in pairs)


def test_what_the_window_shows_is_the_float64_reference(person: Person) -> None:
    person.sit_down()
    person.turn("space", "the first pair")
    time.sleep(0.3)
    screen = person.look()
    person.press("Up")
    person.until(lambda: person.answers() == 1, "the answer")
    first = person.log().trials[1].details()["first"]
    model = read_display(person.study.folder / "display.yaml").models("side-by-side").left
    image = read_exr(person.study.folder / f"{first}.exr")
    # 20 × 10 mm at 0.25 mm: 80 × 40 px; the upper picture's middle is 30 px above the middle of each half.
    for eye, middle in (("left", 160), ("right", 480)):
        shown = screen[240 - 30 - 20 : 240 - 30 + 20, middle - 40 : middle + 40]
        reference = model.code(image.eye(eye)) * 255  # type: ignore[arg-type]  # an eye
        assert np.abs(shown - reference).max() <= 0.501


def test_escape_twice_leaves_and_resume_continues(person: Person) -> None:
    person.sit_down()
    person.turn("space", "the first pair")
    person.answer("Up", "Up")
    person.turn("Escape")
    person.press("s")
    told = person.leave()
    _, _, again = told.partition("Stopped by the observer; 2 of 6 answers saved. Continue: cyclopean run ")
    assert shlex.split(again) == [*person.words, "--resume"]
    person.refused_to_sit_down("observer 07 has an unfinished session of 'small', with 2 answers")
    person.sit_down("--resume")
    person.answer("Down", "Down")
    person.turn("space")
    person.answer("Down")
    person.press("Down")
    assert "6 answers are in" in person.leave()
    answers = [trial.details()["answer"] for trial in person.log().trials if trial.kind == "all_pairs"]
    assert answers == ["first"] * 2 + ["second"] * 4


@pytest.mark.nightly
def test_waiting_for_an_answer_sleeps(person: Person) -> None:
    person.sit_down()
    time.sleep(0.5)
    assert person.process is not None

    def processor_s() -> float:
        fields = Path(f"/proc/{person.process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    before = processor_s()
    time.sleep(3)
    assert processor_s() - before < 0.1
    person.turn("Escape")
    person.press("s")
    person.leave()


def test_ctrl_c_wakes_the_sleeping_session_and_keeps_everything(person: Person) -> None:
    person.sit_down()
    person.turn("space", "the first pair")
    person.answer("Up")
    time.sleep(0.5)
    assert person.process is not None
    person.process.send_signal(signal.SIGINT)
    assert "Ctrl-C; 1 of 6 answers saved." in person.leave()
    assert person.answers() == 1
