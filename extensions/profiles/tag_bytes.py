"""Tags and headers of a profile of version 4 as bytes ([ICC2022], Sections 7 and 10)."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from devices.display import GammaTable
from documents.arrays import Floats

_HEADER, _ENTRY = 128, 12
VERSION = 0x04400000
RELATIVE_COLORIMETRIC = 1
# Largest and least number of s15Fixed16.
_LEAST, _MOST = -(2**31), 2**31 - 1


def fixed(values: ArrayLike) -> bytes:
    """Return numbers of any shape as s15Fixed16, in their order."""
    whole = np.rint(np.asarray(values, dtype=np.float64).ravel() * 65536.0)
    return np.clip(whole, _LEAST, _MOST).astype(">i4").tobytes()


def u16(shares: ArrayLike) -> bytes:
    """Return shares in 0..1, of any shape, as 16 bits, in their order."""
    return np.rint(np.clip(np.asarray(shares, dtype=np.float64).ravel(), 0.0, 1.0) * 65535.0).astype(">u2").tobytes()


def xyz(values: ArrayLike) -> bytes:
    """Return the type ``XYZ `` of one triple."""
    return b"XYZ \0\0\0\0" + fixed(values)


def matrix(values: ArrayLike) -> bytes:
    """Return the type ``sf32`` of numbers."""
    return b"sf32\0\0\0\0" + fixed(values)


def text(words: str) -> bytes:
    """Return the type ``mluc`` of ``words`` in English."""
    encoded = words.encode("utf-16-be")
    return b"mluc\0\0\0\0" + struct.pack(">II2s2sII", 1, 12, b"en", b"US", len(encoded), 28) + encoded


def sampled_curve(values: ArrayLike) -> bytes:
    """Return the type ``curv`` of values (n,) in 0..1, n 2 or more."""
    shares = np.asarray(values, dtype=np.float64)
    return b"curv\0\0\0\0" + struct.pack(">I", len(shares)) + u16(shares)


def parametric_curve(kind: int, numbers: Sequence[float]) -> bytes:
    """Return the type ``para`` of the function ``kind``."""
    return b"para\0\0\0\0" + struct.pack(">HH", kind, 0) + fixed(numbers)


def gamma_table(table: GammaTable) -> bytes:
    """Return the tag ``vcgt`` of a known table."""
    entries = table.entries
    assert entries is not None
    head = b"vcgt\0\0\0\0" + struct.pack(">IHHH", 0, 3, len(entries), 2)
    return head + entries.T.astype(">u2").tobytes()


def stages(
    kind: bytes, last: bytes, rows: ArrayLike, offset: ArrayLike, middle: bytes, grid: Floats, first: bytes
) -> bytes:
    """Return ``mAB `` or ``mBA ``, whose five parts lie one after the other.

    ``last``, ``middle`` and ``first`` are the three curves 'B', 'M' and 'A', each begun at a multiple of four bytes;
    ``rows`` (3, 3) and ``offset`` (3,) the matrix, and ``grid`` (n, n, n, 3) shares in 0..1.
    """
    points = grid.shape[0]
    head = bytes([points] * 3 + [0] * 13) + bytes([2, 0, 0, 0])
    parts = [last, fixed(rows) + fixed(offset), middle, padded(head + u16(grid)), first]
    at, offsets = 32, []
    for part in parts:
        offsets.append(at)
        at += len(part)
    return kind + b"\0\0\0\0" + bytes([3, 3, 0, 0]) + struct.pack(">5I", *offsets) + b"".join(parts)


def padded(part: bytes) -> bytes:
    """Return ``part`` filled up with zeros to a multiple of four bytes."""
    return part + b"\0" * (-len(part) % 4)


def profile(tags: Mapping[str, bytes], white: ArrayLike) -> bytes:
    """Return a display's profile of version 4.4 that connects to XYZ; tags of the same bytes are stored once.

    ``white``: XYZ (3,) of the connection space's D50. The date is left at the beginning of the format, so that the same
    model gives the same file; the profile's ID is the MD5 that ICC asks for.
    """
    places: dict[bytes, tuple[int, int]] = {}
    at = _HEADER + 4 + _ENTRY * len(tags)
    at += -at % 4
    body = b""
    start = at
    for data in tags.values():
        if data not in places:
            places[data] = (start + len(body), len(data))
            body += padded(data)
    table = struct.pack(">I", len(tags)) + b"".join(
        name.encode("latin-1") + struct.pack(">II", *places[data]) for name, data in tags.items()
    )
    table += b"\0" * (start - _HEADER - len(table))
    size = start + len(body)
    head = bytearray(_HEADER)
    struct.pack_into(">I4xI4s4s4s6H4s", head, 0, size, VERSION, b"mntr", b"RGB ", b"XYZ ", 2000, 1, 1, 0, 0, 0, b"acsp")
    struct.pack_into(">I", head, 64, 0)
    head[68:80] = fixed(white)
    whole = bytes(head) + table + body
    digest = hashlib.md5(whole, usedforsecurity=False).digest()
    struct.pack_into(">I", head, 64, RELATIVE_COLORIMETRIC)
    head[84:100] = digest
    return bytes(head) + table + body
