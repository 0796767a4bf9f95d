"""The batched bootstrap against its slow twin, one replicate at a time, and against the binomial law."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from analysis.bootstrap import resample
from analysis.bootstrap.replicates import Replicates
from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.errors import ResultsError
from analysis.scaling import Counts, are_connected, fit, maximise
from analysis.scaling.penalty import FIRTH
from documents.arrays import Floats

Study = Callable[..., Comparisons]
STRENGTHS = (-0.8, -0.2, 0.1, 0.9)


def one_by_one(comparisons: Comparisons, weights: Floats) -> list[Floats]:
    """Count and fit each replicate on its own, answer by answer."""
    found = []
    for drawn in weights:
        wins = np.zeros_like(comparisons.wins)
        for line, person in enumerate(comparisons.observer):
            wins[comparisons.winner[line], comparisons.loser[line]] += comparisons.count[line] * drawn[person]
        plain = fit(wins)
        found.append(fit(wins, method="firth").theta if plain.separated else plain.theta)
    return found


def test_each_replicate_is_what_fitting_it_alone_gives(study: Study) -> None:
    comparisons = study((-2.0, -0.5, 0.2, 2.3), observers=9, seed=4)
    found = resample(comparisons, replicates=60)
    assert found.separated.any()
    assert not found.separated.all()
    assert found.theta == pytest.approx(np.array(one_by_one(comparisons, found.weights)), abs=1e-9)
    assert found.theta.sum(axis=1) == pytest.approx(np.zeros(60), abs=1e-9)


def test_the_left_out_are_the_fits_to_the_other_observers(study: Study) -> None:
    comparisons = study(STRENGTHS)
    found = resample(comparisons, replicates=1)
    assert found.left_out.theta == pytest.approx(np.array(one_by_one(comparisons, 1 - np.eye(12))), abs=1e-9)


def test_draws_that_no_memory_holds_are_refused(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    comparisons = study(STRENGTHS)
    monkeypatch.setattr("analysis.comparisons.comparisons.MOST_NUMBERS", 12 * 16 - 1)
    with pytest.raises(ResultsError, match="12 observers of 4 items"):
        resample(comparisons)
    assert comparisons.wins_by_observer(slice(0, 11)).shape == (11, 4, 4)


def test_blocks_change_nothing_and_a_seed_gives_the_same_again(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    comparisons = study(STRENGTHS)
    whole = resample(comparisons, replicates=100)
    with monkeypatch.context() as patch:
        patch.setattr("analysis.bootstrap.replicates.BLOCK_NUMBERS", 16 * 7)
        blocks = resample(comparisons, replicates=100)
    other = resample(comparisons, replicates=100, seed=1)
    assert (whole.weights == blocks.weights).all()
    assert blocks.left_out.theta == pytest.approx(whole.left_out.theta, abs=1e-12)
    assert whole.theta == pytest.approx(blocks.theta, abs=1e-12)
    assert (whole.weights != other.weights).any()
    assert (whole.weights.sum(axis=1) == 12).all()


@settings(max_examples=10, deadline=None)
@given(st.integers(2, 6), st.floats(-3, 9), st.integers(0, 2**32 - 1))
@example(3, 9.0, 3)  # separated: only rounding moves it at the end, by 1e-9
def test_batched_firth_is_firth(n: int, log10_count: float, seed: int) -> None:
    wins = 10**log10_count * np.random.default_rng(seed).integers(0, 3, (5, n, n)).astype(float)
    wins[:, np.arange(n), np.arange(n)] = 0
    wins[:, np.arange(n - 1), np.arange(1, n)] += 10**log10_count  # links all
    top = maximise(Counts.from_wins(wins), penalty=FIRTH)
    for theta, converged, counts in zip(top.theta, top.converged, wins, strict=True):
        assert converged
        assert theta == pytest.approx(fit(counts, method="firth").theta, abs=1e-7)


def test_draws_that_link_no_items_have_no_fit() -> None:
    """Two observers compared a with b and two b with c: one draw in eight leaves out either link."""
    answers = [Answer("a", "b", observer="1"), Answer("b", "a", observer="2")]
    answers += [Answer("b", "c", observer="3"), Answer("c", "b", observer="4")]
    found = resample(from_answers(answers), replicates=400)
    wins = np.tensordot(found.weights, found.by_observer, 1)
    assert (found.without_fit == ~are_connected(wins + wins.transpose(0, 2, 1))).all()
    assert found.without_fit.mean() == pytest.approx(1 / 8, abs=0.08)
    assert np.isnan(found.theta[found.without_fit]).all()
    assert np.isfinite(found.theta[~found.without_fit]).all()
    assert not (found.separated & found.without_fit).any()


@pytest.mark.parametrize("scale", [1e-3, 1e9])
def test_the_size_of_counts_changes_no_strength(study: Study, scale: float) -> None:
    comparisons = study(STRENGTHS, observers=20, observer_sd=0.0)
    plain = resample(comparisons, replicates=50)
    scaled = replace(comparisons, count=comparisons.count * scale)
    found = resample(scaled, replicates=50)
    assert not plain.separated.any()
    assert found.theta == pytest.approx(plain.theta, abs=1e-8)


def refused(comparisons: Comparisons, match: str, **options: int) -> Replicates | None:
    with pytest.raises(ResultsError, match=match):
        return resample(comparisons, **options)  # type: ignore[arg-type]  # only numbers are tried
    return None


def test_wrong_input_is_refused(study: Study) -> None:
    refused(study(STRENGTHS, observers=1), "one observer")
    refused(from_answers([Answer("a", "b"), Answer("b", "a")]), "no observer named")
    refused(study((-30.0, 0.0, 30.0), observers=3, observer_sd=0.0), "separated")
    refused(study(STRENGTHS), "0 replicates", replicates=0)
