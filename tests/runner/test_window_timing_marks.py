"""Marks of a person's session in a real window, with real keys: what comes out of the port, also after a kill."""

from __future__ import annotations

import json
import os
import signal
import sys
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from typing import Any

import pytest

from documents.platform import pseudo_terminal

Person = Any  # tests/conftest.py
Read = Callable[[float], bytes]
pytestmark = [
    pytest.mark.window,
    pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals"),
]


@pytest.fixture
def line(person: Person) -> Iterator[tuple[str, Read]]:
    """The pseudo-terminal that the person's rig sends its marks to."""
    with pseudo_terminal() as pair:
        assert pair is not None
        marks = f"{{kind: serial, port: {pair[0]}, onset: 5, answer: 6}}"
        person.study.edit("rig.yaml", "distance_mm: 700", f"distance_mm: 700\ntiming_marks: {marks}")
        yield pair


def test_what_is_seen_and_pressed_is_marked_and_the_menu_is_not(person: Person, line: tuple[str, Read]) -> None:
    name, read = line
    person.sit_down()
    assert read(5.0) == b"\x05"  # the instructions
    person.press("q")  # means nothing
    person.turn("space", "the first pair")
    assert read(5.0) == b"\x06\x05"
    person.answer("Up")
    assert read(5.0) == b"\x06\x05"
    person.turn("Escape")
    assert read(0.2) == b""
    person.turn("c")
    assert read(5.0) == b"\x05"  # the pair is shown again
    person.answer("Down")
    assert read(5.0) == b"\x06\x05"
    person.turn("Escape")
    person.press("s")
    person.leave()
    assert read(0.2) == b""
    log = person.log()
    marks = [[mark["mark"] for mark in trial.data["timing_marks"]] for trial in log.trials]
    assert marks == [["onset", "answer"], ["onset", "answer"], ["onset", "onset", "answer"]]
    for trial in log.trials:
        onset, answer = trial.data["timing_marks"][-2:]
        assert onset["port"] == f"serial {name}"
        # The press came after the onset by the response time; marks were sent after both.
        between_s = (answer["sent_s"] - answer["after_ms"] / 1000.0) - (onset["sent_s"] - onset["after_ms"] / 1000.0)
        assert between_s == pytest.approx(trial.response_time_s, abs=0.0002)  # of clocks read one after the other
        assert onset["after_ms"] > 0.0
        assert answer["after_ms"] > 0.0


def test_killed_and_resumed_with_marks(person: Person, line: tuple[str, Read]) -> None:
    _, read = line
    person.sit_down()
    person.turn("space", "the first pair")
    person.answer("Up", "Down")
    assert read(5.0) == b"\x05" + 3 * b"\x06\x05"
    assert person.process is not None
    os.kill(person.process.pid, signal.SIGKILL)
    person.process.communicate()
    assert read(0.2) == b""
    person.sit_down("--resume")
    assert read(5.0) == b"\x05"  # the third pair: none of those that are answered is marked again
    person.answer("Up", "Up")
    person.turn("space")  # the break after four
    person.answer("Down")
    person.press("Up")
    assert "6 answers are in" in person.leave()
    assert read(5.0) == 4 * b"\x06\x05" + b"\x06"
    log = person.log()
    marks = [mark for trial in log.trials for mark in trial.data["timing_marks"]]
    assert [mark["mark"] for mark in marks] == ["onset", "answer"] * 8
    sent = [mark["sent_s"] for mark in marks]
    assert sent == sorted(sent)


def test_a_port_that_is_not_there_opens_no_window(person: Person) -> None:
    marks = "{kind: serial, port: /dev/no_such_port}"
    person.study.edit("rig.yaml", "distance_mm: 700", f"distance_mm: 700\ntiming_marks: {marks}")
    person.refused_to_sit_down("rig.yaml:5:36: serial /dev/no_such_port: there is no such serial port")
    assert not person.study.results.exists()


@pytest.mark.skipif(find_spec("pylsl") is None, reason="pylsl is not installed (pip install '.[lsl]')")
def test_doctor_measures_each_kind_of_mark(person: Person, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DISPLAY", person.screen)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pseudo_terminal() as pair:
        assert pair is not None
        entries = f"{{kind: serial, port: {pair[0]}}}, {{kind: lsl, stream: doctor {os.getpid()}}}, {{kind: parallel}}"
        person.study.edit("rig.yaml", "distance_mm: 700", f"distance_mm: 700\ntiming_marks: [{entries}]")
        words = ("doctor", "--timing", "--seconds", "0.5", "--rig", person.study.folder / "rig.yaml", "--json")
        report = json.loads(person.study.cyclopean(*words).stdout)
        assert pair[1](1.0).count(b"\x01") == 200
    serial, stream, parallel = report["timing_marks"]
    for found in (serial, stream):
        assert found["problem"] == ""
        for delay in (found["sent"], found["looped_sent"], found["looped_received"]):
            assert 0.0 < delay["median_ms"] <= delay["worst_ms"]
        assert found["looped_received"]["median_ms"] > found["looped_sent"]["median_ms"]
    assert parallel["sent"] is None
    assert "there is no such parallel port" in parallel["problem"]
    words_of_it = " ".join(report["meaning"])
    assert f"Marks on serial {pair[0]} were sent" in words_of_it
    assert "By an inlet in the same process, marks of lsl doctor" in words_of_it
    assert "Marks on parallel /dev/parport0 cannot be received here without a wire." in words_of_it
