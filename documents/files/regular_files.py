"""The one way in which files are opened for reading: regular files only, and no more of them than a limit.

A path may lead, itself or by a link, to a pipe that nobody writes to, to a device without an end or to one that acts
when it is opened. It is looked at before it is opened, opened without waiting, and the opened file is looked at once
more, so that nothing can be put in its place in between.
"""

from __future__ import annotations

import errno
import os
import stat
from io import BufferedReader, FileIO
from pathlib import Path
from typing import TYPE_CHECKING

from documents.files.faults import system_fault
from documents.files.paths import looked_for
from documents.findings import Finding, InputError

if TYPE_CHECKING:
    from _typeshed import WriteableBuffer

_KINDS = (
    (stat.S_ISDIR, "a folder", "name a file in it"),
    (stat.S_ISFIFO, "a pipe", "write what comes through it to a file, and name that"),
    (stat.S_ISSOCK, "a socket", "name a file"),
    (stat.S_ISCHR, "a device", "name a file"),
    (stat.S_ISBLK, "a device", "name a file"),
)
_STEP = 1 << 16
# Waits for no writer of a pipe, and makes no terminal this process's own. Windows has neither, and text mode instead.
_FLAGS = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0) | getattr(os, "O_BINARY", 0)


class NotAFileError(OSError):
    """What a new file was to take the place of is a pipe, a device or a socket."""


def refuse_to_replace(path: Path) -> None:
    """Raise NotAFileError if ``path``, or what it links to, is a pipe, a device or a socket.

    A draft that is renamed to it would take its place: whoever may write to ``/dev`` would lose ``/dev/null``.
    """
    try:
        mode = os.stat(path).st_mode
    except OSError:
        return
    for is_kind, name, _ in _KINDS[1:]:
        if is_kind(mode):
            raise NotAFileError(errno.EINVAL, f"it is {name}, not a file", str(path))


class _Raw(FileIO):
    """The bytes of a file; what the system does not let be read is an error of ``error``, as for opening it."""

    def __init__(self, descriptor: int, path: Path, what: str, error: type[InputError]) -> None:
        super().__init__(descriptor, "rb")
        self._path, self._what, self._error = path, what, error

    def readinto(self, buffer: WriteableBuffer, /) -> int:
        try:
            return super().readinto(buffer)
        except OSError as caught:
            raise self._refused(caught) from caught

    def readall(self) -> bytes:
        try:
            return super().readall()
        except (OSError, MemoryError) as caught:
            raise self._refused(caught) from caught

    def _refused(self, caught: Exception) -> InputError:
        return self._error(unreadable(caught, self._path, self._what))


def open_regular(
    path: str | os.PathLike[str],
    what: str = "file",
    *,
    limit_bytes: int | None = None,
    error: type[InputError] = InputError,
) -> BufferedReader:
    """Open the regular file at ``path`` for reading bytes.

    Parameters
    ----------
    path
        The file; links are followed.
    what
        What the file is for, such as ``table``, as a message calls it.
    limit_bytes
        The size in bytes up to which it is opened; None opens a file of any size.
    error
        The error to raise.

    Returns
    -------
    BufferedReader
        The open file, at its beginning; use as a context manager. What cannot be read of it raises ``error`` too.

    Raises
    ------
    InputError
        Of the class ``error``, if it is missing, a folder, a pipe, a device or a socket, too large, or unreadable.

    Examples
    --------
    >>> with open_regular("configs/displays/asus_vg248qe.yaml", "display file") as stream:
    ...     stream.read(1)
    b'#'
    >>> open_regular("configs/displays", "display file")
    Traceback (most recent call last):
    documents.findings.InputError: configs/displays: this is a folder, not a file (name a file in it)
    """
    file = Path(path)
    try:
        _refuse_others(os.stat(file), file, error)
        stream: BufferedReader = BufferedReader(_Raw(os.open(file, _FLAGS), file, what, error))
    except (OSError, ValueError, MemoryError) as caught:
        raise error(unreadable(caught, file, what)) from caught
    try:
        status = os.fstat(stream.fileno())
        _refuse_others(status, file, error)
        if limit_bytes is not None and status.st_size > limit_bytes:
            raise error(_too_large(file, what, limit_bytes))
    except BaseException:
        stream.close()
        raise
    return stream


