"""A copy of a growing log in another folder, kept by a thread that the log never waits for.

The copy holds the first bytes of the log, and is only ever added to. Where it holds other bytes, it is left as it is.
Each time, the thread writes what the copy lacks, so that a copy that was away, full or read-only is caught up later.
"""

from __future__ import annotations

import errno
import io
import os
import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from documents.files.access import make_private, opener
from documents.files.atomic import whole_file
from documents.files.durable_log import DurableLog
from documents.files.faults import system_fault
from documents.findings import InputError

_CHUNK = 1 << 20
_AGAIN_S = 2.0
_LAST_WAIT_S = 10.0


@dataclass(frozen=True, slots=True)
class CopyCheck:
    """How a copy compares with its log: ``size`` bytes of both are the same.

    ``behind`` lines of the log are not wholly in it; ``differs_at`` is the first line that is another one in the copy,
    or that only the copy has.
    """

    size: int
    behind: int
    differs_at: int | None = None

    def __str__(self) -> str:
        """In words."""
        if self.differs_at is not None:
            return f"differs at line {self.differs_at}"
        return f"behind by {self.behind} {'line' if self.behind == 1 else 'lines'}" if self.behind else "whole"


def compare_copy(file: Path, copy: Path, size: int | None = None) -> CopyCheck:
    """Compare ``copy`` with the first ``size`` bytes of the log ``file``, all if None; a missing copy lacks all lines.

    Raises
    ------
    OSError
        If either cannot be read.
    """
    with open(file, "rb") as log:
        return _compare(log, copy, os.stat(file).st_size if size is None else size)


def _compare(log: BinaryIO, copy: Path, left: int) -> CopyCheck:
    """Compare ``copy`` with the next ``left`` bytes of ``log``."""
    same = lines = 0
    if copy.exists() and not copy.is_file():
        raise OSError(errno.EINVAL, "not a regular file", str(copy))
    with open(copy if copy.exists() else os.devnull, "rb") as other:
        while left:
            ours = log.read(min(_CHUNK, left))
            theirs = other.read(len(ours))
            if not ours:
                break
            if theirs != ours[: len(theirs)]:
                first = next(i for i, (a, b) in enumerate(zip(ours, theirs, strict=False)) if a != b)
                return CopyCheck(same + first, 0, lines + ours.count(b"\n", 0, first) + 1)
            lines += theirs.count(b"\n")
            same += len(theirs)
            left -= len(ours)
            if len(theirs) < len(ours):
                rest = ours[len(theirs) :].count(b"\n")
                while left and (ours := log.read(min(_CHUNK, left))):
                    rest += ours.count(b"\n")
                    left -= len(ours)
                return CopyCheck(same, rest)
        if other.read(1):
            return CopyCheck(same, 0, lines + 1)
    return CopyCheck(same, 0)


class CopyDiffersError(Exception):
    """The copy has other bytes than the log; as text, where."""


