"""What a PNG's chunks say of it beside its pixels: colour space, shape of its pixels, EXIF."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from documents.files import open_regular
from stimuli.errors import StimulusError

_MOST_EXIF = 1_000_000
# As large as the profile of a display may be; a thousandth of it may be stored.
MOST_PROFILE_BYTES = 32_000_000
_WHOLE = {b"eXIf": _MOST_EXIF, b"iCCP": MOST_PROFILE_BYTES}
# Of 8 kB each, as some programs write them, of a picture of 800 MB.
_MOST_CHUNKS = 100_000
# Chromaticities and powers as they are rounded by those who write them.
_SAME_XY, _SAME_GAMMA = 2e-3, 1e-3
_STATED = ("white", "red", "green", "blue")


def png_chunks(path: Path) -> Iterator[tuple[str, bytes]]:
    """Yield name and content of a PNG's chunks but its pixels; of long ones the beginning.

    Raises
    ------
    StimulusError
        If it has several profiles: each costs as much as it unpacks to.
    """
    profiles = 0
    with open_regular(path, "picture", error=StimulusError) as file:
        for at, size, name in _chunks(file, path):
            profiles += name == b"iCCP"
            if profiles > 1:
                raise StimulusError.at(path, "the picture has more than one ICC profile (iCCP)", "save it again")
            if name != b"IDAT":
                file.seek(at)
                yield name.decode("latin-1"), file.read(min(size, _WHOLE.get(name, 64)))


def png_pixel_bytes(path: Path) -> int:
    """Return how many bytes of a PNG hold its compressed pixels; StimulusError if a chunk ends beyond the file."""
    with open_regular(path, "picture", error=StimulusError) as file:
        end, pixels = file.seek(0, 2), 0
        for at, size, name in _chunks(file, path):
            if at + size + 4 > end:
                message = f"the picture is cut short or damaged: it ends within the chunk {name.decode('latin-1')!r}"
                raise StimulusError.at(path, message, "copy or save it again")
            pixels += size if name == b"IDAT" else 0
    return pixels


def _chunks(file: BinaryIO, path: Path) -> Iterator[tuple[int, int, bytes]]:
    """Yield where the content of each chunk begins, its size and its name."""
    at, chunks = 8, 0
    while file.seek(at) and len(head := file.read(8)) == 8:
        size, name = struct.unpack(">I4s", head)
        chunks += 1
        if chunks > _MOST_CHUNKS:
            raise StimulusError.at(path, f"the picture has more than {_MOST_CHUNKS} chunks", "save it again")
        yield at + 8, size, name
        at += size + 12


def png_profile(png: dict[str, bytes], path: Path) -> bytes | None:
    """Return the ICC profile in the chunk iCCP, None without one; StimulusError if it is damaged or too large."""
    if "iCCP" not in png:
        return None
    _, _, packed = png["iCCP"].partition(b"\0")
    unpacking = zlib.decompressobj()
    try:
        data = unpacking.decompress(packed[1:], MOST_PROFILE_BYTES)
    except zlib.error as error:
        raise StimulusError.at(path, "its ICC profile (the chunk iCCP) is damaged", "save it again") from error
    if unpacking.unconsumed_tail:
        message = f"its ICC profile unpacks to more than {MOST_PROFILE_BYTES // 10**6} MB"
        raise StimulusError.at(path, message, "save the picture with the profile of its colour space, such as sRGB")
    return data or None


def png_aspect(png: dict[str, bytes]) -> float:
    """Return a pixel's width over its height, as the chunk pHYs states it; 1 without one."""
    if len(png.get("pHYs", b"")) < 8:
        return 1.0
    across, down = struct.unpack(">II", png["pHYs"][:8])
    return down / across if across and down else 1.0


def png_exif(png: dict[str, bytes]) -> Any:
    """Return a PNG's EXIF; Pillow would decode the pixels for it."""
    from PIL.Image import Exif

    exif = Exif()
    if "eXIf" in png:
        exif.load(b"Exif\0\0" + png["eXIf"])
    return exif


def png_space(png: dict[str, bytes], path: Path) -> str | None:
    """Return the colour space that a PNG states beside a profile, in the order of its specification [PNG3].

    gAMA and cHRM, which others keep beside what ranks above them, are looked at only where they stand alone.
    """
    if len(png.get("cICP", b"")) >= 4:
        name = _cicp_space(png["cICP"], path)
        if "sRGB" in png and name != "srgb":
            message = f"its chunk cICP states {name}, and its chunk sRGB another colour space"
            raise StimulusError.at(path, message, "save it with one of them, the one that it is in")
        return name
    if "sRGB" in png:
        return "srgb"
    if "iCCP" in png:
        return None
    gamma = None
    if len(png.get("gAMA", b"")) >= 4:
        gamma = struct.unpack(">I", png["gAMA"][:4])[0] / 1e5
        if not 0.44 <= gamma <= 0.46:
            message = f"its chunk gAMA states values to the power of {gamma:g}, which no named colour space has"
            raise StimulusError.at(path, message, "save it as sRGB, or linear as OpenEXR")
    if len(png.get("cHRM", b"")) >= 32:
        return stated_space(
            [value / 1e5 for value in struct.unpack(">8I", png["cHRM"][:32])], gamma, path, "its chunk cHRM"
        )
    return None


def _cicp_space(cicp: bytes, path: Path) -> str:
    """Return the colour space of the chunk cICP: primaries, transfer, matrix (0 of RGB), and 1 of the full range."""
    primaries, transfer, matrix, full = cicp[:4]
    name = {(1, 13): "srgb", (12, 13): "display-p3"}.get((primaries, transfer))
    if name is None:
        message = f"its chunk cICP states primaries {primaries} and transfer {transfer}, which are not read"
        raise StimulusError.at(path, message, "save it as sRGB or Display P3, or as OpenEXR")
    if matrix:
        message = f"its chunk cICP states the matrix {matrix}, which no PNG has: its codes are RGB (0)"
        raise StimulusError.at(path, message, "save it as sRGB or Display P3")
    if full != 1:
        message = "its chunk cICP states the narrow range of video, in which white is not the highest code"
        raise StimulusError.at(path, message, "save it with the full range")
    return name


def stated_space(xy: Sequence[float], gamma: float | None, path: Path, named: str) -> str | None:
    """Return the colour space of x, y of white, red, green and blue: that of Adobe RGB's power, else None of sRGB's.

    Primaries alone do not say which curve the codes have: of sRGB's, the colour space is still to be named.

    Raises
    ------
    StimulusError
        If they are others. ``named`` says what states them.
    """
    from stimuli.pictures.colour_spaces import primaries_of

    stated = np.reshape(xy, (4, 2))
    for name in ("srgb", "adobe-rgb"):
        red, green, blue, white = primaries_of(name)
        if np.allclose(stated, [white, red, green, blue], rtol=0, atol=_SAME_XY):
            if name == "srgb":
                return None
            if gamma is not None and abs(gamma - 256 / 563) <= _SAME_GAMMA:
                return name
    what = ", ".join(f"{colour} {x:.4g} {y:.4g}" for colour, (x, y) in zip(_STATED, stated, strict=True))
    message = f"{named} states other primaries than sRGB's (x, y of {what}), and no profile beside them"
    raise StimulusError.at(path, message, "save it with its ICC profile, or as sRGB")
