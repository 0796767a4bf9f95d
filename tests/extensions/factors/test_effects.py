"""Effects of factors, aliased ones too, and those of the thesis's Experiment 2."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.comparisons.comparisons import without_observers
from analysis.errors import ResultsError
from analysis.records import SessionLog
from analysis.scaling import fit
from documents.arrays import Floats
from extensions.factors import FactorEffects, factor_effects, session_factors
from extensions.factors.terms import empty_cell, interaction_term, main_term
from extensions.factors.values import Factor, FactorOptions, read_factors
from tests.analysis.slow_profiles import SlowProfile
from tests.kept import known

Factors = Mapping[str, Mapping[str, str | float]]
Drawer = Callable[..., Comparisons]
Regression = Callable[[Comparisons, Floats], tuple[Floats, float]]

TRUTH = {"blue": 0.5, "red": -0.4, "stereo": 0.8, "per unit": 0.6}


def strengths(grid: Factors) -> dict[str, float]:
    return {
        name: TRUTH.get(str(one["paint"]), 0.0)
        + TRUTH.get(str(one["view"]), 0.0)
        + TRUTH["per unit"] * float(one["exposure_s"])
        for name, one in grid.items()
    }


def dummies(grid: Factors) -> Floats:
    """Columns of blue, red, stereo and the exposure, as one would write them by hand."""
    return np.array(
        [
            [one["paint"] == "blue", one["paint"] == "red", one["view"] == "stereo", float(one["exposure_s"])]
            for one in grid.values()
        ],
        dtype=np.float64,
    )


def of(found: FactorEffects, *names: str) -> list[float]:
    return [found_one.estimate for name in names for found_one in found.effects if found_one.level == name]


def test_effects_are_those_of_a_logistic_regression(grid: Factors, draw: Drawer, regression: Regression) -> None:
    answers = draw(strengths(grid))
    found = factor_effects(answers, grid)
    assert [effect.level for effect in found.effects] == ["blue", "red", "stereo", "per unit"]
    beta, log_likelihood = regression(answers, dummies(grid))
    np.testing.assert_allclose([effect.estimate for effect in found.effects], beta, atol=1e-6)
    assert found.log_likelihood == pytest.approx(log_likelihood, abs=1e-9)
    assert found.converged


def test_covariances_are_those_of_the_regression_answer_by_answer(grid: Factors, draw: Drawer) -> None:
    answers = draw(strengths(grid))
    found = factor_effects(answers, grid)
    columns = dummies(grid)
    beta = np.array([effect.estimate for effect in found.effects])
    information = np.zeros((4, 4))
    scores = np.zeros((len(answers.observers), 4))
    for winner, loser, observer in zip(answers.winner, answers.loser, answers.observer, strict=True):
        x = columns[winner] - columns[loser]
        lost = 1 / (1 + np.exp(x @ beta))
        information += lost * (1 - lost) * np.outer(x, x)
        scores[observer] += lost * x
    inverse = np.linalg.inv(information)
    people = len(scores)
    sandwich = people / (people - 1) * inverse @ (scores.T @ scores) @ inverse
    np.testing.assert_allclose(found.joint_covariance, inverse, rtol=1e-9)
    np.testing.assert_allclose(known(found.sandwich_covariance), sandwich, rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose([effect.se for effect in found.effects], np.sqrt(np.diag(inverse)), rtol=1e-9)
    from scipy.stats import norm, t

    rows = columns[answers.winner] - columns[answers.loser]
    for place in (0, 3):  # a level, and a number
        effect = found.effects[place]
        spread = known(effect.robust_se) / effect.se
        order = [place, *(other for other in range(4) if other != place)]
        twin = SlowProfile(rows[:, order], np.ones(len(rows)), np.zeros(len(rows)))
        root = abs(twin.root())
        assert effect.p == pytest.approx(2 * norm.sf(root), rel=1e-6)
        assert effect.robust_p == pytest.approx(2 * t.sf(root / spread, people - 1), rel=1e-6)
        assert (effect.low, effect.high) == pytest.approx(twin.interval(1.959963985), abs=1e-6)
        # Student's 97.5 % point with 11 degrees of freedom, from a table.
        assert (effect.robust_low, effect.robust_high) == pytest.approx(twin.interval(2.200985 * spread), abs=1e-5)
    wald = beta[:2] @ np.linalg.solve(sandwich[:2, :2], beta[:2]) * (people - 2) / (2 * (people - 1))
    assert found.tests[0].robust_statistic == pytest.approx(wald, rel=1e-8)


@pytest.mark.parametrize("observers", [2, 3])
def test_intervals_of_few_observers_have_ends(grid: Factors, draw: Drawer, observers: int) -> None:
    answers = draw(strengths(grid))
    few = without_observers(answers, answers.observer >= observers)
    for effect in factor_effects(few, grid).effects:
        ends = [effect.low, effect.high, effect.robust_low, effect.robust_high]
        assert all(end is None or np.isfinite(end) for end in ends)
        assert effect.low < effect.estimate < effect.high
        json.dumps(effect.to_json(), allow_nan=False)


def test_tests_are_differences_of_log_likelihoods(grid: Factors, draw: Drawer, regression: Regression) -> None:
    answers, columns = draw(strengths(grid)), dummies(grid)
    found = factor_effects(answers, grid)
    _, whole = regression(answers, columns)
    for test, without in zip(found.tests, ([2, 3], [0, 1, 3], [0, 1, 2]), strict=True):
        _, smaller = regression(answers, columns[:, without])
        assert test.statistic == pytest.approx(2 * (whole - smaller), abs=1e-6)
        assert test.df == 4 - len(without)
    products = {
        ("paint", "view"): columns[:, :2] * columns[:, [2]],
        ("paint", "exposure_s"): columns[:, :2] * columns[:, [3]],
        ("view", "exposure_s"): columns[:, [2]] * columns[:, [3]],
    }
    for interaction in found.interactions:
        _, larger = regression(answers, np.hstack([columns, products[interaction.names]]))
        assert interaction.statistic == pytest.approx(2 * (larger - whole), abs=1e-6)
        assert known(interaction.p) <= known(interaction.p_holm) <= 1
    assert len(found.interactions) == 3


def test_one_level_for_each_item_is_the_free_model(grid: Factors, draw: Drawer) -> None:
    answers = draw(strengths(grid))
    named = {name: {"stimulus": name} for name in grid}
    found = factor_effects(answers, named, use=("stimulus",))
    free = fit(answers.wins)
    np.testing.assert_allclose(found.theta, free.theta, atol=1e-10, rtol=0)
    np.testing.assert_allclose([e.estimate for e in found.effects], free.theta[1:] - free.theta[0], atol=1e-10, rtol=0)
    variances = np.diag(free.covariance)[1:] + free.covariance[0, 0] - 2 * free.covariance[0, 1:]
    np.testing.assert_allclose(np.diag(found.joint_covariance), variances, rtol=1e-10)
    assert found.explained is not None
    assert found.explained.deviance_share == pytest.approx(1, abs=1e-12)
    assert found.explained.r_squared == pytest.approx(1, abs=1e-12)
    assert found.explained.deviance_factors == pytest.approx(free.deviance, abs=1e-9)
    assert found.explained.lack_of_fit_df == 0
    assert found.explained.lack_of_fit_p is None


def test_share_and_r_squared_by_hand(grid: Factors, draw: Drawer) -> None:
    answers = draw(strengths(grid), seed=4)
    found = factor_effects(answers, grid, use=("view",))
    free = fit(answers.wins)
    told = known(found.explained)
    null = float(answers.count.sum() * np.log(0.5))
    share = (found.log_likelihood - null) / (free.log_likelihood - null)
    assert told.deviance_share == pytest.approx(share, rel=1e-10)
    assert told.deviance_factors - free.deviance == pytest.approx(told.lack_of_fit, rel=1e-9)
    assert told.lack_of_fit_df == 10
    precision = np.linalg.pinv(free.covariance)
    missed = free.theta - found.theta
    expected = 1 - missed @ precision @ missed / (free.theta @ precision @ free.theta)
    assert told.r_squared == pytest.approx(expected, rel=1e-8)
    assert 0.1 < share < 0.9
    assert known(told.lack_of_fit_p) < 1e-3


@pytest.mark.parametrize("method", ["ml", "map"])
def test_coding_and_reference_do_not_move_the_strengths(grid: Factors, draw: Drawer, method: str) -> None:
    answers = draw(strengths(grid))
    one = factor_effects(answers, grid, method=method)  # type: ignore[arg-type]  # one of its words
    other = factor_effects(answers, grid, coding="sum", method=method)  # type: ignore[arg-type]  # one of its words
    third = factor_effects(answers, grid, references={"paint": "red", "view": "stereo"}, method=method)  # type: ignore[arg-type]  # one of its words
    np.testing.assert_allclose(other.theta, one.theta, atol=1e-9)
    np.testing.assert_allclose(third.theta, one.theta, atol=1e-9)
    levels = [effect for effect in other.effects if effect.factor == "paint"]
    assert [effect.level for effect in levels] == ["grey", "blue", "red"]
    assert sum(effect.estimate for effect in levels) == pytest.approx(0, abs=1e-12)
    assert levels[1].estimate - levels[0].estimate == pytest.approx(one.effects[0].estimate, abs=1e-9)
    (flat,) = (effect for effect in third.effects if effect.level == "flat")
    assert flat.reference == "stereo"
    assert flat.estimate == pytest.approx(-of(one, "stereo")[0], abs=1e-9)


def test_a_logarithm_counts_per_doubling_and_a_unit_is_a_unit(grid: Factors, draw: Drawer) -> None:
    answers = draw(strengths(grid))
    (unit,) = of(factor_effects(answers, grid), "per unit")
    (doubling,) = of(factor_effects(answers, grid, log=("exposure_s",)), "per doubling")
    # From 0.125 to 1 there are 0.875 units and 3 doublings.
    assert 3 * doubling == pytest.approx(0.875 * unit, abs=1e-9)
    scaled = {name: {**one, "exposure_s": float(one["exposure_s"]) * 1e12} for name, one in grid.items()}
    (small,) = of(factor_effects(answers, scaled), "per unit")
    assert small * 1e12 == pytest.approx(unit, rel=1e-9)


def test_two_items_are_the_log_odds() -> None:
    answers = from_answers([Answer("a", "b", 30), Answer("b", "a", 10)])
    found = factor_effects(answers, {"a": {"view": "stereo"}, "b": {"view": "flat"}}, references={"view": "flat"})
    assert found.effects[0].estimate == pytest.approx(np.log(3), abs=1e-12)
    assert found.effects[0].se == pytest.approx(np.sqrt(1 / 30 + 1 / 10), rel=1e-12)
    assert found.effects[0].robust_se is None
    assert found.effects[0].odds_factor == pytest.approx(3)


def test_observers_who_do_not_differ_give_no_robust_error() -> None:
    lines = [Answer("a", "b", count, f"{who}") for who in range(3) for count in (3.0,)]
    lines += [Answer("b", "a", 1.0, f"{who}") for who in range(3)]
    found = factor_effects(from_answers(lines), {"a": {"view": "stereo"}, "b": {"view": "flat"}})
    assert found.effects[0].robust_se is None
    assert found.tests[0].robust_p is None


def test_equal_items_leave_nothing_to_explain() -> None:
    answers = from_answers(
        [Answer(*pair) for a, b in (("a", "b"), ("b", "c"), ("a", "c")) for pair in ((a, b), (b, a))]
    )
    found = factor_effects(answers, {"a": {"view": "x"}, "b": {"view": "x"}, "c": {"view": "y"}})
    assert found.effects[0].estimate == pytest.approx(0, abs=1e-12)
    assert known(found.explained).deviance_share is None
    assert known(found.explained).r_squared is None


def test_a_prior_pulls_effects_towards_zero(grid: Factors, draw: Drawer) -> None:
    answers = draw(strengths(grid))
    sizes = [
        float(np.linalg.norm(factor_effects(answers, grid, method="map", prior_sd=sd).theta)) for sd in (0.1, 1, 100)
    ]
    plain = float(np.linalg.norm(factor_effects(answers, grid).theta))
    assert sizes[0] < sizes[1] < sizes[2] < plain
    assert sizes[2] == pytest.approx(plain, rel=1e-3)
    found = factor_effects(answers, grid, method="map")
    assert found.tests == ()
    assert found.interactions == ()
    assert known(found.explained).lack_of_fit_p is None


def test_the_posterior_is_that_of_the_pair_models_for_free_items(grid: Factors, draw: Drawer) -> None:
    from analysis.scaling import fit_model

    answers = draw(strengths(grid))
    named = {name: {"stimulus": name} for name in grid}
    found = factor_effects(answers, named, use=("stimulus",), method="map", prior_sd=0.7)
    posterior = fit_model(answers, method="map", prior_sd=0.7)
    np.testing.assert_allclose(found.theta, posterior.theta, atol=1e-9)
    v = posterior.covariance
    np.testing.assert_allclose([e.se for e in found.effects], np.sqrt(np.diag(v) + v[0, 0] - 2 * v[0])[1:], rtol=1e-8)
    assert found.iterations <= 8


@pytest.mark.parametrize(
    ("wish", "message"),
    [
        ({"coding": "helmert"}, "there is no coding 'helmert'"),
        ({"method": "firth"}, "there is no method 'firth'"),
        ({"method": "map", "prior_sd": 0.0}, "the prior's standard deviation is 0"),
        ({"use": ("colour",)}, "there is no factor 'colour'"),
        ({"references": {"view": "mono"}}, "no level 'mono'"),
        ({"log": ("view",)}, "'view' is no number"),
        ({"log": ("exposure_s",), "categorical": ("exposure_s",)}, "cannot be both"),
        ({"use": ()}, "no factor whose effect could be estimated"),
    ],
)
def test_wrong_wishes_are_told(wish: dict[str, object], message: str, grid: Factors, draw: Drawer) -> None:
    with pytest.raises(ResultsError, match=message) as raised:
        factor_effects(draw(strengths(grid), observers=2), grid, **wish)  # type: ignore[arg-type]  # keywords by name
    assert len(raised.value.findings) == 1


def test_an_item_without_factors_and_no_answers_are_told(grid: Factors, draw: Drawer) -> None:
    answers = draw(strengths(grid), observers=2)
    with pytest.raises(ResultsError, match="no factors of 'red-stereo-1'"):
        factor_effects(answers, {name: one for name, one in grid.items() if name != "red-stereo-1"})


def test_ties_are_left_out_and_counted() -> None:
    answers = from_answers([Answer("a", "b", 3), Answer("b", "a", 1), Answer("a", "b", 2, tie=True)])
    found = factor_effects(answers, {"a": {"view": "x"}, "b": {"view": "y"}})
    assert found.ties_left_out == 2
    assert found.effects[0].estimate == pytest.approx(-np.log(3), abs=1e-12)


def test_tiny_weights_leave_intervals_by_observers(grid: Factors, draw: Drawer) -> None:
    answers = draw(strengths(grid))
    light = factor_effects(replace(answers, count=answers.count * 1e-4), grid)
    for own, other in zip(light.effects, factor_effects(answers, grid).effects, strict=True):
        assert (own.robust_low, own.robust_high) == pytest.approx((other.robust_low, other.robust_high), abs=0.02)


def test_tests_alone_conclude_the_same(grid: Factors, draw: Drawer) -> None:
    answers = draw(strengths(grid))
    whole, tests = factor_effects(answers, grid), factor_effects(answers, grid, tests_alone=True)
    assert (tests.effects, tests.explained) == ((), None)
    assert (tests.tests, tests.interactions) == (whole.tests, whole.interactions)
    assert [(one.question, one.verdict, one.p) for one in tests.conclusions] == [
        (one.question, one.verdict, one.p) for one in whole.conclusions
    ]
    assert [one.question for one in whole.conclusions][1] == "effect of 'view': stereo over flat"


def reasons(items: Factors, answers: Comparisons, **wishes: object) -> dict[str, str]:
    found = factor_effects(answers, items, **wishes)  # type: ignore[arg-type]  # keywords by name
    return {one.name: one.reason for one in found.left_out}


def test_factors_that_cannot_be_told_are_named_with_the_reason(grid: Factors, draw: Drawer) -> None:
    told: dict[str, dict[str, str | float]] = {
        name: {
            **one,
            "glasses": "shutter",
            "luminance_cd_m2": 26.5,
            "label": name,
            "hue": {"grey": "none", "blue": "cold", "red": "warm"}[str(one["paint"])],
            "brightness": 3 * float(one["exposure_s"]) + 1,
        }
        for name, one in grid.items()
    }
    told["grey-flat-1"]["flakes"] = "coarse"
    answers = draw(dict.fromkeys(grid, 0.0))
    found = reasons(told, answers)
    words = {
        "glasses": "shutter for every",
        "luminance_cd_m2": "26.5 for every",
        "label": "level of its own",
        "hue": "aliased: 'paint'",
        "brightness": "aliased: 'exposure_s'",
        "flakes": "'grey-flat-0.125' and 10 more",
    }
    assert set(found) == set(words)
    assert all(words[name] in found[name] for name in words)


def test_nested_and_joint_factors_are_partly_or_wholly_aliased(grid: Factors, draw: Drawer) -> None:
    answers = draw(dict.fromkeys(grid, 0.0))
    both = {name: {**one, "batch": f"{one['paint']}{one['view']}"} for name, one in grid.items()}
    assert "2 of its 5" in reasons(both, answers)["batch"]
    joint = reasons(both, answers, use=("batch", "view", "paint"))
    assert set(joint) == {"view", "paint"}
    assert all("aliased: 'batch'" in reason for reason in joint.values())


def test_a_factor_between_groups_that_never_met_is_told() -> None:
    pairs = [("a", "b"), ("b", "a"), ("c", "d"), ("d", "c")]
    answers = from_answers([Answer(*pair, 2 if pair[0] in "ac" else 1) for pair in pairs])
    told = {name: {"room": "one" if name in "ab" else "two", "view": "x" if name in "ac" else "y"} for name in "abcd"}
    found = factor_effects(answers, told, references={"view": "y"})
    (left_out,) = found.left_out
    assert left_out.name == "room"
    assert "never compared" in left_out.reason
    # What both rooms share can be told all the same: 4 wins of 6.
    assert found.effects[0].estimate == pytest.approx(np.log(2), abs=1e-12)
    assert known(found.explained).missing is not None


def test_numbers_that_nearly_follow_each_other_are_told_apart(grid: Factors, draw: Drawer) -> None:
    """Aliased is what rounding cannot tell apart, not what is merely alike."""
    answers = draw(dict.fromkeys(grid, 0.0))
    for unlike, kept in ((1e-4, True), (1e-14, False)):
        told = {
            name: {"one": float(place), "other": float(place) * (1 + unlike * place)} for place, name in enumerate(grid)
        }
        found = factor_effects(answers, told, use=("one", "other"))
        assert (len(found.factors) == 2) == kept
        assert found.converged


def test_nothing_that_varies_is_refused_by_name() -> None:
    answers = from_answers([Answer("a", "b"), Answer("b", "a")])
    with pytest.raises(ResultsError, match="'view': it is flat"):
        factor_effects(answers, {"a": {"view": "flat"}, "b": {"view": "flat"}})


def test_numbers_and_words_are_told_apart() -> None:
    told = {
        "a": {"exposure_s": 1, "on": True, "mixed": 1.0, "text": "1"},
        "b": {"exposure_s": 0.5, "on": False, "mixed": "one", "text": "0.5"},
    }
    factors, _ = read_factors(["a", "b"], told, FactorOptions())
    assert [(one.name, one.kind, one.levels) for one in factors] == [
        ("exposure_s", "numeric", ()),
        ("on", "categorical", ("yes", "no")),
        ("mixed", "categorical", ("1", "one")),
        ("text", "categorical", ("1", "0.5")),
    ]
    as_levels, _ = read_factors(["a", "b"], told, FactorOptions(use=("exposure_s",), categorical=("exposure_s",)))
    assert as_levels[0].levels == ("0.5", "1")
    by_reference, _ = read_factors(["a", "b"], told, FactorOptions(use=("exposure_s",), references={"exposure_s": 1}))
    assert by_reference[0].levels == ("1", "0.5")


@pytest.mark.parametrize(("value", "log"), [(float("nan"), ()), (float("inf"), ()), (0.0, ("x",)), (-1.0, ("x",))])
def test_unfit_numbers_are_told(value: float, log: tuple[str, ...]) -> None:
    with pytest.raises(ResultsError, match="the factor 'x' is"):
        read_factors(["a", "b"], {"a": {"x": 1.0}, "b": {"x": value}}, FactorOptions(log=log))


def test_columns_say_what_their_effects_mean() -> None:
    factor = Factor("paint", "categorical", ("a", "b", "c", "b"), ("a", "b", "c"))
    truth = np.array([0.3, -0.5, 1.1, -0.5])
    for coding, expected in (("treatment", [-0.8, 0.8]), ("sum", [0.0, -0.8, 0.8])):
        term = main_term(factor, coding)  # type: ignore[arg-type]  # one of its words
        beta = np.linalg.lstsq(np.column_stack([np.ones(4), term.columns]), truth, rcond=None)[0]
        np.testing.assert_allclose(term.contrasts @ beta[1:], expected, atol=1e-12)
    number = main_term(Factor("x", "numeric", (1e-9, 3e-9, 5e-9)), "treatment")
    assert number.columns.sum() == pytest.approx(0, abs=1e-12)
    slope = (number.columns[2, 0] - number.columns[0, 0]) / 4e-9
    assert number.contrasts[0, 0] * 1 == pytest.approx(slope, rel=1e-12)


def test_empty_cells_are_named_and_not_fitted(thesis: tuple[Comparisons, Factors]) -> None:
    answers, factors = thesis
    found = factor_effects(answers, factors, use=("view", "exposure_s", "tone_mapped"), categorical=("exposure_s",))
    told = {test.names: test for test in found.interactions}
    empty = told["exposure_s", "tone_mapped"]
    assert empty.statistic is empty.p is None
    assert told["view", "exposure_s"].df == 2
    assert told["view", "tone_mapped"].df == 1
    one, other = (Factor(name, "categorical", ("a", "b"), ("a", "b")) for name in "xy")
    assert empty_cell(one, other) == "no stimulus is 'a' (x) and 'b' (y)"
    assert empty_cell(one, Factor("z", "numeric", (1.0, 2.0))) is None
    terms = [main_term(factor, "treatment") for factor in (one, other)]
    assert interaction_term(*terms).columns.tolist() == [[0.0], [1.0]]


def test_factors_come_from_the_sessions_headers(make_session: Callable[..., SessionLog]) -> None:
    def stimuli(view: str) -> tuple[dict[str, object], ...]:
        return ({"name": "a", "factors": {"view": view}}, {"name": "b", "factors": {"view": "flat"}}, {"name": "c"})

    sessions = [make_session(f"{place}", names="abc", stimuli=stimuli("stereo")) for place in range(2)]
    assert session_factors(sessions) == {"a": {"view": "stereo"}, "b": {"view": "flat"}, "c": {}}
    other = make_session("9", names="abc", stimuli=stimuli("flat"))
    with pytest.raises(ResultsError, match="different factors of 'a'") as raised:
        session_factors([*sessions, other])
    assert raised.value.findings[0].file == str(Path("results/sub-9/ses-20260102T030405abcd/session.jsonl"))


# Experiment 2 of the thesis: what Section 4.5.2.3 says of its factors, from the scores of Table 4.4.


@pytest.fixture
def three(thesis: tuple[Comparisons, Factors]) -> FactorEffects:
    """The thesis's three factors: stereoscopy, exposure, and whether the dynamic range was adapted."""
    answers, factors = thesis
    wishes: dict[str, str | float] = {"view": "flat", "exposure_s": 0.125, "tone_mapped": "no"}
    return factor_effects(answers, factors, use=tuple(wishes), references=wishes)


