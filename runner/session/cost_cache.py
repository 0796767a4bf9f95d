"""What was reckoned of pictures, kept as small files, so that it need not be reckoned again.

Each file holds what its numbers depend on, the numbers, and their SHA-256, and appears as a whole: a file that was cut
short, damaged, or made by another version is as good as none. Nothing here is ever in the way: what cannot be read is
reckoned again, and what cannot be written is not kept.
"""

from __future__ import annotations

import contextlib
import json
import os
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from documents.files.hashes import sha256_of_json

_PART = ".part"
# A file is written in a moment: one that is not finished after so long is of a program that was killed.
_LEFT_BEHIND_S = 3600.0


class CostCache:
    """Numbers in files below ``folder``, one for each set of things that they depend on.

    Any number of programs may use one folder at once.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._tidied = False

    def find(self, depends_on: Mapping[str, Any]) -> dict[str, Any] | None:
        """Return what was kept for ``depends_on``, None if nothing was or it is not as it was kept."""
        try:
            kept = json.loads(self._file(depends_on).read_text(encoding="utf-8"))
            if kept["depends_on"] != _plain(depends_on) or kept["sha256"] != sha256_of_json(kept["cost"]):
                return None
            cost = kept["cost"]
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            return None
        return cost if isinstance(cost, dict) else None

    def keep(self, depends_on: Mapping[str, Any], cost: Mapping[str, Any]) -> bool:
        """Keep ``cost`` for ``depends_on``, both of what JSON holds; return whether that could be done."""
        kept = {"depends_on": depends_on, "cost": cost, "sha256": sha256_of_json(cost)}
        text = json.dumps(kept, indent=1, allow_nan=False) + "\n"
        file = self._file(depends_on)
        part: Path | None = None
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            self._tidy()
            descriptor, name = tempfile.mkstemp(_PART, f".{file.stem}-", self._folder)
            part = Path(name)
            with open(descriptor, "w", encoding="utf-8") as stream:
                stream.write(text)
            part.chmod(0o644)  # others who share the cache may read it
            os.replace(part, file)
        except OSError:
            if part is not None:
                with contextlib.suppress(OSError):
                    part.unlink(missing_ok=True)
            return False
        return True

    def _file(self, depends_on: Mapping[str, Any]) -> Path:
        return self._folder / f"{sha256_of_json(depends_on)[:32]}.json"

    def _tidy(self) -> None:
        """Remove what killed programs left behind; once is enough."""
        if self._tidied:
            return
        self._tidied = True
        for part in self._folder.glob(f".*{_PART}"):
            with contextlib.suppress(OSError):
                if time.time() - part.stat().st_mtime > _LEFT_BEHIND_S:
                    part.unlink()


def _plain(value: Mapping[str, Any]) -> Any:
    """Return ``value`` as it comes back from a file: with lists for tuples."""
    return json.loads(json.dumps(value))
