"""Every function does the same on POSIX and, where the system has it, in its branch for Windows."""

from __future__ import annotations

import ctypes
import os
import pty
import signal
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from documents import platform


@pytest.fixture(params=["linux", "darwin", "win32"])
def system(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Take the branch of one operating system; what only others have is not there."""
    name = str(request.param)
    if name == "linux" and sys.platform != "linux":
        pytest.skip("needs Linux")
    monkeypatch.setattr(sys, "platform", name)
    if name != "linux":
        monkeypatch.delattr(os, "sched_getaffinity", raising=False)
        monkeypatch.delattr("time.clock_gettime", raising=False)
    if name == "win32":
        for owner, attribute in ((os, "tcgetpgrp"), (signal, "pthread_sigmask")):
            monkeypatch.delattr(owner, attribute, raising=False)
    return name


@pytest.mark.parametrize(
    ("said", "cores"),
    [
        ({"cpu.max": "max 100000\n"}, sys.maxsize),
        ({"cpu.max": "200000 100000\n"}, 2),
        ({"cpu.max": "150000 100000\n"}, 2),
        ({"cpu.max": "5000 100000\n"}, 1),
        ({"cpu.max": "nothing of the kind"}, sys.maxsize),
        ({"cpu/cpu.cfs_quota_us": "400000\n", "cpu/cpu.cfs_period_us": "100000\n"}, 4),
        ({"cpu/cpu.cfs_quota_us": "-1\n", "cpu/cpu.cfs_period_us": "100000\n"}, sys.maxsize),
        ({}, sys.maxsize),
    ],
)
def test_a_container_has_the_cores_whose_time_it_may_use(tmp_path: Path, said: dict[str, str], cores: int) -> None:
    (tmp_path / "cpu").mkdir()
    for name, text in said.items():
        (tmp_path / name).write_text(text)
    assert platform._cores_of_quota(tmp_path) == cores


def test_a_folder_is_synced_or_left_alone(system: str, tmp_path: Path) -> None:
    platform.sync_folder(tmp_path)
    if system != "win32":
        with pytest.raises(FileNotFoundError):
            platform.sync_folder(tmp_path / "missing")


def test_a_terminal_of_another_process_is_not_read(system: str) -> None:
    leader, terminal = pty.openpty()
    try:
        # It controls no process; on Windows there are no jobs in the background, and any terminal can be read.
        assert platform.reads_terminal(terminal) == (system == "win32")
    finally:
        os.close(leader)
        os.close(terminal)


def test_interrupts_wait_where_signals_can(system: str) -> None:
    caught: list[bool] = []
    before = signal.signal(signal.SIGINT, lambda number, frame: caught.append(True))
    try:
        with platform.interrupts_held():
            signal.raise_signal(signal.SIGINT)
            assert bool(caught) == (system == "win32")
        assert caught
    finally:
        signal.signal(signal.SIGINT, before)


def test_a_pulled_cable_is_an_error_of_the_system(system: str) -> None:
    assert OSError in platform.serial_errors()
    assert len(platform.serial_errors()) == (3 if system == "win32" else 4)


def test_input_is_waited_for_unless_another_descriptor_speaks(system: str) -> None:
    (source, typed), (other, wake) = os.pipe(), os.pipe()
    try:
        os.write(typed, b"words")
        assert platform.wait_for_input(source, other)
        os.close(wake)
        assert platform.wait_for_input(source, other) == (system == "win32")
    finally:
        for descriptor in (source, typed, other):
            os.close(descriptor)


@pytest.mark.parametrize("obedient", [True, False])
def test_a_console_of_windows_is_asked_to_obey_sequences(monkeypatch: pytest.MonkeyPatch, obedient: bool) -> None:
    """That of Windows before 2016 does not; then nothing moves the cursor."""
    asked: list[int] = []

    class Kernel:
        def GetConsoleMode(self, handle: object, mode: object) -> bool:
            mode._obj.value = 3  # type: ignore[attr-defined]  # what ctypes.byref holds
            return True

        def SetConsoleMode(self, handle: object, mode: int) -> bool:
            asked.append(mode)
            return obedient

    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setattr(os, "isatty", lambda descriptor: True)
    monkeypatch.setattr(ctypes, "windll", SimpleNamespace(kernel32=Kernel()), raising=False)
    monkeypatch.setitem(sys.modules, "msvcrt", SimpleNamespace(get_osfhandle=lambda descriptor: 7))
    assert platform.obeys_sequences(2) is obedient
    assert asked == [7]


def test_folders_of_the_user_are_where_the_system_has_them(
    system: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for name in ("XDG_CACHE_HOME", "XDG_STATE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path / "AppData" / "Local"))
    wanted = {"linux": ".cache", "darwin": "Library/Caches", "win32": "AppData/Local"}[system]
    assert platform.user_folder("cache") == tmp_path / wanted
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "own"))
    assert platform.user_folder("cache") == tmp_path / "own"
    assert platform.user_folder("state") != tmp_path / "own"


def test_there_is_a_core_at_least(system: str) -> None:
    assert 1 <= platform.cores() <= (os.cpu_count() or 1)


def test_time_passes(system: str) -> None:
    first = platform.elapsed_s()
    assert platform.elapsed_s() >= first


def test_a_file_is_no_terminal_that_obeys(system: str, tmp_path: Path) -> None:
    with (tmp_path / "out.txt").open("wb") as out:
        assert not platform.obeys_sequences(out.fileno())
