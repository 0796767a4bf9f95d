"""Forms of DNG whose pixels cannot be taken for what the sensor recorded, found by the tags of the file's pictures."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

from documents import Finding, InputError
from documents.files import open_regular

_BITS, _COMPRESSION, _PHOTOMETRIC, _SUB_IFDS, _SAMPLE_FORMAT, _DNG_VERSION = 258, 259, 262, 330, 339, 50706
_WANTED = (_BITS, _COMPRESSION, _PHOTOMETRIC, _SUB_IFDS, _SAMPLE_FORMAT, _DNG_VERSION)
_SENSOR = {32803, 34892}  # a colour filter array, and linear raw
_MOST_DIRECTORIES = 64
_MOST_ENTRIES = 4096
_SIZES = {1: 1, 3: 2, 4: 4, 13: 4}
_FORMATS = {1: "B", 3: "H", 4: "I", 13: "I"}
_LOSSY_JPEG, _JPEG_XL, _DEFLATE = 34892, 52546, (8, 32946)
_REMEDY = (
    "convert it with Adobe DNG Converter, lossless and without 'use lossy compression', or give the camera's own file"
)

Tags = dict[int, tuple[int, ...]]


def unreadable_form(path: Path) -> Finding | None:
    """Return what is wrong with the DNG at ``path``; None if nothing is, or it is no DNG or cannot be read at all."""
    try:
        directories = list(_directories(path))
    except (OSError, InputError):
        return None  # LibRaw reports it
    if not any(_DNG_VERSION in tags for tags in directories):
        return None
    for tags in directories:
        if not _SENSOR & set(tags.get(_PHOTOMETRIC, ())):
            continue
        (compression, *_) = tags.get(_COMPRESSION) or (1,)
        if compression == _LOSSY_JPEG:
            return Finding(
                "the DNG was compressed with loss (JPEG), which changed its light", str(path), remedy=_REMEDY
            )
        if compression == _JPEG_XL:
            return Finding("the DNG is compressed by JPEG XL, which LibRaw does not read", str(path), remedy=_REMEDY)
        if compression in _DEFLATE and max(tags.get(_BITS) or (16,)) <= 16 and not _is_float(tags):
            what = "the DNG has whole numbers compressed by Deflate, which LibRaw does not read"
            return Finding(what, str(path), remedy="write it uncompressed or by lossless JPEG; or export a 16-bit TIFF")
    return None


def _is_float(tags: Tags) -> bool:
    return 3 in tags.get(_SAMPLE_FORMAT, ())


def _directories(path: Path) -> Iterator[Tags]:
    """Yield the tags of each picture in a TIFF file, at most a few; none if it is no TIFF file or is damaged."""
    with open_regular(path, "photograph") as file:
        head = file.read(8)
        order = {b"II*\0": "<", b"MM\0*": ">"}.get(head[:4])
        if order is None or len(head) < 8:
            return
        waiting, seen = [struct.unpack(order + "I", head[4:])[0]], set[int]()
        while waiting and len(seen) < _MOST_DIRECTORIES:
            offset = waiting.pop(0)
            if offset == 0 or offset in seen:
                continue
            seen.add(offset)
            file.seek(offset)
            start = file.read(2)
            count = struct.unpack(order + "H", start)[0] if len(start) == 2 else 0
            entries = file.read(12 * count + 4)
            if not 0 < count <= _MOST_ENTRIES or len(entries) < 12 * count:
                continue
            tags: Tags = {}
            for place in range(0, 12 * count, 12):
                tag, kind, number = struct.unpack_from(order + "HHI", entries, place)
                if tag not in _WANTED or kind not in _SIZES:
                    continue
                if number > _MOST_DIRECTORIES:
                    continue
                data = entries[place + 8 : place + 12]
                if number * _SIZES[kind] > 4:
                    file.seek(struct.unpack(order + "I", data)[0])
                    data = file.read(number * _SIZES[kind])
                if len(data) >= number * _SIZES[kind]:
                    tags[tag] = struct.unpack_from(f"{order}{number}{_FORMATS[kind]}", data)
            waiting += tags.get(_SUB_IFDS, ())
            if len(entries) == 12 * count + 4:
                waiting.append(struct.unpack_from(order + "I", entries, 12 * count)[0])
            yield tags
