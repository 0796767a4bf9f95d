"""Intervals against scipy's bootstrap, by hand, and in what must always hold."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from analysis.bootstrap import intervals, resample, tails
from analysis.bootstrap.confidence_intervals import KINDS, Kind
from analysis.bootstrap.influence import influences, standard_errors
from analysis.bootstrap.replicates import NAMES, Name, Quantity
from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.errors import ResultsError
from analysis.scaling import fit
from documents.arrays import Floats

Study = Callable[..., Comparisons]
STRENGTHS = (-0.8, -0.2, 0.1, 0.9)


@pytest.mark.promise("believable-scores")
def test_bca_is_that_of_scipy(study: Study) -> None:
    """The same replicates handed to scipy; its quantiles interpolate otherwise, by less than a rank."""
    found = resample(study(STRENGTHS, observers=20), replicates=4000)
    for item in (0, 3):

        def statistic(drawn: Floats, axis: int = -1) -> Floats:
            picked = drawn.astype(int)
            rows = picked.reshape(-1, picked.shape[-1])
            thetas = [fit(found.by_observer[row].sum(axis=0)).theta[item] for row in rows]  # noqa: B023 called at once
            return np.array(thetas).reshape(picked.shape[:-1])

        known = stats.bootstrap((np.arange(20.0),), statistic, n_resamples=600, vectorized=True, rng=5, method="BCa")
        ours = intervals(found, kind="bca")
        width = ours.high[item] - ours.low[item]
        assert ours.low[item] == pytest.approx(known.confidence_interval.low, abs=0.1 * width)
        assert ours.high[item] == pytest.approx(known.confidence_interval.high, abs=0.1 * width)


def test_bca_levels_by_hand() -> None:
    """No bias, no acceleration: nothing moves. Bias of 0.1 in z: 2 · 0.1 − 1.96 and 2 · 0.1 + 1.96."""
    none, some = np.array([0.0]), np.array([0.1])
    even, above = np.array([0.5]), np.asarray(stats.norm.cdf([0.1]))
    assert tails.bias_corrected(0.025, even, none) == pytest.approx([0.025])
    assert tails.bias_corrected(0.025, above, none) == pytest.approx(stats.norm.cdf([0.2 + stats.norm.ppf(0.025)]))
    z = stats.norm.ppf(0.975)
    assert tails.bias_corrected(0.975, even, some) == pytest.approx([stats.norm.cdf(z / (1 - 0.1 * z))])
    assert tails.bias_corrected(0.975, even, np.array([0.6])).tolist() == [1.0]
    assert tails.acceleration(np.array([[1.0, 0], [2, 0], [6, 0]])) == pytest.approx([(8 + 1 - 27) / 6 / 14**1.5, 0])


def test_widened_levels_make_up_for_few_observers() -> None:
    assert tails.widened(0.025, 15) == pytest.approx(stats.norm.cdf(np.sqrt(15 / 14) * stats.t.ppf(0.025, 14)))
    assert tails.widened(0.025, 10**6) == pytest.approx(0.025, abs=1e-5)


def test_replicates_without_a_value_lie_on_both_sides() -> None:
    values = np.arange(1.0, 90.0)[:, None]  # 89 values and 10 without: ranks of 99
    level = np.array([0.25])
    assert tails.lower(values, level, 10).tolist() == [15]  # rank 25, of which 10 lie below all
    assert tails.upper(values, 1 - level, 10).tolist() == [75]
    assert tails.lower(values, np.array([0.05]), 10).tolist() == [-np.inf]
    assert tails.upper(values, np.array([0.95]), 10).tolist() == [np.inf]
    assert tails.lower(values, np.array([0.001]), 0).tolist() == [1]
    assert tails.upper(values, np.array([0.999]), 0).tolist() == [89]
    assert tails.lower(np.empty((0, 1)), level, 5).tolist() == [-np.inf]
    endless = np.array([[-np.inf], [-np.inf], [0], [np.inf]])
    for rank, expected in ((1.5, -np.inf), (3, 0), (3.5, np.inf), (4, np.inf)):
        assert tails.upper(endless, np.array([rank / 5]), 0).tolist() == [expected]


def test_a_weak_link_leaves_intervals_open() -> None:
    """One draw in eight does not link c to the others: more than an interval of 95 % leaves outside on a side."""
    answers = [Answer("a", "b", observer="1"), Answer("b", "a", observer="2")]
    answers += [Answer("b", "c", observer="3"), Answer("c", "b", observer="4")]
    found = resample(from_answers(answers), replicates=400)
    for kind in ("percentile", "expanded", "bca", "expanded-bca", "studentised"):
        open_ended = intervals(found, "difference", kind=kind)
        assert np.isneginf(open_ended.low).all()
        assert np.isposinf(open_ended.high).all()
    assert intervals(found).without_fit > 0
    assert intervals(found).to_json()["intervals"][0]["low"] is None
    assert intervals(found, "score").low.tolist() == [0, 0, 0]


def test_separated_answers_reach_as_far_as_the_models_interval() -> None:
    """Item a wins every comparison of every observer: no draw tells how far ahead it is."""
    answers = [Answer("a", other, observer=str(person)) for person in range(8) for other in "bc"]
    answers += [Answer("b", "c", observer=str(person)) for person in range(0, 8, 2)]
    answers += [Answer("c", "b", observer=str(person)) for person in range(1, 8, 2)]
    found = resample(from_answers(answers), method="firth")
    assert found.whole_separated
    assert found.separated.all()
    model = intervals(found, kind="model")
    for kind in KINDS:
        ours = intervals(found, kind=kind)
        assert (ours.low <= model.low).all()
        assert (ours.high >= model.high).all()
        assert ours.whole_separated


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("quantity", NAMES)
def test_what_must_hold_of_every_interval(
    study: Study, kind: Kind, quantity: Name, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = resample(study(STRENGTHS, observers=20), replicates=300)
    narrow, wide = (intervals(found, quantity, kind=kind, level=level) for level in (0.5, 0.95))
    monkeypatch.setattr("analysis.bootstrap.confidence_intervals.BLOCK_NUMBERS", 1)
    blocks = intervals(found, quantity, kind=kind)
    assert (wide.low <= narrow.low).all()
    assert (narrow.low < narrow.high).all()
    assert (narrow.high <= wide.high).all()
    assert blocks.low == pytest.approx(wide.low, abs=1e-12)
    assert len(wide.names) == len(wide.low) == (6 if quantity == "difference" else 4)
    if quantity == "score":
        assert (wide.low >= 0).all()
        assert (wide.high <= 1).all()
    assert [row["items"] for row in wide.to_json()["intervals"]] == [list(names) for names in wide.names]


@given(st.sampled_from(NAMES), st.lists(st.floats(-3, 3), min_size=3, max_size=5))
def test_slopes_are_those_of_the_values(name: Name, strengths: list[float]) -> None:
    theta = np.array(strengths)
    quantity = Quantity.of_items(name, len(theta))
    steps = np.eye(len(theta))
    found = quantity.slopes(theta[None], steps[None])[0]
    for step, slope in zip(steps, found, strict=True):
        numeric = (quantity.values(theta + 1e-5 * step) - quantity.values(theta - 1e-5 * step)) / 2e-5
        assert slope == pytest.approx(numeric, abs=1e-8)


def test_studentised_by_hand(study: Study) -> None:
    found = resample(study(STRENGTHS, observers=20), replicates=199)
    error = standard_errors(influences(found.by_observer, np.ones((1, 20)), found.fit.theta[None]), np.ones((1, 20)))[0]
    t = []
    for weights, theta in zip(found.weights, found.theta, strict=True):
        own = standard_errors(influences(found.by_observer, weights[None], theta[None]), weights[None])[0]
        t.append((theta - found.fit.theta) / own)
    ranked = np.sort(t, axis=0)
    ours = intervals(found, kind="studentised", level=0.9)
    assert ours.low == pytest.approx(found.fit.theta - ranked[189] * error, abs=1e-9)  # ranks 10 and 190 of 199
    assert ours.high == pytest.approx(found.fit.theta - ranked[9] * error, abs=1e-9)


def test_wrong_input_is_refused(study: Study) -> None:
    found = resample(study(STRENGTHS), replicates=10)
    with pytest.raises(ResultsError, match="no kind of interval 'wald'"):
        intervals(found, kind="wald")  # type: ignore[arg-type]  # wrong on purpose
    with pytest.raises(ResultsError, match="no quantity 'worth'"):
        intervals(found, "worth")  # type: ignore[arg-type]  # wrong on purpose
    with pytest.raises(ResultsError, match="level is 95"):
        intervals(found, level=95)
