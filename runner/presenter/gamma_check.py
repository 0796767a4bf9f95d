"""Whether the gamma tables that are loaded are those that the display was measured with, and stay so."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from devices.display import EYES, NO_TABLE, Eye, GammaTable
from runner.presenter.surfaces.gamma_tables import LoadedTable

REMEDY = (
    "load that table again (night light, a colour profile or a calibration loader may have changed it), or measure the "
    "display again; --accept-gamma-table uses it as it is, see docs/modes.md"
)
Loaded = Mapping[Eye, LoadedTable]


@dataclass(frozen=True, slots=True)
class GammaVerdict:
    """What stands against the tables that are loaded: ``refusal`` if they are other ones, ``warning`` if unknown."""

    refusal: str = ""
    warning: str = ""


def compare_tables(measured: Mapping[Eye, GammaTable], loaded: Loaded) -> GammaVerdict:
    """Return whether the ``loaded`` tables are those that each eye was ``measured`` with.

    Without a monitor, as where a session is simulated, there is nothing to say.
    """
    refusals: dict[str, None] = {}
    warnings: dict[str, None] = {}
    for eye in EYES:
        there, before = loaded[eye], measured[eye]
        if not there.monitor:
            continue
        same = before.same_as(there.table)
        if same is False:
            what = f"the gamma table loaded on '{there.monitor}' is not the one that the display was measured with"
            apart = there.table.difference_from(before)
            refusals[f"{what}: {apart}; it is {there.table.sentence()}; measured with {before.sentence()}"] = None
        elif not there.table.known:
            what = f"the gamma table of '{there.monitor}' cannot be read: {there.table.unknown}"
            warnings[f"{what}; colours are right only if it is the one that the display was measured with"] = None
        elif before.unknown == NO_TABLE:
            if not there.table.is_identity:
                what = f"the gamma table loaded on '{there.monitor}' is {there.table.sentence()}"
                warnings[f"{what}: it changes codes, and a nominal display does not take that into account"] = None
        elif same is None:
            what = f"the gamma table that the display was measured with is not known: {before.unknown}"
            warnings[f"{what}; loaded on '{there.monitor}' is {there.table.sentence()}"] = None
    return GammaVerdict("; ".join(refusals), "; ".join(warnings))


def change_of_table(before: GammaTable, now: GammaTable) -> str:
    """Return in a phrase how a table changed, and by how much where both are known."""
    apart = f", and {now.difference_from(before)}" if before.known and now.known else ""
    return f"it was {before.sentence()}, and is {now.sentence()}{apart}"


def tables_json(tables: Mapping[Eye, LoadedTable] | Mapping[Eye, GammaTable]) -> dict[str, Any]:
    """Return what a record holds of each eye's table: ``both`` where they are one."""
    left, right = tables["left"].to_json(), tables["right"].to_json()
    return {"both": left} if left == right else {"left": left, "right": right}


def table_of_record(held: Mapping[str, Any], eye: Eye) -> GammaTable:
    """Return ``eye``'s table of what `tables_json` returned; DeviceError if it cannot be read."""
    return GammaTable.from_json(held.get("both") or held[eye])


class GammaWatch:
    """Looks whether the tables change: at most every ``every_s`` seconds, unless it must be ``now``.

    ``loaded`` are the tables as they were read last; ``reads`` counts the readings.
    """

    def __init__(
        self, read: Callable[[], Loaded], every_s: float = 1.0, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._read = read
        self._every_s = every_s
        self._clock = clock
        self.loaded = read()
        self.reads = 1
        self._last_s = clock()

    def change(self, *, now: bool = False) -> str:
        """Return in a sentence what changed since the last call, an empty text if nothing did or it is too early."""
        if not any(table.monitor for table in self.loaded.values()):
            return ""
        if not now and self._clock() - self._last_s < self._every_s:
            return ""
        before, self.loaded = self.loaded, self._read()
        self.reads += 1
        self._last_s = self._clock()
        for eye in EYES:
            was, there = before[eye], self.loaded[eye]
            if was.table.same_as(there.table) is False or was.table.known != there.table.known:
                what = f"the gamma table on '{there.monitor or was.monitor}' changed"
                return f"{what}: {change_of_table(was.table, there.table)}"
        return ""
