"""Where sessions lie, and how their answers are put on disk.

A session's folder is `RESULTS/EXPERIMENT/sub-OBSERVER/ses-TIMErandom/`; its name never collides between stations. Its
log grows by one line for each trial, which is appended and fsynced; a lock lets only one process write. Another, held
before any window opens, lets an observer have one session of an experiment at a time. Where the rig asks for it, a log
is copied as it grows, with what was torn off it and the files it was made with.
"""

from __future__ import annotations

import re
import secrets
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import TracebackType
from typing import Any

from analysis.errors import ResultsError
from analysis.records import FILE_NAME, Change, Header, Resumption, SessionLog, latest_utc, plain_code, read_session
from analysis.seals import copy_in_mirror
from documents import Finding
from documents.files import DurableLog, LogInUseError, Mirror, OwnedLock, in_use, make_private, remove_left, unwritable
from documents.platform import sync_folder
from documents.text import counted
from runner.errors import SessionError, UsedCodeError
from runner.session.clocks import SteadyClock
from runner.session.events import Ended, Event, Record, Recorded
from runner.session.header import software

LOCK = ".lock"
_LETTERS = "abcdefghijkmnpqrstuvwxyz23456789"
_RANDOM = 10
_NAMED = 12
_READ = 200  # observers whose logs are read to name those that can be resumed
_TIME = "%Y%m%dT%H%M%S"
_LABEL = re.compile(rf"ses-(\d{{8}}T\d{{6}})[{_LETTERS}]+")


def new_label(folder: Path | None = None, now: datetime | None = None) -> str:
    """Return a session label: UTC time to the second and ten random letters, a valid BIDS label.

    Labels in one observer's ``folder`` rise in the order in which the sessions began: where the clock stands before the
    latest of them, as it does after it was set back, the time is a second after that one's. Of labels made in the same
    second on any number of stations, two in a thousand million million are the same.
    """
    time = (now or datetime.now(UTC)).replace(microsecond=0, tzinfo=None)
    taken = (
        [_read_time(label[1]) for path in folder.glob("ses-*") if (label := _LABEL.fullmatch(path.name))]
        if folder
        else []
    )
    if taken:
        time = max(time, max(taken) + timedelta(seconds=1))
    return time.strftime(_TIME) + "".join(secrets.choice(_LETTERS) for _ in range(_RANDOM))


def _read_time(text: str) -> datetime:
    try:
        return datetime.strptime(text, _TIME)
    except ValueError:  # someone's own digits
        return datetime.min


def observer_folder(results: Path, experiment: str, observer: str) -> Path:
    """Return the folder of all of an observer's sessions.

    Raises
    ------
    SessionError
        If there is one of a code that differs in capitals only: Windows and macOS take both folders for one.
    """
    folder = results / experiment / f"sub-{observer}"
    for other in folder.parent.glob("sub-*"):
        if other.name != folder.name and other.name.casefold() == folder.name.casefold():
            twin = other.name.removeprefix("sub-")
            remedy = f"write {twin}, or choose another code"
            what = f"there are sessions of observer '{twin}', and '{observer}' differs from that in capitals only"
            raise SessionError(Finding(what, str(other), remedy=remedy))
    return folder


def unfinished(results: Path, experiment: str, observer: str) -> SessionLog | None:
    """Return the observer's latest session if it was not completed, else None.

    One in which nothing was asked yet, as where ``--resume`` was forgotten and the session left at once, does not hide
    an earlier unfinished one in which something was.
    """
    latest: SessionLog | None = None
    for file in sorted(observer_folder(results, experiment, observer).glob(f"ses-*/{FILE_NAME}"), reverse=True):
        log = read_session(file)
        if log.complete:
            break
        if answered(log):
            return log
        latest = latest or log
    return latest


def answered(log: SessionLog) -> int:
    """Return how many trials were answered, pages of words apart."""
    return len({answer.place for answer in log.answers if not answer.is_page})


def is_running(folder: Path) -> bool:
    """Return whether a process holds the lock of the session in ``folder``; a lock's file alone locks nothing."""
    return in_use(folder / LOCK) is not None


