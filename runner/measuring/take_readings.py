"""The course of a measurement: show a patch, let it settle, read it, keep the reading, show the next.

The instrument reads in a thread of its own, so that the screen is kept (frames in turn, what the window system lost)
and keys are heard meanwhile: space pauses, Escape stops after the reading, a second Escape at once.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, SimpleQueue

from analysis.records import duration
from devices.readings import (
    BEFORE_SETTLINGS,
    Arrangement,
    GarbledError,
    Instrument,
    InstrumentError,
    LostError,
    MeasurementLog,
    PatchEye,
    PatchOnScreen,
    PatchTurn,
    RangeError,
    Reading,
)
from documents import WorkError, counted
from runner.measuring.judge import Judge
from runner.measuring.keys import Keys
from runner.measuring.patch_screen import PatchScreen

TRIES = 3
_STOPPED = "stopped at the keyboard"


@dataclass(frozen=True, slots=True)
class TakenReadings:
    """How many readings were taken, the labels of those that could not be, and why it stopped early, if it did.

    ``set_aside`` are the labels of readings that make no sense, which do not count; they are to be read again.
    """

    taken: int
    failed: tuple[str, ...]
    stopped: str = ""
    set_aside: tuple[str, ...] = ()

    def failure(self, file: Path) -> WorkError | None:
        """Return what to raise where patches are missing in ``file``, with how to resume; None where none is."""
        safe = f"{counted(self.taken, 'reading is', 'readings are')} safe in {file}"
        if self.set_aside:
            aside = counted(len(self.set_aside), "reading was", "readings were")
            return WorkError(
                f"{self.stopped}; {aside} set aside, and {safe}: --resume reads what is missing; if such readings are "
                "right, --accept-readings keeps them"
            )
        if self.stopped:
            return WorkError(f"{self.stopped}; {safe}: resume with --resume")
        if not self.failed:
            return None
        shown = ", ".join(self.failed[:5]) + (" ..." if len(self.failed) > 5 else "")
        return WorkError(
            f"{counted(len(self.failed), 'patch', 'patches')} could not be read ({shown}); "
            f"try {'it' if len(self.failed) == 1 else 'them'} again with --resume"
        )


def take_readings(
    screen: PatchScreen,
    instrument: Instrument,
    log: MeasurementLog,
    steps: Sequence[PatchTurn],
    eye: PatchEye,
    settle_s: float,
    elapsed_s: Callable[[], float],
    say: Callable[[str], None] = lambda words: None,
    ready: Callable[[str], bool] | None = None,
    change: Callable[[], str] = lambda: "",
    judge: Judge | None = None,
    *,
    accept: bool = False,
) -> TakenReadings:
    """Read ``steps`` in their order, each kept in ``log`` before the next is shown, and ``say`` each.

    ``elapsed_s`` returns the seconds since the measurement began, over all its resumptions. A patch out of the
    instrument's range is recorded as failed, and the next comes; an answer that makes no sense is asked for again, and
    the third such, or a lost instrument, stops the measurement.

    Where a person must move the instrument or the glasses, ``ready`` gets what to do and returns once it is done,
    False to stop; without it, the words stand on the screen until a key.

    ``change`` is called after each reading. What it returns, if anything, says what changed the light; the reading is
    then not kept, and the measurement stops.

    Readings that ``judge`` doubts are set aside in ``log``, to be read again, and the measurement stops; with
    ``accept`` they are kept, which ``log`` says.
    """
    keys = Keys(screen, say, "stopping after this reading; Escape again stops at once")
    ready = ready or keys.ask
    failed: list[str] = []
    taken = 0
    stands = Arrangement(eye)
    busy_s, read_at_s = 0.0, -math.inf
    for done, step in enumerate(steps):
        keys.wait_while_paused()
        if keys.stops:
            return TakenReadings(taken, tuple(failed), _STOPPED)
        before = step.patch.shown_before
        shown = screen.show_patch(before or step.patch, eye)
        wanted = step.patch.arrangement(eye)
        request = wanted.request(stands)
        if request and not ready(request):
            return TakenReadings(
                taken, tuple(failed), _STOPPED if keys.stops else "nobody says that the instrument stands"
            )
        stands = wanted
        keys.wait(read_at_s + step.patch.wait_s - elapsed_s() - settle_s if step.patch.wait_s else 0.0)
        began_s = time.monotonic()
        if before is not None:
            keys.wait(BEFORE_SETTLINGS * settle_s)
            shown = screen.show_patch(step.patch, eye)
        keys.wait(settle_s)
        if keys.stops:
            return TakenReadings(taken, tuple(failed), _STOPPED)
        read_at_s = elapsed_s()
        showing = PatchOnScreen(step.label, shown.own, step.position, read_at_s, shown.other, step.patch, shown.place)
        reading, why = None, ""
        try:
            reading = _read(instrument, showing, keys)
        except RangeError as error:
            why = str(error)
        except InstrumentError as error:
            log.fail(step, read_at_s, str(error))
            return TakenReadings(taken, (*failed, step.label), str(error))
        if reading is None and not why:
            return TakenReadings(taken, tuple(failed), _STOPPED)
        if changed := change():
            log.note(stopped=changed, position=step.position)
            return TakenReadings(taken, tuple(failed), changed)
        if reading is not None:
            log.keep(step, read_at_s, reading, shown)
            taken += 1
            doubt = judge.doubt(step, reading) if judge else None
            if doubt and accept:
                log.note(accepted=doubt.words, position=step.position)
                say(f"kept all the same: {doubt.words}")
            elif doubt:
                log.set_aside(doubt.positions, doubt.words)
                return TakenReadings(max(0, taken - len(doubt.labels)), tuple(failed), doubt.words, doubt.labels)
        else:
            log.fail(step, read_at_s, why)
            failed.append(step.label)
        busy_s += time.monotonic() - began_s
        each_s = busy_s / (done + 1)
        left_s = sum(max(each_s, later.patch.wait_s) for later in steps[done + 1 :])
        found = "X {:.4g}  Y {:.4g}  Z {:.4g} cd/m²".format(*reading.XYZ_cd_m2) if reading else f"not read: {why}"
        left = f"{duration(round(left_s))} left" if done + 1 < len(steps) else "done"
        say(f"{done + 1}/{len(steps)}  {step.label}: {found}  ({left})")
    return TakenReadings(taken, tuple(failed))


def _read(instrument: Instrument, showing: PatchOnScreen, keys: Keys) -> Reading | None:
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
