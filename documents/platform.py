"""What only some operating systems have: each function has a branch for POSIX and one for Windows.

No other module calls these parts of ``os``, ``signal``, ``select``, ``time`` and ``termios``.
"""

from __future__ import annotations

import errno
import math
import os
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any, Literal

# How long to wait before each new attempt to replace a file that another process has open: two seconds in all.
_WAITS_S = (0.01, 0.02, 0.05, 0.1, 0.2, 0.4, 0.6, 0.6)


def boot_id() -> str:
    """Return a text that is another after each start of the machine; empty where the system does not say."""
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    except OSError:
        return ""


def cores() -> int:
    """Return how many processor cores this process may use; all cores where the system does not say.

    In a container that may use the time of fewer cores than it sees, on Linux, so many.
    """
    if sys.platform == "linux":
        return min(len(os.sched_getaffinity(0)), _cores_of_quota())
    return os.cpu_count() or 1


@cache
def _cores_of_quota(groups: Path = Path("/sys/fs/cgroup")) -> int:
    """Return the cores whose time the control group, of either version, may use; very many without a limit."""
    for names in (("cpu.max",), ("cpu/cpu.cfs_quota_us", "cpu/cpu.cfs_period_us")):
        with suppress(OSError, ValueError):
            quota, period = " ".join((groups / name).read_text(encoding="ascii") for name in names).split()
            if quota not in ("max", "-1"):
                return max(1, math.ceil(int(quota) / int(period)))
    return sys.maxsize


def elapsed_s() -> float:
    """Return seconds since some moment in the past; on Linux, time in which the machine slept is included."""
    if sys.platform == "linux":
        return time.clock_gettime(time.CLOCK_BOOTTIME)
    return time.monotonic()


def reads_terminal(descriptor: int) -> bool:
    """Return whether lines typed at the terminal ``descriptor`` come to this process.

    False for a job in the background, which a read would stop; Windows has no such jobs.
    """
    try:
        if sys.platform == "win32":
            return os.isatty(descriptor)
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


def wait_for_input(descriptor: int, other: int) -> bool:
    """Wait until something can be read from ``descriptor`` or ``other``; return whether it is ``descriptor``.

    On Windows, where only sockets can be waited for, it returns at once: the read that follows waits.
    """
    if sys.platform == "win32":
        return True
    import select

    ready, _, _ = select.select([descriptor, other], [], [])
    return other not in ready


def obeys_sequences(descriptor: int) -> bool:
    """Return whether the terminal ``descriptor`` moves the cursor as ANSI sequences say; Windows must be asked to."""
    if not os.isatty(descriptor):
        return False
    if sys.platform != "win32":
        return True
    import ctypes
    import msvcrt

    kernel, mode = ctypes.windll.kernel32, ctypes.c_uint32()
    handle = ctypes.c_void_p(msvcrt.get_osfhandle(descriptor))
    virtual_terminal_processing = 4
    return bool(
        kernel.GetConsoleMode(handle, ctypes.byref(mode))
        and kernel.SetConsoleMode(handle, mode.value | virtual_terminal_processing)
    )


def rename(source: Path, target: Path) -> None:
    """Give ``source`` the name ``target``, in place of a file there.

    On Windows a file or folder that a process has open (a reader, a virus scanner) cannot be replaced or renamed: new
    attempts are made for two seconds.

    Raises
    ------
    OSError
        If it cannot be done; nothing has changed then.
    """
    for wait_s in _WAITS_S if sys.platform == "win32" else ():
        try:
            os.replace(source, target)
        except PermissionError:
            time.sleep(wait_s)
        else:
            return
    os.replace(source, target)


def user_folder(kind: Literal["cache", "state"]) -> Path:
    """Return the folder in which programs keep what they can make again (``cache``), or must remember (``state``).

    ``XDG_CACHE_HOME`` and ``XDG_STATE_HOME`` count on every system; else it is where the system has it.
    """
    own = os.environ.get(f"XDG_{kind.upper()}_HOME")
    if own:
        return Path(own)
    local = os.environ.get("LOCALAPPDATA")
    if sys.platform == "win32" and local:
        return Path(local)
    if sys.platform == "darwin":
        return Path.home() / "Library" / {"cache": "Caches", "state": "Application Support"}[kind]
    return Path.home() / {"cache": ".cache", "state": ".local/state"}[kind]


def state_folder() -> Path:
    """Return where this program keeps what it must remember: ``CYCLOPEAN_STATE``, or a folder of the user's state."""
    own = os.environ.get("CYCLOPEAN_STATE")
    return Path(own) if own else user_folder("state") / "cyclopean"


def serial_errors() -> tuple[type[Exception], ...]:
    """Return what reading or writing a serial port raises when its cable is pulled."""
    # pyserial's own error is an OSError; termios' error is not.
    if sys.platform == "win32":
        return (OSError, TypeError, ValueError)
    import termios

    return (OSError, TypeError, ValueError, termios.error)


