"""Files and folders that appear with all their content or not at all.

A draft is named after what it is to be, its process and its machine. What a killed process left is removed when the
same file or folder is next written on that machine.
"""

from __future__ import annotations

import errno
import glob
import hashlib
import os
import platform
import re
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from documents.files.regular import refuse_to_replace
from documents.platform import is_alive, rename


@contextmanager
def whole_file(path: Path, *, keep_suffix: bool = False, make_folder: bool = True) -> Iterator[Path]:
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

    Yields
    ------
    pathlib.Path
        The draft, not yet there, in the folder of ``path``.

    Raises
    ------
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
        path.parent.mkdir(parents=True, exist_ok=True)
    elif not path.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path.parent))
    refuse_to_replace(path)
    suffix = path.suffix if keep_suffix else ""
    _remove_left(path)
    draft = _beside(path, f"part{suffix}")
    try:
        yield draft
        rename(draft, path)
    finally:
        draft.unlink(missing_ok=True)


def write_whole(path: Path, text: str, *, make_folder: bool = True) -> None:
    """Write ``text`` to ``path`` in UTF-8, its line ends as they are, whole or not at all.

    Parameters
    ----------
    path
        The file.
    text
        Its whole content.

    Raises
    ------
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
    with whole_file(path, make_folder=make_folder) as draft:
        draft.write_bytes(text.encode("utf-8"))


@contextmanager
def whole_folder(path: Path, *, replace: bool = False) -> Iterator[Path]:
    """Yield a draft folder beside ``path`` for the body to fill; at the end it takes the place of ``path``.

    If the body raises, ``path`` stays as it was and the draft is removed. The folder above is made if need be. A folder
    at ``path`` must be empty, or goes with all its content if ``replace`` is true.

    Parameters
    ----------
    path
        The folder to make.
    replace
        Whether a folder at ``path`` that is not empty is replaced.

    Yields
    ------
    pathlib.Path
        The draft, an empty folder beside ``path``.

    Raises
    ------
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
    path.parent.mkdir(parents=True, exist_ok=True)
    _remove_left(path)
    draft = _beside(path, "part")
    draft.mkdir(mode=0o700)
    try:
        yield draft
        mask = os.umask(0)
        os.umask(mask)
        draft.chmod(0o777 & ~mask)
        if replace and path.exists():
            before = _beside(path, "before")
            rename(path, before)
            try:
                rename(draft, path)
            except BaseException:
                rename(before, path)
                raise
            shutil.rmtree(before, ignore_errors=True)
        else:
            if path.exists():
                path.rmdir()
            rename(draft, path)
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def _beside(path: Path, what: str) -> Path:
    """Return a new hidden name beside ``path`` that says which process of which machine it belongs to."""
    return path.with_name(f".{path.name[:80]}.{os.getpid()}-{_machine()}-{secrets.token_hex(4)}.{what}")


def _machine() -> str:
    """Return a short name of this machine, from which its own name is not known."""
    return hashlib.sha256(platform.node().encode()).hexdigest()[:8]


def _remove_left(path: Path) -> None:
    """Remove what killed processes of this machine left of drafts for ``path``; what stood there before comes back."""
    owner = re.compile(rf"{re.escape(f'.{path.name[:80]}.')}(\d+)-{_machine()}-[0-9a-f]{{8}}\.(part|before)(\..*)?")
    for left in path.parent.glob(f"{glob.escape(f'.{path.name[:80]}.')}*-{_machine()}-*"):
        match = owner.fullmatch(left.name)
        if match is None or is_alive(int(match[1])):
            continue
        with suppress(OSError):
            if match[2] == "before" and not path.exists():
                rename(left, path)
            elif left.is_dir() and not left.is_symlink():
                shutil.rmtree(left)
            else:
                left.unlink()
