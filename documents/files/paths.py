"""Paths of files that other files name, where a missing one was looked for, and names that every system takes."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

from documents.text.words import nearest

_DEVICES = re.compile(r"(?:con|prn|aux|nul|com[0-9¹²³]|lpt[0-9¹²³])(?:\..*)?", re.IGNORECASE)
# A backslash as the separator of folders, and what YAML and JSON make of one and the next letter between double quotes.
_SLASHES = str.maketrans(
    {"\\": "/", "\0": "/0", "\a": "/a", "\b": "/b", "\t": "/t", "\n": "/n", "\v": "/v", "\f": "/f", "\r": "/r"}
)


def beside(file: Path, name: str) -> Path:
    """Return the path of ``name`` as the ``file`` that names it means it: relative to its folder.

    Parameters
    ----------
    file
        The file that names another.
    name
        A path, absolute or relative to the folder of ``file``.

    Returns
    -------
    pathlib.Path
        The path, as `tidy` returns it.

    Examples
    --------
    >>> beside(Path("configs/rigs/asus_vg248qe_3dvision.yaml"), "../displays/asus_vg248qe.yaml").as_posix()
    'configs/displays/asus_vg248qe.yaml'
    """
    return tidy(file.parent / name)


def tidy(path: Path) -> Path:
    """Return ``path`` without ``folder/..`` wherever that certainly leads back to where it began.

    It does where ``folder`` is a folder; through a symbolic link ``..`` leads elsewhere, and of what is not there
    nothing is known: both stay as they are.

    Parameters
    ----------
    path
        A path, absolute or relative to the current folder.

    Returns
    -------
    pathlib.Path
        The same place by a path without needless detours.

    Examples
    --------
    >>> tidy(Path("configs/../documents/files")).as_posix()
    'documents/files'
    >>> tidy(Path("nowhere/../documents")).as_posix()
    'nowhere/../documents'
    """
    kept = Path(path.anchor)
    for part in path.relative_to(path.anchor).parts:
        if part == ".." and kept.name not in ("", "..") and os.path.isdir(kept) and not kept.is_symlink():
            kept = kept.parent
        else:
            kept /= part
    return kept


def no_file_name(name: str) -> str | None:
    """Return why a file cannot be called ``name`` on every system; None if it can.

    Parameters
    ----------
    name
        The name that a file or a folder is to be given, with or without a suffix.

    Returns
    -------
    str or None
        The reason, without a full stop.

    Examples
    --------
    >>> no_file_name("aux.exr")
    "Windows keeps the name 'aux' for a device"
    >>> no_file_name("auxiliary") is None
    True
    """
    if _DEVICES.fullmatch(name):
        return f"Windows keeps the name '{name.split('.')[0]}' for a device"
    return "Windows drops a full stop or a space at the end of a name" if name.endswith((".", " ")) else None


def with_slashes(name: str) -> str:
    """Return the path ``name`` with a forward slash for each backslash, also for one that became part of an escape.

    Parameters
    ----------
    name
        A path as a YAML file names it.

    Returns
    -------
    str
        The path as every system reads it.

    Examples
    --------
    >>> with_slashes(chr(92).join(["..", "rigs", "lab.yaml"]))
    '../rigs/lab.yaml'
    """
    return name.translate(_SLASHES)


def looked_for(path: Path, name: str = "") -> str:
    """Return the remedy for a missing file: where it was looked for, and the nearest name there is.

    Parameters
    ----------
    path
        The path of a file that does not exist.
    name
        What a file calls it; backslashes in that are no separators of folders, but on Windows.

    Returns
    -------
    str
        The absolute path, and the name in that folder that is spelled most like it; or the path with forward slashes.

    Examples
    --------
    >>> looked_for(Path("experiments/dynamic_rnge.yaml")).split("; ")[1]
    "did you mean 'dynamic_range.yaml'?"
    >>> looked_for(Path("lab.yaml"), "rigs" + chr(92) + "lab.yaml")
    'write the path with forward slashes, which every system reads: rigs/lab.yaml'
    """
    plain = with_slashes(name)
    if plain != name and not (sys.platform == "win32" and plain == name.replace("\\", "/")):
        return f"write the path with forward slashes, which every system reads: {plain}"
    try:
        names = [file.name for file in path.parent.iterdir()]
    except OSError:
        names = []
    near = nearest(path.name, names, cutoff=0.75)
    return f"looked for {tidy(path.absolute())}" + (f"; did you mean '{near}'?" if near else "")