def serial_writer(port: Any) -> Callable[[bytes], object]:
    """Return what writes to pyserial's open ``port`` at once: all of it, or it raises BlockingIOError.

    On Windows the port must have been opened with a write timeout of 0.
    """
    if sys.platform == "win32":
        return port.write  # type: ignore[no-any-return]  # a bound method
    descriptor = port.fileno()
    os.set_blocking(descriptor, False)

    def write(data: bytes) -> None:
        if os.write(descriptor, data) < len(data):
            raise BlockingIOError(errno.EAGAIN, "the port took a part of the bytes only")

    return write


@contextmanager
def pseudo_terminal() -> Iterator[tuple[str, Callable[[float], bytes]] | None]:
    """Open a pair of pseudo-terminals; None on Windows.

    Yield the name of one, which behaves as a serial port, and what reads from the other what is sent there, waiting for
    so many seconds at most.
    """
    if sys.platform == "win32":
        yield None
        return
    import select
    import tty

    ours, theirs = os.openpty()
    try:
        tty.setraw(ours)
        tty.setraw(theirs)

        def read(within_s: float) -> bytes:
            ready, _, _ = select.select([ours], [], [], within_s)
            return os.read(ours, 4096) if ready else b""

        yield os.ttyname(theirs), read
    finally:
        os.close(theirs)
        os.close(ours)


# Linux's ppdev.h
_CLAIM, _RELEASE, _EXCLUSIVE, _WRITE_DATA = 0x708B, 0x708C, 0x708F, 0x40017086


def open_parallel_port(port: str) -> int:
    """Open a parallel port of Linux, such as ``/dev/parport0``, for this process alone, with its data pins at 0.

    Raises
    ------
    OSError
        If it cannot be done; ENOTSUP on another system.
    """
    if sys.platform != "linux":
        raise OSError(errno.ENOTSUP, os.strerror(errno.ENOTSUP), port)
    import fcntl

    descriptor = os.open(port, os.O_RDWR | os.O_NONBLOCK)
    try:
        fcntl.ioctl(descriptor, _EXCLUSIVE)
        fcntl.ioctl(descriptor, _CLAIM)
        set_parallel_pins(descriptor, 0)
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor


def set_parallel_pins(descriptor: int, value: int) -> None:
    """Set the eight data pins of an open parallel port to ``value``, 0 to 255."""
    if sys.platform == "linux":
        import fcntl

        fcntl.ioctl(descriptor, _WRITE_DATA, bytes([value]))


def close_parallel_port(descriptor: int) -> None:
    """Give an open parallel port back."""
    if sys.platform == "linux":
        import fcntl

        with suppress(OSError):
            fcntl.ioctl(descriptor, _RELEASE)
        os.close(descriptor)


def is_alive(process: int) -> bool:
    """Return whether there is a process with this number."""
    if process == os.getpid():
        return True
    if sys.platform == "win32":
        import ctypes

        query_limited_information, still_active = 0x1000, 259
        handle = ctypes.windll.kernel32.OpenProcess(query_limited_information, False, process)
        if not handle:
            return False
        status = ctypes.c_ulong()
        known = ctypes.windll.kernel32.GetExitCodeProcess(handle, ctypes.byref(status))
        ctypes.windll.kernel32.CloseHandle(handle)
        return not known or status.value == still_active
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True  # somebody else's
    return True


def process_start(process: int) -> str:
    """Return when a process was started, in the system's own words; empty if it runs no more, or they are not known."""
    try:
        told = Path(f"/proc/{process}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""
    state, *facts = told.rpartition(")")[2].split()
    return "" if state in ("Z", "X") else facts[18]


def process_space() -> str:
    """Return what tells containers of one machine apart, which number processes each for itself; empty if unknown."""
    try:
        return os.readlink("/proc/self/ns/pid")
    except OSError:
        return ""


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


def run_in_fork(call: Callable[[], None]) -> int | None:
    """Run ``call`` in a fork of this process and return the status that it ended with; None where none can be made."""
    if sys.platform == "win32":
        return None
    child = os.fork()
    if child == 0:
        status = 1
        try:
            call()
            status = 0
        finally:
            os._exit(status)
    return os.waitpid(child, 0)[1]


def limit_this_process(more_bytes: int, more_s: int) -> None:
    """Limit memory and processor time to what this process has taken by now and that much more, where it can be."""
    if sys.platform == "win32":
        return
    import resource

    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    except OSError:  # macOS, which maps much more than it takes
        pages = (64 << 30) // resource.getpagesize()
    used = resource.getrusage(resource.RUSAGE_SELF)
    wanted = {
        resource.RLIMIT_AS: pages * resource.getpagesize() + more_bytes,
        resource.RLIMIT_CPU: int(used.ru_utime + used.ru_stime) + 1 + more_s,
        resource.RLIMIT_CORE: 0,
    }
    for which, most in wanted.items():
        hard = resource.getrlimit(which)[1]
        with suppress(OSError, ValueError):
            resource.setrlimit(which, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))
