"""Each law's chances and derivatives, against their definitions and finite differences."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.stats import norm

from analysis.scaling import Counts, Probit
from analysis.scaling.laws import Davidson, Law, Logistic, RaoKupper

LAWS: list[Law] = [Logistic(), Probit(), Davidson(), RaoKupper()]
number = st.floats(0, 50)


def cell(won: float, lost: float, tied: float) -> Counts:
    first, second = np.array([0]), np.array([1])
    return Counts(2, first, second, np.array([[won]]), np.array([[lost]]), np.array([[tied]]))


def likelihood(law: Law, cells: Counts, d: float, k: float) -> float:
    return float(law.log_likelihood(cells, np.array([[d]]), k)[0, 0])


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
@given(d=st.floats(-8, 8), k=st.floats(0.05, 3), won=number, lost=number, tied=number)
def test_derivatives_are_those_of_the_likelihood(
    law: Law, d: float, k: float, won: float, lost: float, tied: float
) -> None:
    cells = cell(won, lost, tied if law.parameter else 0.0)
    slopes = law.slopes(cells, np.array([[d]]), k)
    h = 1e-6
    by_d = (likelihood(law, cells, d + h, k) - likelihood(law, cells, d - h, k)) / (2 * h)
    assert slopes.d[0, 0] == pytest.approx(by_d, rel=1e-5, abs=1e-4)
    up, down = (law.slopes(cells, np.array([[d + step]]), k) for step in (h, -h))
    assert slopes.dd[0, 0] == pytest.approx(-(up.d[0, 0] - down.d[0, 0]) / (2 * h), rel=1e-5, abs=1e-4)
    if law.parameter:
        by_k = (likelihood(law, cells, d, k + h) - likelihood(law, cells, d, k - h)) / (2 * h)
        assert slopes.k[0, 0] == pytest.approx(by_k, rel=1e-4, abs=1e-3)
        assert slopes.dk[0, 0] == pytest.approx(-(up.k[0, 0] - down.k[0, 0]) / (2 * h), rel=1e-5, abs=1e-4)
        above, below = (law.slopes(cells, np.array([[d]]), k + step) for step in (h, -h))
        assert slopes.kk[0, 0] == pytest.approx(-(above.k[0, 0] - below.k[0, 0]) / (2 * h), rel=1e-4, abs=1e-3)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
@given(d=st.floats(-30, 30), k=st.floats(0.01, 3))
def test_chances_sum_to_one_and_turn_round_with_the_items(law: Law, d: float, k: float) -> None:
    chances = np.concatenate(law.probabilities(np.array([d]), k))
    turned = np.concatenate(law.probabilities(np.array([-d]), k))
    assert chances.sum() == pytest.approx(1, abs=1e-12)
    assert (chances >= 0).all()
    assert turned == pytest.approx(chances[[1, 0, 2]], rel=1e-12)
    for outcome, chance in enumerate(chances.tolist()):
        if chance > 0:
            counts = [0.0, 0.0, 0.0]
            counts[outcome] = 1
            assert likelihood(law, cell(*counts), d, k) == pytest.approx(np.log(chance), rel=1e-9, abs=1e-12)


def test_the_laws_are_as_published() -> None:
    """π_i = 3, π_j = 1, ν = 0.5, η = 2."""
    d = np.array([np.log(3)])
    assert np.concatenate(Davidson().probabilities(d, np.log(0.5))) == pytest.approx(
        np.array([3, 1, 0.5 * np.sqrt(3)]) / (4 + 0.5 * np.sqrt(3))
    )
    first, second = 3 / (3 + 2), 1 / (1 + 6)
    assert np.concatenate(RaoKupper().probabilities(d, np.log(2))) == pytest.approx([first, second, 1 - first - second])
    assert Probit().probabilities(d, 0.0)[0] == pytest.approx(norm.cdf(np.log(3)))
    assert Logistic().probabilities(d, 0.0)[0] == pytest.approx(0.75)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_far_apart_the_information_keeps_its_digits(law: Law) -> None:
    """One surprising answer at 30: the slope of log p by d is 1 (logistic) or about d (probit)."""
    d: NDArray[np.float64] = np.array([[30.0]])
    slopes = law.slopes(cell(0, 1, 0), d, 0.7)
    assert np.isfinite(slopes.d).all()
    assert slopes.d[0, 0] == pytest.approx(-30.0332 if isinstance(law, Probit) else -1, rel=1e-4)
    assert slopes.dd[0, 0] > 0


def test_an_impossible_threshold_is_infinitely_unlikely() -> None:
    assert likelihood(RaoKupper(), cell(1, 1, 1), 0.0, -0.1) == -np.inf
