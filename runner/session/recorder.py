"""Putting answers on disk: one line appended and fsynced per trial, and a lock so that only one process writes."""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO

from filelock import FileLock, Timeout

from analysis.records.session_record import FILE_NAME, Header, Mark, Note, Resumption, SessionLog, Trial, read_session
from documents import Finding
from documents.platform import sync_folder
from runner.errors import SessionError


class Recorder:
    """An open session log.

    Every ``append``, ``note`` and ``mark`` returns only once its line is on disk; they may
    come from several threads. What could not be written whole is taken off the log
    again, so that a later line never joins the rest of a broken one. Use as a context
    manager; the lock goes with it, or with the process if that is killed.
    """

    def __init__(self, folder: Path, lock: FileLock, stream: BinaryIO) -> None:
        self.folder = folder
        self._lock = lock
        self._stream = stream
        self._turn = threading.Lock()

    @classmethod
    def create(cls, folder: Path, header: Header) -> Recorder:
        """Make the session's ``folder`` and its log with the header.

        Raises
        ------
        SessionError
            If the folder exists already or cannot be written.
        """
        try:
            folder.parent.mkdir(parents=True, exist_ok=True)
            folder.mkdir()
        except FileExistsError as error:
            raise SessionError(Finding("this session exists already", str(folder))) from error
        except OSError as error:
            raise SessionError(
                Finding(f"the results folder cannot be written: {error.strerror}", str(folder), remedy="choose another")
            ) from error
        try:
            lock = _locked(folder)
            # The log appears with its whole header or not at all.
            part = folder / f".{FILE_NAME}.part"
            with _open(part) as stream:
                _write(stream, header.to_json())
            os.replace(part, folder / FILE_NAME)
            sync_folder(folder)
            sync_folder(folder.parent)
            return cls(folder, lock, _open(folder / FILE_NAME))
        except OSError as error:
            remedy = "make room, or choose another results folder"
            raise SessionError(
                Finding(f"the session cannot be written: {error.strerror}", str(folder), remedy=remedy)
            ) from error

    @classmethod
    def reopen(cls, folder: Path, resumption: Resumption | None = None) -> tuple[Recorder, SessionLog]:
        """Open a session that stopped, record its ``resumption`` if given, and return what it held.

        A line cut short by a power cut is kept beside the log as ``torn-*.bin`` and taken off its end.

        Raises
        ------
        SessionError
            If another process is running the session, or the log cannot be written.
        ResultsError
            If the log is damaged before its last line.
        """
        file = folder / FILE_NAME
        try:
            lock = _locked(folder)
            log = read_session(file)
            if log.torn_tail:
                whole = file.stat().st_size - len(log.torn_tail)
                with open(folder / f"torn-{whole}.bin", "wb") as kept:
                    kept.write(log.torn_tail)
                    os.fsync(kept.fileno())
                os.truncate(file, whole)
            stream = _open(file)
            if not file.read_bytes().endswith(b"\n"):
                stream.write(b"\n")
                os.fsync(stream.fileno())
            recorder = cls(folder, lock, stream)
            if resumption is not None:
                recorder._write(resumption.to_json())
        except OSError as error:
            what = f"the session cannot be gone on with: {error.strerror}"
            raise SessionError(Finding(what, str(file), remedy="let it be written, and leave some room")) from error
        return recorder, log

    def append(self, trial: Trial) -> None:
        """Record an answer; it is on disk when this returns."""
        self._write(trial.to_json())

    def note(self, note: Note) -> None:
        """Record a note."""
        self._write(note.to_json())

    def mark(self, mark: Mark) -> None:
        """Record the wish that a trial be asked once more."""
        self._write(mark.to_json())

    def answers(self) -> tuple[Trial, ...]:
        """Return every attempt that the log holds."""
        with self._turn:
            return read_session(self.folder / FILE_NAME).answers

    def end(self, facts: Mapping[str, Any]) -> None:
        """Record that the session is complete, and ``facts`` of how it went."""
        self._write({"record": "end", **facts})

    def close(self) -> None:
        """Close the log and let others have it."""
        self._stream.close()
        self._lock.release()

    def _write(self, line: Mapping[str, Any]) -> None:
        with self._turn:
            _write(self._stream, line)

    def __enter__(self) -> Recorder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _write(stream: BinaryIO, line: Mapping[str, Any]) -> None:
    text = json.dumps(line, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    # What no encoding has (half of a surrogate pair) stays as the escape that JSON has for it.
    data = text.encode("utf-8", "backslashreplace") + b"\n"
    before = os.fstat(stream.fileno()).st_size
    try:
        left = memoryview(data)
        while left:  # a disk that is nearly full takes a part, and says at the next attempt what is wrong
            left = left[stream.write(left) :]
        os.fsync(stream.fileno())
    except OSError:
        os.ftruncate(stream.fileno(), before)
        raise


def _locked(folder: Path) -> FileLock:
    lock = FileLock(folder / ".lock")
    try:
        lock.acquire(timeout=0)
    except Timeout as error:
        raise SessionError(
            Finding("another process is running this session", str(folder), remedy="close it first")
        ) from error
    return lock


def _open(file: Path) -> BinaryIO:
    return open(file, "ab", buffering=0)
