"""Paths of files that other files name, without a detour through a folder and out of it again."""

from __future__ import annotations

from pathlib import Path


def beside(file: Path, name: str) -> Path:
    """Return the path of ``name`` as the ``file`` that names it means it: relative to its folder."""
    return tidy(file.parent / name)


def tidy(path: Path) -> Path:
    """Return ``path`` without ``folder/..`` wherever that certainly leads back to where it began.

    It does where ``folder`` is a folder; through a symbolic link ``..`` leads elsewhere, and of what is not there
    nothing is known: both stay as they are.
    """
    kept = Path(path.anchor)
    for part in path.relative_to(path.anchor).parts:
        if part == ".." and kept.name not in ("", "..") and kept.is_dir() and not kept.is_symlink():
            kept = kept.parent
        else:
            kept /= part
    return kept
