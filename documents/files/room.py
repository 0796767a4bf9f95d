"""Why a file could not be written, in one finding: a full disk, a folder that may only be read, a limit on files."""

from __future__ import annotations

import errno
import os
import shutil
from pathlib import Path

from documents.files.faults import system_fault
from documents.files.regular import NotAFileError
from documents.findings import Finding

_FULL = {errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC)}
_READ_ONLY = {errno.EROFS, errno.EACCES, errno.EPERM}
_ELSEWHERE = "choose another folder"
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
    folder = path if path.is_dir() else path.parent
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
    elif (fault := system_fault(caught)) and fault.code != "EIO":
        why, remedy = str(fault), fault.remedy
    else:
        why = str(fault) if fault else caught.strerror or str(caught)
        remedy = f"look at the disk of the folder {folder}, or {elsewhere}"
    return Finding(f"the {what} cannot be written: {why}", str(path), remedy=remedy)


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
