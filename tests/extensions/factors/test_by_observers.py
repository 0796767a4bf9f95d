"""Factors with observers who differ, with separation, and as a figure."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.errors import ResultsError
from analysis.scaling import ObserverTest, count_pairs
from analysis.scaling.separation import recession, strong_groups
from documents.pages import Paragraph
from extensions.factors import (
    FactorEffects,
    drawn_rows,
    effects_svg,
    explained_words,
    factor_effects,
    factors_section,
)
from extensions.factors.separation import is_separated, separated_effects
from extensions.factors.terms import Term
from tests.analysis.conftest import answers_of
from tests.kept import known

# Tests of factors, interactions and lack of fit where observers differ: their level, and what they find.

Factors = Mapping[str, Mapping[str, str | float]]


def study(
    random: np.random.Generator, grid: Factors, theta: NDArray[np.float64], taste: float, observers: int = 10
) -> Comparisons:
    """One answer of each observer to each pair; observers' own strengths scatter by ``taste`` nats."""
    names = list(grid)
    first, second = np.triu_indices(len(names), 1)
    answers = []
    for observer in range(observers):
        own = theta + taste * random.standard_normal(len(names))
        won = random.random(len(first)) < 1 / (1 + np.exp(own[second] - own[first]))
        pairs = zip(np.where(won, first, second).tolist(), np.where(won, second, first).tolist(), strict=True)
        answers += [Answer(names[winner], names[loser], observer=f"{observer}") for winner, loser in pairs]
    return from_answers(answers, names)


def test_statistics_of_independent_answers_are_near_the_likelihood_ratios(grid: Factors) -> None:
    found = factor_effects(study(np.random.default_rng(3), grid, np.linspace(-0.5, 0.5, 12), 0.0, observers=60), grid)
    explained = known(found.explained)
    pairs: list[tuple[float | None, int | None, ObserverTest | None]] = [
        (explained.lack_of_fit, explained.lack_of_fit_df, explained.lack_of_fit_by_observers)
    ]
    pairs += [(test.statistic, test.df, test.by_observers) for test in found.tests]
    pairs += [(test.statistic, test.df, test.by_observers) for test in found.interactions]
    for statistic, df, own in pairs:
        assert known(own).df == df
        assert abs(known(own).statistic - known(statistic)) < 0.03 * known(statistic) + 0.01


def test_no_observers_no_test_by_observers(grid: Factors) -> None:
    answers = study(np.random.default_rng(4), grid, np.zeros(12), 0.0, observers=4)
    found = factor_effects(answers, grid)
    assert found.tests[0].by_observers is None
    assert found.tests[0].observer_p == found.tests[0].robust_p
    assert found.interactions[0].observer_p_holm is None


def test_one_verdict_by_observers_and_averages_and_lack_of_fit_are_said(grid: Factors) -> None:
    red_stereo = np.array([one["paint"] == "red" and one["view"] == "stereo" for one in grid.values()]) * 1.8
    found = factor_effects(study(np.random.default_rng(2), grid, red_stereo, 0.3), grid, use=("paint", "view"))
    (crossed,) = found.to_json()["interactions"]
    assert crossed["verdict"] == "distinguished"
    assert ["'paint'" in line and "'view'" in line for line in found.cautions] == [True, True]
    assert "factors do not name" in explained_words(found)
    assert found.cautions[0] in shown(found)

    random = np.random.default_rng(5)
    alike = factor_effects(study(random, grid, np.zeros(12), 0.0), grid, use=("paint", "view"))
    assert alike.cautions == ()
    assert alike.to_json()["explained"]["lack_of_fit_verdict"] == "not distinguished"
    assert "factors do not name" not in explained_words(alike)

    apart = [factor_effects(study(random, grid, np.zeros(12), 1.0), grid, use=("paint", "view")) for _ in range(12)]
    disputed = [one.tests[0] for one in apart if one.tests[0].p <= 0.05 < (one.tests[0].conclusion.p or 0)]
    assert disputed
    assert {test.to_json()["verdict"] for test in disputed} == {"not distinguished"}


def shown(found: FactorEffects) -> str:
    blocks = factors_section(found).blocks
    return " ".join(block.text for block in blocks if isinstance(block, Paragraph))


Drawer = Callable[..., Comparisons]


