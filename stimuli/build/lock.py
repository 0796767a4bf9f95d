"""One build of a set at a time, and nothing left of that: its lock goes when the build does."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def locked(folder: Path, *, wait: bool = True) -> Iterator[None]:
    """Hold the lock of the set in ``folder``, an empty file beside it, and remove it at the end.

    Who waits for a lock that was removed meanwhile holds a file without a name, and begins anew: two never hold one.

    Raises
    ------
    BlockingIOError
        If another process or thread holds the lock, and this one is not to ``wait``.
    OSError
        If the file cannot be made.
    """
    path = folder.with_name(f"{folder.name}.lock")
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
            if os.fstat(descriptor).st_nlink == 0:
                continue
            try:
                yield
            finally:
                path.unlink(missing_ok=True)
            return
        finally:
            os.close(descriptor)
