"""`cyclopean scores` and `cyclopean report` as programs: what they print, and how they end."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable, Mapping
from itertools import combinations
from pathlib import Path
from typing import Any

import pytest

Call = Callable[..., subprocess.CompletedProcess[str]]
Table = Mapping[str, tuple[float, str]]

KEYS = {"name", "wins", "comparisons", "theta", "se", "score", "log10_score", "class"}


@pytest.fixture
def call(cyclopean: Call) -> Call:
    """Call the program with (words, what its standard input holds)."""
    return lambda words, text="": cyclopean(*words, text=text, expect=None)


def test_table_4_4_in_json(call: Call, table_4_4: Table, tmp_path: Path) -> None:
    lines = ["winner,loser,count"]
    for (a, (score_a, _)), (b, (score_b, _)) in combinations(table_4_4.items(), 2):
        p = score_a / (score_a + score_b)
        lines += [f"{a},{b},{30 * p!r}", f"{b},{a},{30 * (1 - p)!r}"]
    table = tmp_path / "table.csv"
    table.write_text("\n".join(lines), encoding="utf-8")
    done = call(["scores", str(table), "--alpha", "0.045", "--adjust", "none", "--json"])
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    keys = "items model method prior_sd covariance log_likelihood log_posterior deviance df goodness_of_fit "
    keys += (
        "parameters order_test held_by_prior ties_left_out converged iterations separated tests conclusions why work"
    )
    assert set(told) == set(keys.split())
    assert (told["model"], told["method"]) == ("bradley-terry", "ml")
    assert told["goodness_of_fit"]["p_deviance"] == pytest.approx(1)
    assert all(set(item) == {*KEYS, "jnd", "jnd_se"} for item in told["items"])
    assert [item["jnd"] for item in told["items"]] == pytest.approx(
        [item["theta"] / 1.0986122886681098 for item in told["items"]]
    )
    assert [item["name"] for item in told["items"]] == ["6", "4", "10", "3", "9", "5", "1", "7", "2", "8"]
    for item in told["items"]:
        score, label = table_4_4[item["name"]]
        assert f"{item['score']:.4f}" == f"{score:.4f}"
        assert item["class"] == label
        assert item["comparisons"] == pytest.approx(270)
    assert sum(item["theta"] for item in told["items"]) == pytest.approx(0, abs=1e-12)
    assert told["df"] == 36
    assert told["converged"] is True
    assert told["separated"] == []


def test_separated_items_are_named_and_the_penalised_fit_is_offered(call: Call) -> None:
    table = "winner,loser\na,b\na,c\nb,c\nc,b\n"
    done = call(["scores", "-", "--json", "--method", "ml"], table)
    assert done.returncode == 1
    told = json.loads(done.stdout)
    assert told["separated"] == ["a"]
    assert told["converged"] is False
    assert [item["theta"] for item in told["items"]] == [None, None, None]
    assert told["log_likelihood"] is None
    assert told["goodness_of_fit"] is None
    assert "'a': never lost to any of the other items" in done.stderr
    assert "--method firth" in done.stderr
    penalised = call(["scores", "-", "--json", "--pairs", "--method", "firth"], table)
    assert penalised.returncode == 0
    scored = json.loads(penalised.stdout)
    assert scored["items"][0]["name"] == "a"
    assert [pair["high"] is None for pair in scored["pairs"]["pairs"]] == [True, True, False]  # a's have no upper end
    assert json.loads(call(["scores", "-", "--json", "--pairs"], table).stdout) == scored
    assert "'a': never lost" in call(["scores", "-", "--method", "firth"], table).stdout
    apart = call(["scores", "-", "--json"], table + "d,e\n")
    assert (apart.returncode, json.loads(apart.stdout)["items"][0]["theta"]) == (1, None)


def test_a_wrong_table_ends_with_status_2_and_its_place(call: Call, tmp_path: Path) -> None:
    table = tmp_path / "table.csv"
    table.write_text("winner,loser\na,a\n", encoding="utf-8")
    done = call(["scores", str(table)])
    assert done.returncode == 2
    assert done.stdout == ""
    assert f"{table}:2:3: 'a' is compared with itself" in done.stderr
    assert call(["scores", str(tmp_path / "none.csv")]).returncode == 2
    for table_text in ("winner,loser\na,b\nb,a\n", "winner,loser\na,b\n"):
        assert call(["scores", "-", "--alpha", "2"], table_text).returncode == 2


def test_the_table_for_people_shows_scores_and_classes(call: Call) -> None:
    done = call(["scores", "-"], "winner,loser,count\na,b,3\nb,a,1\n")
    assert done.returncode == 0
    assert "0.7500" in done.stdout
    assert "class" in done.stdout


TIES = """winner,loser,observer,first,outcome
a,b,1,a,win
b,a,2,a,
a,b,3,b,tie
b,c,1,b,win
c,a,2,c,win
a,c,3,c,win
b,c,1,c,tie
c,b,1,b,win
a,b,2,b,win
a,c,1,a,win
c,a,3,a,win
b,a,1,b,win
"""


def told_by(call: Call, *options: str, table: str = TIES) -> dict[str, Any]:
    done = call(["scores", "-", "--json", *options], table)
    assert done.returncode == 0, done.stderr
    told: dict[str, Any] = json.loads(done.stdout)
    return told


@pytest.mark.parametrize(("model", "parameter"), [("davidson", "nu"), ("rao-kupper", "eta")])
def test_models_of_ties_tell_their_parameter_and_fit(call: Call, model: str, parameter: str) -> None:
    told = told_by(call, "--model", model, "--order-effect", "--covariance", "sandwich")
    assert [entry["name"] for entry in told["parameters"]] == [parameter, "order"]
    assert told["covariance"] == "sandwich"
    assert 0 <= told["order_test"]["p"] <= 1
    assert told["goodness_of_fit"]["df"] == told["df"] == 6 * 2 - 4
    assert "rough" in told["goodness_of_fit"]["caveat"]
    assert sum(item["score"] for item in told["items"]) == pytest.approx(1)
    assert all({*KEYS, "jnd", "jnd_se"} == set(item) for item in told["items"])


def test_thurstone_tells_jod_in_place_of_scores(call: Call) -> None:
    told = told_by(call, "--model", "thurstone")
    assert all(item["score"] is None for item in told["items"])
    assert [item["jod"] for item in told["items"]] == [item["jnd"] for item in told["items"]]
    assert told["items"][0]["jod"] == pytest.approx(told["items"][0]["theta"] / 0.6744897501960817)
    assert told["ties_left_out"] == 2
    shown = call(["scores", "-", "--model", "thurstone"], TIES)
    assert "JOD" in shown.stdout
    assert "2 answers prefer neither item" in shown.stdout


def test_a_prior_holds_what_is_separated_and_says_so(call: Call) -> None:
    table = "winner,loser\na,b\na,c\nb,c\nc,b\n"
    told = told_by(call, "--method", "map", "--prior-sd", "1.5", table=table)
    assert told["prior_sd"] == 1.5
    assert told["items"][0]["name"] == "a"
    assert told["log_posterior"] < told["log_likelihood"]
    assert "'a'" in told["held_by_prior"][0]
    assert "Only the prior" in call(["scores", "-", "--method", "map"], table).stdout
    assert call(["scores", "-", "--prior-sd", "1"], table).returncode == 2


def test_separation_in_a_model_of_ties_is_explained_with_status_1(call: Call) -> None:
    done = call(
        ["scores", "-", "--model", "davidson", "--method", "ml", "--json"],
        "winner,loser,ties\na,b,0\na,c,0\nb,c,1\nc,b,1\n",
    )
    assert done.returncode == 1
    told = json.loads(done.stdout)
    assert told["separated"] == ["a"]
    assert "'a', then" in told["why"][0]
    assert "'a', then" in done.stderr
    assert "--method map" in done.stderr


def test_quasi_variances_are_one_number_per_item_on_request(call: Call) -> None:
    told = told_by(call, "--quasi-variances")
    quasi = told["quasi_variances"]
    assert set(quasi["by_item"]) == {"a", "b", "c"}
    assert quasi["converged"] is True
    low, high = quasi["worst_relative_errors"]
    assert low == pytest.approx(0, abs=1e-9)  # three items: three differences, three numbers
    assert high == pytest.approx(0, abs=1e-9)
    shown = call(["scores", "-", "--quasi-variances"], TIES)
    assert "quasi se" in shown.stdout
    assert "quasi" not in call(["scores", "-"], TIES).stdout


def test_pairs_and_equivalence(call: Call) -> None:
    table = "winner,loser,count\na,b,40\nb,a,38\nb,c,70\nc,b,10\na,c,66\nc,a,12\n"
    done = call(["scores", "-", "--pairs", "--margin", "1jnd"], table)
    assert done.returncode == 0, done.stderr
    assert "1 of 3 pairs are equivalent, 2 distinguished, 0 not distinguished" in " ".join(done.stdout.split())
    values = json.loads(call(["scores", "-", "--pairs", "--margin", "1jnd", "--json"], table).stdout)
    assert [pair["second"] for pair in values["pairs"]["pairs"]] == ["a", "c", "c"]
    assert [pair["verdict"] for pair in values["equivalence"]["pairs"]] == [
        "equivalent",
        "distinguished",
        "distinguished",
    ]
    wrong = call(["scores", "-", "--margin", "large"], table)
    assert wrong.returncode == 2
    assert "0.5jnd" in wrong.stderr


def test_checks_and_multiverse(call: Call) -> None:
    lines = ["winner,loser,observer"]
    for observer in range(6):
        for number, (one, other) in enumerate(combinations("abcd", 2)):
            lines.append(f"{one},{other},{observer}" if (number + observer) % 3 else f"{other},{one},{observer}")
    done = call(["scores", "-", "--checks", "--multiverse"], "\n".join(lines))
    assert done.returncode == 0, done.stderr
    for words in ("break stochastic transitivity", "bad fit", "are predicted best by", "analyses"):
        assert words in " ".join(done.stdout.split()), words
    values = json.loads(call(["scores", "-", "--checks", "--multiverse", "--json"], "\n".join(lines)).stdout)
    assert values["transitivity"]["triples"] == 4
    assert len(values["residuals"]["pairs"]) == 6
    assert {line["model"] for line in values["model_comparison"]["models"]} == {"bradley-terry", "thurstone"}
    assert len(values["multiverse"]["analyses"]) == 2 * 4 * 4 * 7


def test_groups_have_a_table_each_and_are_named_where_they_have_no_scores(call: Call) -> None:
    lines = ["winner,loser,scene,observer"]
    for observer in "123":
        lines += [
            f"{pair},{scene},{observer}" for scene in ("church", "beach") for pair in ("a,b", "b,c", "c,a", "a,c")
        ]
    text = "\n".join(lines)
    printed = call(["scores", "-"], text)
    assert printed.returncode == 0, printed.stderr
    rows = [line.strip() for line in printed.stdout.splitlines()]
    assert [rows.index(name) for name in ("church", "beach", "all groups together")] == sorted(
        rows.index(name) for name in ("church", "beach", "all groups together")
    )
    assert any(line.startswith("one scale for all groups: ") for line in rows)
    done = call(["scores", "-", "--json"], text)
    values = json.loads(done.stdout)
    assert set(values) == {"groups", "pooled", "agreement", "notes", "work"}
    assert [group["name"] for group in values["groups"]] == ["church", "beach"]
    church = "\n".join(line.replace(",church", "") for line in lines if "beach" not in line).replace(",scene", "")
    alone = json.loads(call(["scores", "-", "--json"], church).stdout)
    # and the penalised one that tests of pairs profile; the intervals are those of neighbours
    assert alone.pop("work") == {"models_fitted": 2, "classes_found": 1, "profile_intervals": 2}
    assert {"name": "church", **alone} == values["groups"][0]
    without = call(["scores", "-"], "\n".join(line for line in lines if line[:9] not in ("c,a,beach",)))
    assert without.returncode == 0
    without = call(["scores", "-", "--method", "ml"], "\n".join(line for line in lines if line[:9] != "c,a,beach"))
    assert without.returncode == 1
    assert without.stderr.startswith("cyclopean: the group 'beach': no finite scores fit these comparisons:")
    assert "church" in without.stdout


@pytest.mark.parametrize(("wins", "verdict"), [(10, "distinguished"), (6, "not distinguished")])
def test_the_best_item_and_the_next_are_concluded_of(call: Call, wins: int, verdict: str) -> None:
    lines = [f"{'a,b' if place < wins else 'b,a'},{place}" for place in range(10)]
    lines += [f"{pair},{place}" for place in range(10) for pair in (("a,c", "b,c") if place else ("c,a", "c,b"))]
    table = "\n".join(["winner,loser,observer", *lines])
    told = json.loads(call(["scores", "-", "--json"], table).stdout)["conclusions"]
    assert [one["question"] for one in told] == ["a over b", "b over c"]
    assert told[0]["verdict"] == verdict
    assert told[0]["by_observers"]
    printed = " ".join(call(["scores", "-"], table).stdout.split())
    assert "a over b: " in printed
    assert f", {verdict} (p " in printed
    assert "b over c" not in printed
