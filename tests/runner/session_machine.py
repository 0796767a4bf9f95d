"""The session engine as a state machine: whatever is done to it, and to its disk and its clock, no answer is lost.

An observer's presses and clicks, storms of presses that answer nothing, the experimenter's notes and marks, kills at
any byte of a line, faults of the disk and a clock that is set, in any order, through one block or two of different
kinds. The session runs in a thread that waits for each press.
"""

from __future__ import annotations

import errno
import json
import os
import queue
import shutil
import tempfile
import threading
from collections import Counter
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from functools import lru_cache
from pathlib import Path
from typing import Any

import pytest
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from analysis.kinds import Trial
from analysis.records import FILE_NAME, Mark, Note, Resumption, SessionLog, SessionTimes, new_header, read_session
from documents.files import durable_log
from runner.blocks import Block
from runner.errors import SessionError
from runner.observers import key_for, plain_key
from runner.ports import MOST_IGNORED, Ask, Ignored, KeyPress, ObserverLeft, WindowClosed
from runner.session import Event, Recorded, Recorder, Resumed, Session
from runner.session.clocks import SteadyClock
from tests.runner.every_kind import VARIANTS, Fickle, Stage, experiment, written

MOST_ASKS = 3000
START = datetime(2026, 3, 1, 12, tzinfo=UTC)
# Of how a trial came about, which may differ where a session was stopped.
CIRCUMSTANCES = ("timed", "interruptions", "ignored", "ignored_more", "clipping")


class Killed(BaseException):
    """The process was killed here."""


@lru_cache
def _blocks(*variants: tuple[str, int]) -> tuple[Block, ...]:
    folder = Path(tempfile.mkdtemp())
    words = "kind: instructions, text: Look."
    try:
        return experiment(folder, words, *(written(*variant) for variant in variants), words).blocks("01")
    finally:
        shutil.rmtree(folder)


@dataclass
class Disk:
    """The disk below the log: it fails, or the process is killed there, as the ``fault`` says that is set for once."""

    fault: str = ""
    keeps: float = 0.0  # the share of a line that is written before the fault
    truncates: bool = True

    def __getattr__(self, name: str) -> Any:
        return getattr(os, name)

    def fsync(self, descriptor: int) -> None:
        if self.fault in ("fsync fails", "killed before fsync"):
            fault, self.fault = self.fault, ""
            if fault == "fsync fails":
                raise OSError(errno.EIO, "Input/output error")
            raise Killed

    def ftruncate(self, descriptor: int, length: int) -> None:
        if not self.truncates:
            self.truncates = True
            raise OSError(errno.EIO, "Input/output error")
        os.ftruncate(descriptor, length)


class Stream:
    """The log's stream on that disk."""

    def __init__(self, file: Path, disk: Disk) -> None:
        self._stream = open(file, "ab", buffering=0)  # noqa: SIM115  # it is closed with the log
        self._disk = disk

    def write(self, data: Any) -> int:
        if self._disk.fault not in ("full", "killed"):
            return self._stream.write(data)
        if self._disk.keeps:
            written = self._stream.write(bytes(data)[: max(1, int(self._disk.keeps * len(data)))])
            self._disk.keeps = 0.0
            return written
        fault, self._disk.fault = self._disk.fault, ""
        if fault == "full":
            raise OSError(errno.ENOSPC, "No space left on device")
        raise Killed

    def fileno(self) -> int:
        return self._stream.fileno()

    @property
    def closed(self) -> bool:
        return self._stream.closed

    def close(self) -> None:
        self._stream.close()


@dataclass
class Clocks:
    """The machine's clock, which may be set, and the time that has passed."""

    passed_s: float = 0.0
    set_by_s: float = 0.0

    def wall(self) -> datetime:
        return START + timedelta(seconds=self.passed_s + self.set_by_s)

    def elapsed(self) -> float:
        return self.passed_s

    def steady(self, not_before: datetime | None = None) -> SteadyClock:
        return SteadyClock(self.wall, self.elapsed, not_before)