def to_resume(results: Path, experiment: str, observer: str) -> SessionLog:
    """Return the observer's unfinished session; raise SessionError, naming those that there are, if there is none."""
    log = unfinished(results, experiment, observer)
    if log is None:
        folder = observer_folder(results, experiment, observer)
        remedy = "; ".join([*_other_sessions(results, experiment, observer), "leave out --resume to begin one"])
        raise SessionError(Finding("there is no unfinished session to resume", str(folder), remedy=remedy))
    return log


def _other_sessions(results: Path, experiment: str, observer: str) -> Iterator[str]:
    """Yield what sessions there are in place of the one that is looked for."""
    if not results.is_dir():
        yield f"there is no folder {results}: is it another one, with --results?"
        return
    own = observer_folder(results, experiment, observer)
    if complete := len(list(own.glob(f"ses-*/{FILE_NAME}"))):
        yield f"observer {observer} has {counted(complete, 'session', 'sessions')} here, the last of them complete"
    people = sorted(path.name.removeprefix("sub-") for path in own.parent.glob("sub-*") if path != own)
    stopped = [
        f"{name} ({counted(answered(log), 'answer', 'answers')})"
        for name in people[:_READ]
        if (log := _readable_unfinished(results, experiment, name))
    ]
    if stopped:
        yield f"unfinished sessions of '{experiment}' there are of the observers {_some(stopped)}"
    elif people and not own.exists():
        yield f"sessions there are of the observers {_some(people)}"
    names = sorted(path.parent.name for path in results.glob(f"*/{own.name}") if path != own)
    elsewhere = [name for name in names if _readable_unfinished(results, name, observer)]
    if elsewhere:
        yield f"observer {observer} has an unfinished session of {_some(elsewhere)}"


def _readable_unfinished(results: Path, experiment: str, observer: str) -> SessionLog | None:
    try:
        return unfinished(results, experiment, observer)
    except ResultsError:
        return None


def _some(names: Sequence[str]) -> str:
    return ", ".join(names[:_NAMED]) + (", ..." if len(names) > _NAMED else "")


