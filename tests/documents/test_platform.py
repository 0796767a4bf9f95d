"""Every function does the same on POSIX and, where the system has it, in its branch for Windows."""

from __future__ import annotations

import os
import pty
import signal
import sys
from pathlib import Path

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


def test_there_is_a_core_at_least(system: str) -> None:
    assert 1 <= platform.cores() <= (os.cpu_count() or 1)


def test_time_passes(system: str) -> None:
    first = platform.elapsed_s()
    assert platform.elapsed_s() >= first


def test_a_folder_is_synced_or_left_alone(system: str, tmp_path: Path) -> None:
    platform.sync_folder(tmp_path)
    if system != "win32":
        with pytest.raises(FileNotFoundError):
            platform.sync_folder(tmp_path / "missing")


def test_a_terminal_of_another_process_is_not_read(system: str) -> None:
    leader, terminal = pty.openpty()
    try:
        assert not platform.reads_terminal(terminal)  # it controls no process
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
