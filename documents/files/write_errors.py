"""Why a file could not be written, in one finding: a full disk, a folder that may only be read, a limit on files."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from documents.files.faults import system_fault
from documents.files.regular_files import NotAFileError
from documents.findings import Finding, InputError

_FULL = {errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC)}
_READ_ONLY = {errno.EROFS, errno.EACCES, errno.EPERM}
_ELSEWHERE = "choose another folder"
# Of the place, not of the machine: what is wrong, and what to do.
_PLACES = {
    errno.ENOENT: ("there is no such file", "put it there, and try again"),
    errno.EISDIR: ("it is a folder", "name a file"),
    errno.ENAMETOOLONG: ("its name is too long", "choose a shorter name"),
    errno.ELOOP: ("its links lead to one another", "name the folder itself"),
    errno.ENOTEMPTY: ("there is something already", "name a new or an empty folder"),
    errno.EEXIST: ("there is something already", "move it away, or choose another name"),
}
_STEP = 1 << 16


def unwritable(
    caught: OSError, path: Path, what: str, *, wanted_bytes: int | None = None, elsewhere: str = _ELSEWHERE
) -> Finding:
    """Return why the ``what`` at ``path`` could not be written, with the folder, and what to do.

    Parameters
    ----------
    caught
        The error that the system raised.
    path
        The file, or the folder that it was to lie in.
    what
        What was to be written, such as ``picture``.
    wanted_bytes
        How many bytes it takes at most, where that is known.
    elsewhere
        How another folder is chosen.

    Returns
    -------
    Finding
        The reason; of a full disk with what is free and what is wanted, and the remedy.

    Examples
    --------
    >>> str(unwritable(OSError(30, "Read-only file system"), Path("configs"), "picture"))
    'configs: the picture cannot be written: the folder configs may only be read (choose another folder)'
    """
    folder = path if os.path.isdir(path) else path.parent  # raises nothing, however long the name is
    if caught.errno in _FULL:
        parts = [] if (free := _free_bytes(folder)) is None else [f"{_size(free)} free"]
        parts += [f"up to {_size(wanted_bytes)} wanted"] if wanted_bytes else []
        why = f"the disk of the folder {folder} is full" + (f" ({', '.join(parts)})" if parts else "")
        remedy = f"make room there, or {elsewhere}"
    elif caught.errno in _READ_ONLY:
        why, remedy = f"the folder {folder} may only be read", elsewhere
    elif caught.errno == errno.EFBIG:
        why, remedy = f"files in the folder {folder} may not become as large", elsewhere
    elif isinstance(caught, NotAFileError):
        why, remedy = str(caught.strerror), "name a file"
    elif isinstance(caught, FileNotFoundError | NotADirectoryError | FileExistsError) and not os.path.isdir(folder):
        why, remedy = _without_folder(folder), f"make the folder, or {elsewhere}"
    elif caught.errno in _PLACES:
        why, remedy = _PLACES[caught.errno]
    elif (fault := system_fault(caught)) and fault.code != "EIO":
        why, remedy = str(fault), fault.remedy
    else:
        why = str(fault) if fault else caught.strerror or str(caught)
        remedy = f"look at the disk of the folder {folder}, or {elsewhere}"
    return Finding(f"the {what} cannot be written: {why}", str(path), remedy=remedy)


@contextmanager
def writing(
    path: Path, what: str, error: Callable[[Finding], Exception] = InputError, *, elsewhere: str = _ELSEWHERE
) -> Iterator[None]:
    """Let the body write the ``what`` at ``path``; what the system refuses is one ``error``, as `unwritable` says it.

    Parameters
    ----------
    path
        The file or folder; an error of the system that names another is told of that one.
    what, elsewhere
        As for `unwritable`.
    error
        Makes the error of the finding.

    Raises
    ------
    Exception
        The ``error``, if the body raises an OSError.

    Examples
    --------
    >>> with writing(Path("nowhere/page.html"), "page"):
    ...     Path("nowhere/page.html").write_text("<p>")
    Traceback (most recent call last):
    ...
    documents.findings.InputError: nowhere/page.html: the page cannot be written: there is no folder nowhere (make the
    folder, or choose another folder)
    """
    try:
        yield
    except OSError as caught:
        named = caught.filename2 or caught.filename
        place = Path(os.fsdecode(named)) if isinstance(named, str | bytes) else path
        raise error(unwritable(caught, place, what, elsewhere=elsewhere)) from caught


def _without_folder(folder: Path) -> str:
    """Say which folder is missing, or is none."""
    for above in (*reversed(folder.parents), folder):
        if os.path.lexists(above) and not os.path.isdir(above):
            return f"{above} is no folder"
    return f"there is no folder {folder}"


def what_stopped(draft: Path) -> OSError | None:
    """Return the error that the system raises where more is written to ``draft``, None if none.

    For libraries that keep the reason to themselves.

    Parameters
    ----------
    draft
        The file that was not finished; it is made if it is not there, and is of no use afterwards.

    Returns
    -------
    OSError or None
        The reason.

    Examples
    --------
    >>> what_stopped(Path("nowhere/picture.exr")).strerror
    'No such file or directory'
    """
    try:
        with draft.open("ab", buffering=0) as file:
            if file.write(b"\0" * _STEP) < _STEP:
                file.write(b"\0" * _STEP)
            os.fsync(file.fileno())
    except OSError as error:
        return error
    return None


def _free_bytes(folder: Path) -> int | None:
    try:
        return shutil.disk_usage(folder).free
    except OSError:
        return None


def _size(count: int) -> str:
    return f"{count / 1e9:.1f} GB" if count >= 1e9 else f"{count / 1e6:.1f} MB"
