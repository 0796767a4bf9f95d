"""Individual observers: the average is that of CIE 170, persons scatter as published, and the seed fixes them."""

from __future__ import annotations

import numpy as np
import pytest

from devices.colour_matching import (
    Departure,
    categorical_observers,
    colorimetric_observer,
    individual_observer,
    individual_observers,
)
from devices.colour_matching.cone_fundamentals import quantal_fundamentals
from devices.errors import DeviceError


@pytest.mark.parametrize("field_deg", [2.0, 10.0])
def test_nobody_in_particular_at_32_is_the_observer_of_cie_170(field_deg: float) -> None:
    average = individual_observer("average", field_deg, 32, Departure())
    published = colorimetric_observer(f"CIE 2015 {field_deg:g}")
    assert np.abs(average.functions - published.functions).max() < 3e-5
    assert average.efficacy_lm_W == pytest.approx(published.efficacy_lm_W, rel=3e-5)


def test_the_seed_fixes_the_persons_and_more_persons_begin_with_the_same() -> None:
    few, many = individual_observers(3, 10, seed=5), individual_observers(6, 10, seed=5)
    for one, other in zip(few, many, strict=False):
        assert one == other
        np.testing.assert_array_equal(one.functions, other.functions)
    assert not np.array_equal(few[0].functions, individual_observers(1, 10, seed=6)[0].functions)


@pytest.mark.nightly
def test_persons_scatter_about_the_average() -> None:
    persons = individual_observers(400, 10, ages_years=(32, 32), seed=2)
    functions = np.array([person.functions for person in persons])
    average = colorimetric_observer("CIE 2015 10").functions
    assert np.abs(functions.mean(axis=0) - average).max() < 0.03
    scatter = functions.std(axis=0).max(axis=0)
    assert np.all(scatter > 0.02)
    assert np.all(scatter < 0.25)
    # Light of equal energy looks the same to all by the scaling.
    areas = functions.sum(axis=1)
    np.testing.assert_allclose(areas, np.broadcast_to(areas[0], areas.shape), rtol=1e-9)


def test_departures_act_where_they_should() -> None:
    plain = np.log10(quantal_fundamentals(10, 32)[:, :2])
    lens = np.log10(quantal_fundamentals(10, 32, Departure(lens=0.5))[:, :2])
    assert lens[10, 1] - plain[10, 1] < -0.5
    assert lens[300, 1] == pytest.approx(plain[300, 1], abs=1e-9)
    macula = np.log10(quantal_fundamentals(10, 32, Departure(macula=1.0))[:, :2])
    assert macula[68, 1] - plain[68, 1] == pytest.approx(-0.095, abs=0.004)
    # A pigment of shifted absorbance, thin enough that density plays no part, is the pigment shifted.
    thin = {"density_L": -0.99, "density_M": -0.99, "density_S": -0.99}
    still = quantal_fundamentals(10, 32, Departure(**thin))
    moved = quantal_fundamentals(10, 32, Departure(**thin, shift_L_nm=3.0))
    medium = quantal_fundamentals(10, 32, Departure(**thin))[:, 1]
    np.testing.assert_array_equal(moved[:, 1], medium)
    # No medium absorbs there.
    assert moved[290:380, 0] == pytest.approx(still[287:377, 0], rel=1e-6)


def test_ten_categories() -> None:
    categories = categorical_observers(2)
    assert len({observer.name for observer in categories}) == 10
    first = individual_observer("", 2, 38, Departure())
    np.testing.assert_allclose(categories[0].functions, first.functions, rtol=1e-12)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: individual_observers(0, 10),
        lambda: individual_observers(1, 0.5),
        lambda: individual_observers(1, 10, ages_years=(10, 30)),
        lambda: individual_observers(1, 10, ages_years=(40, 30)),
        lambda: individual_observer("x", 10, 32, Departure(macula=-1.5)),
        lambda: individual_observer("x", 10, 32, Departure(density_M=-1.0)),
        lambda: individual_observer("x", 10, 32, Departure(shift_L_nm=float("nan"))),
    ],
)
def test_what_is_out_of_range_is_refused(wrong: object) -> None:
    assert callable(wrong)
    with pytest.raises(DeviceError):
        wrong()
