"""OpenEXR files written byte by byte, uncompressed, after its file layout: what no library here writes."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Window = tuple[int, int, int, int]  # first and last column and row: x, y, x, y
_TYPES = {"<u4": 0, "<f2": 1, "<f4": 2}
MULTI_PART = 0x1000


def floats(*values: float) -> bytes:
    """Return floats as OpenEXR stores them."""
    return struct.pack(f"<{len(values)}f", *values)


def strings(*values: str) -> bytes:
    """Return a vector of strings as OpenEXR stores it."""
    return b"".join(struct.pack("<i", len(value)) + value.encode() for value in values)


@dataclass(frozen=True)
class Part:
    """Channels by name, their windows and attributes (name, type, bytes).

    A channel whose array is smaller than its data window is sampled every ``steps[name]`` pixels.
    """

    channels: Mapping[str, NDArray[Any]]
    attributes: Sequence[tuple[str, str, bytes]] = ()
    data: Window | None = None
    display: Window | None = None
    aspect: float = 1.0
    steps: Mapping[str, int] = field(default_factory=dict)
    decreasing: bool = False

    @property
    def window(self) -> Window:
        if self.data is not None:
            return self.data
        height, width = max((array.shape for array in self.channels.values()), key=lambda shape: shape[0])
        return 0, 0, width - 1, height - 1

    def header(self) -> bytes:
        listed = b""
        for name in sorted(self.channels):
            step = self.steps.get(name, 1)
            kind = _TYPES[self.channels[name].dtype.newbyteorder("<").str]
            listed += name.encode() + b"\0" + struct.pack("<iB3xii", kind, 0, step, step)
        attributes = [
            ("channels", "chlist", listed + b"\0"),
            ("compression", "compression", b"\0"),
            ("dataWindow", "box2i", struct.pack("<4i", *self.window)),
            ("displayWindow", "box2i", struct.pack("<4i", *(self.display or self.window))),
            ("lineOrder", "lineOrder", bytes([self.decreasing])),
            ("pixelAspectRatio", "float", floats(self.aspect)),
            ("screenWindowCenter", "v2f", floats(0, 0)),
            ("screenWindowWidth", "float", floats(1)),
            *self.attributes,
        ]
        made = (f"{name}\0{kind}\0".encode() + struct.pack("<i", len(data)) + data for name, kind, data in attributes)
        return b"".join(made) + b"\0"

    def rows(self) -> list[bytes]:
        """Return each row of the file: its number, the bytes of its channels, and their count before them."""
        _, top, _, bottom = self.window
        made = []
        for row in range(top, bottom + 1):
            line = b""
            for name in sorted(self.channels):
                step = self.steps.get(name, 1)
                if row % step == 0:
                    line += self.channels[name][row // step - -(-top // step)].tobytes()
            made.append(struct.pack("<ii", row, len(line)) + line)
        return made


def write_bytes(path: Path, *parts: Part) -> Path:
    """Write parts to ``path``; several each need a name, a type and a chunkCount, which are added."""
    several = len(parts) > 1
    head = struct.pack("<ii", 20000630, 2 | (MULTI_PART if several else 0))
    rows = [part.rows() for part in parts]
    for number, part in enumerate(parts):
        if several:
            more = (
                ("name", "string", f"part{number}".encode()),
                ("type", "string", b"scanlineimage"),
                ("chunkCount", "int", struct.pack("<i", len(rows[number]))),
            )
            fields = part.channels, (*part.attributes, *more), part.data, part.display
            part = Part(*fields, part.aspect, part.steps, part.decreasing)
        head += part.header()
    head += b"\0" if several else b""
    chunks = [
        [(struct.pack("<i", number) if several else b"") + row for row in rows_of]
        for number, rows_of in enumerate(rows)
    ]
    at = len(head) + 8 * sum(map(len, chunks))
    offsets, body = b"", b""
    for part, lines in zip(parts, chunks, strict=True):
        places = []
        for line in reversed(lines) if part.decreasing else lines:
            places.append(at + len(body))
            body += line
        # Offsets stand in the order of rows, whatever the order of the rows themselves.
        offsets += struct.pack(f"<{len(places)}Q", *(reversed(places) if part.decreasing else places))
    path.write_bytes(head + offsets + body)
    return path


def decimated(values: NDArray[Any]) -> NDArray[Any]:
    """Return every second row and column."""
    return np.ascontiguousarray(values[::2, ::2])
