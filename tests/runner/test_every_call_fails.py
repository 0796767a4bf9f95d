"""Each call of a session to the system fails once: what was acknowledged is in the log, or it is said what is not.

Calls are those of Python to the files below the folders of results and of the state. A session runs undisturbed first,
which numbers them; then it runs once for each number, at which the call fails. `make test` takes some of the numbers,
`make nightly` more, `make stress` all.
"""

from __future__ import annotations

import builtins
import errno
import io
import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from analysis.kinds import Trial
from analysis.records import FILE_NAME, read_session, session_files
from analysis.seals import check_log
from documents import InputError
from runner.session import Recorder, Session
from tests.runner.every_kind import VARIANTS, Fickle, OnTrial, Stage, blocks_of, opened

Study = Any  # tests/conftest.py

BY_PATH = (
    *("open", "stat", "lstat", "mkdir", "unlink", "remove", "rmdir", "rename", "replace", "truncate", "chmod", "utime"),
    *("scandir", "listdir", "link", "access"),
)
BY_DESCRIPTOR = ("write", "fsync", "fstat", "lseek", "ftruncate")
FAULTS = (errno.EIO, errno.ENOSPC, errno.EACCES)
SOME = 7  # of the calls, spread over the session


def each_fails_in_kind(folder: Path, state: Path, kind: str, variant: int, some: int | None) -> None:
    """A call fails: what was acknowledged is in the log, or in one that was saved; and the session can be resumed."""
    calls = Calls((folder / "whole", state))
    _, stopped = sit_in_kind(folder / "whole", kind, variant, calls)
    assert stopped is None
    total = len(calls.made)
    assert total > 10
    step = 1 if some is None else max(1, total // some)
    for number in range(variant % step, total, step):
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


def run(study: Study, results: Path, *more: str) -> tuple[subprocess.CompletedProcess[str], list[Trial]]:
    """Run the command in this process; return what became of it, and the trials that were acknowledged."""
    given: list[Trial] = []
    append = Recorder.append

    def then_kept(self: Recorder, record: Any) -> None:
        append(self, record)
        given.extend([record] if isinstance(record, Trial) else [])

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Recorder, "append", then_kept)
        return study.run(*more, results=results, expect=None), given


def known(trials: Any) -> list[tuple[Any, ...]]:
    return [(trial.place, trial.attempt, tuple(trial.events), trial.utc) for trial in trials]


def nothing_is_lost(study: Study, results: Path, told: Any, given: list[Trial], state: Path) -> None:
    """What was acknowledged is in a whole log, or the exit status says that it is not; the session can go on."""
    logs = list(session_files(results))
    rescued = list(session_files(state / "rescued")) if (state / "rescued").exists() else []
    if told.returncode == 0:
        assert read_session(logs[0]).complete
    else:
        assert told.returncode in (1, 2)
        assert told.stderr.splitlines()[-1].startswith(("error: ", "cyclopean: ")), told.stderr
    kept = [known(read_session(log).trials) for log in (*logs, *rescued)]
    assert not given or any(set(known(given)) <= set(trials) for trials in kept), told.stderr
    for log in logs:
        assert check_log(log).findings == ()
    if rescued and (not logs or len(read_session(rescued[0]).trials) > len(read_session(logs[0]).trials)):
        assert str(rescued[0]) in told.stderr
        return
    if not logs or not read_session(logs[0]).complete:
        again, _ = run(study, results, *(["--resume"] if logs else []))
        assert again.returncode == 0, again.stderr
    (log,) = session_files(results)
    assert read_session(log).complete
    assert set(known(given)) <= set(known(read_session(log).trials))


@pytest.fixture
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The state folder of this test alone."""
    folder = tmp_path / "state"
    monkeypatch.setenv("CYCLOPEAN_STATE", str(folder))
    return folder


def each_fails(study: Study, state: Path, some: int | None, fault: int) -> None:
    results = study.folder / "counted"
    run(study, study.folder / "before")  # so that pictures and costs are in the cache
    calls = Calls((results, state))
    with counted(calls):
        told, given = run(study, results)
    assert told.returncode == 0, told.stderr
    assert len(given) == 7
    total = len(calls.made)
    assert total > 100
    # All calls: each fails in one way, which in turn is one of `FAULTS`.
    step = len(FAULTS) if some is None else max(1, total // some)
    for number in range(FAULTS.index(fault) if some is None else fault % step, total, step):
        results = study.folder / f"failing_{number}"
        shutil.rmtree(state, ignore_errors=True)
        failing = Calls((results, state), number, fault)
        with counted(failing):
            told, given = run(study, results)
        assert "Traceback" not in told.stderr, (failing.made[number], told.stderr)
        nothing_is_lost(study, results, told, given, state)
        shutil.rmtree(results, ignore_errors=True)


@pytest.mark.nightly
@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="descriptors are named by /proc")
@pytest.mark.parametrize("some", [SOME, pytest.param(None, marks=pytest.mark.stress)])
@pytest.mark.parametrize("fault", FAULTS)
def test_calls_fail_once(study: Study, state: Path, fault: int, some: int | None) -> None:
    each_fails(study, state, some, fault)


@pytest.mark.nightly
@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="descriptors are named by /proc")
@pytest.mark.parametrize(("kind", "variant"), [(kind, variant) for kind, variant in VARIANTS if variant == 0])
def test_some_calls_fail_once_in_every_kind(kind: str, variant: int, tmp_path: Path, state: Path) -> None:
    each_fails_in_kind(tmp_path, state, kind, variant, 6)


@pytest.mark.stress
@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="descriptors are named by /proc")
@pytest.mark.parametrize(("kind", "variant"), VARIANTS)
def test_every_call_fails_once_in_every_kind(kind: str, variant: int, tmp_path: Path, state: Path) -> None:
    each_fails_in_kind(tmp_path, state, kind, variant, None)
