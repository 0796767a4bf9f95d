"""The screen finds wrong readings on displays of every kind, and drops none where none is wrong."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.characterise import outliers, table_c1_codes, thesis_display
from devices.characterise.outliers import screen
from devices.display import DisplayModel, Plvc, TableCurve
from documents.arrays import Floats
from tests.example_displays import liquid_crystal_XYZ, noisy

CODES = table_c1_codes()
PRIMARIES = np.array([[41.2, 35.8, 18.0], [21.3, 71.5, 7.2], [1.9, 11.9, 95.0]])


def s_shaped(steepness: float = 8.0) -> DisplayModel:
    """An additive panel whose curve is a logistic one, which no GOG follows."""
    x = np.linspace(0.0, 1.0, 65)
    light = 1.0 / (1.0 + np.exp(-steepness * (x - 0.55)))
    light = np.maximum((light - light[0]) / (light[-1] - light[0]), 1e-6 * x)
    curve = TableCurve(tuple(x.tolist()), tuple(light.tolist()))
    return DisplayModel(0.002 * PRIMARIES.sum(axis=1), PRIMARIES, (curve, curve, curve))


def plvc(seed: int = 3) -> Plvc:
    """A panel with that curve whose channels change colour with their level and take light from each other."""
    rng, model = np.random.default_rng(seed), s_shaped(6.0)
    own = PRIMARIES.T[:, None] * (1.0 + 0.03 * rng.uniform(-1, 1, (3, 4, 3)))
    mixtures = 0.02 * rng.uniform(-1, 1, (10, 3)) * PRIMARIES.sum(axis=1)
    return Plvc(model.black_XYZ_cd_m2, PRIMARIES, model.curves, own, mixtures)


DISPLAYS: dict[str, Callable[[Floats], Floats]] = {
    "S-shaped": s_shaped().xyz,
    "steeply S-shaped": s_shaped(12.0).xyz,
    "PLVC": plvc().xyz,
    "interaction": liquid_crystal_XYZ,
    "additive": thesis_display().xyz,
}


def doubted_rows(codes: Floats, XYZ: Floats) -> NDArray[np.bool_]:
    """Return which readings are wrong (n,); a residual that only the choice of a model needs is not fitted."""
    return screen(codes, XYZ, 1, residual=False).wrong


# Every fault on every display, more noise and other seeds: tests/stress.
@pytest.mark.parametrize(
    "display",
    [
        pytest.param(name, marks=pytest.mark.nightly if name == "interaction" else pytest.mark.stress)
        for name in DISPLAYS  # that the others lose none but the wrong one, the tests below tell
    ],
)
def test_a_clean_display_loses_no_reading(display: str) -> None:
    assert not doubted_rows(CODES, noisy(DISPLAYS[display](CODES), 0.002, 0)).any()


def test_one_reading_off_by_a_fifth_is_found_and_no_other() -> None:
    XYZ = noisy(DISPLAYS["PLVC"](CODES), 0.002, 1)
    XYZ[49] *= 0.8
    assert np.flatnonzero(doubted_rows(CODES, XYZ)).tolist() == [49]


@pytest.mark.nightly
def test_what_a_repeat_confirms_stays() -> None:
    codes = np.concatenate([CODES, CODES[[49, 49]]])
    XYZ = noisy(DISPLAYS["additive"](codes), 0.002, 1)
    XYZ[[49, 120, 121]] *= 0.8  # the display is so there, whatever the models think of it
    assert not doubted_rows(codes, XYZ).any()


@pytest.mark.nightly
def test_what_a_repeat_contradicts_goes() -> None:
    codes = np.concatenate([CODES, CODES[[49]]])
    XYZ = noisy(DISPLAYS["additive"](codes), 0.002, 1)
    XYZ[49] *= 0.8
    assert np.flatnonzero(doubted_rows(codes, XYZ)).tolist() == [49]


@pytest.mark.nightly
def test_a_screen_that_goes_round_in_circles_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = 0

    codes = CODES[np.union1d(np.arange(0, 120, 4), [26, 52, 78, 119])]

    def doubted(*_: object) -> NDArray[np.bool_]:
        nonlocal asked
        asked += 1
        return np.asarray((np.arange(len(codes)) == 19) & (asked % 2 == 1))

    monkeypatch.setattr(outliers, "doubted", doubted)
    assert not doubted_rows(codes, noisy(thesis_display().xyz(codes), 0.002, 1)).any()
    assert asked == 3
