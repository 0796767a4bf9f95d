"""What proves a way to score: ours keeps the promises, one that breaks a promise is found out, names are refused."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cyclopean.testing import BrokenPromiseError, prove_method
from documents import InputError
from runner.reports import METHODS, Scored
from tests.choice import nightly

SHARES = """
from documents.pages import Column, Table
from runner.reports import Scored

CYCLOPEAN_INTERFACE = 1

class Shares(Scored):
    refused = (*Scored.refused, "alpha")
    model = "thurstone"
    title = "Shares of answers, best first"

    @classmethod
    def of(cls, comparisons, options, common):
        from analysis.comparisons import split_groups

        parts = split_groups(comparisons) or [("", comparisons)]
        return cls({name: dict(zip(part.items, part.won / part.compared)) for name, part in parts}, options)

    def scales(self):
        best = {name: sorted(part.items(), key=lambda one: -one[1]) for name, part in self.value.items()}
        return [(name, [{"name": item, "share": share} for item, share in part]) for name, part in best.items()]

    def told(self):
        columns = (Column("item", "item"), Column("share", "share", "number", 3))
        return [Table("shares", "", columns, tuple(tuple(row.values()) for row in self.rows()))]

    def to_json(self):
        return {"items": self.rows()}
"""
BROKEN = {
    "-one[1]": ("one[1]", "they are dcba"),
    "part.won / part.compared": ("part.won / part.compared + (comparisons.winner[0] > 1)", "the rows are others"),
    "split_groups(comparisons) or ": ("", "their groups are"),
    "tuple(tuple(row.values()) for row in self.rows())": ("()", "'a' is not there"),
    '{"items": self.rows()}': ('{"items": float("nan")}', "not JSON compliant"),
    '"alpha")': ('"alpa")', "no option 'alpa'"),
}


def _shares(old: str = "", new: str = "") -> type[Scored]:
    held: dict[str, Any] = {"__name__": "shares"}
    exec(SHARES.replace(old, new) if old else SHARES, held)
    kind: type[Scored] = held["Shares"]
    return kind


@pytest.mark.parametrize("old", BROKEN)
def test_a_broken_promise_is_found(old: str) -> None:
    with pytest.raises(BrokenPromiseError, match=BROKEN[old][1]):
        prove_method("shares", method=_shares(old, BROKEN[old][0]))


@pytest.mark.parametrize("name", ["auto", *nightly("ml", "firth", "map")])
def test_ours_keeps_the_promises(name: str) -> None:
    assert len(prove_method(name)) == 5


def test_another_packages_is_typed_after_method(
    install: Callable[..., None],
    cyclopean: Callable[..., subprocess.CompletedProcess[str]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(METHODS, "_loaded", {})
    install("others", SHARES, group=METHODS.group, shares="Shares")
    assert len(prove_method("shares")) == 5
    table = tmp_path / "table.csv"
    table.write_text("winner,loser,count\na,b,3\nb,a,1\n", encoding="utf-8")
    told = cyclopean("scores", table, "--method", "shares", "--json").stdout
    assert '"share": 0.75' in told
    assert '"method_of": "others 1.0"' in told
    assert "the method 'shares' is of others 1.0" in cyclopean("scores", table, "--method", "shares").stdout
    for words, message in {
        ("--pairs",): "pairs does not go with the method shares",
        ("--model", "davidson"): "the method shares is for the model thurstone",
    }.items():
        assert message in cyclopean("scores", table, "--method", "shares", *words, expect=2).stderr
    with pytest.raises(InputError, match=r"there is no method 'shars' \(did you mean 'shares'\?\)"):
        prove_method("shars")
