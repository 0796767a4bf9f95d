"""The start by plain sums against the iteration from near the log odds; one fit on any number of threads."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.scaling import Counts, are_connected, fit, maximise, newton
from documents.arrays import Floats
from documents.blas_threads import set_blas_threads

SLOW = 200  # steps; a limit makes the iteration begin near the log odds


def table(n: int, seed: int, spread: float = 0.7, share: float = 1.0, each: int = 20) -> Floats:
    """Counts of ``each`` answers to a ``share`` of all pairs, and of one loop through all items."""
    random = np.random.default_rng(seed)
    theta = random.normal(0, spread, n)
    first, second = np.triu_indices(n, 1)
    asked = random.random(len(first)) < share
    won = random.binomial(each, 1 / (1 + np.exp(theta[second] - theta[first]))) * asked
    wins = np.zeros((n, n))
    wins[first, second], wins[second, first] = won, each * asked - won
    wins[np.arange(n), np.arange(1, n + 1) % n] += 1
    return wins


@pytest.mark.parametrize(("n", "share"), [(2, 1.0), (3, 1.0), (10, 1.0), (40, 0.2), (100, 1.0)])
def test_it_ends_where_the_slow_way_ends(n: int, share: float) -> None:
    wins = table(n, n, share=share)
    near = newton.plain_maximum(wins)
    assert near is not None
    slow, fast = fit(wins, most_iterations=SLOW), fit(wins)
    assert np.abs(near[0] - slow.theta).max() < 1e-8
    assert np.abs(fast.theta - slow.theta).max() < 1e-12
    assert np.abs(fast.covariance - slow.covariance).max() < 1e-12 * slow.covariance.max()
    assert fast.log_likelihood == pytest.approx(slow.log_likelihood, rel=1e-14)
    assert (fast.converged, slow.converged) == (True, True)
    assert fast.iterations == near[1] + 1


@settings(max_examples=60)
@given(
    n=st.integers(2, 12),
    seed=st.integers(0, 10_000),
    spread=st.floats(0, 6),
    each=st.integers(1, 1000),
    scale=st.sampled_from([1e-3, 1.0, 1e6]),
)
def test_every_finite_fit_is_that_of_the_slow_way(n: int, seed: int, spread: float, each: int, scale: float) -> None:
    """Tables are scaled alike, which moves no maximum; the widest are refused by the start or taken rightly."""
    wins = scale * table(n, seed, spread, each=each)
    if not are_connected(wins[None])[0]:
        return
    slow, fast = fit(wins, most_iterations=SLOW), fit(wins)
    assert slow.converged
    assert fast.converged
    assert np.abs(fast.theta - slow.theta).max() < 1e-10


def test_long_steps_are_refused() -> None:
    wins = np.array([[0, 100, 0, 1], [0, 0, 100, 0], [0, 0, 0, 100], [1e-6, 0, 0, 0]])
    assert newton.plain_maximum(wins) is None
    assert fit(wins).converged


def test_a_table_that_is_not_plain_begins_near_the_log_odds(monkeypatch: pytest.MonkeyPatch) -> None:
    taken = []
    monkeypatch.setattr("analysis.scaling.newton.plain_maximum", lambda wins: taken.append(len(wins)))
    wins = table(6, 1)
    maximise(Counts.from_wins(np.stack([wins, wins])))
    fit(wins, method="firth")
    fit(wins, most_iterations=5)
    assert not taken
    fit(wins)
    assert taken == [6]


@pytest.mark.usefixtures("blas_threads_kept")
def test_a_fit_is_the_same_on_any_number_of_threads() -> None:
    wins = table(180, 4)
    found = set()
    for threads in (1, 2, 4):
        set_blas_threads(threads)
        fitted = fit(wins)
        found.add(fitted.theta.tobytes() + fitted.covariance.tobytes())
    assert len(found) == 1
