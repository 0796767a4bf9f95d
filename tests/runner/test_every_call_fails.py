"""Each call of a session to the system fails once: what was acknowledged is in the log, or it is said what is not.

Calls are those of Python to the files below the folders of results and of the state. A session runs undisturbed first,
which numbers them; then it runs once for each number, at which the call fails.
"""

from __future__ import annotations

import builtins
import errno
import io
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from analysis.kinds import Trial
from analysis.records import FILE_NAME, read_session
from analysis.seals import check_log
from documents import InputError
from runner.session import Session
from tests.runner.every_kind import VARIANTS, Fickle, OnTrial, Stage, blocks_of, opened

BY_PATH = (
    *("open", "stat", "lstat", "mkdir", "unlink", "remove", "rmdir", "rename", "replace", "truncate", "chmod", "utime"),
    *("scandir", "listdir", "link", "access"),
)
BY_DESCRIPTOR = ("write", "fsync", "fstat", "lseek", "ftruncate")
FAULTS = (errno.EIO, errno.ENOSPC, errno.EACCES)


def each_fails_in_kind(folder: Path, state: Path, kind: str, variant: int) -> None:
    """A call fails: what was acknowledged is in the log, or in one that was saved; and the session can be resumed."""
    calls = Calls((folder / "whole", state))
    _, stopped = sit_in_kind(folder / "whole", kind, variant, calls)
    assert stopped is None
    total = len(calls.made)
    assert total > 10
    for number in range(total):
        own, fault = folder / str(number), FAULTS[number % len(FAULTS)]
        shutil.rmtree(state, ignore_errors=True)
        failing = Calls((own, state), number, fault)
        kept, stopped = sit_in_kind(own, kind, variant, failing)
        place = failing.made[number]
        log = own / FILE_NAME
        saved = [log, *state.rglob(FILE_NAME)]
        files = [file for file in saved if file.exists()]
        if kept:
            assert any(set(known(kept)) <= set(known(read_session(file).trials)) for file in files), (place, stopped)
        if stopped is None:
            assert read_session(log).complete, place
            continue
        if not log.exists():
            assert not kept, place  # a session that could not be created begins in another folder
            continue
        assert check_log(log).findings == (), place
        if read_session(log).complete:  # what failed came after its last line
            continue
        _, again = sit_in_kind(own, kind, variant, Calls(()))
        assert again is None, (place, again)
        assert read_session(log).complete, place


def sit_in_kind(folder: Path, kind: str, variant: int, calls: Calls) -> tuple[list[Trial], Exception | None]:
    """Begin a session of one block, or resume it, and return what was acknowledged, and why it stopped."""
    kept: list[Trial] = []
    try:
        with counted(calls):
            recorder, before = opened(folder)
            block = blocks_of(kind, variant)
            session = Session(block, Stage(), Fickle(1), recorder, before, listeners=[OnTrial(kept.append)])
            with recorder:
                session.run()
    except (OSError, InputError) as error:
        return kept, error
    return kept, None


class Calls:
    """Counts calls to files below ``folders``, and lets the one with the number ``failing`` fail with ``fault``."""

    def __init__(self, folders: tuple[Path, ...], failing: int = -1, fault: int = errno.EIO) -> None:
        self.folders, self.failing, self.fault = tuple(map(str, folders)), failing, fault
        self.made: list[str] = []

    def hit(self, name: str, path: object) -> None:
        """Count a call, and fail if it is the one."""
        try:
            text = os.fsdecode(path)  # type: ignore[arg-type]  # what is no path is none of these
        except TypeError:
            return
        if not text.startswith(self.folders):
            return
        self.made.append(f"{name} {text}")
        if len(self.made) - 1 == self.failing:
            raise OSError(self.fault, os.strerror(self.fault), text)


class Failing:
    """An open file whose writes are counted and may fail."""

    def __init__(self, stream: Any, path: object, calls: Calls) -> None:
        self._stream, self._path, self._calls = stream, path, calls

    def write(self, data: Any) -> Any:
        """Write, or fail."""
        self._calls.hit("write", self._path)
        return self._stream.write(data)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def __enter__(self) -> Failing:
        self._stream.__enter__()
        return self

    def __exit__(self, *how: object) -> None:
        self._stream.__exit__(*how)

    def __iter__(self) -> Iterator[Any]:
        return iter(self._stream)


@contextmanager
def counted(calls: Calls) -> Iterator[None]:
    """Let every call of Python to the system's files go through ``calls``."""
    real_open = io.open

    def opened(file: Any, mode: str = "r", *more: Any, **named: Any) -> Any:
        calls.hit("open", file)
        stream = real_open(file, mode, *more, **named)
        writes = set(mode) & set("wax+") and isinstance(file, str | bytes | os.PathLike)
        return Failing(stream, file, calls) if writes and str(file).startswith(calls.folders) else stream

    def by_path(name: str, real: Callable[..., Any]) -> Callable[..., Any]:
        def call(path: Any = ".", *more: Any, **named: Any) -> Any:
            calls.hit(name, path)
            return real(path, *more, **named)

        return call

    def by_descriptor(name: str, real: Callable[..., Any]) -> Callable[..., Any]:
        def call(descriptor: Any, *more: Any) -> Any:
            if isinstance(descriptor, int):
                try:
                    path = os.readlink(f"/proc/self/fd/{descriptor}")
                except OSError:
                    path = ""
                calls.hit(name, path)
            return real(descriptor, *more)

        return call

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(io, "open", opened)
        patch.setattr(builtins, "open", opened)
        for name in BY_PATH:
            patch.setattr(os, name, by_path(name, getattr(os, name)))
        for name in BY_DESCRIPTOR:
            patch.setattr(os, name, by_descriptor(name, getattr(os, name)))
        yield


def known(trials: Any) -> list[tuple[Any, ...]]:
    return [(trial.place, trial.attempt, tuple(trial.events), trial.utc) for trial in trials]


@pytest.fixture
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The state folder of this test alone."""
    folder = tmp_path / "state"
    monkeypatch.setenv("CYCLOPEAN_STATE", str(folder))
    return folder


@pytest.mark.stress
@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="descriptors are named by /proc")
@pytest.mark.parametrize(("kind", "variant"), VARIANTS)
def test_every_call_fails_once_in_every_kind(kind: str, variant: int, tmp_path: Path, state: Path) -> None:
    each_fails_in_kind(tmp_path, state, kind, variant)
