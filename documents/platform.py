"""What only some operating systems have: each function has a branch for POSIX and one for Windows.

No other module calls these parts of ``os``, ``signal``, ``time`` and ``termios``.
"""

from __future__ import annotations

import os
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def boot_id() -> str:
    """Return a text that is another after each start of the machine; empty where the system does not say."""
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    except OSError:
        return ""


def cores() -> int:
    """Return how many processor cores this process may use; all cores where the system does not say."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def elapsed_s() -> float:
    """Return seconds since some moment in the past; on Linux, time in which the machine slept is included."""
    if sys.platform == "linux":
        return time.clock_gettime(time.CLOCK_BOOTTIME)
    return time.monotonic()


def reads_terminal(descriptor: int) -> bool:
    """Return whether lines typed at the terminal ``descriptor`` come to this process and can be waited for.

    False for a job in the background, which a read would stop. False on Windows, where ``select`` waits for sockets
    only.
    """
    if sys.platform == "win32":
        return False
    try:
        return os.isatty(descriptor) and os.tcgetpgrp(descriptor) == os.getpgrp()
    except OSError:
        return False


def command_to_type(*words: str) -> str:
    """Return what a person types at a shell for this program, as it was started, with ``words``, quoted."""
    started = Path(sys.argv[0] if sys.argv else "")
    program = ["cyclopean"]
    if started.name == "__main__.py" and started.parent.name == "cyclopean":
        program = [sys.executable, "-m", "cyclopean"]
    elif started.stem == "cyclopean":
        by_name = shutil.which("cyclopean")
        if by_name is None or Path(by_name).resolve() != started.resolve():
            program = [str(started)]
    if sys.platform == "win32":
        return subprocess.list2cmdline([*program, *words])
    return shlex.join([*program, *words])


def serial_errors() -> tuple[type[Exception], ...]:
    """Return what reading or writing a serial port raises when its cable is pulled."""
    # pyserial's own error is an OSError; termios' error is not.
    if sys.platform == "win32":
        return (OSError, TypeError, ValueError)
    import termios

    return (OSError, TypeError, ValueError, termios.error)


def sync_folder(folder: Path) -> None:
    """Put the names in ``folder`` on disk; does nothing on Windows, where a folder cannot be opened."""
    if sys.platform == "win32":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


@contextmanager
def interrupts_held() -> Iterator[None]:
    """Hold back Ctrl-C in the body, and in the processes started there; does nothing on Windows."""
    if sys.platform == "win32":
        yield
        return
    from multiprocessing import resource_tracker

    # Processes are started beside a tracker, the start of which would let interrupts through again.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