def read_regular(
    path: str | os.PathLike[str], limit_bytes: int, what: str = "file", *, error: type[InputError] = InputError
) -> bytes:
    """Return the content of the regular file at ``path``.

    Parameters
    ----------
    path
        The file; links are followed.
    limit_bytes
        The size in bytes up to which it is read. A larger one is not read on.
    what
        What the file is for, such as ``table``, as a message calls it.
    error
        The error to raise.

    Returns
    -------
    bytes
        All of the file.

    Raises
    ------
    InputError
        As `open_regular`.

    Examples
    --------
    >>> read_regular("configs/displays/asus_vg248qe.yaml", 1_000_000)[:1]
    b'#'
    >>> read_regular("configs/displays/asus_vg248qe.yaml", 10, "display file")
    Traceback (most recent call last):
    documents.findings.InputError: configs/displays/asus_vg248qe.yaml: the display file is larger than 10 bytes
    """
    with open_regular(path, what, limit_bytes=limit_bytes, error=error) as stream:
        try:
            content = stream.read(os.fstat(stream.fileno()).st_size + 1)
            while len(content) <= limit_bytes and (more := stream.read(_STEP)):  # it grew, or has no stated size
                content += more
        except (OSError, MemoryError) as caught:
            raise error(unreadable(caught, Path(path), what)) from caught
    if len(content) > limit_bytes:
        raise error(_too_large(Path(path), what, limit_bytes))
    return content


def read_regular_text(
    path: str | os.PathLike[str], limit_bytes: int, what: str = "file", *, error: type[InputError] = InputError
) -> str:
    r"""Return the text of the regular file at ``path``: UTF-8, with or without its mark, line ends as they are.

    Parameters
    ----------
    path
        The file; links are followed.
    limit_bytes
        The size in bytes up to which it is read.
    what
        What the file is for, such as ``table``, as a message calls it.
    error
        The error to raise.

    Returns
    -------
    str
        All of the file, without the byte-order mark.

    Raises
    ------
    InputError
        As `open_regular`, or if the file is not UTF-8.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "table.csv")
    ...     _ = file.write_bytes(b"\xef\xbb\xbfwinner,loser")
    ...     read_regular_text(file, 100)
    'winner,loser'
    """
    content = read_regular(path, limit_bytes, what, error=error)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as caught:
        remedy = "save it as UTF-8"
        raise error(Finding(f"the {what} is not UTF-8 text", str(path), remedy=remedy)) from caught


def unreadable(caught: Exception, path: Path, what: str) -> Finding:
    """Return why the file at ``path`` could not be opened or read, as one finding.

    Parameters
    ----------
    caught
        The error that the system raised.
    path
        The file.
    what
        What the file is for, such as ``table``.

    Returns
    -------
    Finding
        What is wrong, and for a missing file where it was looked for; what the machine could not do, with what to do.

    Examples
    --------
    >>> str(unreadable(OSError(13, "Permission denied"), Path("results.csv"), "table"))
    'results.csv: the table cannot be read: Permission denied'
    """
    if isinstance(caught, FileNotFoundError):
        return Finding("there is no such file", str(path), remedy=looked_for(path))
    if fault := system_fault(caught):
        return Finding(f"the {what} cannot be read: {fault}", str(path), remedy=fault.remedy)
    why = (caught.strerror if isinstance(caught, OSError) else None) or str(caught)
    return Finding(f"the {what} cannot be read: {why}", str(path))


def inside(folder: Path, path: Path, *, error: type[InputError] = InputError) -> Path:
    """Return where ``path`` leads, links resolved; it must be ``folder`` or in it.

    Parameters
    ----------
    folder
        The folder that may not be left; a link to a folder stands for that folder.
    path
        A path, absolute or relative to the current folder. What it names need not exist.
    error
        The error to raise.

    Returns
    -------
    pathlib.Path
        The absolute path, without links.

    Raises
    ------
    InputError
        Of the class ``error``, if it leads out of the folder.

    Examples
    --------
    >>> inside(Path("configs"), Path("configs/rigs/../displays")).name
    'displays'
    >>> inside(Path("configs/rigs"), Path("configs/rigs/../../README.md"))
    Traceback (most recent call last):
    documents.findings.InputError: configs/rigs/../../README.md: this leads out of the folder configs/rigs ...
    """
    place = _resolved(path)
    if place.is_relative_to(_resolved(folder)):
        return place
    remedy = f"it leads to {place}: copy that into the folder"
    raise error(Finding(f"this leads out of the folder {folder}", str(path), remedy=remedy))


def _resolved(path: Path) -> Path:
    return Path(os.path.realpath(path))


def _refuse_others(status: os.stat_result, path: Path, error: type[InputError]) -> None:
    """Raise if ``status`` is not that of a regular file."""
    if stat.S_ISREG(status.st_mode):
        return
    known = ((kind, remedy) for is_kind, kind, remedy in _KINDS if is_kind(status.st_mode))
    kind, remedy = next(known, ("something else", "name a file"))
    if path.is_symlink():
        kind = f"a link to {kind}"
    raise error(Finding(f"this is {kind}, not a file", str(path), remedy=remedy))


def _too_large(path: Path, what: str, limit_bytes: int) -> Finding:
    bound = f"{limit_bytes / 1e6:g} MB" if limit_bytes >= 100_000 else f"{limit_bytes} bytes"
    return Finding(f"the {what} is larger than {bound}", str(path))
