"""MATLAB's MAT-files of version 5 (``-v6``, ``-v7``): the numbers, texts, cells and structs in them, and nothing else.

"MATLAB MAT-File Format", The MathWorks. A file may come from anywhere: every size is checked against the bytes that
are there before one is used, nothing is allocated for what a file only announces, and what is unpacked has a limit.
What holds no measurements (objects, function handles, sparse matrices, complex numbers) is passed over and becomes
None.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Value: TypeAlias = "NDArray[np.float64] | str | list[Value] | dict[str, Value] | None"

_HEADER = 128
# What a file may unpack to, in all, and what may stand in what is read of it: a thousand calibrations have less.
_MOST_UNPACKED_BYTES = 50_000_000
_MOST_NUMBERS = 20_000_000
_MOST_VALUES = 100_000
_MOST_VARIABLES = 10_000
_MOST_DEPTH = 30
# The head of a variable, with the longest name and the most dimensions, has fewer bytes.
_ENOUGH_FOR_A_HEAD = 1024
_MATRIX, _COMPRESSED = 14, 15
_CELL, _STRUCT, _CHAR = 1, 2, 4
_NUMBERS = range(6, 16)
_WITH_DIMENSIONS = range(1, 16)
_COMPLEX = 0x0800
_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_TEXTS = {1: "latin-1", 2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}

_Part: TypeAlias = tuple[int, memoryview]
_NOTHING: _Part = (0, memoryview(b""))


class MatFileError(ValueError):
    """The bytes are no MAT-file of version 5, or are damaged; as text, why."""


def read_mat(data: bytes, *names: str) -> dict[str, Value]:
    """Return the variables called ``names`` of the MAT-file ``data``, those that it has.

    Numbers of any class become float64 arrays, texts str, cell arrays lists and struct arrays lists of mappings,
    column by column.

    Raises
    ------
    MatFileError
        If the file is of another format or version, is damaged, or unpacks to more than the limits.
    """
    if data[:10] == b"MATLAB 7.3" or data[512:520] == b"\x89HDF\r\n\x1a\n":
        raise MatFileError("it is of version 7.3")
    order = {b"MI": ">", b"IM": "<"}.get(data[126:128])
    if order is None or struct.unpack(f"{order}H", data[124:126])[0] >> 8 != 1:
        raise MatFileError("it is no MAT-file of version 5")
    reader = _Reader(order)
    read: dict[str, Value] = {}
    for count, (kind, body) in enumerate(reader.parts(memoryview(data)[_HEADER:])):
        if count == _MOST_VARIABLES:
            raise MatFileError(f"it has more than {_MOST_VARIABLES} variables")
        if kind == _COMPRESSED:
            begin = memoryview(_unpacked(body, _ENOUGH_FOR_A_HEAD)[0])
            if reader.name_of(begin[8:]) in names:
                for inner, matrix in reader.parts(reader.unpacked(body)):
                    reader.keep(inner, matrix, names, read)
        else:
            reader.keep(kind, body, names, read)
    return read


def _unpacked(body: memoryview, most_bytes: int) -> tuple[bytes, bool]:
    """Return at most ``most_bytes`` of what ``body`` unpacks to, and whether that is all."""
    unpack = zlib.decompressobj()
    try:
        plain = unpack.decompress(body, most_bytes)
        # Of what fills the limit exactly, the end is read only with the next byte.
        return plain, unpack.eof or (bool(unpack.unconsumed_tail) and not unpack.decompress(unpack.unconsumed_tail, 1))
    except zlib.error as error:
        raise MatFileError(f"its compressed part is damaged: {error}") from error


@dataclass(slots=True)
class _Reader:
    """Reads the parts of a file whose numbers have the byte ``order`` ``<`` or ``>``."""

    order: str
    left_to_unpack: int = field(default=_MOST_UNPACKED_BYTES)
    values: int = 0
    numbers: int = 0

    def unpacked(self, body: memoryview) -> memoryview:
        plain, whole = _unpacked(body, self.left_to_unpack)
        if not whole and len(plain) == self.left_to_unpack:
            raise MatFileError(f"it unpacks to more than {_MOST_UNPACKED_BYTES / 1e6:g} MB")
        if not whole:
            raise MatFileError("its compressed part is cut off")
        self.left_to_unpack -= len(plain)
        return memoryview(plain)

    def parts(self, data: memoryview) -> Iterator[_Part]:
        """Yield type and body of each part of ``data``."""
        at = 0
        while at < len(data):
            if at + 8 > len(data):
                raise MatFileError("it is cut off")
            kind, size = struct.unpack_from(f"{self.order}II", data, at)
            begin = at + 8
            after = begin + size + (0 if kind == _COMPRESSED else -size % 8)
            if kind >> 16:  # a small part has its size in the upper half, and its body in the tag
                kind, size, begin, after = kind & 0xFFFF, kind >> 16, at + 4, at + 8
            if begin + size > min(len(data), after):
                raise MatFileError(f"a part states {size} bytes, and has {min(len(data), after) - begin}")
            yield kind, data[begin : begin + size]
            at = after

    def head(self, parts: Iterator[_Part]) -> tuple[int, tuple[int, ...], str]:
        """Return the flags, with the class in the lowest byte, the dimensions and the name of the matrix of ``parts``.

        What is of a class that other programs know has neither dimensions nor name here.
        """
        _, flags = next(parts, _NOTHING)
        word = struct.unpack_from(f"{self.order}I", flags)[0] if len(flags) >= 4 else 0
        if word & 0xFF not in _WITH_DIMENSIONS:
            return word, (), ""
        (_, dimensions), (_, name) = next(parts, _NOTHING), next(parts, _NOTHING)
        if not 8 <= len(dimensions) <= 128 or len(dimensions) % 4:
            raise MatFileError("a variable has no dimensions")
        shape = struct.unpack(f"{self.order}{len(dimensions) // 4}i", dimensions)
        if min(shape) < 0:
            raise MatFileError(f"a variable has the dimensions {_times(shape)}")
        return word, shape, bytes(name).decode("utf-8", "replace")

    def name_of(self, body: memoryview) -> str:
        return self.head(self.parts(body))[2] if body else ""

    def keep(self, kind: int, body: memoryview, names: tuple[str, ...], read: dict[str, Value]) -> None:
        """Put the variable of a part of the file into ``read``, if it is one of ``names``."""
        if kind == _MATRIX and (name := self.name_of(body)) in names:
            read[name] = self.value(body, 0)

    def value(self, body: memoryview, depth: int) -> Value:
        self.values += 1
        if self.values > _MOST_VALUES or depth > _MOST_DEPTH:
            raise MatFileError(f"it has more than {_MOST_VALUES} values, or more than {_MOST_DEPTH} in each other")
        if not body:
            return np.zeros(0)
        parts = self.parts(body)
        word, shape, _ = self.head(parts)
        kind, count = word & 0xFF, math.prod(shape)
        if kind == _CELL:
            return [self.inner(parts, depth) for _ in range(_few(count))]
        if kind == _STRUCT:
            names = self.field_names(parts)
            each = range(_few(count * len(names)) // max(len(names), 1))
            return [{name: self.inner(parts, depth) for name in names} for _ in each]
        if kind == _CHAR:
            return self.text(*next(parts, _NOTHING))
        if kind in _NUMBERS and not word & _COMPLEX:
            return self.array(*next(parts, _NOTHING), shape)
        return None

    def inner(self, parts: Iterator[_Part], depth: int) -> Value:
        kind, body = next(parts, _NOTHING)
        if kind != _MATRIX:
            raise MatFileError("a cell or a field is missing")
        return self.value(body, depth + 1)

    def field_names(self, parts: Iterator[_Part]) -> list[str]:
        (_, length), (_, names) = next(parts, _NOTHING), next(parts, _NOTHING)
        size = struct.unpack_from(f"{self.order}I", length)[0] if len(length) >= 4 else 0
        if size == 0 and not names:
            return []
        if size == 0 or len(names) % size:
            raise MatFileError("the names of a struct's fields are damaged")
        each = (bytes(names[at : at + size]) for at in range(0, size * _few(len(names) // size), size))
        return [name.split(b"\0")[0].decode("utf-8", "replace") for name in each]

    def text(self, kind: int, body: memoryview) -> str:
        if kind not in _TEXTS:
            raise MatFileError(f"a text has the unknown type {kind}")
        ending = "" if _TEXTS[kind] in ("latin-1", "utf-8") else "-le" if self.order == "<" else "-be"
        return bytes(body).decode(_TEXTS[kind] + ending, "replace")

    def array(self, kind: int, body: memoryview, shape: tuple[int, ...]) -> NDArray[np.float64]:
        if kind not in _TYPES:
            raise MatFileError(f"numbers have the unknown type {kind}")
        count = math.prod(shape)
        if len(body) != int(_TYPES[kind][1]) * count:
            raise MatFileError(f"a variable of {_times(shape)} numbers has {len(body)} bytes of them")
        self.numbers += count
        if self.numbers > _MOST_NUMBERS:
            raise MatFileError(f"it has more than {_MOST_NUMBERS} numbers")
        read = np.frombuffer(body, dtype=self.order + _TYPES[kind]).astype(np.float64)
        return read.reshape(shape, order="F") if count else np.zeros(0)


def _few(count: int) -> int:
    """Return ``count``, if as many values may be read."""
    if count > _MOST_VALUES:
        raise MatFileError(f"it has {count} values in one variable")
    return count


def _times(shape: tuple[int, ...]) -> str:
    return " by ".join(map(str, shape))