class Recorder:
    """An open session log, a `DurableLog`; use as a context manager.

    It listens to its session: it returns only once a line is on disk. Events may come from several threads.
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
            make_private(folder, new=True)
        except FileExistsError as error:
            raise SessionError(Finding("this session exists already", str(folder))) from error
        except OSError as error:
            raise SessionError(unwritable(error, folder, "session")) from error
        try:
            log = DurableLog.create(folder / FILE_NAME, folder / LOCK, header.to_json())
            try:
                sync_folder(folder.parent)
            except BaseException:
                log.close()
                raise
        except LogInUseError as error:
            raise running_now(folder, error) from error
        except OSError as error:
            raise SessionError(unwritable(error, folder, "session")) from error
        return cls(folder, log)

    @classmethod
    def reopen(
        cls,
        folder: Path,
        resumption: Callable[[SessionLog], Resumption] | None = None,
        stopped: SessionLog | None = None,
    ) -> tuple[Recorder, SessionLog]:
        """Open a session that stopped, record its ``resumption`` if given, and return what its log says.

        ``stopped`` is the log as it was read before; it is read again only if it grew or shrank since.

        A line cut short by a power cut is kept beside the log as ``torn-*.bin`` and taken off its end.

        Raises
        ------
        SessionError
            If another process is running the session or completed it, or the log cannot be written.
        ResultsError
            If the log is damaged before its last line.
        """
        file = folder / FILE_NAME

        def read(file: Path) -> SessionLog:
            return stopped if stopped and file.stat().st_size == stopped.state.file_size else read_session(file)

        try:
            log, session = DurableLog.reopen(file, folder / LOCK, folder / "torn.bin", read)
            try:
                if resumption is not None:
                    if session.complete:
                        raise SessionError(Finding("this session is complete: it cannot be resumed", str(file)))
                    log.append(resumption(session).to_json())
            except BaseException:
                log.close()
                raise
        except LogInUseError as error:
            raise running_now(folder, error) from error
        except OSError as error:
            elsewhere = "copy the results where they may be written, and resume there"
            raise SessionError(unwritable(error, file, "session", elsewhere=elsewhere)) from error
        return cls(folder, log), session

    @classmethod
    def resume(
        cls,
        folder: Path,
        accepted_changes: Mapping[str, Any],
        stopped: SessionLog | None = None,
        clock: Callable[[datetime | None], SteadyClock] = lambda not_before: SteadyClock(not_before=not_before),
    ) -> tuple[Recorder, SessionLog, SteadyClock]:
        """Open a session that stopped, record that it is resumed, and return its clock, which begins where it stopped.

        Raises
        ------
        SessionError, ResultsError
            As `reopen`.
        """
        clocks: list[SteadyClock] = []

        def resumption(log: SessionLog) -> Resumption:
            clocks.append(clock(latest_utc(log)))
            changes = {name: Change.model_validate(change) for name, change in accepted_changes.items()}
            now, before = {"commit": ""} | software(), log.software[-1]
            versions = {name: version for name, version in now.items() if before.get(name, "") != version}
            return Resumption(
                utc=clocks[0](), accepted_changes=changes, clock_behind_s=clocks[0].behind_s, software=versions
            )

        recorder, log = cls.reopen(folder, resumption, stopped)
        return recorder, log, clocks[0]

    @property
    def log(self) -> DurableLog:
        """The log."""
        return self._log

    def append(self, record: Record) -> None:
        """Write a record; it is on disk when this returns."""
        self._log.append(record.to_json())

    def end(self, facts: Mapping[str, Any]) -> None:
        """Write that the session is complete, and ``facts`` of how it went."""
        self._log.end({"record": "end", **facts})

    def hear(self, event: Event) -> None:
        """Write what the event records."""
        if isinstance(event, Recorded):
            self.append(event.record)
        elif isinstance(event, Ended):
            self.end(event.facts)

    def check(self) -> None:
        """Compare the log's file with all that was recorded; also once it is closed.

        Raises
        ------
        LogDisturbedError
            If another program removed, replaced or changed it, in which case it was written again.
        """
        self._log.check()

    def close(self) -> None:
        """Close the log and let others open it."""
        self._log.close()

    def __enter__(self) -> Recorder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def running_now(folder: Path, error: LogInUseError) -> SessionError:
    """Return what is said where another process writes the session in ``folder``."""
    what = f"another process is running this session{error.who}"
    return SessionError(Finding(what, str(folder), remedy=error.remedy))


def refuse_running(results: Path, experiment: str, observer: str) -> None:
    """Raise SessionError if a session of the observer in the experiment runs now."""
    folder = observer_folder(results, experiment, observer)
    if error := in_use(folder / LOCK):
        raise _running(folder, experiment, observer, error)


@contextmanager
def only_session(results: Path, experiment: str, observer: str) -> Iterator[None]:
    """Let nobody else run a session of the observer in the experiment meanwhile; leave nothing if none was begun.

    Raises
    ------
    SessionError
        If one runs now, or the folder cannot be written.
    """
    folder = observer_folder(results, experiment, observer)
    try:
        made = [path for path in (folder, folder.parent, results) if not path.exists()]
        make_private(folder)
        lock = OwnedLock.take(folder / LOCK)
    except LogInUseError as error:
        raise _running(folder, experiment, observer, error) from error
    except OSError as error:
        raise SessionError(unwritable(error, folder, "results")) from error
    try:
        for other in folder.glob("ses-*"):  # of a process that was killed while it wrote there
            remove_left(other)
        yield
    finally:
        if folder in made and not any(folder.glob("ses-*")):
            with suppress(OSError):  # Windows keeps a file that is open
                (folder / LOCK).unlink()
        lock.release()
        with suppress(OSError):  # what is not empty stays
            for path in made:
                path.rmdir()


def _running(folder: Path, experiment: str, observer: str, error: LogInUseError) -> SessionError:
    what = f"observer {observer} has a session of '{experiment}' that another process is running now{error.who}"
    remedy = f"wait until it ends, or give this observer's own code; or {error.remedy}"
    return SessionError(Finding(what, str(folder), remedy=remedy))


def next_sitting(results: Path, experiment: str, observer: str, *, simulated: bool) -> int:
    """Return the number of the observer's next session: 1 and those before it in which something was answered."""
    return 1 + sum(log is None or bool(answered(log)) for log in _earlier(results, experiment, observer, simulated))