@dataclass
class Kept:
    """A log that lists what was on disk when it returned."""

    recorder: Recorder
    acknowledged: list[Any]

    def hear(self, event: Event) -> None:
        self.recorder.hear(event)
        if isinstance(event, Recorded) and isinstance(event.record, Trial | Note | Mark):
            self.acknowledged.append(_plain(event.record))


@dataclass
class Sitting:
    """A session that runs in a thread of its own until it is over; ``ask`` is what it waits for."""

    session: Session
    recorder: Recorder
    ask: Ask | None = None
    ended_by: BaseException | None = None
    _presses: queue.Queue[Any] = field(default_factory=queue.Queue)
    _asks: queue.Queue[Ask | None] = field(default_factory=queue.Queue)

    def start(self) -> None:
        self.session.observer = self
        threading.Thread(target=self._run, daemon=True).start()
        self.ask = self._asks.get()

    def _run(self) -> None:
        try:
            with self.recorder:
                self.session.run()
        except BaseException as error:
            self.ended_by = error
        self._asks.put(None)

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        self._asks.put(ask)
        press = self._presses.get()
        if isinstance(press, BaseException):
            raise press
        key, seconds, storm = press
        ignored = tuple(Ignored(key, -0.1 - number, "before") for number in range(min(storm, MOST_IGNORED)))
        return KeyPress(key, onset_s + seconds, ignored, storm - len(ignored))

    def press(self, press: Any) -> None:
        """Press a key after some seconds and a storm of others, or end the session by an exception.

        Wait for what is asked next.
        """
        self._presses.put(press)
        self.ask = self._asks.get()


def _plain(record: Any) -> Any:
    return json.loads(json.dumps(record.to_json()))


