"""Class stability against classifying each replicate on its own."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from itertools import product

import numpy as np
import pytest

from analysis.bootstrap import class_stability, resample
from analysis.bootstrap.influence import influences
from analysis.choices import Adjust
from analysis.classes import classify
from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.covariance import contrast_variances, shrink
from analysis.covariance.laplacian import differences_of
from analysis.errors import ResultsError
from analysis.scaling import Counts, CovarianceKind, fit
from analysis.scaling.jeffreys import Jeffreys
from analysis.scaling.profile import Profiles
from tests.choice import nightly

Study = Callable[..., Comparisons]
STRENGTHS = (-1.2, -0.9, 0.1, 0.5, 1.5)


@pytest.mark.parametrize(
    ("covariance", "adjust"),
    [("sandwich", "holm"), ("model", "bh"), *nightly(*product(("model", "scaled", "shrinkage"), ("none", "holm")))],
)
def test_it_is_what_classifying_each_replicate_gives(study: Study, covariance: CovarianceKind, adjust: Adjust) -> None:
    found = resample(study(STRENGTHS, observers=20), replicates=60)
    stability = class_stability(found, alpha=0.1, adjust=adjust, covariance=covariance)
    shared, labels = np.zeros((5, 5)), [Counter[str]() for _ in range(5)]
    counts = Counter[int]()
    for weights, theta, separated in zip(found.weights, found.theta, found.separated, strict=True):
        wins = np.tensordot(weights, found.by_observer, 1)
        spread, df = fit(wins, method="firth" if separated else "ml").covariance, None
        if covariance != "model":
            moved = influences(found.by_observer, weights[None], theta[None])[0]
            each = np.repeat(moved, weights.astype(int), axis=0) * np.sqrt(20 / 19)  # as often as they were drawn
            kind = "scaled" if separated else covariance
            own = shrink(spread[None], each[None], kind, freedom=19, at_least_model=kind == "scaled")
            spread, df = own.covariance[0], own.degrees_of_freedom()[0]
        pairs, counted = np.triu_indices(5, 1), Counts.from_wins(wins[None])
        model = contrast_variances(fit(wins, method="firth" if separated else "ml").covariance)[pairs]
        profiles = Profiles(
            Jeffreys(counted), theta, differences_of(5, *pairs), contrast_variances(spread)[pairs] / model, df
        )
        classes = classify(theta, spread, alpha=0.1, adjust=adjust, df=df, profiles=profiles)
        shared += [[bool(set(a.split("+")) & set(b.split("+"))) for b in classes.labels] for a in classes.labels]
        counts[len(classes.members)] += 1
        for label, met in zip(classes.labels, labels, strict=True):
            met[label] += 1
    assert stability.shared == pytest.approx(shared / 60)
    for label, share, met in zip(stability.labels, stability.label_shares, labels, strict=True):
        assert met[label] == max(met.values()) == pytest.approx(60 * share)
    assert stability.class_counts == dict(sorted(counts.items()))


def test_draws_without_a_fit_are_counted_and_left_out() -> None:
    answers = [Answer("a", "b", observer="1"), Answer("b", "a", observer="2")]
    answers += [Answer("b", "c", observer="3"), Answer("c", "b", observer="4")]
    stability = class_stability(resample(from_answers(answers), replicates=100))
    assert stability.without_fit > 0
    assert stability.shared[0, 0] == 1
    assert sum(stability.class_counts.values()) == 100 - stability.without_fit
    told = stability.to_json()
    assert told["without_fit"] == stability.without_fit
    assert [item["name"] for item in told["items"]] == ["a", "b", "c"]


def test_wrong_input_is_refused(study: Study) -> None:
    found = resample(study(STRENGTHS), replicates=5)
    with pytest.raises(ResultsError, match="alpha"):
        class_stability(found, alpha=5)
    with pytest.raises(ResultsError, match="tukey"):
        class_stability(found, adjust="tukey")  # type: ignore[arg-type]  # wrong on purpose
    with pytest.raises(ResultsError, match="robust"):
        class_stability(found, covariance="robust")  # type: ignore[arg-type]  # wrong on purpose