def separated_by_hand(agreeing: NDArray[np.float64]) -> bool:
    """In the plane a cone's edges are at right angles to some row; if there is no edge, some row lies in it."""
    across = np.column_stack([-agreeing[:, 1], agreeing[:, 0]])
    for candidate in np.vstack([across, -across, agreeing, -agreeing]):
        along = agreeing @ candidate
        if (along >= -1e-9).all() and (along > 1e-9).any():
            return True
    return False


@given(
    st.lists(st.tuples(st.integers(-2, 2), st.integers(-2, 2)), min_size=3, max_size=5, unique=True),
    st.lists(st.tuples(st.integers(0, 4), st.integers(0, 4)), min_size=1, max_size=7),
)
@settings(max_examples=25, deadline=None)
def test_the_programme_finds_what_the_plane_shows(columns: list[tuple[int, int]], pairs: list[tuple[int, int]]) -> None:
    n = len(columns)
    answers = [Answer(f"{one % n}", f"{other % n}") for one, other in pairs if one % n != other % n]
    if not answers:
        return
    comparisons = from_answers(answers, [f"{place}" for place in range(n)])
    place = [int(name) for name in comparisons.items]
    x = np.array(columns, dtype=np.float64)[place]
    cells, _ = count_pairs(comparisons)
    agreeing = x[comparisons.winner] - x[comparisons.loser]
    apart = separated_by_hand(agreeing)
    assert (recession(cells, x) is not None) == apart
    # The graph alone settles it where it can.
    assert not (apart and len(strong_groups(comparisons.wins)) == 1)
    term = Term(("x", "y"), x, np.empty((0, 2)), ())
    assert is_separated(cells, [term]) == apart == bool(separated_effects(cells, [term]))


def test_a_level_that_always_wins_is_named_and_refused(grid: Factors) -> None:
    """Stereo beats flat wherever they meet; within each view the paints take turns."""
    answers = []
    for one in grid:
        for other in grid:
            if one != other and not ("flat" in one and "stereo" in other):
                answers.append(Answer(one, other, 2 if "blue" in one else 1, observer="x"))
    found = factor_effects(from_answers(answers, list(grid)), grid)
    (sentence,) = found.separation
    assert "'view' ('stereo' over 'flat')" in sentence
    assert found.effects == ()
    assert np.isnan(found.theta).all()
    assert not found.converged
    with pytest.raises(ResultsError, match="no finite effects"):
        effects_svg(found)
    held = factor_effects(from_answers(answers, list(grid)), grid, method="map", prior_sd=2.0)
    assert held.held_by_prior == found.separation
    assert held.converged
    (stereo,) = (effect for effect in held.effects if effect.level == "stereo")
    assert 1 < stereo.estimate < 10
    assert known(held.explained).missing


def test_an_order_of_levels_and_the_way_of_a_number_are_told() -> None:
    pairs = [("a", "b"), ("b", "c"), ("a", "c")]
    answers = from_answers([Answer(*pair) for pair in pairs])
    levels = factor_effects(answers, {name: {"paint": name} for name in "abc"}, use=("paint",))
    assert "'paint' ('a' over 'b' over 'c')" in levels.separation[0]
    number = factor_effects(answers, {"a": {"x": 1.0}, "b": {"x": 2.0}, "c": {"x": 3.0}})
    assert "'x' (less is preferred)" in number.separation[0]


def test_effects_that_only_run_away_together_are_named_together() -> None:
    """Neither factor is one-sided by itself; the item that has both levels won against the one that has neither."""
    told = {f"{one}{other}": {"x": one, "y": other} for one in "01" for other in "01"}
    joint = [Answer("11", "00"), Answer("10", "01"), Answer("01", "10")]
    only = factor_effects(from_answers(joint, list(told)), told)
    (sentence,) = only.separation
    assert sentence.endswith("'x' ('1' over '0'); 'y' ('1' over '0').")


