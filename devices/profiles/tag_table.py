"""An ICC profile as bytes: its header, its tag table, and numbers of a tag that are never read beyond its end.

[ICC2022], Section 7; versions 2 and 4 share what is read here. A profile may come from anywhere: every offset and
length is checked against the file before a byte is used, and nothing is allocated for what the file only announces.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.errors import DeviceError
from documents import Finding
from documents.arrays import Floats
from documents.files import read_regular

# Profiles of displays hold some kilobytes, with a table and thousands of readings some megabytes.
_MOST_BYTES = 32_000_000
_HEADER, _ENTRY = 128, 12
_MOST_TAGS = 500
_MOST_FINDINGS = 20
_CLASSES = {
    "scnr": "a scanner or camera",
    "prtr": "a printer",
    "link": "a link between two devices",
    "abst": "an abstract transform",
    "nmcl": "named colours",
}
_A_DISPLAY = "a profile of an RGB display is needed"


@dataclass(frozen=True, slots=True)
class Tag:
    """The bytes of one tag; ``name`` is its signature, such as ``rTRC``, and ``file`` the name that findings carry."""

    file: str
    name: str
    data: bytes

    @property
    def type(self) -> str:
        """The signature of its type, such as ``curv``."""
        return _signature(self.data[:4])

    def finding(self, message: str, remedy: str | None = None) -> Finding:
        """Return what is wrong with the tag."""
        return Finding(f"the tag '{self.name}' {message}", self.file, remedy=remedy)

    def error(self, message: str, remedy: str | None = None) -> DeviceError:
        """Return an error on the tag."""
        return DeviceError(self.finding(message, remedy))

    def wrong_type(self, expected: str) -> DeviceError:
        """Return an error that the tag's type is none of ``expected``."""
        return self.error(f"is of the type '{self.type}'", f"{expected} is needed")

    def part(self, at: int, size: int) -> bytes:
        """Return ``size`` bytes from ``at``; DeviceError if the tag ends before."""
        if at < 0 or size < 0 or at + size > len(self.data):
            raise self.error(
                f"needs {at + size} bytes and has {len(self.data)}", "the profile is damaged: make or fetch it again"
            )
        return self.data[at : at + size]

    def u8(self, at: int, count: int) -> NDArray[np.uint8]:
        """Return ``count`` bytes from ``at``."""
        return np.frombuffer(self.part(at, count), dtype=np.uint8)

    def u16(self, at: int, count: int) -> NDArray[np.uint16]:
        """Return ``count`` whole numbers of 16 bits from ``at``."""
        return np.frombuffer(self.part(at, 2 * count), dtype=">u2").astype(np.uint16)

    def whole(self, at: int, form: str) -> int:
        """Return the number of ``form`` (``B``, ``H`` or ``I``) at ``at``."""
        return int(struct.unpack(f">{form}", self.part(at, struct.calcsize(form)))[0])

    def fixed(self, at: int, count: int) -> Floats:
        """Return ``count`` numbers from ``at`` that are stored as s15Fixed16."""
        return np.frombuffer(self.part(at, 4 * count), dtype=">i4").astype(np.float64) / 65536.0


@dataclass(frozen=True, slots=True)
class ProfileFile:
    """A profile's header and where its tags lie. ``version`` is (major, minor), ``pcs`` ``XYZ`` or ``Lab``."""

    file: str
    data: bytes
    version: tuple[int, int]
    pcs: str
    places: Mapping[str, tuple[int, int]]

    def tag(self, name: str) -> Tag | None:
        """Return the tag ``name``, None if the profile has none."""
        if name not in self.places:
            return None
        offset, size = self.places[name]
        return Tag(self.file, name, self.data[offset : offset + size])


def read_profile_file(path: Path) -> ProfileFile:
    """Read the header and tag table of the display profile at ``path``.

    Raises
    ------
    DeviceError
        If the file cannot be read, is no ICC profile, is of another device than an RGB display, or its tag table is
        broken; all that is wrong at once.
    """
    return parse_profile_file(read_regular(path, _MOST_BYTES, "profile", error=DeviceError), str(path))


def parse_profile_file(data: bytes, file: str) -> ProfileFile:
    """Return the profile in ``data``; ``file`` is the name that findings carry; else as `read_profile_file`."""
    if len(data) < _HEADER + 4 or data[36:40] != b"acsp":
        remedy = "an .icc or .icm file, which has 'acsp' at byte 36"
        raise DeviceError(Finding("the file is no ICC profile", file, remedy=remedy))
    size, version = struct.unpack(">I4xH", data[:10])
    findings = _header_findings(data, file, size, version)
    if findings:
        raise DeviceError(findings)
    places = _places(data, file)
    return ProfileFile(file, data, (version >> 8, version >> 4 & 15), _signature(data[20:24]).strip(), places)


def _header_findings(data: bytes, file: str, size: int, version: int) -> list[Finding]:
    findings = []
    if version >> 8 not in (2, 4):
        findings.append(Finding(f"the profile is of version {version >> 8}", file, remedy="2 and 4 are read"))
    kind, space, pcs = (_signature(data[at : at + 4]) for at in (12, 16, 20))
    if kind in _CLASSES:
        what = f"the profile is of {_CLASSES[kind]} (class '{kind}', colours '{space.strip()}')"
        findings.append(Finding(what, file, remedy=_A_DISPLAY))
    elif kind not in ("mntr", "spac"):
        findings.append(Finding(f"the profile's class is '{kind}'", file, remedy=_A_DISPLAY))
    elif space != "RGB ":
        findings.append(Finding(f"the profile's colours are '{space.strip()}', not RGB", file, remedy=_A_DISPLAY))
    elif pcs not in ("XYZ ", "Lab "):
        findings.append(Finding(f"the profile connects to '{pcs.strip()}'", file, remedy="XYZ or Lab is needed"))
    if size > len(data):
        what = f"the profile says that it has {size} bytes, and the file has {len(data)}"
        findings.append(Finding(what, file, remedy="it was cut off: fetch or make it again"))
    return findings


def _places(data: bytes, file: str) -> dict[str, tuple[int, int]]:
    """Return the offset and size of every tag; DeviceError with each that is wrong."""
    (count,) = struct.unpack_from(">I", data, _HEADER)
    ends = _HEADER + 4 + _ENTRY * count
    if count > _MOST_TAGS or ends > len(data):
        what = f"the tag table says that it has {count} tags, which do not fit into the {len(data)} bytes of the file"
        what = what if ends > len(data) else f"the tag table says that it has {count} tags"
        raise DeviceError(Finding(what, file, remedy=f"at most {_MOST_TAGS}; the profile is damaged"))
    places: dict[str, tuple[int, int]] = {}
    findings = []
    for number in range(count):
        raw, offset, size = struct.unpack_from(">4sII", data, _HEADER + 4 + _ENTRY * number)
        name = _signature(raw)
        if offset < ends or size < 8 or offset + size > len(data):
            what = f"the tag '{name}' lies at byte {offset} and has {size} bytes"
            remedy = f"a tag has 8 bytes or more and lies in {ends}..{len(data)}; the profile is damaged"
            findings.append(Finding(what, file, remedy=remedy))
        elif name in places:
            findings.append(Finding(f"the tag '{name}' stands twice in the tag table", file, remedy="once is right"))
        places[name] = (offset, size)
    if findings:
        raise DeviceError(findings[:_MOST_FINDINGS])
    return places


def _signature(raw: bytes) -> str:
    """Return four bytes as text, whatever they are."""
    return raw.decode("latin-1")
