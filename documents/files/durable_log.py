"""A log of JSON lines that survives a crash: each line is on disk before `append` returns.

Each line gets its number and a checksum that is chained to the line before (`documents.files.chain`). One process at a
time has the log open. A line that could not be written whole is taken off again, so that a later line
never joins the rest of a broken one. A last line that a power cut left unfinished is kept in a file of its own when the
log is opened again, and taken off the log; a last line that is whole but for its line end counts.

All lines are in memory too. Before and after each line, and when the log is closed, the file that the path names is
compared with them: if another program removed, replaced or changed it, or the record of who writes it
(`documents.files.owned_lock`), the log is written again and `LogDisturbedError` is raised; where another process took
it over, it is written in the state folder.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Protocol, TypeVar

from documents.files.access import opener
from documents.files.atomic import whole_file
from documents.files.chain import CHAINED, COUNT, EMPTY, LogState, sealed
from documents.files.log_rescue import LogDisturbedError, difference, rescue
from documents.files.owned_lock import OwnedLock, Owner
from documents.platform import sync_folder


class HasState(Protocol):
    """What a log's reader returns: its ``state`` is that of `read_lines`."""

    @property
    def state(self) -> LogState:
        """Where the log ends, and what the next line is chained to."""


Read = TypeVar("Read", bound=HasState)


