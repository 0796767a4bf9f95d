"""The course of a measurement with instruments and keys that do as told: retries, failures, pauses, stops."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from devices.readings import (
    GarbledError,
    InstrumentError,
    LostError,
    MeasurementLog,
    PatchOnScreen,
    RangeError,
    Reading,
    TimedOutError,
    find_patches,
    read_session,
    step_facts,
    steps,
)
from runner.measuring.code_screen import CodeScreen, EyeCodes
from runner.measuring.take_readings import TakenReadings, take_readings
from runner.ports import KeyPress, WindowClosed
from runner.presenter import PresentationError, find_mode
from runner.presenter.surfaces.egl import EglSurface
from tests.runner.measuring.displays import HEADER

STEPS = steps(find_patches("grey"), 1)


@dataclass
class Told:
    """Reads the codes off the screen itself, and fails as told by label: the errors come one by one."""

    screen: CodeScreen
    errors: dict[str, list[InstrumentError]] = field(default_factory=dict)
    takes_s: float = 0.0
    asked: list[str] = field(default_factory=list)
    name: str = "told"

    def read(self, showing: PatchOnScreen) -> Reading:
        self.asked.append(showing.label)
        time.sleep(self.takes_s)
        if self.errors.get(showing.label):
            raise self.errors[showing.label].pop(0)
        red, green, blue = (100.0 * code for code in showing.codes)
        return Reading((red, green, blue))

    def close(self) -> None:
        pass


@dataclass
class Desk:
    """A screen, a log and keys that are pressed when the told label is asked for."""

    surface: EglSurface
    screen: CodeScreen
    log: MeasurementLog
    said: list[str] = field(default_factory=list)

    def run(self, instrument: Told, count: int = len(STEPS)) -> TakenReadings:
        order = STEPS[:count]
        return take_readings(self.screen, instrument, self.log, order, "both", 0.0, lambda: 1.0, self.said.append)


@pytest.fixture
def desk(tmp_path: Path) -> Iterator[Desk]:
    try:
        surface = EglSurface((32, 24))
    except PresentationError as error:
        pytest.skip(str(error))
    header = {**HEADER, "steps": step_facts(STEPS)}
    with (
        surface,
        CodeScreen(surface, find_mode("side-by-side")) as screen,
        MeasurementLog.create(tmp_path / "m.jsonl", header) as log,
    ):
        yield Desk(surface, screen, log)


def test_each_patch_is_on_the_screen_while_it_is_read_and_on_disk_before_the_next(desk: Desk) -> None:
    class Looking(Told):
        def read(self, showing: PatchOnScreen) -> Reading:
            kept = read_session(desk.log.file).readings
            assert sorted(kept) == list(range(showing.position))
            return super().read(showing)

    shown: list[tuple[float, ...]] = []
    show = desk.screen.show

    def showing(codes: EyeCodes) -> None:
        shown.append(codes.left)
        show(codes)

    desk.screen.show = showing  # type: ignore[method-assign]  # stands in for the real one
    assert desk.run(Looking(desk.screen)) == TakenReadings(len(STEPS), ())
    assert shown == [step.patch.codes for step in STEPS]
    kept = read_session(desk.log.file).readings
    for step in STEPS:
        np.testing.assert_allclose(kept[step.position].reading.XYZ_cd_m2, 100.0 * np.array(step.patch.codes))
    assert [words.split("/")[0] for words in desk.said] == [str(number + 1) for number in range(len(STEPS))]
    assert desk.said[-1].endswith("(done)")


def test_an_answer_without_sense_is_asked_for_again(desk: Desk) -> None:
    label = STEPS[3].label
    instrument = Told(desk.screen, {label: [GarbledError("junk"), TimedOutError("late")]})
    assert desk.run(instrument) == TakenReadings(len(STEPS), ())
    assert instrument.asked.count(label) == 3


def test_the_third_answer_without_sense_stops_it(desk: Desk) -> None:
    label = STEPS[3].label
    outcome = desk.run(Told(desk.screen, {label: [GarbledError("junk")] * 3}))
    assert outcome == TakenReadings(3, (label,), "junk")
    assert read_session(desk.log.file).failures == {3: "junk"}


def test_a_patch_out_of_range_is_left_for_later(desk: Desk) -> None:
    label = STEPS[4].label
    outcome = desk.run(Told(desk.screen, {label: [RangeError("too bright")]}))
    assert outcome == TakenReadings(len(STEPS) - 1, (label,))
    session = read_session(desk.log.file)
    assert [step.label for step in session.missing] == [label]
    assert [words.split("/")[0] for words in desk.said if "not read: too bright" in words] == ["5"]


def test_a_lost_instrument_stops_it_at_once(desk: Desk) -> None:
    label = STEPS[5].label
    instrument = Told(desk.screen, {label: [LostError("unplugged")]})
    assert desk.run(instrument) == TakenReadings(5, (label,), "unplugged")
    assert instrument.asked.count(label) == 1
    assert len(read_session(desk.log.file).readings) == 5


def _press(desk: Desk, keys: Callable[[], tuple[KeyPress, ...]]) -> None:
    desk.surface.poll_keys = keys  # type: ignore[method-assign]  # stands in for the real one


def test_escape_stops_after_the_reading_that_runs(desk: Desk) -> None:
    instrument = Told(desk.screen, takes_s=0.05)
    pressed: list[bool] = []

    def keys() -> tuple[KeyPress, ...]:
        if len(instrument.asked) == 3 and not pressed:
            pressed.append(True)
            return (KeyPress("escape", 0.0),)
        return ()

    _press(desk, keys)
    assert desk.run(instrument) == TakenReadings(3, (), "stopped at the keyboard")
    assert len(read_session(desk.log.file).readings) == 3


@pytest.mark.parametrize("closed", [False, True], ids=["escape twice", "window closed"])
def test_a_second_escape_or_a_closed_window_leaves_a_reading_that_hangs(desk: Desk, closed: bool) -> None:
    instrument = Told(desk.screen, takes_s=0.05)  # long enough for the keys to be heard

    def keys() -> tuple[KeyPress, ...]:
        if len(instrument.asked) < 3:
            instrument.takes_s = 5.0 if len(instrument.asked) == 2 else 0.05
            return ()
        if closed:
            raise WindowClosed("closed")
        return (KeyPress("escape", time.monotonic()),)  # twice within a quarter of a second is once

    _press(desk, keys)
    begun_s = time.monotonic()
    outcome = desk.run(instrument)
    assert outcome.stopped == "stopped at the keyboard"
    assert outcome.taken == len(read_session(desk.log.file).readings) == 2
    assert time.monotonic() - begun_s < 4.0


def test_space_pauses_until_space(desk: Desk) -> None:
    instrument = Told(desk.screen, takes_s=0.02)
    polls = 0

    def keys() -> tuple[KeyPress, ...]:
        nonlocal polls
        if len(instrument.asked) < 2:
            return ()
        polls += 1
        if polls in (1, 40):
            pressed_s = float(polls)
            return (KeyPress("space", pressed_s), KeyPress("text  ", pressed_s), KeyPress("space", pressed_s + 0.05))
        if polls == 39:
            assert len(instrument.asked) == 2
        return ()

    _press(desk, keys)
    assert desk.run(instrument, 5) == TakenReadings(5, ())
    assert polls > 40
    assert [words for words in desk.said if "/" not in words] == ["paused: space resumes", "resumed"]


def test_frames_in_turn_go_on_while_the_instrument_reads(desk: Desk) -> None:
    with CodeScreen(desk.surface, find_mode("frame-sequential")) as screen:
        drawn: list[float] = []
        redraw = screen.redraw

        def redrawing() -> None:
            drawn.append(time.monotonic())
            redraw()

        screen.redraw = redrawing  # type: ignore[method-assign]  # stands in for the real one
        desk.screen = screen
        desk.run(Told(screen, takes_s=0.3), 1)
    assert len(drawn) > 8  # 18 refreshes of 60 Hz, on a machine that may be busy
