"""The graphics card's gamma table: what a code becomes between the framebuffer and the cable.

Three channels of entries of 16 bits; code 0 takes the first, full code the last. An operating system, a calibration
loader or a night light can change it at any time, and no framebuffer shows that.

Drivers return 256, 1024 or 4096 entries, rounded to the bits of their hardware: the higher bits followed by zeros, by
the higher bits again, or rounded to 16 bits. So tables are compared as shares of full code, in steps of the fewest bits
that hold all their entries. A rounded or truncated entry lies less than one step from what it stands for: so far may an
entry of an identity lie from its code, and of two tables of equal size and bits one entry from the other. Of two tables
of different size or bits, each is allowed its own step. A step is never taken finer than one of 12 bits, 0.06 of an
8-bit code.
"""

from __future__ import annotations

import base64
import binascii
import hashlib
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.errors import DeviceError
from documents.arrays import Floats

Entries = NDArray[np.uint16]

_FULL = 65535
_FEWEST_BITS, _FINEST_BITS, _ENTRY_BITS = 8, 12, 16
_MOST_ENTRIES = 65536


@dataclass(frozen=True, eq=False)
class GammaTable:
    """A gamma table, or why it is not known.

    ``entries``: shape (n, 3), 16 bits, of red, green and blue at the codes 0 to 1 in equal steps, or None.
    ``unknown``: why there are none, in a phrase; empty where there are.

    Raises DeviceError unless there are either 2 to 65536 entries of three channels or a reason.

    Examples
    --------
    >>> table = GammaTable.from_shares((np.arange(256) / 255) ** 1.1)
    >>> table.size, round(table.departure_codes, 1), table.is_identity
    (256, 8.9, False)
    """

    entries: Entries | None
    unknown: str = ""

    def __post_init__(self) -> None:
        if self.entries is None:
            if not self.unknown:
                raise DeviceError("a gamma table without entries needs a reason")
            return
        given = np.asarray(self.entries)
        if given.ndim != 2 or given.shape[1] != 3 or not 2 <= len(given) <= _MOST_ENTRIES or self.unknown:
            raise DeviceError(f"a gamma table holds 2 to {_MOST_ENTRIES} × 3 entries, not an array of {given.shape}")
        if given.dtype.kind not in "ui" or given.min() < 0 or given.max() > _FULL:
            raise DeviceError(f"the entries of a gamma table are whole numbers in 0..{_FULL}")
        entries = given.astype(np.uint16)
        entries.flags.writeable = False
        object.__setattr__(self, "entries", entries)

    @classmethod
    def identity(cls, size: int = 256) -> GammaTable:
        """Return the table of ``size`` entries that changes nothing."""
        return cls.from_shares(np.linspace(0.0, 1.0, size))

    @classmethod
    def unreadable(cls, why: str) -> GammaTable:
        """Return the table that could not be read, with the reason in a phrase."""
        return cls(None, why)

    @classmethod
    def from_shares(cls, shares: ArrayLike, codes: ArrayLike | None = None) -> GammaTable:
        """Return the table with the ``shares`` of full code, 0..1, rounded to 16 bits.

        Parameters
        ----------
        shares
            Shape (n, 3), or (n,) for three channels alike.
        codes
            The codes in 0..1 that the shares stand at, rising from 0 to 1, shape (n,); equal steps if None. Shares at
            other steps are interpolated on straight lines to as many equal ones.

        Returns
        -------
        GammaTable
            A table of n entries.

        Raises
        ------
        DeviceError
            If the shapes disagree, or a number is not finite or outside 0..1.
        """
        values = np.asarray(shares, dtype=np.float64)
        values = np.repeat(values[:, None], 3, axis=1) if values.ndim == 1 else values
        if values.ndim != 2 or values.shape[1] != 3 or len(values) < 2:
            raise DeviceError(f"a gamma table has a red, a green and a blue column; its shape is {values.shape}")
        if not np.all(np.isfinite(values)) or values.min() < 0 or values.max() > 1:
            raise DeviceError("the shares of a gamma table must lie in 0..1")
        if codes is not None:
            at = np.asarray(codes, dtype=np.float64)
            rises = at.shape == (len(values),) and np.all(np.isfinite(at)) and np.all(np.diff(at) > 0)
            if not rises or at[0] != 0 or at[-1] != 1:
                raise DeviceError("the codes of a gamma table must rise from 0 to 1, one for each entry")
            values = _interpolated(values, np.linspace(0.0, 1.0, len(values)), at)
        return cls(np.rint(values * _FULL).astype(np.uint16))

    @property
    def known(self) -> bool:
        """Whether there are entries."""
        return self.entries is not None

    @property
    def size(self) -> int:
        """The number of entries of a channel; 0 if unknown."""
        return 0 if self.entries is None else len(self.entries)

    @property
    def bits(self) -> int:
        """The fewest bits, 8 to 16, that hold every entry; 0 if unknown."""
        return 0 if self.entries is None else self._bits_and_shares[0]

    @property
    def shares(self) -> Floats:
        """The entries as shares of full code, shape (n, 3): the value of `bits` bits that each stands for."""
        if self.entries is None:
            raise DeviceError(f"the gamma table is not known: {self.unknown}")
        return self._bits_and_shares[1]

    @cached_property
    def _bits_and_shares(self) -> tuple[int, Floats]:
        assert self.entries is not None
        bits, shares = _decoded(self.entries)
        shares.flags.writeable = False
        return bits, shares

    @property
    def sha256(self) -> str:
        """The SHA-256 of the size and the shares; two ways to write the same bits in 16 have the same one."""
        if self.entries is None:
            return ""
        rounded = np.rint(self.shares * _FULL).astype(">u2")
        return hashlib.sha256(len(rounded).to_bytes(4, "big") + rounded.tobytes()).hexdigest()

    @property
    def departure_codes(self) -> float:
        """The largest difference of an entry from the identity, in codes of 8 bits; NaN if unknown."""
        return float("nan") if self.entries is None else 255.0 * _departure(self.shares)

    @property
    def step(self) -> float:
        """The step that entries are compared within, as a share of full code; NaN if unknown."""
        return 1.0 / (2 ** min(self.bits, _FINEST_BITS) - 1) if self.known else float("nan")

    @property
    def is_identity(self) -> bool:
        """Whether every entry lies within a step of the code that it stands at; False if unknown."""
        return self.known and _within(_departure(self.shares), self.step)

    def same_as(self, other: GammaTable) -> bool | None:
        """Return whether ``other`` does the same to codes; None if one of the two is not known.

        Identities of any size and rounding are the same. Other tables are compared at the codes of the smaller one.
        """
        if not self.known or not other.known:
            return None
        if self.is_identity or other.is_identity:
            return self.is_identity and other.is_identity
        alike = (self.size, self.bits) == (other.size, other.bits)
        return _within(self.difference_codes(other) / 255.0, self.step if alike else self.step + other.step)

    def difference_codes(self, other: GammaTable) -> float:
        """Return the largest difference of two known tables at the smaller one's codes, in codes of 8 bits."""
        return 255.0 * float(self._differences(other).max())

    def difference_from(self, other: GammaTable) -> str:
        """Return in a phrase by how much, at which code and in which channel this one differs most from ``other``.

        Both must be known.
        """
        apart = self._differences(other)
        entry, channel = (int(place) for place in np.unravel_index(int(np.argmax(apart)), apart.shape))
        code = 255.0 * entry / (len(apart) - 1)
        return (
            f"it differs by up to {255.0 * apart.max():.2f} codes of 8 bits, most at code {code:.3g} of "
            f"{('red', 'green', 'blue')[channel]}"
        )

    def _differences(self, other: GammaTable) -> Floats:
        """Return by which shares two known tables differ at the smaller one's codes, shape (n, 3)."""
        smaller, larger = sorted((self, other), key=lambda table: table.size)
        return np.abs(smaller.shares - larger.at(np.linspace(0.0, 1.0, smaller.size)))

    def at(self, codes: ArrayLike) -> Floats:
        """Return what ``codes`` in 0..1 become, shares of full code.

        Parameters
        ----------
        codes
            Shape (n,) for the three channels alike, or (n, 3). Codes between entries are interpolated.

        Returns
        -------
        ndarray
            Shape (n, 3).
        """
        asked = np.asarray(codes, dtype=np.float64)
        asked = np.repeat(asked[:, None], 3, axis=1) if asked.ndim == 1 else asked
        at = np.linspace(0.0, 1.0, self.size)
        columns = [np.interp(asked[:, channel], at, self.shares[:, channel]) for channel in range(3)]
        return np.stack(columns, axis=1)

    def to_json(self) -> dict[str, Any]:
        """Return what a record holds of it: hash, largest departure, size and, unless it is the identity, entries."""
        if self.entries is None:
            return {"unknown": self.unknown}
        facts = {"hash": self.sha256, "departure_codes": round(self.departure_codes, 3), "size": self.size}
        if self.is_identity:
            return facts
        packed = zlib.compress(self.entries.astype(">u2").T.tobytes(), 9)
        return {**facts, "entries": base64.b64encode(packed).decode("ascii")}

    @classmethod
    def from_json(cls, held: Mapping[str, Any]) -> GammaTable:
        """Return the table of a record; one without entries is the identity of its size.

        Raises
        ------
        DeviceError
            If it cannot be read, or its hash is not that of its entries.
        """
        if "unknown" in held:
            return cls.unreadable(str(held["unknown"]))
        try:
            size, digest = int(held["size"]), str(held["hash"])
        except (KeyError, TypeError, ValueError) as error:
            raise DeviceError("a gamma table needs its size and hash, or why it is unknown") from error
        if not 2 <= size <= _MOST_ENTRIES:
            raise DeviceError(f"a gamma table of {size} entries; 2 to {_MOST_ENTRIES} are possible")
        if "entries" not in held or held["entries"] is None:
            if not cls._near_identity(held.get("departure_codes")):
                raise DeviceError("a gamma table that is not the identity needs its entries")
            return cls.identity(size)
        table = cls(_unpacked(str(held["entries"]), size))
        if table.sha256 != digest:
            raise DeviceError("the hash of the gamma table is not that of its entries; measure again")
        return table

    def to_text(self) -> str:
        """Return the record on one line: ``hash=... departure_codes=... size=... entries=...``, or ``unknown=...``."""
        return " ".join(f"{key}={value}" for key, value in self.to_json().items())

    @classmethod
    def from_text(cls, text: str) -> GammaTable:
        """Return the table of what `to_text` wrote; errors as `from_json`."""
        if text.startswith("unknown="):
            return cls.unreadable(text.removeprefix("unknown=") or "no reason is given")
        held: dict[str, Any] = dict(part.split("=", 1) for part in text.split() if "=" in part)
        try:
            held["departure_codes"] = float(held.get("departure_codes", "nan"))
        except ValueError:
            raise DeviceError("the largest departure of a gamma table is a number") from None
        return cls.from_json(held)

    @staticmethod
    def _near_identity(departure: object) -> bool:
        """Whether a record without entries can be of an identity: no coarser than 8 bits, off by less than a step."""
        return isinstance(departure, int | float) and 0 <= departure < 1

    def sentence(self) -> str:
        """Return what it is, in a phrase."""
        if not self.known:
            return f"unknown ({self.unknown})"
        if self.is_identity:
            return f"the identity ({self.size} entries)"
        return f"not the identity: off by up to {self.departure_codes:.2f} codes of 8 bits ({self.size} entries)"


