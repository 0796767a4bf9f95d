"""The gamma tables of monitors, read through glfw, and set by a process of its own.

glfw keeps what a table was before its first change in a process, and writes that back when it is terminated. So a
process that restores a table would undo this itself. `set_tables` leaves the setting to a process that ends without
terminating glfw.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from devices.display import GammaTable
from documents.text import JsonResult
from runner.presenter.errors import PresentationError
from runner.presenter.surfaces.x11 import is_xwayland

Entries = NDArray[np.uint16]
# Where a table stays what it was set to when the process that set it ends.
SETTABLE = ("x11", "win32")
_PATIENCE_S = 30.0


@dataclass(frozen=True, slots=True)
class LoadedTable(JsonResult):
    """The gamma table that is loaded on a monitor; ``entries`` are what the driver returned, also if it makes no sense.

    ``monitor`` is the name that the window system has for it, empty where there is no monitor.
    """

    monitor: str
    table: GammaTable
    entries: Entries | None = None
    json_keys: ClassVar = {"table": "*", "entries": None}

    @classmethod
    def unknown(cls, why: str, monitor: str = "") -> LoadedTable:
        """Return that the table of ``monitor`` cannot be read, with the reason in a phrase."""
        return cls(monitor, GammaTable.unreadable(why))

    def __str__(self) -> str:
        return f"{self.table.sentence()} on '{self.monitor}'" if self.monitor else self.table.sentence()


def monitor_names(glfw: Any) -> dict[str, Any]:
    """Return glfw's monitors by their names; several of one name are numbered from the second on."""
    named: dict[str, Any] = {}
    for handle in glfw.get_monitors() or ():
        told = glfw.get_monitor_name(handle)
        name = told.decode("utf-8", "replace") if isinstance(told, bytes) else str(told)
        count = sum(other.partition(" #")[0] == name for other in named)
        named[f"{name} #{count + 1}" if count else name] = handle
    return named


def why_unreadable(display_server: str) -> str:
    """Return why no table of ``display_server`` can be read, an empty text if they can."""
    if display_server == "wayland":
        return "Wayland does not let programs read it"
    if display_server == "x11" and is_xwayland():
        return "Xwayland has a table of its own, not that of the screen"
    return ""


def read_table(glfw: Any, monitor: str, handle: Any) -> LoadedTable:
    """Return the table of the monitor called ``monitor``; unknown, with the reason, where there is none."""
    try:
        ramp = glfw.get_gamma_ramp(handle)
    except ValueError:  # a null pointer
        return LoadedTable.unknown("the window system gives no gamma table", monitor)
    entries = np.rint(65535.0 * np.array([ramp.red, ramp.green, ramp.blue])).astype(np.uint16).T
    if len(entries) < 2:
        return LoadedTable.unknown("the window system gives an empty gamma table", monitor)
    if not entries.any():
        why = "all its entries are 0, as on a virtual screen where none was ever loaded"
        return LoadedTable(monitor, GammaTable.unreadable(why), entries)
    return LoadedTable(monitor, GammaTable(entries), entries)


def set_tables(tables: Mapping[str, Entries]) -> None:
    """Load ``tables`` by monitor, and check what is read back.

    Raises
    ------
    PresentationError
        If a monitor is not there, or the driver returns something else afterwards.
    """
    order = {name: np.asarray(entries).T.tolist() for name, entries in tables.items()}
    command = [sys.executable, "-m", "runner.presenter.surfaces.set_gamma_tables"]
    root = str(Path(__file__).resolve().parents[3])  # the process imports this checkout
    paths = os.pathsep.join(filter(None, (root, os.environ.get("PYTHONPATH"))))
    try:
        done = subprocess.run(
            command,
            input=json.dumps(order),
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            timeout=_PATIENCE_S,
            env={**os.environ, "PYTHONPATH": paths, "PYTHONIOENCODING": "utf-8"},
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise PresentationError(f"the gamma table could not be set: {error}") from error
    if done.returncode != 0:
        why = (done.stdout or done.stderr).strip().splitlines()
        raise PresentationError(f"the gamma table could not be set: {why[-1] if why else 'no reason is given'}")
