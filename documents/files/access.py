"""Who may read what has people's data: results, reports and tables of answers.

The account that made them alone, unless ``CYCLOPEAN_ACCESS`` says that its ``group`` may too, or ``all`` whom its umask
lets. Windows has no such modes: there the folder's own permissions count.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

from documents.findings import Finding, InputError

VARIABLE = "CYCLOPEAN_ACCESS"
_MASKS = {"private": 0o700, "group": 0o770, "all": 0o777}


def access_mask() -> int:
    """Return the bits of a mode that files and folders with people's data may have.

    Raises
    ------
    InputError
        If ``CYCLOPEAN_ACCESS`` is none of ``private``, ``group`` and ``all``.
    """
    asked = os.environ.get(VARIABLE) or "private"
    if asked not in _MASKS:
        remedy = f"set it to one of {', '.join(_MASKS)}, or remove it"
        raise InputError(Finding(f"the environment variable {VARIABLE} is '{asked}'", remedy=remedy))
    return 0o777 if sys.platform == "win32" else _MASKS[asked]


def make_private(folder: Path, *, new: bool = False) -> None:
    """Make ``folder``, and those above it that are missing, for people's data; a folder that is there stays as it is.

    Parameters
    ----------
    folder
        The folder.
    new
        Whether it must not be there yet.

    Raises
    ------
    InputError
        If ``CYCLOPEAN_ACCESS`` has no meaning.
    OSError
        If it cannot be made, is a file, or is there already and must be ``new``.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as above:
    ...     make_private(Path(above, "results", "sub-01"))
    ...     Path(above, "results", "sub-01").is_dir()
    True
    """
    mask = access_mask()
    for path in (*reversed(folder.parents), folder):
        if path == folder and new:
            path.mkdir(mask)
        elif not path.is_dir():
            path.mkdir(mask, exist_ok=True)  # another station may make it meanwhile


def opener(path: str, flags: int) -> int:
    """Open a file for people's data, for `open`: a new one is only for whom it may be."""
    return os.open(path, flags, 0o666 & access_mask())


def restrict(folder: Path) -> None:
    """Take from ``folder`` and all in it what others may not have."""
    mask = access_mask()
    for path in (folder, *folder.rglob("*")):
        if not path.is_symlink():
            path.chmod(path.stat().st_mode & 0o777 & mask)
