"""Whatever `check` accepts runs, and whatever ran is reported, exported and replayed."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings

from tests.runner.generated_experiments import write
from tests.runner.mixed_experiments import mixed_experiments, mutants
from tests.runner.whole_way import whole_way

Drawn = dict[str, Any]
UNCHECKED = [HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
PLAIN: Drawn = {
    "panel": (1280, 720),
    "mode": "flat",
    "stereo": False,
    "question": "Which?",
    "layout": {"arrangement": "vertical", "size_mm": [5, 4], "gap_mm": 1, "reference": "none"},
    "blocks": [],
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    folder = tmp_path_factory.mktemp("drawn")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CYCLOPEAN_CACHE", str(folder / "cache"))
        yield folder


numbers = count()


def taken(drawn: Drawn, folder: Path, *, page: bool) -> bool:
    """Write an experiment and take it the whole way; return whether `check` accepted it."""
    file = write(drawn, folder)
    place = folder / f"way-{next(numbers)}"
    try:
        return whole_way(file, folder / "observers.yaml", place, page=page)
    finally:
        shutil.rmtree(place, ignore_errors=True)


# More of both: tests/stress.
@pytest.mark.promise("check-runs")
@given(drawn=mixed_experiments())
@settings(max_examples=3, suppress_health_check=UNCHECKED)
def test_experiments_of_all_kinds_mixed(drawn: Drawn, folder: Path) -> None:
    taken(drawn, folder, page=False)


@pytest.mark.promise("check-runs")
@given(drawn=mutants())
@settings(max_examples=6, suppress_health_check=UNCHECKED)
def test_experiments_that_were_edited_without_rules(drawn: Drawn, folder: Path) -> None:
    taken(drawn, folder, page=False)


SCALE = {"name": "quality", "question": "How good"}
WAYS: dict[str, list[dict[str, Any]]] = {
    "words alone": [{"kind": "instructions", "text": "Look."}],
    "a questionnaire alone": [
        {"kind": "questionnaire", "questions": [{"kind": "text", "name": "age", "question": "How old"}]}
    ],
    "practice alone": [{"kind": "practice", "trials": 2, "block": {"kind": "all_pairs"}}],
    "practice of a test": [
        {"kind": "practice", "trials": 2, "block": {"kind": "screening", "tests": [{"test": "near_acuity"}]}}
    ],
    "a kind twice": [
        {"kind": "best_of_series", "series": {"a": ["a", "b"], "first": ["b", "c"]}},
        {"kind": "best_of_series", "series": {"a": ["a", "b"]}, "ratings": [SCALE]},
        {"kind": "rating", "stimuli": ["a", "b"], "ratings": [SCALE]},
        {"kind": "rating", "stimuli": ["b", "c"], "ratings": [SCALE]},
    ],
}


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize(
    "way", [pytest.param(way, marks=[] if way == "a kind twice" else pytest.mark.nightly) for way in WAYS]
)
def test_what_has_gone_wrong(way: str, folder: Path) -> None:
    assert taken({**PLAIN, "blocks": WAYS[way]}, folder, page=True)


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize("law", ["davidson", pytest.param("rao_kupper", marks=pytest.mark.nightly)])
def test_ties_alone_have_no_scores(law: str, folder: Path) -> None:
    behaviour = {"ties": {"law": law, "width": 1e9}}
    assert taken(
        {**PLAIN, "behaviour": behaviour, "blocks": [{"kind": "all_pairs", "ties": "both"}]}, folder, page=True
    )


@pytest.mark.parametrize(
    "block",
    [
        {"kind": "active_pairs", "trials": 3, "within": "scene"},
        {"kind": "all_pairs", "stimuli": ["a", "b"], "catch": {"pairs": [["a", "b"], ["b", "a"]], "identical": 1}},
        {"kind": "preference", "pairs": "all"},
        {"kind": "all_pairs", "repeats": 10**9},
    ],
)
def test_a_wrong_block_is_a_finding_where_keys_are_set_too(block: Drawn, folder: Path) -> None:
    assert not taken({**PLAIN, "blocks": [block], "more": {"keys": {"left": ["1"]}}}, folder, page=False)
