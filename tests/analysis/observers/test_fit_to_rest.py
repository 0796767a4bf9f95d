"""Each observer under the others' scores: against a slow twin, calibrated, and finding who answers otherwise."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.stats import chi2, norm

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.observers import fit_to_rest as module
from analysis.observers.fit_to_rest import FitToRest, fits_to_rest
from analysis.observers.tails import lower_tail
from analysis.scaling import fit
from tests.kept import known

Study = Callable[..., Comparisons]


def slow_twin(comparisons: Comparisons, person: int) -> tuple[float, float, float, float]:
    """Return mean log likelihood, its expectation, z and p of one observer, pair by pair as the formulas stand."""
    own = comparisons.wins_by_observer()[person]
    rest = fit(comparisons.wins - own, method="firth")
    n = len(own)
    total = mean = variance = third = 0.0
    pull = np.zeros(n)
    for i in range(n):
        for j in range(i + 1, n):
            d = float(rest.theta[i] - rest.theta[j])
            p = 1 / (1 + math.exp(-d))
            count = own[i, j] + own[j, i]
            spread = rest.covariance[i, i] + rest.covariance[j, j] - 2 * rest.covariance[i, j]
            total += own[i, j] * math.log(p) + own[j, i] * math.log(1 - p)
            mean += count * (p * math.log(p) + (1 - p) * math.log(1 - p))
            mean -= count * p * (1 - p) * spread * (1 - (2 * p - 1) * d / 2)
            variance += count * p * (1 - p) * d**2
            third += count * p * (1 - p) * (1 - 2 * p) * d**3
            pull[i] += count * p * (1 - p) * d
            pull[j] -= count * p * (1 - p) * d
    variance += float(pull @ rest.covariance @ pull)
    z = (total - mean) / math.sqrt(variance)
    skew = third / variance**1.5
    df = 8 / skew**2
    # Pearson's type III law: mirrored where the skewness is negative, as it is here.
    p_value = float(chi2.sf(df - z * math.sqrt(2 * df), df)) if skew < 0 else float(norm.cdf(z))
    return total / own.sum(), mean / own.sum(), z, p_value


@pytest.mark.parametrize("times", [1, 3])
def test_it_is_that_of_the_slow_twin(study: Study, times: int) -> None:
    random = np.random.default_rng(2)
    comparisons = study(np.tile(random.normal(0, 1, 5), (6, 1)), random, times)
    for person, line in enumerate(fits_to_rest(comparisons)):
        assert line is not None
        expected = slow_twin(comparisons, person)
        assert (line.mean_log_likelihood, line.expected, line.z, line.p) == pytest.approx(expected, rel=1e-8)


def test_influence_is_what_leaving_out_changes(study: Study) -> None:
    random = np.random.default_rng(3)
    comparisons = study(np.tile(random.normal(0, 1, 5), (5, 1)), random, 2)
    together = fit(comparisons.wins, method="firth").theta
    for own, line in zip(comparisons.wins_by_observer(), fits_to_rest(comparisons), strict=True):
        assert line is not None
        change = together - fit(comparisons.wins - own, method="firth").theta
        most = int(np.abs(change).argmax())
        assert line.influence == pytest.approx(change[most], rel=1e-8)
        assert line.most_moved == comparisons.items[most]


def test_blocks_change_nothing(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(4)
    comparisons = study(np.tile(random.normal(0, 1, 4), (7, 1)), random)
    whole = fits_to_rest(comparisons)
    monkeypatch.setattr(module, "_MOST_NUMBERS", 32)
    for one, other in zip(whole, fits_to_rest(comparisons), strict=True):
        assert one is not None
        assert other is not None
        assert other.z == pytest.approx(one.z, rel=1e-9)


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 10**6), st.integers(2, 5), st.integers(2, 6))
@example(499, 4, 5)
def test_neither_order_nor_names_matter(seed: int, n: int, people: int) -> None:
    random = np.random.default_rng(seed)
    answers = [
        Answer(f"i{a}", f"i{b}", 1.0, f"{person}")
        for person in range(people)
        for a, b in (random.permutation(n)[:2] for _ in range(6))
    ]
    lines = by_name(from_answers(answers))
    moved = [replace(answer, winner="z" + answer.winner, loser="z" + answer.loser) for answer in answers]
    again = by_name(from_answers([moved[index] for index in random.permutation(len(moved))]))
    assert lines.keys() == again.keys()
    for name, line in lines.items():
        other = again[name]
        assert (line is None) == (other is None)
        if line and other:
            assert other.z == pytest.approx(line.z, rel=1e-6, abs=1e-9)
            assert abs(other.influence) == pytest.approx(abs(line.influence), rel=1e-6, abs=1e-9)


def by_name(comparisons: Comparisons) -> dict[str, FitToRest | None]:
    return dict(zip(comparisons.observers, fits_to_rest(comparisons), strict=True))


def test_who_answers_the_other_way_round_is_found_and_not_the_others(study: Study) -> None:
    random = np.random.default_rng(5)
    theta = np.tile(np.linspace(-1, 1, 8), (12, 1))
    theta[4] *= -1
    lines = fits_to_rest(study(theta, random))
    assert [person for person, line in enumerate(lines) if line and line.outlier] == [4]
    found = known(lines[4])
    assert found.z < -4
    assert found.mean_log_likelihood < math.log(0.5) < found.expected
    assert found.to_json()["outlier"] is True


@pytest.mark.nightly
def test_z_and_p_are_calibrated(study: Study) -> None:
    random = np.random.default_rng(6)
    z, p, flagged = [], [], []
    for _ in range(60):
        lines = fits_to_rest(study(np.tile(random.normal(0, 0.8, 6), (20, 1)), random))
        assert all(lines)
        z += [line.z for line in lines if line]
        p += [line.p for line in lines if line]
        flagged.append(any(line.outlier for line in lines if line))
    # Standard errors: 0.03 for the mean of z, 0.02 for its deviation, 0.006 for the share, 0.03 for the studies.
    assert np.mean(z) == pytest.approx(0, abs=0.1)
    assert np.std(z) == pytest.approx(1, abs=0.1)
    assert np.mean(np.array(p) <= 0.05) == pytest.approx(0.05, abs=0.025)
    assert np.mean(flagged) <= 0.06 + 3 * 0.03


def test_a_lone_observer_and_one_whose_rest_is_not_linked_have_no_fit() -> None:
    alone = from_answers([Answer("a", "b", 3), Answer("b", "a", 2)])
    assert fits_to_rest(alone) == (None,)
    bridge = [
        Answer("a", "b", 2, "01"),
        Answer("c", "d", 2, "01"),
        Answer("b", "c", 1, "02"),
        Answer("a", "b", 1, "02"),
    ]
    lines = by_name(from_answers(bridge))
    assert lines == {"01": None, "02": None}
    ties_only = from_answers([*two_items(), Answer("a", "b", 1, "03", tie=True)])
    assert by_name(ties_only)["03"] is None


def test_too_many_items_are_not_fitted_for_every_observer() -> None:
    path = [Answer(f"{item}", f"{item + 1}", 1, f"0{item % 2}") for item in range(module.MOST_ITEMS)]
    assert fits_to_rest(from_answers(path)) == (None, None)


def two_items() -> list[Answer]:
    return [Answer("a", "b", 4, "01"), Answer("b", "a", 1, "01"), Answer("a", "b", 3, "02"), Answer("b", "a", 2, "02")]


def test_two_items_and_separated_rests_are_finite() -> None:
    assert all(by_name(from_answers(two_items())).values())
    won_always = [Answer("a", "b", 3, f"0{person}") for person in range(5)]
    for line in fits_to_rest(from_answers(won_always)):
        assert line is not None
        assert np.isfinite([line.z, line.p, line.influence]).all()
    balanced = [
        Answer("a", "b", 1, "01"),
        Answer("b", "a", 1, "01"),
        Answer("a", "b", 1, "02"),
        Answer("b", "a", 1, "02"),
    ]
    # The others hold both to be alike: nothing is foretold, so nothing can be held against it.
    assert fits_to_rest(from_answers(balanced)) == (None, None)


@pytest.mark.parametrize("count", [1e-3, 1e9])
def test_counts_from_tiny_to_huge(count: float) -> None:
    answers = [replace(answer, count=answer.count * count) for answer in two_items()]
    for line in fits_to_rest(from_answers(answers)):
        assert line is not None
        assert np.isfinite([line.z, line.p, line.influence, line.mean_log_likelihood]).all()


def test_the_law_of_three_moments() -> None:
    x = np.linspace(-3, 3, 25)
    one = np.ones_like(x)
    assert lower_tail(x, one, 0 * one) == pytest.approx(norm.cdf(x))
    assert lower_tail(x, one, 1e-5 * one) == pytest.approx(norm.cdf(x), abs=1e-5)
    # χ² with 5 degrees of freedom has variance 10 and third moment 40; its mirror image has −40.
    assert lower_tail(x, 10 * one, 40 * one) == pytest.approx(chi2.cdf(x + 5, 5), rel=1e-9)
    assert lower_tail(x, 10 * one, -40 * one) == pytest.approx(chi2.sf(5 - x, 5), rel=1e-9)
