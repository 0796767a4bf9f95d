"""The course of a measurement: show a patch, let it settle, read it, keep the reading, show the next.

The instrument reads in a thread of its own, so that the screen is kept (frames in turn, what the window system lost)
and keys are heard meanwhile: space pauses, Escape stops after the reading, a second Escape at once.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from queue import Empty, SimpleQueue

from devices.instruments import Instrument, Reading, Showing
from devices.instruments.errors import GarbledError, InstrumentError, LostError, RangeError
from devices.patches import Step
from runner.measuring.code_screen import CodeScreen, EyeCodes
from runner.measuring.log import MeasurementLog
from runner.ports import WindowClosed

TRIES = 3
_IDLE_S = 0.004
_REFRESH_HZ = 60.0


@dataclass(frozen=True, slots=True)
class Progress:
    """What was just done: ``reading`` of ``step``, or ``why`` there is none; the ``done`` of ``of``, and time left."""

    step: Step
    reading: Reading | None
    why: str
    done: int
    of: int
    left_s: float


@dataclass(frozen=True, slots=True)
class Outcome:
    """How many readings were taken, the labels of those that could not be, and why it stopped early, if it did."""

    taken: int
    failed: tuple[str, ...]
    stopped: str = ""


class Keys:
    """What keys ask for. ``poll`` keeps the screen and hears the keys once; it sleeps for the least while."""

    def __init__(self, screen: CodeScreen, tell: Callable[[str], None], on_stop: str = "stopping") -> None:
        self._screen = screen
        self._tell = tell
        self._on_stop = on_stop
        self._refresh_s = 1.0 / (screen.surface.facts.refresh_hz or _REFRESH_HZ)
        self._paced = screen.surface.facts.vsync
        self.paused = False
        self.stops = 0

    def poll(self) -> str:
        """Return the last other key that was pressed, an empty text if none.

        A closed window is as two presses of Escape.
        """
        other = ""
        try:
            for press in self._screen.surface.poll_keys():
                if press.key == "space":
                    self.paused = not self.paused
                    self._tell("paused: space goes on" if self.paused else "going on")
                elif press.key == "escape":
                    self.stops += 1
                    self._tell(self._on_stop)
                elif not press.key.startswith(("text ", "again ", "click")):
                    other = press.key
        except WindowClosed:
            self.stops = 2
        if self._screen.takes_turns:
            self._screen.redraw()
            if not self._paced:
                time.sleep(self._refresh_s)
        else:
            time.sleep(_IDLE_S)
        return other

    def wait(self, seconds: float) -> None:
        """Keep the screen for ``seconds``, less if asked to stop."""
        until_s = time.monotonic() + seconds
        while time.monotonic() < until_s and not self.stops:
            self.poll()

    def wait_while_paused(self) -> None:
        """Keep the screen until the pause ends or it is to stop."""
        while self.paused and not self.stops:
            self.poll()


def take_readings(
    screen: CodeScreen,
    instrument: Instrument,
    log: MeasurementLog,
    steps: Sequence[Step],
    eye: str,
    settle_s: float,
    elapsed_s: Callable[[], float],
    on_progress: Callable[[Progress], None] = lambda progress: None,
    tell: Callable[[str], None] = lambda words: None,
) -> Outcome:
    """Read ``steps`` in their order, each kept in ``log`` before the next is shown.

    ``elapsed_s`` tells the seconds since the measurement began, over all its resumptions. A patch out of the
    instrument's range is recorded as failed, and the next comes; an answer that makes no sense is asked for again, and
    the third such, or a lost instrument, stops the measurement.
    """
    keys = Keys(screen, tell, "stopping after this reading; Escape again stops at once")
    failed: list[str] = []
    taken = 0
    begun_s = time.monotonic()
    paused_s = 0.0
    for done, step in enumerate(steps):
        before_s = time.monotonic()
        keys.wait_while_paused()
        paused_s += time.monotonic() - before_s
        if keys.stops:
            return Outcome(taken, tuple(failed), "stopped at the keyboard")
        screen.show(EyeCodes.of(step.patch.codes, "both" if screen.shared else eye))
        keys.wait(settle_s)
        if keys.stops:
            return Outcome(taken, tuple(failed), "stopped at the keyboard")
        read_at_s = elapsed_s()
        showing = Showing(step.label, step.patch.codes, step.position, read_at_s)
        reading, why = None, ""
        try:
            reading = _read(instrument, showing, keys)
        except RangeError as error:
            why = str(error)
        except InstrumentError as error:
            log.fail(step, read_at_s, str(error))
            return Outcome(taken, (*failed, step.label), str(error))
        if reading is None and not why:
            return Outcome(taken, tuple(failed), "stopped at the keyboard")
        if reading is not None:
            log.keep(step, read_at_s, reading)
            taken += 1
        else:
            log.fail(step, read_at_s, why)
            failed.append(step.label)
        each_s = (time.monotonic() - begun_s - paused_s) / (done + 1)
        left_s = each_s * (len(steps) - done - 1)
        on_progress(Progress(step, reading, why, done + 1, len(steps), left_s))
    return Outcome(taken, tuple(failed))


def _read(instrument: Instrument, showing: Showing, keys: Keys) -> Reading | None:
    """Return the reading, None if it was stopped at once; an answer that makes no sense is asked for again."""
    for left in reversed(range(TRIES)):
        try:
            return _in_a_thread(lambda: instrument.read(showing), keys)
        except GarbledError:
            if not left or keys.stops:
                raise
    raise LostError("the instrument was not asked")  # TRIES is above 0


def _in_a_thread(read: Callable[[], Reading], keys: Keys) -> Reading | None:
    """Return what ``read`` does, keeping the screen meanwhile; None if it was to be stopped at once."""
    answers: SimpleQueue[Reading | BaseException] = SimpleQueue()

    def work() -> None:
        try:
            answers.put(read())
        except BaseException as error:
            answers.put(error)

    threading.Thread(target=work, name="instrument", daemon=True).start()
    while keys.stops < 2:
        try:
            answer = answers.get_nowait()
        except Empty:
            keys.poll()
            continue
        if isinstance(answer, BaseException):
            raise answer
        return answer
    return None
