"""`cyclopean power` on experiments as people write them."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from functools import partial
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analysis.errors import ResultsError
from tests.invoked import invoked, printed_json

Cyclopean = Callable[..., subprocess.CompletedProcess[str]]  # tests/conftest.py
Study = Any  # tests/conftest.py
ROOT = Path(__file__).parents[3]
THESIS = str(ROOT / "experiments/dynamic_range.yaml")
ENDS = ("low", "sd", "high")
TABLE_4_4 = str(ROOT / "configs/observers/table_4_4.yaml")


ask, told = partial(invoked, "power"), partial(printed_json, "power")


def test_the_thesis_s_design_by_its_own_scores() -> None:
    found = told(THESIS, "--scores", TABLE_4_4, "--observers", "10:30:20", "--replicates", "40")
    assert [size["observers"] for size in found["sizes"]] == [10, 30]
    assert (found["alpha"], found["adjust"]) == (0.05, "holm")  # the experiment's
    assert len(found["items"]) == 10
    assert len(found["sizes"][0]["pairs"]) == 45
    # Table 4.4's classes part 33 of the 45 pairs.
    assert len(found["needed"]["pairs"]) == 33
    apart = next(pair for pair in found["sizes"][1]["pairs"] if set(pair["items"]) == {"2.1-stereo", "3.2-flat"})
    assert apart["should_differ"]
    assert apart["separates"] > 0.99


@pytest.mark.parametrize(("words", "sizes"), [("7", [7]), ("5:12:3", [5, 8, 11]), ("9,5:6,5", [5, 6, 9])])
def test_numbers_of_observers(words: str, sizes: list[int]) -> None:
    found = told(THESIS, "--observers", words, "--replicates", "2")
    assert [size["observers"] for size in found["sizes"]] == sizes


def test_without_scores_a_spread_is_assumed_and_said() -> None:
    found = told(THESIS, "--observers", "10", "--replicates", "20")
    thetas = [item["theta"] for item in found["items"]]
    assert max(thetas) - min(thetas) == pytest.approx(2.0)
    assert "equal steps over 2 nats" in found["notes"][0]
    assert "88 times in 100" in found["notes"][0]


@pytest.mark.parametrize(
    ("asked", "kind"), [("auto", "shrinkage"), ("model", "model"), ("sandwich", "sandwich"), ("scaled", "scaled")]
)
def test_standard_errors_are_those_that_the_experiment_asks_for(study: Study, asked: str, kind: str) -> None:
    head = study.experiment.read_text().split("analysis:")[0]
    study.experiment.write_text(head + f"analysis: {{covariance: {asked}}}\n")
    words = (str(study.experiment), "--observers", "8", "--replicates", "20")
    assert told(*words)["covariance"] == kind
    assert told(*words, "--covariance", "scaled")["covariance"] == "scaled"


@pytest.fixture(scope="module")
def pilot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A table of 12 observers who differ by 1 nat."""
    random = np.random.default_rng(1)
    names = [item["name"] for item in told(THESIS, "--observers", "5", "--replicates", "2")["items"]]
    lines = ["winner,loser,observer"]
    for person in range(12):
        own = np.linspace(1.0, -1.0, len(names)) + random.normal(0, 1, len(names))
        for one, other in combinations(range(len(names)), 2):
            won = random.random() < 1 / (1 + np.exp(own[other] - own[one]))
            lines.append(f"{names[one if won else other]},{names[other if won else one]},{person}")
    table = tmp_path_factory.mktemp("pilot") / "pilot.csv"
    table.write_text("\n".join(lines) + "\n")
    return table


