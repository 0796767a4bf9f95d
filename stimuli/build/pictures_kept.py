"""Pictures that were made before: in other sets of the cache, in a broken one, or by a build that was killed."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

from stimuli.build.stimulus_set import MANIFEST, known_hashes

Entry = dict[str, Any]


class Workshop:
    """The folder in which a set is being built: a picture and its entry for each key, until all are there.

    Its name begins with a dot: it is no set. It outlives a killed build, and the next one goes on from it.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def picture(self, key: str) -> Path:
        """Return where the picture of ``key`` lies."""
        return self.folder / f"{key}.exr"

    def keep(self, key: str, entry: Entry) -> None:
        """Record that the picture of ``key`` is whole; the record appears after the picture, whole or not at all."""
        draft = self.folder / f"{key}.part"
        draft.write_text(json.dumps(entry, allow_nan=False), encoding="utf-8")
        draft.replace(self._entry(key))

    def kept(self, keys: Collection[str]) -> dict[str, Entry]:
        """Return the entries of those ``keys`` whose picture lies here as it was made."""
        hashes = known_hashes(self.folder)
        found = {}
        for key in keys:
            try:
                entry = json.loads(self._entry(key).read_text(encoding="utf-8"))
                if hashes.sha256(self.picture(key)) == entry["sha256"]:
                    found[key] = entry
            except (OSError, ValueError, KeyError, TypeError):
                continue
        return found

    def forget(self, keys: Collection[str]) -> None:
        """Remove the pictures of ``keys``, and the folder if nothing else is in it."""
        for key in keys:
            self.picture(key).unlink(missing_ok=True)
            self._entry(key).unlink(missing_ok=True)
        for left in (*self.folder.glob(".*.exr"), *self.folder.glob("*.part")):
            left.unlink(missing_ok=True)
        if self.folder.is_dir() and not any(self.folder.iterdir()):
            self.folder.rmdir()

    def take(self, key: str, picture: Path, entry: Entry) -> None:
        """Bring in a picture from another set: the same file under another name, where the file system has that."""
        here = self.picture(key)
        here.unlink(missing_ok=True)
        link_or_copy(picture, here)
        self.keep(key, entry)

    def _entry(self, key: str) -> Path:
        return self.folder / f"{key}.json"


def link_or_copy(file: Path, other: Path) -> None:
    """Give ``file`` the name ``other`` too, or copy it where the file system has one name for each file."""
    try:
        os.link(file, other)
    except OSError:
        shutil.copyfile(file, other)


def pictures_of_sets(cache: Path, keys: Collection[str]) -> Iterator[tuple[str, Path, Entry]]:
    """Yield key, file and entry of pictures in the sets of ``cache`` that have one of ``keys`` and are whole."""
    left = set(keys)
    for manifest in sorted(cache.glob(f"[!.]*/{MANIFEST}")):
        if not left:
            return
        try:
            entries = json.loads(manifest.read_text(encoding="utf-8"))["stimuli"]
            hashes = known_hashes(manifest.parent)
            for entry in entries:
                key, picture = entry.get("key"), manifest.with_name(str(entry["file"]))
                if key in left and picture.is_file() and hashes.sha256(picture) == entry["sha256"]:
                    left.discard(key)
                    yield key, picture, {name: entry[name] for name in entry if name not in ("name", "file", "factors")}
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            continue