def _decoded(entries: Entries) -> tuple[int, Floats]:
    """Return the fewest bits that hold all ``entries``, and the shares of full code that these bits stand for."""
    wide = entries.astype(np.uint32)
    for bits in range(_FEWEST_BITS, _ENTRY_BITS):
        highest = 2**bits - 1
        higher, shift = wide >> (_ENTRY_BITS - bits), _ENTRY_BITS - bits
        nearest = np.rint(wide * (highest / _FULL)).astype(np.uint32)
        for value, written in (
            (higher, higher << shift),
            (higher, higher << shift | higher >> (bits - shift)),
            (nearest, np.rint(nearest * (_FULL / highest)).astype(np.uint32)),
        ):
            if np.array_equal(written, wide):
                return bits, value / highest
    return _ENTRY_BITS, wide / _FULL


def _departure(shares: Floats) -> float:
    return float(np.abs(shares - np.linspace(0.0, 1.0, len(shares))[:, None]).max())


def _within(difference: float, step: float) -> bool:
    """Whether two entries are less than a step apart, whatever the last bit of a division says."""
    return difference < step * (1.0 - 1e-9)


def _interpolated(values: Floats, at: Floats, codes: Floats) -> Floats:
    return np.stack([np.interp(at, codes, values[:, channel]) for channel in range(3)], axis=1)


def _unpacked(packed: str, size: int) -> Entries:
    wanted = size * 6
    try:
        unpacking = zlib.decompressobj()
        data = unpacking.decompress(base64.b64decode(packed, validate=True), wanted + 1)
    except (binascii.Error, zlib.error, ValueError) as error:
        raise DeviceError(f"the entries of the gamma table cannot be read: {error}") from error
    if len(data) != wanted:
        raise DeviceError(f"the gamma table does not hold the {size} entries of three channels that it states")
    return np.frombuffer(data, dtype=">u2").astype(np.uint16).reshape(3, size).T.copy()
