"""Simulated studies: their truth, and a small calibration whose bounds fit its size."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.choices import CovarianceChoice
from analysis.scaling import fit
from benchmarks.simulated_studies import Design, coverage, decisions
from tests.choice import nightly

# Medina 2016, Table 4.4.
THETA = np.log([0.0718, 0.0432, 0.0762, 0.2036, 0.0740, 0.2574, 0.0543, 0.0296, 0.0751, 0.1149])
CENTRED = THETA - THETA.mean()


def test_observers_who_are_alike_have_the_strengths_they_were_given() -> None:
    assert Design(CENTRED, 30).truth() == pytest.approx(CENTRED, abs=1e-9)


@pytest.mark.promise("level")
def test_the_default_interval_holds_the_truth_as_often_as_it_says_and_the_models_does_not() -> None:
    """Sixty studies of observers who differ: four standard errors, between studies, are about 3 %."""
    design = Design(CENTRED, 15, observer_sd=0.7)
    found = coverage(design, ["expanded-bca", "model"], ["difference"], studies=60, replicates=400)
    ours, model = found
    assert ours.standard_error < 0.01
    assert 0.92 < ours.covered < 0.98
    assert model.covered < 0.91
    assert ours.too_high + ours.too_low == pytest.approx(1 - ours.covered)
    assert ours.worst <= ours.covered


@pytest.mark.promise("level")
@pytest.mark.parametrize(
    ("covariance", "observer_sd", "least", "most"),
    # Four standard deviations of 5 % of 150 studies are 7 %.
    [
        ("auto", 0.7, 0.0, 0.12),
        ("model", 0.7, 0.14, 1.0),
        *nightly(("auto", 0.0, 0.0, 0.12), ("model", 0.0, 0.0, 0.12)),
    ],
)
def test_equal_items_are_seldom_told_apart(
    covariance: CovarianceChoice, observer_sd: float, least: float, most: float
) -> None:
    found = decisions(Design(np.zeros(10), 6, observer_sd), studies=150, covariance=covariance)
    assert least <= found.false_difference <= most
    if covariance == "auto":
        assert 0.92 < found.differences < 0.98


def test_camps_and_items_that_divide_observers_have_their_truth() -> None:
    design = Design(CENTRED, 20_000, np.r_[1.5, np.zeros(9)], camps=np.r_[0, 0.7, -0.7, np.zeros(7)])
    (by_observer,) = design.studies(1, seed=3)
    found = fit(by_observer.sum(axis=0))
    assert np.abs(found.theta - design.truth()).max() < 0.03
