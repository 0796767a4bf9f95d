"""Names that two blocks share: refused where they mean different things, and distinguished in sessions that exist."""

from __future__ import annotations

import csv
import json
from collections import defaultdict
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from statistics import fmean
from typing import Any

import pytest
from click.testing import CliRunner

from analysis.errors import ResultsError
from analysis.kinds import RecordError
from analysis.ratings import summarise_ratings
from analysis.records import FILE_NAME, SessionLog, read_results, read_session
from analysis.records.lines import read_header
from analysis.report import describe, write_report
from analysis.series import gather
from documents import InputError
from extensions.bids import export_dataset
from runner.check import CheckOptions, check_file
from runner.cli.main import group
from runner.session import SessionOptions, run_session, simulate
from tests.answers import changed

Study = Any  # tests/conftest.py
BLOCKS = "  - {kind: instructions, text: Look at the two pictures.}\n  - {kind: all_pairs, break_every: 4}\n"


def write(study: Study, *blocks: str) -> None:
    study.edit("small.yaml", BLOCKS, "".join(f"  - {block}\n" for block in blocks))


def rating(highest: int, kind: str = "rating") -> str:
    return f"{{kind: {kind}, ratings: [{{name: quality, question: How good, highest: {highest}}}]}}"


def findings(study: Study) -> list[str]:
    checked = check_file(study.experiment, CheckOptions(False, study.results, pictures=False))
    return [str(error).removeprefix(f"{study.folder}/") for error in checked.errors]


ONE = "{kind: best_of_series, series: {one: [one, two, three]}}"
OTHER = "{kind: best_of_series, series: {one: [two, four]}}"
AROUND = ("{kind: all_pairs}", ONE, OTHER)


def test_series_of_one_name_with_other_pictures_are_refused(study: Study) -> None:
    write(study, *AROUND)
    (error,) = findings(study)
    assert error.startswith("small.yaml:10:37: the series 'one' means two, four here")
    assert "(line 9)" in error
    assert "such as 'one_2'" in error
    for begin in (
        lambda: simulate(study.experiment, study.observers, results=study.results),
        lambda: run_session(study.experiment, "01", SessionOptions(study.results, simulate=study.observers)),
    ):
        with pytest.raises(InputError, match="the series 'one' means two, four here"):
            begin()
    assert not study.results.exists()


@pytest.mark.parametrize(
    ("blocks", "said"),
    [
        ((ONE, ONE), None),
        ((ONE, "{kind: practice, trials: 1, block: {kind: best_of_series, series: {one: [two, four]}}}"), None),
        ((ONE, "{kind: best_of_series, series: {one: [three, two, one]}}"), "means three, two, one here"),
        ((rating(5), rating(5)), None),
        (
            (rating(5), rating(9)),
            "the scale 'quality' means 1 to 9 here and 1 to 5 in block 1 (line 8)",
        ),
        (
            (
                rating(5),
                rating(9, "best_of_series, series: {one: [one, two]}"),
            ),
            None,
        ),
    ],
)
def test_names_may_be_shared_that_mean_the_same(study: Study, blocks: tuple[str, ...], said: str | None) -> None:
    write(study, *blocks)
    errors = findings(study)
    assert len(errors) == (said is not None), errors
    assert said is None or said in errors[0]


FACTORS = {"one": ("a-b", "c", 1), "two": ("a-b", "c", 2), "three": ("a", "b-c", 1), "four": ("a", "b-c", 2)}


def factors(study: Study) -> None:
    for name, (scene, codec, level) in FACTORS.items():
        study.edit(
            "recipe.yaml",
            f"file: {name}.exr",
            f"file: {name}.exr, factors: {{scene: {scene}, codec: {codec}, level: {level}}}",
        )


BY = "{kind: best_of_series, series: {by: [scene, codec], order: level}}"


def test_series_that_factors_give_one_name_are_refused(study: Study) -> None:
    factors(study)
    write(study, BY)
    (error,) = findings(study)
    assert error.startswith("small.yaml:8:37: ")
    assert "'a-b-c'" in error
    assert "list the series by name" in error


@pytest.fixture
def recorded(study: Study, monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[SessionLog, ...]]:
    """Record sessions of experiments that were not refused before."""

    def record(*blocks: str) -> tuple[SessionLog, ...]:
        write(study, *blocks)
        with monkeypatch.context() as patch:
            patch.setattr("runner.protocol.experiment._name_clashes", lambda *words: ())
            done = simulate(study.experiment, study.observers, 2, results=study.results)
        return tuple(read_session(folder / FILE_NAME) for folder in done.folders)

    return record


@pytest.mark.usefixtures("undrawn")
def test_sessions_with_one_name_for_two_series_are_scored_by_block(
    study: Study, recorded: Callable[..., tuple[SessionLog, ...]], tmp_path: Path
) -> None:
    logs = recorded(*AROUND)
    choices = gather(logs)
    assert {series.name: series.stimuli for series in choices.design.series} == {
        "one (block 2)": ("one", "two", "three"),
        "one (block 3)": ("two", "four"),
    }
    assert choices.counts.tolist() == [[1, 1], [1, 1]]
    report = write_report(logs, tmp_path / "report.html", csv_folder=tmp_path / "tables")
    text = json.dumps(report.to_json(), allow_nan=False)
    assert text.count("one (block 2)") >= 3
    assert "one (block 3)" in (tmp_path / "report.html").read_text(encoding="utf-8")
    exported = export_dataset([study.results], tmp_path / "bids")
    assert exported.sessions == 2
    rows = (tmp_path / "bids/sub-01").rglob("*_beh.tsv")
    assert sum('["two","four"]' in file.read_text().replace(" ", "").replace('""', '"') for file in rows) == 1


def test_series_that_factors_gave_one_name_are_told_apart(
    study: Study, recorded: Callable[..., tuple[SessionLog, ...]]
) -> None:
    factors(study)
    logs = recorded(BY)
    assert [series.name for series in gather(logs).design.series] == [
        "a-b-c (block 1, one to two)",
        "a-b-c (block 1, three to four)",
    ]
    assert describe(logs).by_part["series"] is not None


def test_a_series_of_other_pictures_in_another_session_is_refused(
    study: Study, recorded: Callable[..., tuple[SessionLog, ...]]
) -> None:
    log, other = recorded(ONE)
    (trial,) = other.trials
    bent = changed(trial, data={**trial.details(), "stimuli": ["one", "two", "four"]})
    with pytest.raises(ResultsError, match="shows other pictures as 'one' than"):
        gather([log, replace(other, records=(bent,))])


# Ratings that follow a choice between two pictures: on the page, in JSON and CSV, apart from those of single ones.


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


@pytest.mark.nightly
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
