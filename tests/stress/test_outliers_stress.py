"""The screen both ways: it finds planted wrong readings on displays of every kind, and drops none of clean ones."""

from __future__ import annotations

import numpy as np
import pytest

from devices.characterise.patches import patches
from documents.arrays import Floats
from tests.devices.characterise.test_outliers import CODES, DISPLAYS, doubted_rows
from tests.example_displays import noisy
from tests.stress.how_many import how_many

pytestmark = pytest.mark.stress

# A reading that is off by so much is to be found.
SEEN_DELTA_E = 3.0


def _planted(kind: str, XYZ: Floats, rng: np.random.Generator) -> tuple[Floats, set[int]]:
    """Return the readings with a fault, and its rows."""
    out, row = XYZ.copy(), int(rng.integers(1, len(XYZ)))
    if kind == "20 % off":
        out[row] *= rng.choice([0.8, 1.2])
        return out, {row}
    if kind == "the patch before":
        out[row] = out[row - 1]
        return out, {row}
    other = int(rng.integers(1, len(XYZ)))
    out[[row, other]] = out[[other, row]]
    return out, {row, other}


@pytest.mark.parametrize("display", DISPLAYS)
def test_clean_displays_lose_none(display: str) -> None:
    dropped = [
        int(doubted_rows(CODES, noisy(DISPLAYS[display](CODES), 0.002 if seed % 2 else 0.005, seed)).sum())
        for seed in range(how_many(6, 16))
    ]
    assert sum(dropped) == 0


@pytest.mark.parametrize("kind", ["20 % off", "the patch before", "swapped rows"])
def test_planted_readings_are_found_and_no_others(kind: str) -> None:
    found, to_find, extra = 0, 0, 0
    for display in DISPLAYS.values():
        true = patches(CODES, display(CODES))
        for seed in range(how_many(2, 5)):
            XYZ, rows = _planted(kind, noisy(true.XYZ, 0.002, seed), np.random.default_rng(seed))
            off = true.delta_e_2000(XYZ)
            seen = {row for row in rows if off[row] >= SEEN_DELTA_E}
            wrong = set(np.flatnonzero(doubted_rows(CODES, XYZ)).tolist())
            found += len(seen & wrong)
            to_find += len(seen)
            extra += len(wrong - rows)
    assert found >= 0.95 * to_find
    assert extra <= 1


@pytest.mark.parametrize("anchor", [0, 26, 52, 78], ids=["black", "red", "green", "blue"])
@pytest.mark.parametrize("display", ["S-shaped", "additive"])
def test_black_and_primaries_go_only_where_all_else_contradicts_them(display: str, anchor: int) -> None:
    XYZ = noisy(DISPLAYS[display](CODES), 0.002, 1)
    XYZ[anchor] = XYZ[119] if anchor == 0 else 0.3 * XYZ[anchor]
    found = doubted_rows(CODES, XYZ)
    assert anchor in np.flatnonzero(found)
    assert found.sum() <= 2


def test_a_fifth_of_wrong_readings_is_found_to_the_last() -> None:
    XYZ = noisy(DISPLAYS["additive"](CODES), 0.002, 1)
    rng = np.random.default_rng(6)
    rows = rng.choice(120, 24, replace=False)
    XYZ[rows] *= rng.uniform(1.5, 3, (24, 3))
    assert np.flatnonzero(doubted_rows(CODES, XYZ)).tolist() == sorted(rows.tolist())