class DurableLog:
    """An open log; use as a context manager. ``append`` may be called from several threads.

    ``size`` is how many bytes of it were written; `read` returns them from memory.
    """

    def __init__(self, file: Path, lock: OwnedLock, stream: BinaryIO, state: LogState, content: bytes) -> None:
        self.file = file
        self._content = bytearray(content)
        self._rest = False  # whether an attempt that failed may have left something behind the last line
        try:
            self._changed_ns = os.fstat(stream.fileno()).st_mtime_ns
        except OSError:
            stream.close()
            raise
        self._disturbed: LogDisturbedError | None = None
        self._lock = lock
        self._stream = stream
        self._turn = threading.Lock()
        self._lines, self._digest, self._ended = state.lines, state.digest, state.ended

    @property
    def size(self) -> int:
        """How many bytes were written."""
        return len(self._content)

    def read(self, begin: int, end: int) -> bytes:
        """Return the bytes from ``begin`` to ``end`` as they were written, whatever became of the file."""
        return bytes(self._content[begin:end])

    @property
    def taken_over(self) -> Owner | None:
        """Whose record was left behind by a process that ended without closing the log, None if there was none."""
        return self._lock.taken_over

    @classmethod
    def create(cls, file: Path, lock_file: Path, header: Mapping[str, Any], *, private: bool = True) -> DurableLog:
        """Make the log ``file`` with ``header`` as its first line; it appears with the whole header or not at all.

        ``private`` says that it has people's data, as for `whole_file`.

        Raises
        ------
        LogInUseError
            If somebody else holds ``lock_file``.
        OSError
            If the log cannot be written.
        """
        lock = OwnedLock.take(lock_file)
        try:
            line, digest = sealed({**header, CHAINED: True}, 1, EMPTY)
            with whole_file(file, private=private) as draft, open(draft, "wb", buffering=0) as stream:
                _write(stream, line + b"\n", 0)
            sync_folder(file.parent)
            return cls(file, lock, _open(file), LogState(1, len(line) + 1, digest, 1), line + b"\n")
        except BaseException:
            lock.release()
            raise

    @classmethod
    def reopen(
        cls, file: Path, lock_file: Path, torn_file: Path, read: Callable[[Path], Read]
    ) -> tuple[DurableLog, Read]:
        """Open the log ``file`` to append to it, and return it with what ``read`` returns of it.

        An unfinished last line is moved to ``torn_file``, with its place in the log added to the name:
        ``torn.bin`` becomes ``torn-1024.bin``.

        Raises
        ------
        LogInUseError
            If somebody else holds ``lock_file``.
        OSError
            If the log cannot be written.
        """
        lock = OwnedLock.take(lock_file)
        try:
            content = read(file)
            state = content.state
            if state.torn_tail:
                _set_aside(file, state.torn_tail, torn_file)
            with open(file, "rb") as stream:
                held = stream.read(state.size)
            log = cls(file, lock, _open(file), state, held)
        except BaseException:
            lock.release()
            raise
        try:
            if state.lacks_line_end:
                log._add(b"\n")
        except BaseException:
            log._release()
            raise
        return log, content

    def append(self, line: Mapping[str, Any]) -> None:
        """Write ``line`` and return when it is on disk.

        Raises
        ------
        LogDisturbedError
            If another program removed, replaced or changed the file; the line is in the log that was written again.
        OSError
            If it cannot be written; the log then ends as it did before.
        ValueError
            If the log has its end line, or ``line`` has a key that the log adds or a value that JSON does not have.
        """
        with self._turn:
            self._put(line)

    def end(self, line: Mapping[str, Any]) -> None:
        """Write ``line``, of the record ``end``, with the number of lines before it; none may follow.

        Raises
        ------
        LogDisturbedError, OSError
            As `append`.
        """
        with self._turn:
            self._put({**line, COUNT: self._lines}, ends=True)

    def check(self) -> None:
        """Compare every byte of the file with what was written; also of a log that was closed.

        Raises
        ------
        LogDisturbedError
            If another program removed, replaced or changed the file, which was written again then.
        """
        with self._turn:
            self._rescue_if(self._difference(closely=True))

    def _put(self, line: Mapping[str, Any], *, ends: bool = False) -> None:
        if self._ended:
            raise ValueError(f"the log {self.file} has its end line already")
        data, digest = sealed(line, self._lines + 1, self._digest)
        what = self._difference(closely=self._was_touched())
        if what is None and self._disturbed is None:
            try:
                self._add(data + b"\n")
            except OSError:
                self._rescue_if(self._difference(closely=False))
                raise
            what = self._difference(closely=False)
        else:  # the line goes with the others
            self._content += data + b"\n"
            what = what or "another program changed the file before"
        self._lines, self._digest, self._ended = self._lines + 1, digest, ends
        self._rescue_if(what)

    def _add(self, data: bytes) -> None:
        try:
            _write(self._stream, data, self.size)
        except BaseException:
            self._rest = True
            raise
        self._rest = False
        self._content += data
        self._changed_ns = os.fstat(self._stream.fileno()).st_mtime_ns

    def _was_touched(self) -> bool:
        try:
            return os.stat(self.file).st_mtime_ns != self._changed_ns
        except OSError:
            return True

    def _difference(self, *, closely: bool) -> str | None:
        descriptor = None if self._stream.closed else self._stream.fileno()
        lost = self._lock.lost()
        if self._lock.is_taken:
            return lost
        return difference(self.file, descriptor, self._content, exact=not self._rest, closely=closely) or lost

    def _rescue_if(self, what: str | None) -> None:
        """Write the log again if something became of it, and raise that; what is raised once is not found twice."""
        if what is None:
            return
        self._stream.close()
        taken = self._lock.is_taken
        done = rescue(self.file, self._content, elsewhere=taken)
        self._disturbed = LogDisturbedError(self.file, what, self._lines, done, complete=self._ended, taken=taken)
        self._rest = False
        raise self._disturbed

    def close(self) -> None:
        """Compare the file with what was written, close the log and let others open it.

        Raises
        ------
        LogDisturbedError
            As `check`, unless it was raised before.
        """
        try:
            if not self._stream.closed:
                self.check()
        finally:
            self._release()

    def _release(self) -> None:
        self._stream.close()
        self._lock.release()

    def __enter__(self) -> DurableLog:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _open(file: Path) -> BinaryIO:
    return open(file, "ab", buffering=0)


def _write(stream: BinaryIO, data: bytes, before: int) -> None:
    """Write ``data`` at the end of a log of ``before`` bytes; what an earlier attempt left there is taken off first."""
    if os.fstat(stream.fileno()).st_size > before:
        os.ftruncate(stream.fileno(), before)
    try:
        left = memoryview(data)
        while left:  # a disk that is nearly full takes a part, and says at the next attempt what is wrong
            left = left[stream.write(left) :]
        os.fsync(stream.fileno())
    except OSError:
        os.ftruncate(stream.fileno(), before)
        raise


def _set_aside(file: Path, tail: bytes, torn_file: Path) -> None:
    """Take ``tail`` off the end of ``file``, once it is on disk in a file of its own."""
    whole = file.stat().st_size - len(tail)
    stem, number = f"{torn_file.stem}-{whole}", 1
    aside = torn_file.with_stem(stem)
    while aside.exists() and aside.read_bytes() != tail:  # the log was torn here before
        number += 1
        aside = torn_file.with_stem(f"{stem}-{number}")
    with open(aside, "wb", opener=opener) as kept:
        kept.write(tail)
        kept.flush()
        os.fsync(kept.fileno())
    sync_folder(aside.parent)
    os.truncate(file, whole)