def test_earlier_answers_say_how_much_observers_differ(pilot: Path, tmp_path: Path) -> None:
    words = (THESIS, "--observers", "10", "--replicates", "10")
    measured = told(*words, "--observers-from", str(pilot))
    fitted = printed_json("scores", pilot, "--observers", "random")
    spread = {"sd": fitted["spread"]["sd"], "source": "measured", "low": fitted["spread"]["low"]}
    assert measured["observer_spread"] == spread | {"high": fitted["spread"]["high"]}
    assert 0.6 < measured["observer_sd"] < 1.4
    assert measured["scores_of"] == "average"
    assert [line["observer_sd"] for line in measured["by_observer_sd"]] == sorted(fitted["spread"][k] for k in ENDS)
    (tmp_path / "random.json").write_text(json.dumps(fitted))
    typical = {item["name"]: item["theta"] for item in fitted["groups"][0]["items"]}
    for scores in (pilot, tmp_path / "random.json"):
        both = told(*words, "--scores", str(scores))
        assert both["observer_spread"] == measured["observer_spread"]
        assert both["scores_of"] == "typical"
        assert {item["name"]: item["theta"] for item in both["items"]} == pytest.approx(typical, abs=1e-9)


def test_answers_that_set_no_limit_are_compared_with_a_large_spread(tmp_path: Path) -> None:
    table = tmp_path / "two.csv"
    table.write_text("winner,loser,observer\na,b,1\nb,a,2\na,b,2\n")
    found = told(THESIS, "--observers", "10", "--replicates", "10", "--observers-from", str(table))
    assert found["observer_spread"]["high"] is None
    assert "with no upper limit" in found["notes"][1]
    assert [line["observer_sd"] for line in found["by_observer_sd"]] == [0.0, 1.5]


@pytest.mark.parametrize(
    ("words", "finding"),
    [
        (["--observers", "60:10"], "'60:10' is not a number of observers"),
        (["--observers", "0"], "'0' is not a number of observers"),
        (["--observers", "many"], "'many' is neither a number nor a range such as 10:60:5"),
        (["--observers", "1:100000"], "more than 1000 numbers"),
        (["--adjust", "some"], "'some' is not one of"),
        (["--spread", "2", "--scores", TABLE_4_4], "do not go together"),
        (["--scheduler", "tcp://127.0.0.1:1", "--workers", "2"], "do not go together"),
        (["--observer-sd", "0", "--observers-from", "pilot.csv"], "do not go together"),
        (["--json", "--csv", "-"], "would go to the terminal"),
    ],
)
def test_wrong_words_are_refused(words: list[str], finding: str) -> None:
    result = ask(THESIS, *words)
    assert isinstance(result.exception, ResultsError) or result.exit_code == 2
    assert finding in " ".join(f"{result.output} {result.exception}".split())


@pytest.mark.parametrize(
    ("words", "status", "finding"),
    [
        (
            [THESIS, "--pair", "2.1-stereo", "2.1-stero"],
            2,
            "no item '2.1-stero' to compare (did you mean '2.1-stereo'?)",
        ),
        ([str(ROOT / "experiments/exposure_series.yaml")], 2, "no block compares all pairs"),
        ([THESIS, "--scores", "no.json"], 2, "no.json"),
        ([THESIS, "--observers-from", "no.csv"], 2, "no.csv"),
        ([THESIS, "--observers-from", TABLE_4_4], 2, "neither a table of comparisons nor results"),
        ([THESIS, "--spread", "-1"], 2, "the spread is -1 nats"),
        ([THESIS, "--spread", "nan"], 2, "--spread"),
        ([THESIS, "--power", "1.5"], 2, "the power is 1.5"),
        ([THESIS, "--observers", "5", "--replicates", "5", "-o", "/proc/none/p.html"], 1, "cannot be written"),
        ([THESIS, "--observers", "5", "--scheduler", "nonsense"], 1, "no Dask scheduler answers at nonsense"),
    ],
)
def test_what_is_wrong_is_said_in_a_line(cyclopean: Cyclopean, words: list[str], status: int, finding: str) -> None:
    told = cyclopean("power", *words, expect=status)
    assert finding in told.stderr
    assert "Traceback" not in told.stderr


def test_observers_and_limits_are_refused_in_words(cyclopean: Callable[..., Any]) -> None:
    for words in (("--observers", "9" * 5000), ("--observers", "1-100000000"), ("--observers", "1e999")):
        told = cyclopean("power", "experiments/dynamic_range.yaml", *words, expect=2)
        assert told.stderr.splitlines()[-1].startswith(("Error: ", "error: "))
