"""The identity as gamma table for as long as a session lasts, and the table before it restored, also after a crash.

Before the identity is loaded, what was there is written to a file of the user's: one for each monitor. Each session
that needs the identity holds a lock beside it, which the operating system lets go when a process ends in whatever way.
The last session to end restores the table and removes the file. Where the last one was killed, the next start of a
window finds a file that nobody needs, restores the table, and says so.

A table that something else has loaded meanwhile stays as it is.
"""

from __future__ import annotations

import hashlib
import json
import os
import secrets
import socket
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from filelock import FileLock, Timeout

from devices.display import GammaTable
from devices.errors import DeviceError
from documents.files import read_cached_json, unwritable, whole_file
from documents.platform import boot_id, state_folder, sync_folder
from runner.presenter.errors import PresentationError
from runner.presenter.surfaces.gamma_tables import Entries, LoadedTable

Load = Callable[[Mapping[str, Entries]], None]


def tables_folder() -> Path:
    """Return where tables to restore are kept: ``CYCLOPEAN_STATE``, else ``cyclopean`` in the user's state folder."""
    return state_folder() / "gamma_tables"


class IdentityTables:
    """The identity on monitors from `load` to `close`; ``set_tables`` loads tables by monitor."""

    def __init__(self, set_tables: Load) -> None:
        self._set_tables = set_tables
        self._held: dict[str, FileLock] = {}

    def load(self, loaded: LoadedTable) -> None:
        """Load the identity on the monitor of ``loaded``, which is what is there; nothing if it is there already.

        Raises
        ------
        PresentationError
            If the table is not known, what was there cannot be written down, or the identity cannot be loaded.
        """
        if loaded.monitor in self._held:
            return
        if loaded.entries is None:
            raise PresentationError(f"the identity cannot be loaded as gamma table: {loaded.table.unknown}")
        place = _Place(loaded.monitor)
        try:
            with place.turn():
                others = place.in_use()
                if loaded.table.is_identity and not place.file.exists():
                    return
                if not place.file.exists() or not (others or loaded.table.is_identity):
                    place.write(loaded.entries)
                lock = place.use()
        except OSError as error:
            elsewhere = "set CYCLOPEAN_STATE to another folder"
            found = unwritable(error, place.file.parent, "gamma table to restore", elsewhere=elsewhere)
            raise PresentationError(found) from error
        self._held[loaded.monitor] = lock
        identity = GammaTable.identity(len(loaded.entries)).entries
        assert identity is not None
        self._set_tables({loaded.monitor: identity})

    def close(self, read: Callable[[], Mapping[str, LoadedTable]]) -> None:
        """Restore what was there, unless another session needs the identity; ``read`` gives the tables by monitor.

        Raises
        ------
        PresentationError
            If a table could not be loaded again; the next start of a window tries it once more.
        """
        there = read() if self._held else {}
        while self._held:
            monitor, lock = self._held.popitem()
            place = _Place(monitor)
            with place.turn():
                place.leave(lock)
                if not place.in_use():
                    place.restore(there.get(monitor), self._set_tables)


def restore_left(read: Callable[[], Mapping[str, LoadedTable]], set_tables: Load) -> tuple[str, ...]:
    """Restore the tables that killed sessions left on the monitors of this display server; say so in remarks.

    ``read`` gives the tables that are loaded, by monitor; it is called only if there is something to restore.
    """
    there: Mapping[str, LoadedTable] | None = None
    remarks: list[str] = []
    for place in _places():
        with place.turn():
            if not place.file.exists() or place.in_use():
                continue
            there = read() if there is None else there
            what = f"a session that was killed left the identity as gamma table of '{place.monitor}'"
            try:
                if place.restore(there.get(place.monitor), set_tables):
                    remarks.append(f"{what}; the table from before it is loaded again")
            except PresentationError as error:
                remarks.append(f"{what}: {error}")
    return tuple(remarks)


class _Place:
    """The files of one monitor on this display server."""

    def __init__(self, monitor: str) -> None:
        self.monitor = monitor
        digest = hashlib.sha256(f"{_server()}\n{monitor}".encode()).hexdigest()[:24]
        self.file = tables_folder() / f"{digest}.json"

    @contextmanager
    def turn(self) -> Iterator[None]:
        """Let one process at a time look at the files and change them."""
        self.file.parent.mkdir(parents=True, exist_ok=True)
        with FileLock(self.file.with_name(".lock"), timeout=60):
            yield

    def use(self) -> FileLock:
        """Return a lock that says that this process needs the identity."""
        lock = FileLock(self.file.with_name(f"{self.file.stem}.{os.getpid()}-{secrets.token_hex(4)}.use"))
        lock.acquire(timeout=0)
        return lock

    def leave(self, lock: FileLock) -> None:
        """Let go of what `use` returned."""
        lock.release()
        Path(lock.lock_file).unlink(missing_ok=True)

    def in_use(self) -> bool:
        """Return whether a process needs the identity; what dead ones left is removed."""
        used = False
        for file in self.file.parent.glob(f"{self.file.stem}.*.use"):
            try:
                FileLock(file).acquire(timeout=0).lock.release()
            except Timeout:
                used = True
            else:
                file.unlink(missing_ok=True)  # its name was that process's own
        return used

    def write(self, entries: Entries) -> None:
        """Keep the table to restore, on disk when this returns."""
        kept = {"server": _server(), "monitor": self.monitor, "boot": boot_id(), "entries": entries.tolist()}
        with whole_file(self.file) as draft, draft.open("w", encoding="utf-8") as opened:
            json.dump(kept, opened)
            opened.flush()
            os.fsync(opened.fileno())
        sync_folder(self.file.parent)

    def restore(self, there: LoadedTable | None, set_tables: Load) -> bool:
        """Load what was kept if ``there`` is the identity still, and forget it; return whether it was loaded.

        What was kept stays where the monitor is not there now, or does not take the table. A table that is no longer
        the identity stays, because something else has loaded it.

        Raises
        ------
        PresentationError
            If the monitor does not take the table.
        """
        if there is None or there.entries is None:
            return False
        kept = self._kept()
        ours = kept is not None and there.table.is_identity and kept.shape == there.entries.shape
        restores = kept is not None and ours and not np.array_equal(kept, there.entries)
        if kept is not None and restores:
            set_tables({self.monitor: kept})
        self.file.unlink(missing_ok=True)
        return restores

    def _kept(self) -> Entries | None:
        """Return the table to restore; None if it was kept before the machine was started, or cannot be read."""
        try:
            kept = read_cached_json(self.file)
            table = GammaTable(np.array(kept["entries"], dtype=np.int64))
            return table.entries if kept["boot"] == boot_id() else None
        except (OSError, ValueError, KeyError, TypeError, DeviceError):
            return None


def _places() -> list[_Place]:
    """Return the monitors of this display server of which a table is kept."""
    places = []
    folder = tables_folder()
    for file in sorted(folder.glob("*.json")) if folder.is_dir() else ():
        try:
            kept = read_cached_json(file)
            place = _Place(str(kept["monitor"]))
        except (OSError, ValueError, KeyError, TypeError):
            continue
        if place.file == file:
            places.append(place)
    return places


def _server() -> str:
    """Return a name of the display server that monitors belong to."""
    if sys.platform != "linux":
        return sys.platform
    display, _, screen = os.environ.get("DISPLAY", "").partition(":")
    return f"{display or socket.gethostname()}:{screen.partition('.')[0]}"
