"""The readings that a fit is given, with the white that they are judged against and how a difference looks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.characterise.metric import difference_roots, lab_slopes
from devices.colour.ciede2000 import delta_e_2000
from devices.colour.spaces import xyz_to_lab
from documents.arrays import Floats


@dataclass(frozen=True, slots=True, eq=False)
class Patches:
    """``codes`` (n, 3) in 0..1, ``XYZ`` (n, 3), ``black`` (3,) and ``white`` (3,) in one unit, and ``lab`` (n, 3).

    ``black`` is the mean reading at code 0, or zero where none was taken. ``roots`` (n, 3, 3): |root · ΔLab| ≈ ΔE00.
    """

    codes: Floats
    XYZ: Floats
    black: Floats
    white: Floats
    lab: Floats
    roots: Floats

    def __len__(self) -> int:
        return len(self.codes)

    @property
    def count(self) -> int:
        """How many there are."""
        return len(self)

    @property
    def black_read(self) -> Floats | None:
        """The mean reading at code 0, (3,); None where none was taken."""
        return self.black if np.any(np.all(self.codes == 0, axis=1)) else None

    def select(self, rows: NDArray[np.intp]) -> Patches:
        """Return the patches of ``rows``; black and white stay."""
        return Patches(self.codes[rows], self.XYZ[rows], self.black, self.white, self.lab[rows], self.roots[rows])

    def residuals(self, XYZ: Floats) -> Floats:
        """Return root · (Lab of ``XYZ`` − Lab measured), shape (n, 3)."""
        return np.asarray(np.einsum("nij,nj->ni", self.roots, xyz_to_lab(XYZ, self.white) - self.lab))

    def slopes(self, XYZ: Floats) -> Floats:
        """Return the derivatives of `residuals` by XYZ, shape (n, 3, 3)."""
        return np.asarray(self.roots @ lab_slopes(XYZ, self.white))

    def delta_e_2000(self, XYZ: Floats) -> Floats:
        """Return ΔE00 (n,) between ``XYZ`` (n, 3) and what was measured."""
        return delta_e_2000(xyz_to_lab(XYZ, self.white), self.lab)

    def apart_delta_e_2000(self, row: int, others: NDArray[np.intp]) -> Floats:
        """Return by how much the readings ``others`` differ from that of ``row``."""
        return delta_e_2000(self.lab[others], self.lab[row])


def patches(codes: Floats, XYZ: Floats, white: Floats | None = None) -> Patches:
    """Return readings, shapes (n, 3) and (n, 3), ready to fit. Readings below zero are kept as they are.

    Where ``white`` is None it is the mean reading at full drive of all channels, or the sum of the channels' own where
    there is none.
    """
    dark = np.all(codes == 0, axis=1)
    black = XYZ[dark].mean(axis=0) if dark.any() else np.zeros(3)
    full = np.all(codes == 1, axis=1)
    if white is None:
        white = XYZ[full].mean(axis=0) if full.any() else black + primaries_at_full(codes, XYZ, black).sum(axis=1)
    lab = xyz_to_lab(XYZ, white)
    return Patches(codes, XYZ, black, white, lab, difference_roots(lab))


def primaries_at_full(codes: Floats, XYZ: Floats, black: Floats) -> Floats:
    """Return thesis Expression 3.10, (3, 3): each channel alone at its highest code, minus black.

    Where the highest code of a channel alone is below 1 its light is a little less than full; a channel that was never
    alone gives zeros.
    """
    out = np.zeros((3, 3))
    for channel in range(3):
        alone = (codes[:, channel] > 0) & np.all(np.delete(codes, channel, axis=1) == 0, axis=1)
        if alone.any():
            top = codes[alone, channel].max()
            out[:, channel] = XYZ[alone & (codes[:, channel] == top)].mean(axis=0) - black
    return out
