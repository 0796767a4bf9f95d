"""A lock with a record of who has it: held where the system's locks do not reach, taken over from the dead alone."""

from __future__ import annotations

import errno
import itertools
import json
import os
import subprocess
import sys
import threading
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from filelock import FileLock

from documents.files import (
    DurableLog,
    LogDisturbedError,
    LogInUseError,
    LogState,
    OwnedLock,
    in_use,
    owned_lock,
    read_lines,
)
from documents.files.owned_lock import STALE_S, Owner
from documents.platform import process_start
from tests.kept import known


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / ".lock"


def record(file: Path) -> Path:
    return file.with_name(".lock.owner")


def left_by(file: Path, **facts: Any) -> Owner:
    """Leave a record of another owner, as where the system's lock is not seen."""
    owner = replace(Owner.here(), **facts)
    record(file).write_text(json.dumps(asdict(owner)) + "\n")
    return owner


def ended_process() -> int:
    with subprocess.Popen([sys.executable, "-c", ""]) as program:
        return program.pid


def test_one_has_it_until_it_is_released(file: Path) -> None:
    lock = OwnedLock.take(file)
    with pytest.raises(LogInUseError) as refused:
        OwnedLock.take(file)
    assert known(refused.value.owner).process == os.getpid()
    assert (in_use(file) is None, lock.lost(), lock.taken_over) == (False, None, None)
    lock.release()
    assert (in_use(file), record(file).exists()) == (None, False)
    OwnedLock.take(file).release()


def test_removing_the_lock_s_file_lets_nobody_in(file: Path) -> None:
    lock = OwnedLock.take(file)
    file.unlink()
    with pytest.raises(LogInUseError):
        OwnedLock.take(file)
    lock.release()


@pytest.mark.parametrize("fault", [NotImplementedError(), OSError(errno.ENOLCK, "no locks available")])
def test_the_record_locks_where_the_disk_has_no_locks(
    file: Path, monkeypatch: pytest.MonkeyPatch, fault: Exception
) -> None:
    def acquire(*_: object, **__: object) -> None:
        raise fault

    monkeypatch.setattr(FileLock, "acquire", acquire)
    lock = OwnedLock.take(file)
    with pytest.raises(LogInUseError):
        OwnedLock.take(file)
    lock.release()
    OwnedLock.take(file).release()


@pytest.mark.skipif(not process_start(os.getpid()), reason="the system does not tell when a process was started")
def test_what_a_killed_process_left_is_taken_over_at_once_and_nothing_of_a_living_one(file: Path) -> None:
    living = os.getppid()
    owner = left_by(file, process=living, started=process_start(living), token="0")
    with pytest.raises(LogInUseError) as refused:
        OwnedLock.take(file)
    assert refused.value.owner == owner
    for process in (ended_process(), living):  # the second is another one with the number of the first
        owner = left_by(file, token="0", process=process, started="1")
        assert in_use(file) is None
        lock = OwnedLock.take(file)
        assert lock.taken_over == owner
        lock.release()


def test_another_machine_is_believed_for_two_minutes(file: Path) -> None:
    left_by(file, machine="another", host="there", token="0")
    for age_s, held in ((0.0, True), (STALE_S - 30, True), (STALE_S + 30, False)):
        os.utime(record(file), (time.time() - age_s,) * 2)
        assert (in_use(file) is not None) == held
    assert in_use(file) is None
    lock = OwnedLock.take(file)
    assert known(lock.taken_over).host == "there"
    lock.release()


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b'{"host": 1}', b"\xff" * 20_000])
def test_a_record_that_says_nothing_locks_nothing(file: Path, content: bytes) -> None:
    record(file).write_bytes(content)
    OwnedLock.take(file).release()


