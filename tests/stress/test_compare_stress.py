"""Comparisons pressed to their edges: 36 megapixels within 2 GB, many shifts and turns, pictures at random."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from documents import InputError
from stimuli.comparison.registering import align
from stimuli.pictures import RowFile
from tests.stimuli.comparison.scenes import PLATE, RIG, spots, written
from tests.stress.memory import command_alone

pytestmark = pytest.mark.stress


def test_thirty_six_megapixels_in_two_gigabytes(tmp_path: Path) -> None:
    """A pair as large as a D800's pictures, with page, both maps and sparkle; shifted, every row is interpolated.

    The right picture is the left one three pixels aside.
    """
    shift_px = 0.4
    tile = spots(size=(736, 491), count=4000)
    moved = spots(shift_px, size=(736, 491), count=4000)
    files = []
    for name, one in (("a", tile), ("b", moved)):
        whole = np.tile(one, (10, 10, 1))
        # Tiles alone would fit at many shifts: light falls off, and a coarse pattern tells them apart.
        coarse = np.random.default_rng(4).uniform(0.6, 1.4, (10, 10))
        for row in range(10):
            for column in range(10):
                whole[row * 491 : (row + 1) * 491, column * 736 : (column + 1) * 736] *= np.float32(coarse[row, column])
        files.append(written(tmp_path / f"{name}.exr", whole, np.roll(whole, 3, axis=1)))
    del whole
    words = ["compare", *map(str, files), "--regions", str(PLATE), "--rig", str(RIG), "-o", "o.html", "--json"]
    said, _, peak_mb = command_alone(*words, cwd=tmp_path)
    assert peak_mb * 2**20 <= 2e9
    found = json.loads(said)
    assert len(found["eyes"]) == 2
    for eye in found["eyes"].values():
        assert eye["registration"]["shift_px"] == pytest.approx([shift_px, 0.0], abs=0.02)


@pytest.mark.parametrize("seed", range(40))
def test_any_shift_and_turn_is_found_or_refused(seed: int) -> None:
    """Never a wrong place: what comes back is right to a twentieth of a pixel, or an error says that it is unknown."""
    rng = np.random.default_rng(seed)
    dx, dy = rng.uniform(-40, 40, 2)
    angle = float(rng.choice([0.0, rng.uniform(-1, 1), rng.uniform(-45, 45)]))
    noise = float(rng.choice([0.0, 0.02, 0.2]))
    pair = [
        spots(seed=seed, size=(320, 260)),
        spots(dx, dy, angle, seed=seed, size=(320, 260), gain=rng.uniform(0.1, 9)),
    ]
    noisy = [np.maximum(one * (1 + noise * rng.standard_normal(one.shape)), 0).astype(np.float32) for one in pair]
    try:
        found = align(RowFile.of(noisy[0]), RowFile.of(noisy[1]), "auto")
    except InputError:
        assert noise > 0.1 or abs(angle) > 20 or np.hypot(dx, dy) > 30
        return
    allowed = 0.05 if noise < 0.1 else 0.2
    assert found.shift_px == pytest.approx((dx, dy), abs=allowed)
    assert found.rotation_deg == pytest.approx(angle, abs=0.05)
    assert found.residual_px is not None
    assert found.residual_px < (0.1 if noise < 0.1 else 0.25)


@pytest.mark.parametrize("seed", range(30))
def test_nothing_in_common_is_refused(seed: int) -> None:
    one, two = spots(seed=seed, size=(320, 260)), spots(seed=seed + 100, size=(320, 260))
    with pytest.raises(InputError):
        align(RowFile.of(one), RowFile.of(two), "auto")
