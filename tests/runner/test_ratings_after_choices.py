"""Ratings that follow a choice between two pictures: on the page, in JSON and CSV, apart from those of single ones."""

from __future__ import annotations

import csv
import json
from collections import defaultdict
from pathlib import Path
from statistics import fmean
from typing import Any

import pytest
from click.testing import CliRunner

from analysis.kinds import RecordError
from analysis.ratings import summarise_ratings
from analysis.records import read_results
from analysis.records.lines import read_header
from runner.cli.main import group
from runner.session import simulate

Study = Any  # tests/conftest.py
BLOCKS = "  - {kind: instructions, text: Look at the two pictures.}\n  - {kind: all_pairs, break_every: 4}\n"
PAIRS = (
    "{kind: all_pairs, ties: both, catch: {every: 2, pairs: [[four, one]], identical: 1}, ratings: "
    "[{name: quality, question: How good, highest: 5}, {name: gloss, question: How glossy, of: both, highest: 9}]}"
)
RATING = "{kind: rating, ratings: [{name: quality, question: How good, highest: 5}]}"
TWO = (("chosen", "quality"), ("both", "gloss"))
PRACTICE = f"{{kind: practice, trials: 3, block: {PAIRS}}}"


def record(study: Study, *blocks: str) -> None:
    study.edit("small.yaml", BLOCKS, "".join(f"  - {block}\n" for block in blocks))
    simulate(study.experiment, study.observers, 3, results=study.results)


def report(study: Study) -> tuple[dict[str, Any], str, dict[str, list[dict[str, str]]]]:
    """Return what the command prints as JSON, its page, and its tables by name."""
    page, tables = study.folder / "page.html", study.folder / "tables"
    words = ["report", str(study.results), "-o", str(page), "--csv", str(tables), "--json", "--no-thumbnails"]
    done = CliRunner().invoke(group, words, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    read = {file.stem: list(csv.DictReader(file.read_text(encoding="utf-8").splitlines())) for file in tables.iterdir()}
    return json.loads(done.stdout), page.read_text(encoding="utf-8"), read


def by_hand(results: Path) -> dict[tuple[str, str], dict[str, float]]:
    """Return each stimulus's mean over observers by what was rated and scale, from the lines of the logs."""
    given: dict[tuple[str, str], dict[str, dict[str, list[int]]]] = defaultdict(
        lambda: defaultdict(lambda: defaultdict(list))
    )
    for file in results.rglob("session.jsonl"):
        for line in map(json.loads, file.read_text(encoding="utf-8").splitlines()):
            if "catch" in line or line.get("kind") == "practice":
                continue
            for scale, value in (line.get("ratings") or {}).items():
                if isinstance(value, dict):
                    rated = [(line[role], number) for role, number in value.items()]
                    of = "both"
                else:
                    of = "alone" if line["kind"] == "rating" else "chosen"
                    rated = [(line["stimulus"] if of == "alone" else line.get("chosen"), value)]
                for stimulus, number in rated:
                    if number is not None:
                        given[of, scale][stimulus][file.parents[1].name].append(number)
    return {
        which: {name: fmean(fmean(values) for values in people.values()) for name, people in stimuli.items()}
        for which, stimuli in given.items()
    }


@pytest.mark.usefixtures("undrawn")
def test_they_are_reported_by_what_was_rated_and_never_pooled(study: Study) -> None:
    record(study, PRACTICE, PAIRS, RATING)
    found, page, tables = report(study)
    expected = by_hand(study.results)
    assert set(expected) == {("alone", "quality"), *TWO}
    scales = found["ratings"]["scales"]
    assert [(one["of"], one["scale"]) for one in scales] == [("alone", "quality"), *TWO]
    for one in scales:
        means = {score["stimulus"]: score["mean"] for score in one["scores"]}
        assert means == pytest.approx(expected[one["of"], one["scale"]])
    for of, scale, name in (
        ("alone", "quality", "ratings_quality"),
        ("chosen", "quality", "ratings_quality_chosen"),
        ("both", "gloss", "ratings_gloss_both"),
    ):
        means = {row["stimulus"]: float(row["mean"]) for row in tables[name]}
        assert means == pytest.approx(expected[of, scale])
    for caption in ("Mean opinion scores: quality", "chosen of two: quality", "both stimuli of a pair: gloss"):
        assert caption in page
    assert "observers, 12 ratings." in page


@pytest.mark.nightly
def test_logs_say_where_scales_end(study: Study) -> None:
    record(study, RATING, PAIRS)
    logs = list(study.results.rglob("session.jsonl"))
    planned = [json.loads(log.read_text(encoding="utf-8").splitlines()[0])["planned"] for log in logs]
    scales = [block.get("scales") for block in planned[0]]
    assert scales == [{"quality": [1, 5]}, {"quality": [1, 5], "gloss": [1, 9]}]
    assert [scale.ends for scale in summarise_ratings(read_results(study.results)).scales] == [(1, 5), (1, 5), (1, 9)]
    header = json.loads(logs[0].read_text(encoding="utf-8").splitlines()[0])
    read_header(header)
    header["planned"][0]["scales"]["quality"] = [5, 5]
    with pytest.raises(RecordError, match="lowest number of each scale"):
        read_header(header)
