from __future__ import annotations

from collections.abc import Callable, Mapping
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.errors import ResultsError
from analysis.factors import effects_svg, factor_effects
from analysis.factors.separation import is_separated, separated_effects
from analysis.factors.terms import Term
from analysis.scaling import count_pairs
from analysis.scaling.separation import recession, strong_groups
from tests.analysis.conftest import answers_of

Factors = Mapping[str, Mapping[str, str | float]]
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
    assert held.explained is not None
    assert held.explained.missing


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
    assert interaction.not_fitted is not None
    assert "no finite maximum" in interaction.not_fitted


def test_a_solver_that_gives_up_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    import scipy.optimize

    gave_up = SimpleNamespace(x=None, message="Time limit reached")
    monkeypatch.setattr(scipy.optimize, "linprog", lambda *_, **__: gave_up)
    answers = from_answers([Answer("a", "b")])
    with pytest.raises(ResultsError, match="could not be decided: Time limit reached"):
        factor_effects(answers, {"a": {"x": 1.0}, "b": {"x": 2.0}})
