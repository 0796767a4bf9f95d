"""The cache of stimulus sets: its folder, the sets in it, and the leftovers of killed builds."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from documents import Finding, InputError
from documents.files import read_cached_json, system_fault
from documents.platform import user_folder
from documents.text import JsonResult
from stimuli.build.stimulus_set import MANIFEST, SUFFIXES, StimulusSet, read_stimulus_set

# How a person chooses another cache, for messages.
OTHER_CACHE = "name another folder in the environment variable CYCLOPEAN_CACHE"
# A set's folder while it is built, before it appears, and the one that it takes the place of.
_UNFINISHED = re.compile(r"\.([0-9a-f]{32})(-new|-old)?")


def cache_folder() -> Path:
    """Return where stimulus sets are kept: ``CYCLOPEAN_CACHE``, else ``cyclopean/stimuli`` in the user's cache.

    Returns
    -------
    pathlib.Path
        The folder, whether or not it exists.

    Examples
    --------
    >>> from unittest.mock import patch
    >>> with patch.dict(os.environ, CYCLOPEAN_CACHE="/data/stimuli"):
    ...     cache_folder().as_posix()
    '/data/stimuli'
    """
    own = os.environ.get("CYCLOPEAN_CACHE")
    if own:
        return Path(own)
    return user_folder("cache") / "cyclopean" / "stimuli"


@contextmanager
def locked(folder: Path, *, wait: bool = True) -> Iterator[None]:
    """Hold the lock of the set in ``folder``, an empty file beside it, and remove it at the end.

    Raises
    ------
    filelock.Timeout
        If another process or thread holds the lock, and this one is not to ``wait``.
    OSError
        If the file cannot be made.
    """
    from filelock import FileLock

    path = folder.with_name(f"{folder.name}.lock")
    # Of the shortest wait, so that builds that take turns lose little.
    with FileLock(path, timeout=-1 if wait else 0, poll_interval=0.01):
        try:
            yield
        finally:
            # While it is locked: a process that waits for a file without a name makes another. On Windows an open file
            # cannot be removed, and the lock removes it when it is let go.
            with contextlib.suppress(PermissionError):
                path.unlink(missing_ok=True)


@dataclass(frozen=True, slots=True)
class CachedSet(JsonResult):
    """A finished set in the cache: facts of its manifest, and its size on disk."""

    folder: Path
    digest: str | None
    kind: str
    pixel_pitch_mm: float
    names: tuple[str, ...]
    bytes: int
    json_keys: ClassVar = {"names": "stimuli"}


def cached_sets() -> Iterator[CachedSet]:
    """Yield the finished sets in the cache; those whose manifest cannot be read are left out.

    Yields
    ------
    CachedSet
        The folder of a set, the facts of its manifest, and its size in bytes.

    Examples
    --------
    >>> import json
    >>> from tempfile import TemporaryDirectory
    >>> from unittest.mock import patch
    >>> facts = {"digest": "f2", "recipe": {"kind": "pictures"}, "pixel_pitch_mm": 0.25, "stimuli": [{"name": "car"}]}
    >>> with TemporaryDirectory() as folder, patch.dict(os.environ, CYCLOPEAN_CACHE=folder):
    ...     Path(folder, "set").mkdir()
    ...     _ = Path(folder, "set", MANIFEST).write_text(json.dumps(facts), encoding="utf-8")
    ...     [(cached.kind, cached.pixel_pitch_mm, cached.names) for cached in cached_sets()]
    [('pictures', 0.25, ('car',))]
    """
    for manifest in _manifests():
        try:
            known = read_cached_json(manifest)
            cached = CachedSet(
                manifest.parent,
                known.get("digest"),
                known["recipe"]["kind"],
                known["pixel_pitch_mm"],
                tuple(entry["name"] for entry in known["stimuli"]),
                sum(file.stat().st_size for file in manifest.parent.iterdir()),
            )
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            continue
        yield cached


def find_cached(digest: str, recipe_path: Path) -> StimulusSet | None:
    """Return the set in the cache with this digest; None if there is none, or it is not as it was built.

    Parameters
    ----------
    digest
        The SHA-256 of the set, as in its manifest and in the record of a session.
    recipe_path
        The recipe to name as its source; the file is not read.

    Returns
    -------
    StimulusSet or None
        The set, its pictures' SHA-256 compared with its manifest; None if there is no such set.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from unittest.mock import patch
    >>> with TemporaryDirectory() as folder, patch.dict(os.environ, CYCLOPEAN_CACHE=folder):
    ...     find_cached("0" * 64, Path("configs/stimuli/preliminary.yaml")) is None
    True
    """
    for manifest in _manifests():
        known = read_cached_json(manifest)
        if isinstance(known, dict) and known.get("digest") == digest:
            return read_stimulus_set(manifest.parent, recipe_path)
    return None


def _manifests() -> list[Path]:
    return sorted(cache_folder().glob(f"[!.]*/{MANIFEST}"))


@dataclass(frozen=True, slots=True)
class Leftover(JsonResult):
    """A folder of an unfinished build, how many pictures are in it, and for how long nothing was written to it."""

    folder: Path
    pictures: int
    bytes: int
    untouched_s: float
    json_keys: ClassVar = {"untouched_s": None}
    json_also: ClassVar = ("untouched_hours",)

    def __str__(self) -> str:
        count = "1 picture" if self.pictures == 1 else f"{self.pictures} pictures"
        return f"{self.folder.name}: {count}, {self.bytes / 1e6:.1f} MB"

    @property
    def untouched_hours(self) -> float:
        """The same in hours."""
        return self.untouched_s / 3600


def leftovers(untouched_s: float = 0.0) -> Iterator[Leftover]:
    """Yield the unfinished builds that were not written to for ``untouched_s``; a build may be at work in them.

    Parameters
    ----------
    untouched_s
        For how long nothing was written to a build, at least, in seconds; 0 yields all.

    Yields
    ------
    Leftover
        The folder of an unfinished build, its pictures, its size in bytes, and for how long it was not written to.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from unittest.mock import patch
    >>> with TemporaryDirectory() as folder, patch.dict(os.environ, CYCLOPEAN_CACHE=folder):
    ...     Path(folder, "." + 32 * "0").mkdir()
    ...     [(leftover.pictures, leftover.bytes) for leftover in leftovers()]
    [(0, 0)]
    """
    for folder in sorted(cache_folder().glob(".*")):
        if not _UNFINISHED.fullmatch(folder.name) or folder.is_symlink() or not folder.is_dir():
            continue
        with contextlib.suppress(FileNotFoundError):  # finished meanwhile
            stats = [entry.stat() for entry in os.scandir(folder)]
            newest = max(stat.st_mtime for stat in (*stats, folder.stat()))
            leftover = Leftover(
                folder,
                sum(1 for suffix in SUFFIXES for _ in folder.glob(f"[!.]*{suffix}")),
                sum(stat.st_size for stat in stats),
                max(time.time() - newest, 0.0),
            )
            if leftover.untouched_s >= untouched_s:
                yield leftover


def remove_leftovers(untouched_s: float) -> tuple[Leftover, ...]:
    """Remove the unfinished builds that were not written to for ``untouched_s``, and return them.

    The folder of a build that is at work stays.

    Parameters
    ----------
    untouched_s
        For how long nothing was written to a build, at least, in seconds; 0 removes all that are not at work.

    Returns
    -------
    tuple[Leftover, ...]
        The builds that were removed.

    Raises
    ------
    InputError
        If a folder cannot be removed.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from unittest.mock import patch
    >>> with TemporaryDirectory() as folder, patch.dict(os.environ, CYCLOPEAN_CACHE=folder):
    ...     Path(folder, "." + 32 * "0").mkdir()
    ...     removed = remove_leftovers(0.0)
    ...     len(removed), removed[0].folder.exists()
    (1, False)
    """
    from filelock import Timeout

    removed = []
    for leftover in leftovers(untouched_s):
        unfinished = _UNFINISHED.fullmatch(leftover.folder.name)
        assert unfinished is not None
        try:
            # The lock that a build of this set holds.
            with locked(leftover.folder.with_name(unfinished[1]), wait=False):
                shutil.rmtree(leftover.folder)
            removed.append(leftover)
        except Timeout:
            continue
        except OSError as error:
            message = f"it cannot be removed: {system_fault(error) or error.strerror or error}"
            raise InputError(Finding(message, str(leftover.folder))) from error
    return tuple(removed)
