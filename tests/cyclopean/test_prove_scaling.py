"""What proves a law of choice: ours keep the promises, one that breaks one is found out; another package's is used."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from analysis.scaling import LAWS, MODELS, Law
from cyclopean.testing import BrokenPromiseError, prove_scaling

LAW = """
import numpy as np
from analysis.scaling import Law, Slopes

CYCLOPEAN_INTERFACE = 1

class Sech(Law):
    jnd = 2 / np.pi * np.log(np.tan(3 * np.pi / 8))
    unit = "sech"

    def probabilities(self, d, k=0.0):
        first = 2 / np.pi * np.arctan(np.exp(np.pi / 2 * d))
        return first, 2 / np.pi * np.arctan(np.exp(-np.pi / 2 * d)), np.zeros_like(d)

    def log_likelihood(self, counts, d, k=0.0):
        first, second, _ = self.probabilities(d)
        return counts.won * np.log(first) + counts.lost * np.log(second)

    def slopes(self, counts, d, k=0.0):
        first, second, _ = self.probabilities(d)
        density, bend = 0.5 / np.cosh(np.pi / 2 * d), np.pi / 2 * np.tanh(np.pi / 2 * d)
        ahead, behind = density / first, density / second
        information = counts.won * ahead * (ahead + bend) + counts.lost * behind * (behind - bend)
        return Slopes(counts.won * ahead - counts.lost * behind, information)

    def difference(self, chance):
        return 2 / np.pi * np.log(np.tan(np.pi / 2 * chance))

SECH = Sech()
"""
BROKEN = {
    "sum to 1": {"np.zeros_like(d)": "np.zeros_like(d) + 0.01"},
    "sides are alike": {
        "np.arctan(np.exp(np.pi / 2 * d))": "np.arctan(np.exp(np.pi / 2 * d + 0.1))",
        "2 / np.pi * np.arctan(np.exp(-np.pi / 2 * d)),": "1 - first,",
    },
    "75 : 25": {"np.tan(3 * np.pi / 8)": "np.tan(np.pi / 3)"},
    r"difference\(0.75\)": {"np.pi / 2 * chance": "np.pi / 2.1 * chance"},
    "likelihood is that": {"counts.lost * np.log(second)": "counts.won * np.log(second)"},
    "likelihood: d is": {"- counts.lost * behind, inf": "+ counts.lost * behind, inf"},
    "likelihood: dd is": {"(behind - bend)": "(behind + bend)"},
    "far out": {"2 / np.pi * np.arctan(np.exp(-np.pi / 2 * d)),": "1 - first,"},
    "one maximum": {  # Cauchy's
        "2 / np.pi * np.arctan(np.exp(np.pi / 2 * d))": "0.5 + np.arctan(d) / np.pi",
        "2 / np.pi * np.arctan(np.exp(-np.pi / 2 * d))": "0.5 - np.arctan(d) / np.pi",
        "0.5 / np.cosh(np.pi / 2 * d)": "1 / np.pi / (1 + d * d)",
        "np.pi / 2 * np.tanh(np.pi / 2 * d)": "2 * d / (1 + d * d)",
        "2 / np.pi * np.log(np.tan(3 * np.pi / 8))": "1.0",
        "2 / np.pi * np.log(np.tan(np.pi / 2 * chance))": "np.tan(np.pi * (chance - 0.5))",
    },
}


def _law(changed: dict[str, str]) -> Law:
    held: dict[str, Law] = {}
    text = LAW
    for old, new in changed.items():
        assert old in text
        text = text.replace(old, new)
    exec(text, held)
    return held["SECH"]


@pytest.mark.parametrize("model", MODELS)
def test_ours_keep_the_promises(model: str) -> None:
    assert len(prove_scaling(model)) == 9


@pytest.mark.parametrize("said", BROKEN)
def test_a_broken_promise_is_found(said: str) -> None:
    with pytest.raises(BrokenPromiseError, match=said):
        prove_scaling("sech", law=_law(BROKEN[said]))


def test_another_packages_law_is_found_by_its_name_and_named(
    install: Callable[..., None], cyclopean: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(LAWS, "_loaded", {})
    install("laws", LAW, "2.1", group=LAWS.group, sech="SECH")
    install("torn", LAW.replace("return first", "return 1 / 0"), group=LAWS.group, torn="SECH")
    assert len(prove_scaling("sech")) == 9
    table = tmp_path / "table.csv"
    table.write_text("winner,loser,count\na,b,30\nb,a,10\n")
    found = json.loads(cyclopean("scores", table, "--model", "sech", "--checks", "--margin", "0.5jnd", "--json").stdout)
    assert (found["model"], found["model_of"]) == ("sech", "laws 2.1")
    assert found["items"][0]["jod"] == pytest.approx(0.5)  # 30 of 40 are 1 JOD apart
    assert found["equivalence"]["margin"] == pytest.approx(0.2806, abs=1e-3)
    assert "laws 2.1" in cyclopean("scores", table, "--model", "sech").stdout
    told = cyclopean("scores", table, "--model", "sceh", expect=2).stderr
    assert "no model 'sceh' (did you mean 'sech'?)" in told
    assert "torn 1.0" in cyclopean("scores", table, "--model", "torn", expect=2).stderr
