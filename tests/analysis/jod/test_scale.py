"""Scales in JOD with intervals, and observers who differ."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from itertools import combinations
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binom, norm

from analysis.bootstrap.replicates import draw_observers
from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.errors import ResultsError
from analysis.jod import scale_jod
from analysis.jod.fits import fit_jod
from cyclopean import scores

Call = Callable[..., subprocess.CompletedProcess[str]]
TRUE_JOD = {"a": 0.0, "b": 0.6, "c": 1.5, "d": 1.2}


@pytest.fixture
def answers() -> Comparisons:
    """Six observers, three answers to each pair of four items; the last answers against the others."""
    random, told = np.random.default_rng(8), []
    for observer in range(6):
        for first, second in list(combinations("abcd", 2)) * 3:
            apart = (TRUE_JOD[first] - TRUE_JOD[second]) * (-1 if observer == 5 else 1)
            won = random.random() < norm.cdf(apart / 1.4826)
            told.append(Answer(*((first, second) if won else (second, first)), observer=f"o{observer}"))
    return from_answers(told, items="abcd")


def test_the_first_item_is_at_zero_unless_another_is_named(answers: Comparisons) -> None:
    ((_, first),) = scale_jod(answers, replicates=20).scales
    ((_, other),) = scale_jod(answers, replicates=20, zero="c").scales
    assert (first.zero, other.zero) == ("a", "c")
    assert first.jod[0] == other.jod[2] == 0
    assert first.jod - first.jod[2] == pytest.approx(other.jod)
    assert [item.name for item in first.items] == [item.name for item in other.items]
    zero = next(item for item in other.items if item.name == "c")
    assert (zero.jod, zero.low, zero.high) == (0, 0, 0)


def test_intervals_are_percentiles_of_scales_of_drawn_observers(answers: Comparisons) -> None:
    ((_, scale),) = scale_jod(answers, replicates=40, seed=3, alpha=0.1).scales
    drawn = []
    for weights in draw_observers(6, 40, 3):
        (jod,) = fit_jod(np.einsum("s,sij->ij", weights, answers.wins_by_observer())[None], "gaussian").jod
        drawn.append(jod - jod[0])
    # MATLAB's prctile: the i-th of n values is the 100 (i − 0.5)/n percentile.
    places = 100 * (np.arange(1, 41) - 0.5) / 40
    for item in scale.items:
        values = np.sort(np.array(drawn)[:, "abcd".index(item.name)])
        assert item.low == pytest.approx(np.interp(5, places, values), abs=1e-8)
        assert item.high == pytest.approx(np.interp(95, places, values), abs=1e-8)


def test_an_observer_is_judged_by_the_scale_of_the_others(answers: Comparisons) -> None:
    people = scale_jod(answers, replicates=20).observers
    own, logs = answers.wins_by_observer(), []
    for observer in range(6):
        (jod,) = fit_jod((own.sum(axis=0) - own[observer])[None], "gaussian").jod
        chance = norm.cdf((jod[:, None] - jod[None]) / 1.4826)
        p = binom.pmf(own[observer], own[observer] + own[observer].T, chance)
        logs.append(float(np.log(p[np.triu_indices(4, 1)]).sum()))
    ranked = np.sort(logs)
    lower, upper = ranked[1], ranked[4]  # MATLAB's quartiles of six values
    assert [one.log_likelihood for one in people] == pytest.approx(logs)
    expected = [max(lower - value, 0) / (upper - lower) for value in logs]
    assert [one.distance for one in people] == pytest.approx(expected)
    assert [one.name for one in people if one.worth_a_look] == ["o5"]


def test_without_observers_there_are_no_intervals() -> None:
    ((_, scale),) = scale_jod(from_answers([Answer("a", "b", 3), Answer("b", "a", 9)])).scales
    assert (scale.covariance, scale.replicates, scale.items[0].low) == (None, 0, None)
    assert scale.items[0].jod == pytest.approx(1.0, abs=1e-3)


def test_where_there_is_no_maximum_there_is_no_number(cyclopean: Call) -> None:
    done = cyclopean("scores", "-", "--method", "pwcmp", "--json", text="winner,loser,count\na,b,5\n", expect=1)
    assert [(item["name"], item["jod"]) for item in json.loads(done.stdout)["items"]] == [("a", None), ("b", None)]
    assert "--model thurstone --method map" in done.stderr


def test_groups_have_scales_of_their_own() -> None:
    counts = {"church": {"ab": 1, "ba": 3}, "beach": {"ab": 3, "ba": 1, "ca": 2, "ac": 1}}
    told = [
        Answer(pair[0], pair[1], times, f"o{who}", group=group)
        for who in range(4)
        for group, own in counts.items()
        for pair, times in own.items()
    ]
    scales = scale_jod(from_answers(told), replicates=20)
    assert [(name, [item.name for item in scale.items]) for name, scale in scales.scales] == [
        ("church", ["b", "a"]),
        ("beach", ["c", "a", "b"]),
    ]
    assert len(scales.observers) == 4
    with pytest.raises(ResultsError, match="there is no item 'c' in the group 'church'"):
        scale_jod(from_answers(told), zero="c")


@pytest.mark.parametrize(
    ("told", "options", "message"),
    [
        ([Answer("a", "b", 0.5)], {}, r"'a' was preferred over 'b' 0\.5 times: pwcmp takes whole counts \(use another"),
        ([Answer("a", "b"), Answer("c", "d")], {}, "items of different groups"),
        ([Answer("a", "b")], {"prior": "none"}, "use --distance-prior gaussian"),
        ([Answer("a", "b")], {"zero": "B"}, r"there is no item 'B' \(the items are a, b\)"),
        ([Answer("a", "b")], {"prior": "flat"}, "there is no prior on distances 'flat'"),
        ([Answer("a", "b")], {"replicates": 3}, "3 replicates were asked for"),
        ([Answer("a", "b")], {"alpha": 2.0}, "alpha is 2"),
    ],
)
def test_what_has_no_scale_is_refused(told: list[Answer], options: dict[str, object], message: str) -> None:
    with pytest.raises(ResultsError, match=message):
        scale_jod(from_answers(told), **options)  # type: ignore[arg-type]


@pytest.mark.nightly
def test_the_command_and_python_agree(cyclopean: Call, tmp_path: Path) -> None:
    lines = ["winner,loser,count,observer"]
    lines += [f"{a},{b},{n},{who}" for who in "xyz" for a, b, n in (("a", "b", 1), ("b", "a", 3), ("b", "c", 2))]
    table = tmp_path / "t.csv"
    table.write_text("\n".join(lines), encoding="utf-8")
    done = cyclopean("scores", str(table), "--method", "pwcmp", "--jod-zero", "c", "--json")
    told = json.loads(done.stdout)
    assert (told["method"], told["model"], told["zero"], told["distance_prior"]) == (
        "pwcmp", "thurstone", "c", "gaussian",
    )  # fmt: skip
    by_python = scores(pd.read_csv(table), method="pwcmp", jod_zero="c").to_frame()
    assert by_python["jod"].tolist() == pytest.approx([item["jod"] for item in told["items"]])
    assert list(told["items"][0]) == ["name", "wins", "comparisons", "jod", "jod_low", "jod_high", "class"]
    plain = cyclopean("scores", str(table), "--method", "pwcmp").stdout
    assert "'a' is at 0 JOD" in plain
    assert "no observer" not in plain  # three observers have no quartiles


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--method", "pwcmp", "--pairs"], "pairs does not go with the method pwcmp"),
        (["--method", "pwcmp", "--model", "davidson"], "the method pwcmp is for the model thurstone"),
        (["--jod-zero", "a"], "jod_zero and distance_prior go with the method pwcmp"),
    ],
)
def test_options_that_do_not_go_together(cyclopean: Call, words: list[str], message: str) -> None:
    done = cyclopean("scores", "-", *words, expect=2)
    assert message in done.stderr