class SessionMachine(RuleBasedStateMachine):
    """See the file's description; each step is followed by a look at the log."""

    def __init__(self) -> None:
        super().__init__()
        self.home = Path(tempfile.mkdtemp())
        self.folder = self.home / "s"
        self.disk, self.clocks = Disk(), Clocks()
        self.acknowledged: list[Any] = []
        self.may_survive = 0  # lines that were not acknowledged, but may be on disk
        self.sitting: Sitting | None = None
        self.complete = False
        self.patch = pytest.MonkeyPatch()
        self.patch.setattr(durable_log, "os", self.disk)
        self.patch.setattr(durable_log, "_open", lambda file: Stream(file, self.disk))

    @initialize(
        variants=st.lists(st.sampled_from(VARIANTS), min_size=1, max_size=2, unique_by=lambda one: one[0]),
        seed=st.integers(0, 9),
    )
    def begin(self, variants: list[tuple[str, int]], seed: int) -> None:
        self.blocks = _blocks(*variants)
        self.person = Fickle(seed)
        clock = self.clocks.steady()
        stimuli = tuple({"name": name, "factors": {}, "flat": True} for name in "abcdef")
        header = new_header("e", "01", "s", clock(), question="Which?", simulated=True, stimuli=stimuli)
        self._sit(Recorder.create(self.folder, header), clock)

    def _sit(self, recorder: Recorder, clock: SteadyClock, log: SessionLog | None = None) -> None:
        kept = Kept(recorder, self.acknowledged)
        session = Session(self.blocks, Stage(), self.person, kept, Resumed.of(log) if log else Resumed(), utc=clock)
        self.sitting = Sitting(session, recorder)
        self.sitting.start()
        self._settle()

    def _settle(self) -> None:
        """Take note of a session that is over."""
        if self.sitting is None or self.sitting.ask is not None:
            return
        error, self.sitting = self.sitting.ended_by, None
        self.disk.fault, self.disk.truncates = "", True
        self.complete = error is None
        self.may_survive = 0 if error is None else 1
        if error is not None and not isinstance(error, ObserverLeft | WindowClosed | Killed | OSError):
            raise error

    @property
    def asked(self) -> Ask | None:
        return self.sitting.ask if self.sitting else None

    def _press(self, press: Any) -> None:
        assert self.sitting is not None
        self.sitting.press(press)
        self._settle()

    runs = precondition(lambda self: self.sitting is not None)
    stopped = precondition(lambda self: self.sitting is None and not self.complete)

    @runs
    @rule(
        which=st.integers(0, 20),
        seconds=st.sampled_from([0.2, 1.0, 7.5]),
        by_mouse=st.booleans(),
        storm=st.sampled_from([0, 0, 1, MOST_IGNORED, 1400]),
    )
    def press(self, which: int, seconds: float, by_mouse: bool, storm: int) -> None:
        """Press or click something that means something: an answer, an entry of the menu, a letter."""
        ask = self.asked
        assert ask is not None
        meanings = sorted({*ask.keys.values(), *ask.targets})
        meaning = meanings[which % len(meanings)]
        key = "text x" if ask.typing and which % 3 else key_for(ask, meaning)
        if by_mouse and meaning in ask.targets:
            key = f"click {meaning}"
        self.clocks.passed_s += seconds
        self._press((key, seconds, storm))

    @runs
    @rule(presses=st.integers(1, 12))
    def answer(self, presses: int) -> None:
        """Answer plainly."""
        for _ in range(presses):
            if self.asked is None:
                return
            self.clocks.passed_s += 1.0
            self._press((self.person.respond(self.asked, 0.0).key, 1.0, 0))

    @runs
    @rule(key=st.sampled_from(["escape", "escape", "f12"]))
    def interrupt(self, key: str) -> None:
        self._press((key, 0.5, 0))

    @runs
    @rule(words=st.sampled_from(["dim", "Lampe Ä \u2028", "n" * 300]))
    def note(self, words: str) -> None:
        self._by_experimenter(lambda session: session.note(words, "experimenter"))

    @runs
    @rule()
    def mark(self) -> None:
        self._by_experimenter(lambda session: session.mark("experimenter"))

    def _by_experimenter(self, act: Any) -> None:
        """Do something from another thread than the session's; where the disk fails, the session goes on."""
        assert self.sitting is not None
        try:
            act(self.sitting.session)
        except OSError:
            self.may_survive = 1
        except Killed as killed:
            self._press(killed)

    @runs
    @rule(
        fault=st.sampled_from(["full", "fsync fails", "killed", "killed before fsync"]),
        keeps=st.sampled_from([0.0, 0.01, 0.5, 0.999, 1.0]),
        truncates=st.booleans(),
        then=st.sampled_from(["a note", "a mark", "an answer", "whatever comes"]),
    )
    def break_the_disk(self, fault: str, keeps: float, truncates: bool, then: str) -> None:
        """Let the next line that is written fail, or kill the process in it."""
        self.disk.fault, self.disk.keeps, self.disk.truncates = fault, keeps, truncates
        if then == "a note":
            self.note("too late")
        elif then == "a mark":
            self.mark()
        elif then == "an answer":
            self.answer(1)

    @runs
    @rule(end=st.sampled_from([Killed, WindowClosed, ObserverLeft]))
    def stop(self, end: type[BaseException]) -> None:
        self._press(end())

    @rule(seconds=st.sampled_from([0.0, 1.0, 3600.0]), set_by_s=st.sampled_from([0.0, -86400.0, 3600.0, 3.2e7]))
    def pass_time(self, seconds: float, set_by_s: float) -> None:
        self.clocks.passed_s += seconds
        self.clocks.set_by_s += set_by_s

    @stopped
    @rule(size=st.sampled_from([1, 4096]))
    def zeros_after_a_power_cut(self, size: int) -> None:
        """Some file systems leave zeros where a line had not come to the disk."""
        with open(self.folder / FILE_NAME, "ab") as stream:
            if not read_session(self.folder / FILE_NAME).state.lacks_line_end:
                stream.write(bytes(size))

    @stopped
    @rule(fault=st.sampled_from(["", "", "full", "fsync fails", "killed"]), keeps=st.sampled_from([0.0, 0.5]))
    def resume(self, fault: str, keeps: float) -> None:
        self._survivors()
        self.disk.fault, self.disk.keeps = fault, keeps
        try:
            recorder, log, clock = Recorder.resume(self.folder, {}, clock=self.clocks.steady)
        except SessionError as error:
            if not fault or "another process" in str(error):
                raise
            self.may_survive = 1
            return
        except Killed:
            return
        finally:
            self.disk.fault, self.disk.keeps, self.disk.truncates = "", 0.0, True
        self._sit(recorder, clock, log)

    def _survivors(self) -> None:
        """Count among what was kept a line that was on disk although nobody was assured of it."""
        on_disk = self._on_disk(read_session(self.folder / FILE_NAME))
        self.acknowledged += on_disk[len(self.acknowledged) :]
        self.may_survive = 0

    @staticmethod
    def _on_disk(log: SessionLog) -> list[Any]:
        return [_plain(record) for record in log.records if not isinstance(record, Resumption)]

    @invariant()
    def the_log_has_what_was_acknowledged_once_and_in_order(self) -> None:
        if not (self.folder / FILE_NAME).exists():
            return
        log = read_session(self.folder / FILE_NAME)
        on_disk = self._on_disk(log)
        assert on_disk[: len(self.acknowledged)] == self.acknowledged
        assert len(on_disk) - len(self.acknowledged) <= self.may_survive
        attempts = Counter((answer.place, answer.attempt) for answer in log.answers)
        assert not attempts or max(attempts.values()) == 1
        times = [log.header.started_utc, *(record.utc for record in log.records)]
        assert times == sorted(times)
        assert SessionTimes.of(log).moved_s == 0
        assert log.complete == self.complete or self.may_survive

    def teardown(self) -> None:
        """Let the session come to its end, and compare it with one that nothing was done to."""
        try:
            if self.folder.exists():
                self._finish()
                self._compare(read_session(self.folder / FILE_NAME))
        finally:
            if self.sitting is not None:
                self._press(Killed())
            self.patch.undo()
            shutil.rmtree(self.home)

    def _finish(self) -> None:
        self.disk.fault, self.disk.truncates = "", True
        for _ in range(MOST_ASKS):
            if self.complete or read_session(self.folder / FILE_NAME).complete:
                return
            if self.sitting is None:
                self.resume("", 0.0)
            elif self.asked is not None:
                self._press((plain_key(self.asked), 1.0, 0))
        raise AssertionError("the session has no end")

    def _compare(self, log: SessionLog) -> None:
        self.complete = True
        self.the_log_has_what_was_acknowledged_once_and_in_order()
        assert log.complete
        assert log.pending == ()
        marks = Counter((mark.block, mark.trial) for mark in log.marks)
        attempts = Counter(answer.place for answer in log.answers if answer.attempt)
        assert all(attempts[place] >= count for place, count in marks.items())
        undisturbed = _Script(log)
        Session(self.blocks, undisturbed, undisturbed, undisturbed).run()
        assert (undisturbed.presses, undisturbed.notes, undisturbed.marks, len(undisturbed.ends)) == ([], [], [], 1)
        assert [_said(trial) for trial in undisturbed.trials] == [_said(trial) for trial in log.first_attempts]


def _said(trial: Trial) -> Any:
    plain = _plain(trial)
    return {key: value for key, value in plain.items() if key not in (*CIRCUMSTANCES, "utc")}


class _Script(Stage):
    """Gives the answers of a log in a session that nothing is done to, and takes what it records."""

    def __init__(self, log: SessionLog) -> None:
        super().__init__()
        self.presses = [press for trial in log.first_attempts for press in trial.events]

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        key, seconds = self.presses.pop(0)
        return KeyPress(key, onset_s + seconds)