def refuse_used(results: Path, experiment: str, observer: str, again: str, *, simulated: bool) -> None:
    """Raise UsedCodeError if the observer finished a session, with how to have ``again`` another."""
    logs = _earlier(results, experiment, observer, simulated)
    done = [log for log in logs if log is not None and log.complete and answered(log)]
    if done:
        ended = latest_utc(done[-1])
        when = f"{ended:%Y-%m-%d %H:%M} UTC" if ended else done[-1].header.started_utc
        what = f"observer {observer} finished a session of '{experiment}' on {when}"
        what += f", with {counted(answered(done[-1]), 'answer', 'answers')}"
        raise UsedCodeError(what, str(done[-1].file), again)


def near_codes(results: Path, experiment: str, observer: str) -> Iterator[str]:
    """Yield that there are sessions of a code that differs from the observer's in leading zeros only."""
    own = observer_folder(results, experiment, observer)
    for other in sorted(own.parent.glob("sub-*")):
        code = other.name.removeprefix("sub-")
        if other != own and plain_code(code) == plain_code(observer):
            yield f"there are sessions of observer {code}, and {observer} counts as somebody else"


def _earlier(results: Path, experiment: str, observer: str, simulated: bool) -> Iterator[SessionLog | None]:
    """Yield the observer's sessions, the oldest first; None for one that cannot be read, which others report."""
    for file in sorted(observer_folder(results, experiment, observer).glob(f"ses-*/{FILE_NAME}")):
        try:
            log = read_session(file)
        except ResultsError:
            yield None
            continue
        if log.header.simulated == simulated:
            yield log


def refuse_mirror_within(results: Path, mirror: Path, rig: str) -> None:
    """Raise SessionError if results and their copies would lie in one folder."""
    inside, outside = results.resolve(), mirror.resolve()
    if inside.is_relative_to(outside) or outside.is_relative_to(inside):
        what = f"results_mirror is {mirror}, and the results are in {results}: one lies in the other"
        raise SessionError(Finding(what, rig, remedy="name a folder on another disk"))


_TORN = re.compile(r"sub-[^/]+/ses-[^/]+/torn-[^/]+\.bin")


class LogMirror(Mirror):
    """A mirror that listens to the session whose log it copies."""

    def hear(self, event: Event) -> None:
        """Copy each line."""
        if isinstance(event, Recorded | Ended):
            self.follow(self._log.size)

    def close(self, wait_s: float = 10.0) -> str | None:
        """Let the copy be completed; return what is wrong with it."""
        self.follow(self._log.size)  # also after an error, at which no listener heard of the last line
        return super().close(wait_s)


def start_mirror(recorder: Recorder, folder: Path, note: Callable[[str, str], None]) -> LogMirror:
    """Have the session of ``recorder`` copied to ``folder``, and what that lacks of the experiment's other sessions.

    What goes wrong is noted once in the session's log, by ``note``, and never stops the session.
    """

    def on_fault(words: str) -> None:
        with suppress(OSError, ValueError):  # the session is over, or its own disk is full, which it reports
            note(words, "program")

    copy = copy_in_mirror(recorder.folder.absolute() / FILE_NAME, folder)
    mirror = LogMirror(recorder.log, copy, folder, lambda: _beside(recorder, folder), on_fault)
    mirror.follow(recorder.log.size)
    return mirror


def _beside(recorder: Recorder, folder: Path) -> Iterator[tuple[Path, Path]]:
    """Yield the files beside a session's log, each with its copy."""
    experiment = recorder.folder.absolute().parents[1]
    for file in sorted(experiment.rglob("*")):
        copy = folder / experiment.name / file.relative_to(experiment)
        name = file.relative_to(experiment).as_posix()
        wanted = name.startswith("configuration/") or _TORN.fullmatch(name) or _lacks(file, copy, recorder.folder)
        if wanted and file.is_file():
            yield file, copy


def _lacks(file: Path, copy: Path, own: Path) -> bool:
    """Return whether ``file`` is another session's log that nobody writes now, and ``copy`` is not all of it."""
    if file.name != FILE_NAME or file.parent.name == own.name:
        return False
    return not (copy.exists() and copy.stat().st_size == file.stat().st_size) and not is_running(file.parent)
