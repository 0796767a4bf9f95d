"""Tables of a profile: what they give is what LittleCMS gives, and damaged ones are refused."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from devices.errors import DeviceError
from devices.profiles.colour_table import read_table
from devices.profiles.tag_table import Tag
from tests.devices.profiles.little_cms import through
from tests.devices.profiles.profile_bytes import CHAD, curv, para, profile, s15

RNG = np.random.default_rng(1)
CODES = np.concatenate([RNG.random((400, 3)), np.eye(3), np.zeros((1, 3)), np.ones((1, 3))])


def _smooth_grid(shape: tuple[int, int, int]) -> np.ndarray:
    """Return a grid (r, g, b, 3) of 0..1 that rises with all channels, with some noise."""
    axes = np.meshgrid(*(np.linspace(0, 1, points) for points in shape), indexing="ij")
    colours = np.stack([0.3 * axes[0] + 0.2 * axes[1] + 0.1, 0.6 * axes[1] + 0.2, 0.5 * axes[2] + 0.1 * axes[0]], -1)
    return np.asarray(colours + 0.1 * np.random.default_rng(2).random(colours.shape))


def _in_a_row(size: int) -> bytes:
    """Return ``mft1`` or ``mft2`` with a grid of 5 points."""
    full, form = (255, "B") if size == 1 else (65535, "H")
    n, m = (256, 256) if size == 1 else (17, 33)
    first = np.linspace(0, 1, n) ** 1.4
    last = np.linspace(0, 1, m) ** 0.9
    values = np.concatenate([np.tile(first, 3), _smooth_grid((5, 5, 5)).ravel(), np.tile(last, 3)])
    head = (b"mft1" if size == 1 else b"mft2") + b"\0\0\0\0" + bytes([3, 3, 5, 0])
    head += s15(1, 0, 0, 0, 1, 0, 0, 0, 1) + (b"" if size == 1 else struct.pack(">HH", n, m))
    return head + struct.pack(f">{values.size}{form}", *np.rint(values * full).astype(int).tolist())


def _by_offsets(shape: tuple[int, int, int], size: int, *, matrix: bool) -> bytes:
    """Return ``mAB `` with curves of several kinds."""
    full, form = (255, "B") if size == 1 else (65535, "H")
    grid = np.rint(_smooth_grid(shape) * full).astype(int).ravel().tolist()
    last = curv() * 3
    middle = para(0, 1.1) * 3
    rows = s15(0.8, 0.1, 0, 0, 0.9, 0.05, 0.1, 0, 0.7, 0.01, 0.02, 0.0)
    clut = bytes([*shape, *[0] * 13, size, 0, 0, 0]) + struct.pack(f">{len(grid)}{form}", *grid)
    clut += b"\0" * (-len(clut) % 4)
    first = curv(*(round(65535 * (i / 63) ** 1.7) for i in range(64))) * 3
    parts, at = [last, rows if matrix else b"", middle if matrix else b"", clut, first], 32
    offsets = []
    for part in parts:
        offsets.append(at if part else 0)
        at += len(part)
    return b"mAB \0\0\0\0" + bytes([3, 3, 0, 0]) + struct.pack(">5I", *offsets) + b"".join(parts)


TABLES = {
    "8 bits": _in_a_row(1),
    "16 bits": _in_a_row(2),
    "mAB": _by_offsets((5, 4, 6), 2, matrix=True),
    "mAB, 8 bits, no matrix": _by_offsets((3, 3, 3), 1, matrix=False),
}


# XYZ have no coding in 8 bits.
@pytest.mark.parametrize(
    ("name", "pcs"),
    [(name, pcs) for name in TABLES for pcs in (b"XYZ ", b"Lab ") if (name, pcs) != ("8 bits", b"XYZ ")],
)
def test_a_table_gives_what_littlecms_gives(name: str, pcs: bytes) -> None:
    tag = TABLES[name]
    chad = b"sf32\0\0\0\0" + s15(*CHAD)
    wanted = through(profile({"A2B0": tag, "chad": chad}, pcs=pcs), CODES)
    found = read_table(Tag("display.icc", "A2B0", tag), pcs.decode().strip()).xyz(CODES)
    # LittleCMS keeps sampled curves in 16 bits.
    assert np.abs(found - wanted).max() < 1.5e-4
    assert np.abs(found).max() > 0.3


@pytest.mark.parametrize(
    ("tag", "words"),
    [
        (b"mft2\0\0\0\0\x04\x03\x05\0", "leads from 4 channels to 3"),
        (b"mft2\0\0\0\0\x03\x03\x01\0", "grid of 1 points"),
        (b"mft2\0\0\0\0\x03\x03\x05\0" + b"\0" * 40, "curves of 0 entries"),
        (b"mft1\0\0\0\0\x03\x03\xff\0" + b"\0" * 40, "needs 816 bytes"),
        (b"mft1\0\0\0\0\x03\x03\xff\0" + b"\0" * 900, "needs 49744941 bytes and has 912"),
        (b"curv\0\0\0\0", "type 'curv'"),
        (b"mAB \0\0\0\0\x03\x03\0\0" + b"\0" * 20, "no curves at its end"),
        (b"mAB \0\0\0\0\x03\x03\0\0" + struct.pack(">5I", 32, 0, 0, 32, 0) + curv() * 3, "grid without curves"),
        (b"mAB \0\0\0\0\x03\x03\0\0" + struct.pack(">5I", 2**32 - 1, 0, 0, 0, 0), "needs 4294967299 bytes"),
        (
            b"mAB \0\0\0\0\x03\x03\0\0" + struct.pack(">5I", 32, 0, 0, 68, 32) + curv() * 3 + b"\xff" * 3 + b"\0" * 17,
            "255x255x255 points in numbers of 0 bytes",
        ),
    ],
)
def test_a_damaged_table_is_refused(tag: bytes, words: str) -> None:
    with pytest.raises(DeviceError) as caught:
        read_table(Tag("display.icc", "A2B0", tag), "Lab").xyz(CODES)
    assert words in str(caught.value)
