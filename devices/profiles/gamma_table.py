"""The graphics card's gamma table that a profile carries (``vcgt``): calibration programs load it with the profile.

Apple's tag, which ICC never took up: a table of one or three channels in 8 or 16 bits, or gamma, least and most of each
channel.
"""

from __future__ import annotations

import numpy as np

from devices.display import GammaTable
from devices.profiles.tag_table import Tag

_MOST_ENTRIES = 65536
# Channels, entries, bytes of each and of the tag, as a program of Adobe's says it of entries of two bytes, which is how
# LittleCMS reads them.
_ADOBE = (3, 256, 1, 1576)
# A formula becomes a table of so many entries, as large as any graphics card's.
_FORMULA_ENTRIES = 4096


def read_gamma_table(tag: Tag) -> GammaTable:
    """Return the gamma table in the tag ``vcgt``.

    Raises
    ------
    DeviceError
        If the tag is of another type or size, or a formula leaves 0..1.
    """
    if tag.type != "vcgt":
        raise tag.wrong_type("'vcgt'")
    kind = tag.whole(8, "I")
    if kind == 0:
        return _table(tag)
    if kind == 1:
        return _formula(tag)
    raise tag.error(f"is of the kind {kind}", "0, a table, or 1, a formula, is needed")


def _table(tag: Tag) -> GammaTable:
    channels, entries, size = (tag.whole(at, "H") for at in (12, 14, 16))
    what = f"says that it has {channels} channels of {entries} entries of {size} bytes"
    if channels not in (1, 3) or size not in (1, 2) or not 2 <= entries <= _MOST_ENTRIES:
        raise tag.error(what, "1 or 3 channels, 2 entries or more, and 1 or 2 bytes are possible")
    if (channels, entries, size, len(tag.data)) == _ADOBE:
        size = 2
    wanted, there = channels * entries * size, len(tag.data) - 18
    # What fills up the tag behind the table is not looked at. As much again behind entries of one byte is no filling:
    # they have two then.
    if there < wanted or (size == 1 and there >= 2 * wanted):
        remedy = f"{wanted} bytes belong to that; load the calibration with its own program and save the profile again"
        raise tag.error(f"{what}, and holds {there} bytes of them", remedy)
    if size == 1:
        values = tag.u8(18, channels * entries).astype(np.uint16) * np.uint16(257)
    else:
        values = tag.u16(18, channels * entries)
    columns = values.reshape(channels, entries).T
    return GammaTable(np.repeat(columns, 3, axis=1) if channels == 1 else columns)


def _formula(tag: Tag) -> GammaTable:
    numbers = tag.fixed(12, 9).reshape(3, 3)
    if not (np.all(numbers[:, 0] > 0) and np.all((numbers[:, 1:] >= 0) & (numbers[:, 1:] <= 1))):
        rows = "; ".join("gamma {:g}, least {:g}, most {:g}".format(*row) for row in numbers.tolist())
        raise tag.error(f"holds {rows}", "gamma above 0, least and most in 0..1 are needed")
    codes = np.linspace(0.0, 1.0, _FORMULA_ENTRIES)
    columns = [least + (most - least) * codes**gamma for gamma, least, most in numbers.tolist()]
    return GammaTable.from_shares(np.stack(columns, axis=1))
