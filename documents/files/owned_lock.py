"""A lock that holds on network folders too: the system's lock of a file and, beside it, a record of who has it.

The record of ``.lock`` is ``.lock.owner``: machine, process, when that started, a random token and the time, which a
thread writes again every `BEAT_S` seconds while the lock is held. It also holds where the locks of another machine are
not seen, and where somebody removes the lock's file. A record counts as left behind, and is taken over, if its process
runs no more on this machine, or if it is of another machine and had no sign of life for `STALE_S` seconds, by the clock
of the disk that has the folder.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import platform
import secrets
import sys
import threading
import time
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from documents.files.access import opener
from documents.files.atomic import draft_of
from documents.files.regular_files import read_regular
from documents.findings import InputError
from documents.platform import boot_id, is_alive, process_space, process_start, rename

if TYPE_CHECKING:
    from filelock import FileLock

BEAT_S = 10.0
STALE_S = 120.0
_MOST_BYTES = 10_000
_NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP}  # the folder's disk has none
_held: set[str] = set()  # the tokens of this process


@dataclass(frozen=True, slots=True)
class Owner:
    """Who holds a lock: a process, the name of its machine, and since when; ``beat_utc`` is its last sign of life.

    ``machine`` also tells machines of one name apart, and a machine before and after a restart. ``inode`` is that of
    the record's file, 0 if unknown: on its machine a copy of the record locks nothing.
    """

    host: str
    machine: str
    process: int
    started: str
    token: str
    since_utc: str
    beat_utc: str
    inode: int = 0

    @classmethod
    def here(cls) -> Owner:
        """Return this process, as it takes a lock now."""
        process, now = os.getpid(), _now()
        return cls(platform.node(), _machine(), process, process_start(process), secrets.token_hex(8), now, now)

    @property
    def is_here(self) -> bool:
        """Whether its machine is this one, not restarted since."""
        return self.machine == _machine()

    def __str__(self) -> str:
        """In words."""
        since, beat = (time[:19].replace("T", " ") for time in (self.since_utc, self.beat_utc))
        return f"process {self.process} on {self.host}, since {since} UTC, last sign of life {beat[11:]} UTC"


class LogInUseError(Exception):
    """Another process, or another part of this one, has the lock: ``owner``, where that is known."""

    def __init__(self, file: Path, owner: Owner | None = None) -> None:
        self.owner = owner
        super().__init__(f"{file}: {owner or 'another process'}")

    @property
    def who(self) -> str:
        """Who has it, in brackets after a space; empty where that is not known."""
        return f" ({self.owner})" if self.owner else ""

    @property
    def remedy(self) -> str:
        """What to do."""
        if self.owner is None or self.owner.is_here:
            return "close it first"
        wait = f"try again once it gave no sign of life for {STALE_S / 60:.0f} minutes"
        return f"close it on {self.owner.host} first; if that machine is off or not connected, {wait}"


class OwnedLock:
    """A lock that is held, until `release`; ``taken_over`` is whose record was left behind, None if there was none."""

    def __init__(self, record: Path, descriptor: int, lock: FileLock, owner: Owner, taken_over: Owner | None) -> None:
        self.taken_over = taken_over
        self.is_taken = False
        self._record, self._descriptor, self._lock, self._owner = record, descriptor, lock, owner
        self._turn = threading.Lock()
        self._over = threading.Event()
        threading.Thread(target=self._beat, name="sign of life", daemon=True).start()

    @classmethod
    def take(cls, file: Path) -> OwnedLock:
        """Take the lock of ``file``, which is made; do not wait.

        Raises
        ------
        LogInUseError
            If somebody else has it.
        OSError
            If the file or the record cannot be written.
        """
        lock, record = _system_lock(file), _record_of(file)
        try:
            left = _read(record)
            if left and _lives(left, file):
                raise LogInUseError(file, left)
            if os.path.lexists(record):
                _take_away(record, left)
            owner, descriptor = _made(record)
            return cls(record, descriptor, lock, owner, left)
        except BaseException:
            lock.release()
            raise

    def lost(self) -> str | None:
        """Return what became of the record while the lock is held, None if nothing did.

        Where another process has taken the lock, ``is_taken`` is true from then on.
        """
        if self._over.is_set():
            return None
        owner = None
        try:
            owner = _parsed(read_regular(self._record, _MOST_BYTES))
        except InputError as error:
            if isinstance(error.__cause__, FileNotFoundError):
                return f"another program removed the record of who writes the log ({self._record.name})"
            if isinstance(error.__cause__, OSError):
                return None  # it says nothing of who is there: the log itself is compared too
        if owner is None:
            return f"another program changed the record of who writes the log ({self._record.name})"
        self.is_taken |= owner.token != self._owner.token
        return f"another process took the log over ({owner})" if self.is_taken else None

    def release(self) -> None:
        """Let others take it."""
        with self._turn:
            if not self._over.is_set():
                self._over.set()
                os.close(self._descriptor)
                _held.discard(self._owner.token)
                with suppress(OSError):
                    if (owner := _read(self._record)) and owner.token == self._owner.token:
                        self._record.unlink()
        self._lock.release()

    def _beat(self) -> None:
        """Write the time again and again, into the file that was made: never into one that stands in its place."""
        while not self._over.wait(BEAT_S):
            with self._turn, suppress(OSError):
                if not self._over.is_set():
                    os.lseek(self._descriptor, 0, os.SEEK_SET)
                    os.write(self._descriptor, _line(replace(self._owner, beat_utc=_now())))


def in_use(file: Path) -> LogInUseError | None:
    """Return who has the lock of ``file``, as an error; None if nobody has: the file alone locks nothing."""
    left = _read(_record_of(file))
    if left and _lives(left, file):
        return LogInUseError(file, left)
    if not file.exists():
        return None
    try:
        _system_lock(file).release()
    except LogInUseError as error:
        return error
    except OSError:
        return None  # it cannot be opened: taking it reports that
    return None


def _system_lock(file: Path) -> FileLock:
    from filelock import FileLock, Timeout

    lock = FileLock(file, thread_local=False)  # it may be released by another thread than took it
    try:
        lock.acquire(timeout=0)
    except Timeout as error:
        raise LogInUseError(file, _read(_record_of(file))) from error
    except NotImplementedError:
        pass  # the record locks alone
    except OSError as error:
        if error.errno not in _NO_LOCKS:
            raise
    return lock


def _take_away(record: Path, left: Owner | None) -> None:
    """Remove the record that was read as ``left``; raise LogInUseError if it is another one by now.

    It is looked at once more under a name that nobody else removes: where the system's locks are not seen, two may find
    the same record left behind, and the second must not remove the first one's.
    """
    aside = draft_of(record, "before")
    try:
        rename(record, aside)
    except FileNotFoundError:
        return  # somebody else takes it over at this moment: who makes the new record first has it
    now = _read(aside)
    if now != left:
        with suppress(FileExistsError):
            _put(aside, record)
    aside.unlink(missing_ok=True)
    if now != left:
        raise LogInUseError(record, now)


def _made(record: Path) -> tuple[Owner, int]:
    """Make the record and return it with its open file; raise LogInUseError if there is one.

    It appears whole, but on Windows and on disks without links.
    """
    owner, draft = Owner.here(), draft_of(record, "part")
    _held.add(owner.token)  # before another thread can read it
    try:
        if sys.platform == "win32":  # there no name is taken from an open file
            return _created(record, owner)
        made = _created(draft, owner)
        try:
            os.link(draft, record)
        except OSError as error:
            os.close(made[1])
            if isinstance(error, FileExistsError):
                raise
            return _created(record, owner)
        finally:
            with suppress(OSError):  # the next who writes here removes it
                draft.unlink(missing_ok=True)
        return made
    except FileExistsError as error:  # somebody took it at this moment
        _held.discard(owner.token)
        raise LogInUseError(record, _read(record)) from error
    except BaseException:
        _held.discard(owner.token)
        raise


def _created(path: Path, owner: Owner) -> tuple[Owner, int]:
    descriptor = opener(str(path), os.O_CREAT | os.O_EXCL | os.O_RDWR)
    try:
        owner = replace(owner, inode=os.fstat(descriptor).st_ino)
        os.write(descriptor, _line(owner))
    except BaseException:
        os.close(descriptor)
        path.unlink()
        raise
    return owner, descriptor


def _put(file: Path, path: Path) -> None:
    """Let ``file`` be ``path`` too, or alone where a file has one name; raise FileExistsError if that is there."""
    try:
        os.link(file, path)
    except FileExistsError:
        raise
    except OSError:  # a disk without links
        if os.path.lexists(path):
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path)) from None
        rename(file, path)


def _record_of(file: Path) -> Path:
    return file.with_name(f"{file.name}.owner")


def _line(owner: Owner) -> bytes:
    """Return ``owner`` as bytes, as many whenever it was."""
    return json.dumps(asdict(owner)).encode() + b"\n"


def _read(record: Path) -> Owner | None:
    try:
        return _parsed(read_regular(record, _MOST_BYTES))
    except InputError:
        return None


def _parsed(data: bytes) -> Owner | None:
    """Return the owner, None if a process was killed, or the machine lost its power, while the record was made."""
    try:
        owner = Owner(**json.loads(data))
        datetime.fromisoformat(owner.since_utc), datetime.fromisoformat(owner.beat_utc)
        os.fspath(owner.token)
        return replace(owner, process=int(owner.process))
    except (TypeError, ValueError):
        return None


def _lives(owner: Owner, file: Path) -> bool:
    """Return whether the owner that the record of ``file`` names runs still, as far as can be told from here."""
    if not owner.is_here:
        return _silent_s(file) < STALE_S
    if owner.inode and _is_copy(owner, file):
        return False
    if owner.process == os.getpid():
        return owner.token in _held
    if owner.started:
        return process_start(owner.process) == owner.started
    return is_alive(owner.process) and _silent_s(file) < STALE_S


def _is_copy(owner: Owner, file: Path) -> bool:
    try:
        return _record_of(file).stat().st_ino != owner.inode
    except OSError:
        return False


def _silent_s(file: Path) -> float:
    """Return for how long the record of ``file`` had no sign of life, by the clock of the disk where both lie."""
    try:
        beat_s = _record_of(file).stat().st_mtime
    except OSError:
        return 0.0
    try:
        file.touch()
        return file.stat().st_mtime - beat_s
    except OSError:
        return time.time() - beat_s


def _machine() -> str:
    return hashlib.sha256(f"{platform.node()}/{boot_id()}/{process_space()}".encode()).hexdigest()[:16]


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
