"""Files and folders that appear with all their content or not at all.

A draft is named after what it is to be, its process and its machine. What killed processes left in a folder is removed
when something is next written into that folder on that machine.
"""

from __future__ import annotations

import errno
import hashlib
import os
import platform
import re
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from documents.files.access import make_private, opener, restrict
from documents.files.regular_files import refuse_to_replace
from documents.findings import InputError
from documents.platform import is_alive, rename

_LONGEST = 80  # letters of a name that a draft's name has


@contextmanager
def whole_file(
    path: Path, *, keep_suffix: bool = False, make_folder: bool = True, private: bool = False
) -> Iterator[Path]:
    """Yield the name of a draft beside ``path`` for the body to write; at the end it takes the place of ``path``.

    Who reads ``path`` meanwhile finds what was there before, and two who write at once do not mix. If the body raises,
    ``path`` stays as it was. The folder is made if need be, unless ``make_folder`` is false. The draft is named
    ``.NAME.PROCESS-TOKEN.part``; with ``keep_suffix`` the suffix of ``path`` follows, for writers that choose the
    format by it.

    Parameters
    ----------
    path
        The file to write; one in its place is replaced.
    keep_suffix
        Whether the draft ends in the suffix of ``path``.
    make_folder
        Whether to make the folder of ``path`` if it is missing.
    private
        Whether it has people's data: nobody else may read it, nor the folder that is made, unless
        ``CYCLOPEAN_ACCESS`` says otherwise. The draft is there then, empty.

    Yields
    ------
    pathlib.Path
        The draft, in the folder of ``path``; not yet there unless ``private``.

    Raises
    ------
    InputError
        If ``CYCLOPEAN_ACCESS`` has no meaning.
    OSError
        If there is no folder, ``path`` is a pipe, a device or a socket, or the draft cannot be put in its place.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with whole_file(Path(folder, "scores.txt")) as draft:
    ...         size = draft.write_text("0.75")
    ...     [file.name for file in Path(folder).iterdir()]
    ['scores.txt']
    """
    if make_folder:
        _make_folder(path.parent, private)
    elif not path.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path.parent))
    refuse_to_replace(path)
    suffix = path.suffix if keep_suffix else ""
    remove_left(path.parent)
    draft = draft_of(path, f"part{suffix}")
    try:
        with _named(path, draft):
            if private:
                open(draft, "xb", opener=opener).close()
            yield draft
            rename(draft, path)
    finally:
        with suppress(OSError):  # the next who writes here removes it
            draft.unlink(missing_ok=True)


@contextmanager
def _named(path: Path, draft: Path) -> Iterator[None]:
    """Let errors of the system name ``path``, where they name its draft or nothing; also what others made of them."""
    try:
        yield
    except (OSError, InputError) as caught:
        error = caught if isinstance(caught, OSError) else caught.__cause__
        if not isinstance(error, OSError):
            raise
        names = [Path(name) for name in (error.filename, error.filename2) if isinstance(name, str)]
        in_draft = any(draft in (name, *name.parents) for name in names)
        if in_draft or not (names or error is not caught):
            error.filename = str(path)
            del error.filename2
        if in_draft and error is not caught:
            raise error from None
        raise


def _make_folder(folder: Path, private: bool) -> None:
    if private:
        make_private(folder)
    else:
        folder.mkdir(parents=True, exist_ok=True)


def write_whole(path: Path, text: str, *, make_folder: bool = True, private: bool = False) -> None:
    """Write ``text`` to ``path`` in UTF-8, its line ends as they are, whole or not at all.

    Parameters
    ----------
    path
        The file.
    text
        Its whole content.
    private
        As for `whole_file`.

    Raises
    ------
    InputError
        As `whole_file`.
    OSError
        If it cannot be written; what was at ``path`` is then still there.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_whole(Path(folder, "page.html"), "<p>ΔE00")
    ...     Path(folder, "page.html").read_text(encoding="utf-8")
    '<p>ΔE00'
    """
    with whole_file(path, make_folder=make_folder, private=private) as draft:
        draft.write_bytes(text.encode("utf-8"))


@contextmanager
def whole_folder(path: Path, *, replace: bool = False, private: bool = False) -> Iterator[Path]:
    """Yield a draft folder beside ``path`` for the body to fill; at the end it takes the place of ``path``.

    If the body raises, ``path`` stays as it was and the draft is removed. The folder above is made if need be. A folder
    at ``path`` must be empty, or goes with all its content if ``replace`` is true.

    Parameters
    ----------
    path
        The folder to make.
    replace
        Whether a folder at ``path`` that is not empty is replaced.
    private
        As for `whole_file`, of all that is in the folder at the end.

    Yields
    ------
    pathlib.Path
        The draft, an empty folder beside ``path``.

    Raises
    ------
    InputError
        As `whole_file`.
    OSError
        If the draft cannot be put in place of ``path``.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with whole_folder(Path(folder, "results")) as draft:
    ...         size = Path(draft, "scores.txt").write_text("0.75")
    ...     [file.name for file in Path(folder, "results").iterdir()]
    ['scores.txt']
    """
    _make_folder(path.parent, private)
    remove_left(path.parent)
    draft = draft_of(path, "part")
    try:
        with _named(path, draft):
            draft.mkdir(mode=0o700)
            yield draft
            mask = os.umask(0)
            os.umask(mask)
            draft.chmod(0o777 & ~mask)
            if private:
                restrict(draft)
            _put(draft, path, replace)
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def _put(draft: Path, path: Path, replace: bool) -> None:
    if not (replace and path.exists()):
        if path.exists():
            path.rmdir()
        rename(draft, path)
        return
    before = draft_of(path, "before")
    rename(path, before)
    try:
        rename(draft, path)
    except BaseException:
        rename(before, path)
        raise
    shutil.rmtree(before, ignore_errors=True)


def draft_of(path: Path, what: str) -> Path:
    """Return a new hidden name beside ``path`` that says which process of which machine it belongs to."""
    return path.with_name(f".{path.name[:_LONGEST]}.{os.getpid()}-{_machine()}-{secrets.token_hex(4)}.{what}")


def _machine() -> str:
    """Return a short name of this machine, from which its own name is not known."""
    return hashlib.sha256(platform.node().encode()).hexdigest()[:8]


def remove_left(folder: Path) -> None:
    """Remove what killed processes of this machine left of drafts in ``folder``; what such a one took away comes back.

    Nothing of a process that lives is touched, nor what another machine left.
    """
    owner = re.compile(rf"\.(.+)\.(\d+)-{_machine()}-[0-9a-f]{{8}}\.(part|before)(\..*)?")
    with suppress(OSError), os.scandir(folder) as entries:
        left = [match for entry in entries if (match := owner.fullmatch(entry.name))]
        for match in left:
            if not is_alive(int(match[2])):
                with suppress(OSError):
                    _clear(folder / match[0], match)


def _clear(left: Path, match: re.Match[str]) -> None:
    path = left.with_name(match[1])
    if match[3] == "before" and len(path.name) == _LONGEST:
        return  # its whole name is not known
    if match[3] == "before" and not path.exists():
        rename(left, path)
    elif left.is_dir() and not left.is_symlink():
        shutil.rmtree(left)
    else:
        left.unlink()
