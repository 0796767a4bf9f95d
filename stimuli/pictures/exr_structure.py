"""What an OpenEXR file declares, checked against limits and its own size before a library reads it [OpenEXR].

A header of some hundred bytes can ask for all memory, and many parts, attributes or channels for minutes: libraries
compare each with all others.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from math import ceil
from pathlib import Path
from typing import BinaryIO

import numpy as np

from documents.files import open_regular
from stimuli.errors import StimulusError

MAX_PARTS = 64
# Of all parts together; renderers write some hundred attributes, and lists of their objects of some megabytes.
MAX_HEADER_BYTES = 32_000_000
MAX_ATTRIBUTES = 4096
# OpenImageIO reads no more.
MAX_LISTED_CHANNELS = 1024
MAX_SIDE_PX = 1 << 16
# Of the rows or the tile that are compressed together; it is in memory once for each thread.
MAX_BLOCK_BYTES = 256_000_000

_LONGEST_NAME = 255
_TILED, _DEEP, _SEVERAL = 0x200, 0x800, 0x1000
_ROWS = {0: 1, 1: 1, 2: 1, 3: 16, 4: 32, 5: 16, 6: 32, 7: 32, 8: 32, 9: 256, 10: 256, 11: 32}
_BYTES = {0: 4, 1: 2, 2: 4}
# A block's place in the table of offsets, and the row and size before its bytes.
_LEAST_BLOCK_BYTES = 16
_DAMAGED = "copy or write it again"


@dataclass(slots=True)
class _Part:
    """What one part declares."""

    channels: list[tuple[int, int, int]] = field(default_factory=list)  # type, and the steps across and down
    compression: int = 0
    window: tuple[int, int, int, int] = (0, 0, 0, 0)
    tile: tuple[int, int, int] | None = None
    kind: str = ""

    @property
    def size_px(self) -> tuple[int, int]:
        left, top, right, bottom = self.window
        return right - left + 1, bottom - top + 1

    def block_bytes(self) -> int:
        """Return the bytes of the rows, or the tile, that are compressed together."""
        width, height = self.size_px
        across, down = self.tile[:2] if self.tile else (width, min(_ROWS.get(self.compression, 256), height))
        return sum(_BYTES.get(kind, 4) * ceil(across / x) * ceil(down / y) for kind, x, y in self.channels)

    def blocks(self) -> int:
        """Return how many blocks the part has, of all its levels."""
        width, height = self.size_px
        if self.tile is None:
            return ceil(height / _ROWS.get(self.compression, 256))
        across, down, mode = self.tile
        widths, heights = _levels(width), _levels(height)
        if mode & 15 == 0:
            return ceil(width / across) * ceil(height / down)
        if mode & 15 == 1:
            levels = max(len(widths), len(heights))
            widths += [1] * (levels - len(widths))
            heights += [1] * (levels - len(heights))
            return sum(ceil(w / across) * ceil(h / down) for w, h in zip(widths, heights, strict=True))
        return sum(ceil(w / across) for w in widths) * sum(ceil(h / down) for h in heights)


def _levels(side: int) -> list[int]:
    return [max(side >> level, 1) for level in range(side.bit_length())]


def check_exr(path: Path, *, whole: bool = False) -> None:
    """Check the headers of the OpenEXR file at ``path``; what OpenEXR itself refuses at once is left to it.

    With ``whole``, all blocks must lie within the file.

    Raises
    ------
    StimulusError
        If the file has more parts, attributes, channels or pixels than any picture, or blocks too large for memory, or
        ends before what its header declares.
    """
    with open_regular(path, "picture", error=StimulusError) as file:
        size = file.seek(0, 2)
        file.seek(0)
        head = file.read(8)
        if len(head) < 8:
            return
        flags = struct.unpack("<I", head[4:])[0]
        parts = []
        for part in _parts(file, path, several=bool(flags & _SEVERAL)):
            if not (part.kind == "tiledimage" if flags & _SEVERAL else flags & _TILED):
                part.tile = None
            _refuse(part, path)
            parts.append(part)
        if flags & _DEEP or any(part.kind.startswith("deep") for part in parts):
            return  # refused by its name
        blocks = sum(max(part.blocks(), 0) for part in parts)
        start = file.tell()
        if start + blocks * _LEAST_BLOCK_BYTES > size:
            what = f"its header asks for {blocks} blocks of pixels, more than its {size} bytes can be"
            message = f"the picture is damaged: {what}"
            raise StimulusError.at(path, message, _DAMAGED)
        if whole:
            _refuse_cut_short(file, blocks, size, path)


def _refuse_cut_short(file: BinaryIO, blocks: int, size: int, path: Path) -> None:
    offsets = np.frombuffer(file.read(8 * blocks), "<u8")
    beyond = int(np.count_nonzero(offsets > size - 8))
    if beyond:
        message = f"the picture is damaged: {beyond} of its {blocks} blocks lie beyond its end"
        raise StimulusError.at(path, message, _DAMAGED)


def _refuse(part: _Part, path: Path) -> None:
    width, height = part.size_px
    if max(width, height) > MAX_SIDE_PX:
        what = f"a view of {width} × {height} pixels is too large: {MAX_SIDE_PX} a side are the most"
        raise StimulusError.at(path, what, "crop it")
    if part.tile is not None and min(part.tile[:2]) < 1:
        raise StimulusError.at(path, "the picture is damaged: its tiles have no size", _DAMAGED)
    if min(width, height) > 0 and part.block_bytes() > MAX_BLOCK_BYTES:
        what = "tiles" if part.tile else "rows"
        message = f"its {what} are compressed in blocks of {part.block_bytes() / 1e6:.0f} MB"
        remedy = f"write it with fewer channels or smaller blocks ({MAX_BLOCK_BYTES / 1e6:.0f} MB at most)"
        raise StimulusError.at(path, message, remedy)


def _parts(file: BinaryIO, path: Path, *, several: bool) -> Iterator[_Part]:
    """Yield the parts, and leave ``file`` where the table of offsets begins."""
    attributes = parts = 0
    while True:
        part, own = _Part(), 0
        for name, kind, size in _attributes(file, path):
            own += 1
            attributes += 1
            if attributes > MAX_ATTRIBUTES:
                what = f"the file has more than {MAX_ATTRIBUTES} attributes"
                raise StimulusError.at(path, what, "write it with fewer metadata")
            _take(part, name, kind, file.read(size), path)
        if several and own == 0:
            return
        parts += 1
        if parts > MAX_PARTS:
            raise StimulusError.at(
                path, f"the file has more than {MAX_PARTS} parts", "keep only the views that are shown"
            )
        yield part
        if not several:
            return


def _attributes(file: BinaryIO, path: Path) -> Iterator[tuple[bytes, bytes, int]]:
    """Yield name, type and size of attributes up to the end of a part's header, each before its value is read."""
    while name := _name(file, path):
        kind = _name(file, path)
        length = file.read(4)
        if len(length) < 4:
            raise StimulusError.at(path, "the picture cannot be read: its header is cut short", _DAMAGED)
        (size,) = struct.unpack("<i", length)
        if not 0 <= size <= MAX_HEADER_BYTES - file.tell():
            shown = name[:40].decode("ascii", "replace")
            what = f"the attribute '{shown}' has {size} bytes, and a header {MAX_HEADER_BYTES // 1_000_000} MB at most"
            raise StimulusError.at(path, what, "write it with fewer metadata, or copy it again")
        yield name, kind, size


