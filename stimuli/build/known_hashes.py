"""SHA-256 of files that have not changed since they were last hashed, without reading them again.

A file's size, inode, and times of modification (mtime) and of any change (ctime), in nanoseconds, stand beside its
hash. Writing to a file, replacing it, or setting its mtime back changes one of them: no call sets ctime. What is
written within a clock tick of hashing might not: a hash is only relied on if the file had then lain still for two
seconds, the coarsest tick of any file system. What the medium itself loses shows in none of them: `verify` reads
everything, and OpenEXR's own checksums notice when such a picture is decoded.
"""

from __future__ import annotations

import contextlib
import json
import time
from pathlib import Path

from documents.files import read_cached_json, sha256_of_file, write_whole

_STILL_NS = 2_000_000_000


class KnownHashes:
    """Hashes kept in the JSON file ``record``; ``hashed`` counts the files that had to be read.

    With ``verify`` none is relied on. A record that is damaged, or cannot be written, costs time and nothing else.
    """

    def __init__(self, record: Path, *, verify: bool = False) -> None:
        self._record = record
        self._known: dict[str, list[object]] = {} if verify else _read(record)
        self._changed = False
        self.hashed = 0

    def sha256(self, path: Path) -> str:
        """Return the SHA-256 of the file at ``path``; OSError or InputError if it cannot be read."""
        now = _fingerprint(path)
        name = str(path.absolute())
        known = self._known.get(name)
        if known is not None and known[:-1] == now and isinstance(known[-1], str):
            return known[-1]
        began_ns = time.time_ns()
        digest = sha256_of_file(path)
        self.hashed += 1
        if now == _fingerprint(path) and max(now[2:]) + _STILL_NS <= began_ns:
            self._known[name] = [*now, digest]
            self._changed = True
        return digest

    def keep(self) -> None:
        """Write the new hashes, as a whole or not at all; nothing where the folder does not exist."""
        if not self._changed:
            return
        if self._record.parent.is_dir():
            with contextlib.suppress(OSError):
                write_whole(self._record, json.dumps(self._known))
        self._changed = False


def _fingerprint(path: Path) -> list[int]:
    stat = path.stat()
    return [stat.st_size, stat.st_ino, stat.st_mtime_ns, stat.st_ctime_ns]


def _read(record: Path) -> dict[str, list[object]]:
    known = read_cached_json(record)
    if not isinstance(known, dict):
        return {}
    return {name: facts for name, facts in known.items() if isinstance(facts, list) and len(facts) == 5}
