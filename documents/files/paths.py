"""Paths of files that other files name: without detours, and where one that is missing was looked for."""

from __future__ import annotations

from pathlib import Path

from documents.text.words import nearest


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
        if part == ".." and kept.name not in ("", "..") and kept.is_dir() and not kept.is_symlink():
            kept = kept.parent
        else:
            kept /= part
    return kept


def looked_for(path: Path) -> str:
    """Return the remedy for a missing file: where it was looked for, and the nearest name there is.

    Parameters
    ----------
    path
        The path of a file that does not exist.

    Returns
    -------
    str
        The absolute path, and the name in that folder that is spelled most like it.

    Examples
    --------
    >>> looked_for(Path("experiments/dynamic_rnge.yaml")).split("; ")[1]
    "did you mean 'dynamic_range.yaml'?"
    """
    try:
        names = [file.name for file in path.parent.iterdir()]
    except OSError:
        names = []
    near = nearest(path.name, names, cutoff=0.75)
    return f"looked for {tidy(path.absolute())}" + (f"; did you mean '{near}'?" if near else "")