def _name(file: BinaryIO, path: Path) -> bytes:
    place = file.tell()
    text, end, _ = file.read(_LONGEST_NAME + 1).partition(b"\0")
    if not end:
        raise StimulusError.at(path, "the picture cannot be read: its header is cut short", _DAMAGED)
    file.seek(place + len(text) + 1)
    return text


def _take(part: _Part, name: bytes, kind: bytes, value: bytes, path: Path) -> None:
    """Take from an attribute what the size of the part depends on; one of a wrong form is left to OpenEXR."""
    if (name, kind) == (b"channels", b"chlist"):
        part.channels = list(_channels(value, path))
    elif (name, kind) == (b"compression", b"compression") and len(value) == 1:
        part.compression = value[0]
    elif (name, kind) == (b"dataWindow", b"box2i") and len(value) == 16:
        left, top, right, bottom = struct.unpack("<4i", value)
        part.window = left, top, right, bottom
    elif (name, kind) == (b"tiles", b"tiledesc") and len(value) == 9:
        across, down, mode = struct.unpack("<IIB", value)
        part.tile = across, down, mode
    elif (name, kind) == (b"type", b"string"):
        part.kind = value.decode("latin-1")


def _channels(value: bytes, path: Path) -> Iterator[tuple[int, int, int]]:
    at = count = 0
    while at < len(value) and value[at]:
        end = value.find(b"\0", at)
        if end < 0 or end + 17 > len(value):
            return
        count += 1
        if count > MAX_LISTED_CHANNELS:
            what = f"the picture has more than {MAX_LISTED_CHANNELS} channels"
            raise StimulusError.at(path, what, "keep R, G and B")
        kind, x, y = struct.unpack_from("<i4xii", value, end + 1)
        yield kind, max(x, 1), max(y, 1)
        at = end + 17
