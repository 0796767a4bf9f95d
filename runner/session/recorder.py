"""Putting answers on disk: one line appended and fsynced per trial, and a lock so that only one process writes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

from analysis.records.session_record import FILE_NAME, Header, Mark, Note, Resumption, SessionLog, Trial, read_session
from documents import Finding
from documents.files.durable_log import DurableLog, LogInUseError
from documents.platform import sync_folder
from runner.errors import SessionError


class Recorder:
    """An open session log, a `DurableLog`; use as a context manager.

    Every ``append``, ``note`` and ``mark`` returns only once its line is on disk; they may come from several threads.
    """

    def __init__(self, folder: Path, log: DurableLog) -> None:
        self.folder = folder
        self._log = log

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
            log = DurableLog.create(folder / FILE_NAME, folder / ".lock", header.to_json())
            sync_folder(folder.parent)
        except LogInUseError as error:
            raise _in_use(folder) from error
        except OSError as error:
            remedy = "make room, or choose another results folder"
            raise SessionError(
                Finding(f"the session cannot be written: {error.strerror}", str(folder), remedy=remedy)
            ) from error
        return cls(folder, log)

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
            log, session = DurableLog.reopen(file, folder / ".lock", folder / "torn.bin", read_session)
            if resumption is not None:
                log.append(resumption.to_json())
        except LogInUseError as error:
            raise _in_use(folder) from error
        except OSError as error:
            what = f"the session cannot be resumed: {error.strerror}"
            raise SessionError(Finding(what, str(file), remedy="let it be written, and leave some room")) from error
        return cls(folder, log), session

    def append(self, trial: Trial) -> None:
        """Record an answer; it is on disk when this returns."""
        self._log.append(trial.to_json())

    def note(self, note: Note) -> None:
        """Record a note."""
        self._log.append(note.to_json())

    def mark(self, mark: Mark) -> None:
        """Record the wish that a trial be asked once more."""
        self._log.append(mark.to_json())

    def answers(self) -> tuple[Trial, ...]:
        """Return every attempt that the log holds."""
        return self._log.read(read_session).answers

    def end(self, facts: Mapping[str, Any]) -> None:
        """Record that the session is complete, and ``facts`` of how it went."""
        self._log.append({"record": "end", **facts})

    def close(self) -> None:
        """Close the log and let others open it."""
        self._log.close()

    def __enter__(self) -> Recorder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _in_use(folder: Path) -> SessionError:
    return SessionError(Finding("another process is running this session", str(folder), remedy="close it first"))
