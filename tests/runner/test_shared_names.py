"""Names that two blocks share: refused where they mean different things, and distinguished in sessions that exist."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from analysis.errors import ResultsError
from analysis.records import FILE_NAME, SessionLog, read_session
from analysis.report import describe, write_report
from analysis.series import gather
from documents import InputError
from extensions.bids import export_dataset
from runner.check import CheckOptions, check_file
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