def test_the_table_of_the_docs(three: FactorEffects) -> None:
    """Stereo clearly preferred, medium exposures before short before long ones, tone-mapped ones preferred less."""
    assert [effect.level for effect in three.effects] == ["stereo", "0.0666667", "1", "yes"]
    assert [effect.estimate for effect in three.effects] == pytest.approx([0.90, -0.18, -0.48, -0.63], abs=0.005)
    assert [test.statistic for test in three.tests] == pytest.approx([128.6, 21.2, 51.2], abs=0.05)
    assert [test.df for test in three.tests] == [1, 2, 1]


def test_the_factors_explain_nearly_all(three: FactorEffects) -> None:
    told = known(three.explained)
    assert known(told.deviance_share) > 0.95
    assert known(told.r_squared) > 0.94
    assert known(told.lack_of_fit_p) > 0.05


def test_image_and_view_as_the_recipe_has_them(thesis: tuple[Comparisons, Factors]) -> None:
    """Image takes up exposure and scale. Stereo has the largest test, though the images lie further apart."""
    answers, factors = thesis
    found = factor_effects(answers, factors, references={"view": "flat", "image": "3.2"})
    assert [one.name for one in found.left_out] == ["exposure_s", "luminance_scale", "tone_mapped"]
    assert all("'image' already explains" in one.reason for one in found.left_out)
    image, view = found.tests
    assert (image.name, image.df, view.name, view.df) == ("image", 4, "view", 1)
    assert view.statistic > image.statistic
    effect = {one.level: one.estimate for one in found.effects}
    order = sorted(("1.1", "1.2", "2.1", "3.1", "3.2"), key=lambda image: -effect.get(image, 0.0))
    assert order == ["2.1", "1.1", "3.1", "1.2", "3.2"]
    assert 0.85 < effect["stereo"] < effect["2.1"] < 1.1
    (interaction,) = found.interactions
    assert interaction.df == 4
    # The interaction makes the model free: what it gains is all that was lacking.
    assert interaction.statistic == pytest.approx(known(found.explained).lack_of_fit, abs=1e-9)