def test_signs_of_life_go_on_and_never_into_another_s_record(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(owned_lock, "BEAT_S", 0.01)
    lock = OwnedLock.take(file)
    os.utime(record(file), (0, 0))
    until_s = time.monotonic() + 20
    while record(file).stat().st_mtime == 0:
        assert time.monotonic() < until_s
        time.sleep(0.01)
    assert lock.lost() is None
    record(file).unlink()
    time.sleep(0.05)
    assert not record(file).exists()
    assert lock.lost() is not None
    assert not lock.is_taken
    other = left_by(file, token="0", machine="another")
    time.sleep(0.05)
    assert json.loads(record(file).read_bytes()) == asdict(other)
    assert lock.lost() is not None
    assert lock.is_taken
    lock.release()
    assert record(file).exists()  # it is not ours


def test_a_log_whose_record_was_removed_is_whole_and_stops(tmp_path: Path) -> None:
    file = tmp_path / "a.jsonl"
    log = DurableLog.create(file, tmp_path / ".lock", {"record": "session"})
    record(tmp_path / ".lock").unlink()
    with pytest.raises(LogDisturbedError) as stopped:
        log.append({"record": "trial", "trial": 0})
    assert (stopped.value.in_place, stopped.value.taken) == (True, False)
    assert file.read_bytes().count(b"\n") == 2
    log.close()


def test_a_log_that_another_process_took_over_is_left_to_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CYCLOPEAN_STATE", str(tmp_path / "state"))
    file = tmp_path / "results" / "ses" / "a.jsonl"
    file.parent.mkdir(parents=True)
    log = DurableLog.create(file, file.with_name(".lock"), {"record": "session"})
    log.append({"record": "trial", "trial": 0})
    left_by(file.with_name(".lock"), token="0", machine="another")
    theirs = file.read_bytes() + b'{"record":"resume"}\n'
    file.write_bytes(theirs)
    with pytest.raises(LogDisturbedError) as stopped:
        log.append({"record": "trial", "trial": 1})
    assert stopped.value.taken
    assert file.read_bytes() == theirs
    assert known(stopped.value.saved).is_relative_to(tmp_path / "state")
    assert known(stopped.value.saved).read_bytes().count(b'"trial"') >= 2
    log.close()


class Turns:
    """Lets two threads touch the record of a lock in turn, in the order that is given."""

    def __init__(self, order: tuple[str, ...]) -> None:
        self.left, self.turn = list(order), threading.Condition(threading.RLock())
        self.inside = threading.local()

    def taken(self, call: Any) -> Any:
        """Return ``call``, which waits for its turn where its path is the record or a draft of it."""

        def wait(path: Any, *more: Any, **named: Any) -> Any:
            name = threading.current_thread().name
            ours = name in "ab" and not getattr(self.inside, "now", False) and ".lock.owner" in str(path)
            if not ours:
                return call(path, *more, **named)
            with self.turn:
                assert self.turn.wait_for(lambda: not self.left or self.left[0] == name or name not in self.left, 20)
                self.inside.now = True
                try:
                    return call(path, *more, **named)
                finally:
                    self.inside.now = False
                    if self.left and self.left[0] == name:
                        del self.left[0]
                    self.turn.notify_all()

        return wait

    def over(self, name: str) -> None:
        """Take the turns that a thread did not need."""
        with self.turn:
            self.left = [one for one in self.left if one != name]
            self.turn.notify_all()


TURNS = 7  # of each thread that takes a lock over: the read, the two names, the removals


def orders(every: int) -> list[tuple[str, ...]]:
    places = list(itertools.combinations(range(2 * TURNS), TURNS))
    return [tuple("a" if turn in ours else "b" for turn in range(2 * TURNS)) for ours in places[::every]]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="Windows lets nobody take the name of an open file")
@pytest.mark.parametrize("every", [197, pytest.param(3, marks=pytest.mark.stress)])
@pytest.mark.parametrize("stale", [True, False])
def test_of_two_who_take_over_at_the_same_instant_one_has_the_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stale: bool, every: int
) -> None:
    """Where the system's locks are not seen; in many orders of what each does with the record."""

    def none(*_: object, **__: object) -> None:
        raise NotImplementedError

    monkeypatch.setattr(FileLock, "acquire", none)
    for number, order in enumerate(orders(every)):
        file = tmp_path / str(number) / "a.jsonl"
        file.parent.mkdir()
        lock = file.with_name(".lock")
        DurableLog.create(file, lock, {"record": "session"}).close()
        if stale:
            left_by(lock, machine="another", token="0")
            os.utime(record(lock), (time.time() - STALE_S - 30,) * 2)
        taken: dict[str, DurableLog] = {}
        turns = Turns(order)

        def take_over(file: Path, taken: dict[str, DurableLog], turns: Turns) -> None:
            name = threading.current_thread().name
            try:
                log, _ = DurableLog.reopen(file, file.with_name(".lock"), file.with_name("torn.bin"), read)
                taken[name] = log
            except LogInUseError:
                pass
            finally:
                turns.over(name)

        with monkeypatch.context() as patch:
            for call in ("open", "unlink", "rename", "replace", "link"):
                patch.setattr(os, call, turns.taken(getattr(os, call)))
            threads = [threading.Thread(target=take_over, name=name, args=(file, taken, turns)) for name in "ab"]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
        assert len(taken) == 1, order
        for name, log in taken.items():
            log.append({"record": "trial", "by": name})
            log.close()
        assert read(file).state.lines == 2
        assert [one.name for one in file.parent.iterdir() if "owner" in one.name] == []


@dataclass
class Content:
    """What `read` returns."""

    state: LogState


def read(file: Path) -> Content:
    with file.open("rb") as stream:
        return Content(read_lines(stream, lambda number, line: None))
