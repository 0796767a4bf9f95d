"""Marks of a person's session in a real window, with real keys: what comes out of the port, also after a kill."""

from __future__ import annotations

import json
import os
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
    marks = [[mark["mark"] for mark in trial.details()["timing_marks"]] for trial in log.trials]
    assert marks == [["onset", "answer"], ["onset", "answer"], ["onset", "onset", "answer"]]
    for trial in log.trials:
        onset, answer = trial.details()["timing_marks"][-2:]
        assert onset["port"] == f"serial {name}"
        # The press came after the onset by the response time; marks were sent after both.
        between_s = (answer["sent_s"] - answer["after_ms"] / 1000.0) - (onset["sent_s"] - onset["after_ms"] / 1000.0)
        assert between_s == pytest.approx(trial.response_time_s, abs=0.0002)  # of clocks read one after the other
        assert onset["after_ms"] > 0.0
        assert answer["after_ms"] > 0.0


@pytest.mark.skipif(find_spec("pylsl") is None, reason="pylsl is not installed (pip install '.[lsl]')")
@pytest.mark.nightly
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
    said = " ".join(report["meaning"])
    assert all(port in said for port in (f"serial {pair[0]}", "lsl doctor", "parallel /dev/parport0"))