def test_items_may_be_separated_where_the_factors_are_not(grid: Factors, draw: Drawer) -> None:
    """One item that never lost: no free strengths, but the effects are held by the others."""
    answers = draw(dict.fromkeys(grid, 0.0), observers=6, seed=2)
    best = next(iter(grid))
    pairs = [(one.winner, one.loser) for one in answers_of(answers)]
    lines = [Answer(*(pair if pair[1] != best else pair[::-1])) for pair in pairs]
    found = factor_effects(from_answers(lines, list(grid)), grid)
    assert found.converged
    assert found.separation == ()
    assert np.isfinite([effect.estimate for effect in found.effects]).all()
    assert found.explained is not None
    assert found.explained.r_squared is None
    assert np.isnan(found.explained.free_theta).all()
    assert found.explained.deviance_null > found.explained.deviance_factors


def test_an_interaction_that_runs_away_is_not_fitted() -> None:
    """Four items in a cycle of wins but for one that never lost."""
    told = {f"{one}{other}": {"x": one, "y": other} for one in "01" for other in "01"}
    answers = [
        Answer(one, other, 3 if one == "11" else 1) for one in told for other in told if one != other and other != "11"
    ]
    found = factor_effects(from_answers(answers, list(told)), told)
    assert found.separation == ()
    (interaction,) = found.interactions
    assert interaction.p is None
    assert "no finite maximum" in known(interaction.not_fitted)


def test_a_solver_that_gives_up_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    import scipy.optimize

    gave_up = SimpleNamespace(x=None, message="Time limit reached")
    monkeypatch.setattr(scipy.optimize, "linprog", lambda *_, **__: gave_up)
    answers = from_answers([Answer("a", "b")])
    with pytest.raises(ResultsError, match="could not be decided: Time limit reached"):
        factor_effects(answers, {"a": {"x": 1.0}, "b": {"x": 2.0}})


def test_rows_are_the_effects_with_references_and_ranges(grid: Factors, draw: Drawer) -> None:
    answers = draw(dict.fromkeys(grid, 0.0))
    found = factor_effects(answers, grid, log=("exposure_s",))
    rows = drawn_rows(found)
    assert [(row.factor, row.level, row.is_reference) for row in rows] == [
        ("paint", "grey", True),
        ("paint", "blue", False),
        ("paint", "red", False),
        ("view", "flat", True),
        ("view", "stereo", False),
        ("exposure_s", "0.125 to 1", False),
    ]
    assert rows[1].estimate == found.effects[0].estimate
    assert rows[0].interval is None
    # Three doublings.
    assert rows[-1].estimate == pytest.approx(3 * found.effects[-1].estimate)
    assert rows[-1].interval == pytest.approx((3 * found.effects[-1].low, 3 * found.effects[-1].high))
    assert (rows[-1].robust_interval or (0, 0))[1] == pytest.approx(3 * (found.effects[-1].robust_high or 0))
    by_mean = drawn_rows(factor_effects(answers, grid, coding="sum"))
    assert not any(row.is_reference for row in by_mean)


def test_the_picture_is_sound_and_names_every_row(grid: Factors, draw: Drawer) -> None:
    told = {name: {**one, "paint": f"<b>{one['paint']}&"} for name, one in grid.items()}
    found = factor_effects(draw(dict.fromkeys(grid, 0.0)), told)
    svg = effects_svg(found)
    root = ElementTree.fromstring(svg.replace("xlink:href", "href"))
    text = ["".join(element.itertext()).strip() for element in root.iter() if element.tag.endswith("text")]
    for row in drawn_rows(found):
        assert f"{row.factor}: {row.level}" in text
    assert "3 factors" in root.attrib["aria-label"]
    assert "<b>" not in svg
    assert effects_svg(found) == svg


@pytest.mark.nightly
def test_one_interval_is_drawn_and_it_is_the_one_of_the_verdict(grid: Factors, draw: Drawer) -> None:
    found, few = (factor_effects(draw(dict.fromkeys(grid, 0.0), observers), grid) for observers in (12, 4))
    assert (found.by_observers, few.by_observers) == (True, False)
    for effects, read, other in ((found, "robust_{}", "{}"), (few, "{}", "robust_{}")):
        first = effects.effects[0]
        assert effects.interval(first) == tuple(getattr(first, read.format(end)) for end in ("low", "high"))
        for ends, changes in ((other, False), (read, True)):
            far: dict[str, Any] = {ends.format("low"): -50.0, ends.format("high"): 50.0}
            moved = replace(effects, effects=tuple(replace(one, **far) for one in effects.effects))
            assert (effects_svg(moved) != effects_svg(effects)) is changes
