"""What the machine could not do, in a true sentence each: too many open files, no memory, a failing or full disk.

Whoever reads or writes asks here first: no file is damaged, and none is missing, because of these.
"""

from __future__ import annotations

import errno
import os
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class SystemFault:
    """Why the machine failed: the system's ``code``, such as ``EMFILE``, ``why`` in words, and a ``remedy``."""

    code: str
    why: str
    remedy: str

    def __str__(self) -> str:
        return f"{self.why} ({self.code})"


_TOO_LARGE = "the file is larger than this system takes", "use a smaller file, or a 64-bit system"
_FULL_REMEDY = "make room there, or choose another folder"
_FAULTS = {
    fault.code: fault
    for fault in (
        SystemFault(
            "EMFILE",
            "this program has as many files open as it may",
            "allow more and try again (ulimit -n 4096), or give fewer files at a time",
        ),
        SystemFault("ENFILE", "this machine has as many files open as it can", "close other programs, and try again"),
        SystemFault("ENOMEM", "there is not enough memory", "close other programs, or use a machine with more memory"),
        SystemFault(
            "EIO",
            "the disk, or the connection to it, failed",
            "look at the disk and its cable or network, and copy the file from another place if it fails again",
        ),
        SystemFault("EROFS", "the disk may only be read", "choose another folder"),
        SystemFault("ENOSPC", "the disk is full", _FULL_REMEDY),
        SystemFault("EDQUOT", "what you may write to the disk is used up", _FULL_REMEDY),
        SystemFault("EFBIG", *_TOO_LARGE),
        SystemFault("EOVERFLOW", *_TOO_LARGE),
    )
}
_STEP = 1 << 20


def system_fault(caught: BaseException | None) -> SystemFault | None:
    """Return what of the machine made ``caught`` be raised, or what it was raised from; None if it was something else.

    Parameters
    ----------
    caught
        Any exception.

    Returns
    -------
    SystemFault or None
        The reason.

    Examples
    --------
    >>> str(system_fault(OSError(24, "Too many open files")))
    'this program has as many files open as it may (EMFILE)'
    >>> system_fault(FileNotFoundError(2, "No such file or directory")) is None
    True
    """
    while caught is not None:
        if isinstance(caught, MemoryError):
            return _FAULTS["ENOMEM"]
        code = errno.errorcode.get(caught.errno or 0) if isinstance(caught, OSError) else None
        if code in _FAULTS:
            return _FAULTS[code]
        caught = caught.__cause__
    return None


def what_stops_reading(path: Path) -> OSError | None:
    """Return the error of the machine for which the file at ``path`` cannot be read to its end, None if there is none.

    For libraries that keep the reason to themselves. What is wrong with the file itself is none.

    Parameters
    ----------
    path
        A regular file.

    Returns
    -------
    OSError or None
        The reason.

    Examples
    --------
    >>> what_stops_reading(Path("README.md")) is None
    True
    """
    try:
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_BINARY", 0))
        try:
            while os.read(descriptor, _STEP):
                pass
        finally:
            os.close(descriptor)
    except OSError as error:
        return error if system_fault(error) else None
    return None