class Mirror:
    """Keeps ``copy`` the same as ``log``, and copies of the files ``beside`` it, which do not grow meanwhile.

    The lines are taken from memory, so that the copy has them whatever becomes of the log's own file.

    Parameters
    ----------
    log, copy
        The log and its copy, below ``folder``, which is not made: it may be that of a disk that is not there.
    beside
        Returns pairs of a file and its copy; each is copied once.
    on_fault
        Called once, from another thread, with what went wrong first.
    """

    def __init__(
        self,
        log: DurableLog,
        copy: Path,
        folder: Path,
        beside: Callable[[], Iterable[tuple[Path, Path]]] = tuple,
        on_fault: Callable[[str], None] = lambda words: None,
    ) -> None:
        self._log, self._copy, self._folder = log, copy, folder
        self._beside, self._on_fault = beside, on_fault
        self._turn = threading.Condition()
        self._wanted = self._done = 0
        self._left_ns = 0  # when this thread changed the copy last
        self._copied: set[Path] = set()
        self._fault: str | None = None  # may pass
        self._left: str | None = None  # what is left as it is
        self._said = self._closing = self._over = False
        self._thread = threading.Thread(target=self._run, name="mirror of the results", daemon=True)
        self._thread.start()

    def follow(self, size: int) -> None:
        """State that the first ``size`` bytes of the log are on disk; returns at once."""
        with self._turn:
            self._wanted = max(size, self._wanted)
            self._turn.notify()

    def close(self, wait_s: float = _LAST_WAIT_S) -> str | None:
        """Wait for the copy ``wait_s`` at most; return what is wrong with it, None if it is whole."""
        with self._turn:
            self._closing = True
            self._turn.notify()
        self._thread.join(wait_s)
        with self._turn:
            if self._fault is None and self._done < self._wanted:
                return f"the copy of the results in {self._folder} is not complete yet"
            return self._fault or self._left

    def _run(self) -> None:
        while True:
            with self._turn:
                waits_s = _AGAIN_S if self._fault is not None else None
                self._turn.wait_for(lambda: self._closing or self._news, waits_s)
                wanted, closing = self._wanted, self._closing
            if not wanted:
                return
            fault, over = self._attempt(wanted, closing)
            with self._turn:
                self._fault, words = fault, fault or self._left
                first = words is not None and not self._said
                self._said |= first
                over = over or (closing and (fault is not None or self._done == self._wanted))
            if first:
                self._on_fault(str(words))
            if over:
                return

    @property
    def _news(self) -> bool:
        return self._fault is None and self._wanted > self._done

    def _attempt(self, wanted: int, closing: bool) -> tuple[str | None, bool]:
        """Add to the copy what it lacks; return what is wrong, and whether it is of no use to try again."""
        try:
            self._catch_up(wanted, closing)
            for file, copy in self._beside():
                if copy not in self._copied:
                    self._copied.add(copy)
                    self._complete(file, copy)
        except CopyDiffersError as error:
            return f"{error}; it is left as it is", True
        except (OSError, InputError) as error:
            self._copied.clear()
            return f"the results are not copied to {self._folder}: {self._words(error)}", False
        return None, False

    def _words(self, error: OSError | InputError) -> str:
        """Say what went wrong, and with which file where that is none of the copies."""
        if isinstance(error, InputError):
            return str(error)
        words, name = str(system_fault(error) or error.strerror or error), error.filename
        return words if name is None or self._folder in Path(name).parents else f"{words}: {name}"

    def _catch_up(self, wanted: int, closely: bool) -> None:
        """Write what the copy lacks; it is compared with the log if it was touched meanwhile, or ``closely``."""
        if not self._folder.is_dir():
            raise FileNotFoundError(errno.ENOENT, "there is no such folder", str(self._folder))
        make_private(self._copy.parent)
        with open(self._copy, "ab", buffering=0, opener=opener) as stream:
            held = os.fstat(stream.fileno())
            done = held.st_size
            if closely or not done or (done, held.st_mtime_ns) != (self._done, self._left_ns):
                check = _compare(io.BytesIO(self._log.read(0, wanted)), self._copy, wanted)
                if check.differs_at is not None:
                    raise CopyDiffersError(f"the copy {self._copy} has another line {check.differs_at} than the log")
            left = memoryview(self._log.read(done, wanted))
            while left:
                written = stream.write(left)
                left, done = left[written:], done + written
            os.fsync(stream.fileno())
            self._left_ns = os.fstat(stream.fileno()).st_mtime_ns
        with self._turn:
            self._done = done

    def _complete(self, file: Path, copy: Path) -> None:
        """Make ``copy`` the whole of ``file``, at once, unless it has other bytes."""
        check = compare_copy(file, copy)
        if check.differs_at is not None:
            self._left = self._left or f"the copy {copy} is another file than {file}; it is left as it is"
        elif check.size < file.stat().st_size or not copy.exists():
            with whole_file(copy, private=True) as draft:
                draft.write_bytes(file.read_bytes())
