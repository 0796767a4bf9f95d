"""One session at a time of an observer and an experiment, held before any window opens."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from documents import Finding
from documents.files import LogInUseError, OwnedLock, in_use, make_private, remove_left, unwritable
from runner.errors import SessionError
from runner.session.folders import LOCK, observer_folder


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
