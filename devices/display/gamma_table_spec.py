"""What a display file says of the gamma table that was loaded while a mode was measured."""

from __future__ import annotations

from pydantic import Field

from devices.display.gamma_table import GammaTable
from devices.errors import DeviceError
from documents.yaml import NotNegative, Strict


class GammaTableSpec(Strict):
    """A gamma table: its hash, largest departure from the identity, size and entries; or why it is unknown.

    The identity needs no entries. ``display fit`` writes it from the readings.
    """

    hash: str | None = None
    """The SHA-256 of the table's entries."""
    departure_codes: NotNegative | None = None
    """The largest departure from the identity, in codes."""
    size: int | None = Field(default=None, ge=2, le=65536)
    """How many entries the table has."""
    entries: str | None = None
    """The entries, packed as text."""
    unknown: str | None = Field(default=None, min_length=1)
    """Why the table is not known."""

    def table(self) -> GammaTable:
        """Return the table; DeviceError if the keys do not make one."""
        held = self.model_dump(exclude_none=True)
        if self.unknown is not None and len(held) > 1:
            raise DeviceError("a gamma table that is unknown has no other key")
        return GammaTable.from_json(held)
