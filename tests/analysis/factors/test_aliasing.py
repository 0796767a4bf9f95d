from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.errors import ResultsError
from analysis.factors import factor_effects, session_factors
from analysis.factors.terms import empty_cell, interaction_term, main_term
from analysis.factors.values import Factor, FactorOptions, read_factors
from analysis.records import SessionLog

Factors = Mapping[str, Mapping[str, str | float]]
Drawer = Callable[..., Comparisons]


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
    assert found.explained is not None
    assert found.explained.missing is not None


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
