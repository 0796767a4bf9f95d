"""What killed builds left in the cache: finished pictures, from which the next build of that recipe goes on."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

# A set's folder while it is built, before it appears, and the one that it takes the place of.
_UNFINISHED = re.compile(r"\.([0-9a-f]{32})(-new|-old)?")


@dataclass(frozen=True, slots=True)
class Leftover:
    """A folder of an unfinished build, how many pictures are in it, and for how long nobody has written to it."""

    folder: Path
    pictures: int
    bytes: int
    untouched_s: float

    def __str__(self) -> str:
        count = "1 picture" if self.pictures == 1 else f"{self.pictures} pictures"
        return f"{self.folder.name}: {count}, {self.bytes / 1e6:.1f} MB"

    def to_json(self) -> dict[str, Any]:
        """Return the facts as JSON."""
        facts = {"pictures": self.pictures, "bytes": self.bytes, "untouched_hours": self.untouched_s / 3600}
        return {"folder": str(self.folder), **facts}


def leftovers(cache: Path, untouched_s: float = 0.0) -> Iterator[Leftover]:
    """Yield the unfinished builds in ``cache`` that nobody wrote to for ``untouched_s``; a build may be at them."""
    for folder in sorted(cache.glob(".*")):
        if not _UNFINISHED.fullmatch(folder.name) or folder.is_symlink() or not folder.is_dir():
            continue
        with contextlib.suppress(FileNotFoundError):  # finished meanwhile
            stats = [entry.stat() for entry in os.scandir(folder)]
            newest = max(stat.st_mtime for stat in (*stats, folder.stat()))
            found = Leftover(
                folder,
                sum(1 for _ in folder.glob("[!.]*.exr")),
                sum(stat.st_size for stat in stats),
                max(time.time() - newest, 0.0),
            )
            if found.untouched_s >= untouched_s:
                yield found


def remove(leftover: Leftover) -> bool:
    """Remove a leftover unless a build is at it, and return whether it was removed; OSError if it cannot be."""
    from stimuli.build.lock import locked

    found = _UNFINISHED.fullmatch(leftover.folder.name)
    assert found is not None
    try:
        # The lock that a build of this set holds.
        with locked(leftover.folder.with_name(found[1]), wait=False):
            shutil.rmtree(leftover.folder)
            return True
    except BlockingIOError:
        return False
