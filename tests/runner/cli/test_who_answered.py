"""Simulated observers beside people: who is said to have answered, and who counts."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import cyclopean
from documents import InputError
from tests.invoked import invoked, printed
from tests.runner.cli.sessions import NAMES, write_session

PEOPLE, SIMULATED = ("01", "02"), ("01", "91", "92")
Folder = Callable[..., Path]


@pytest.fixture
def folder(tmp_path: Path) -> Folder:
    def make(people: tuple[str, ...], simulated: tuple[str, ...]) -> Path:
        results = tmp_path / f"results-{len(people)}-{'-'.join(simulated)}"
        for observer in people:
            write_session(results, observer, simulated=False)
        for observer in simulated:
            write_session(results, observer)
        return results

    return make


def _reported(*words: object) -> dict[str, Any]:
    return dict(json.loads(printed("report", *words, "--no-thumbnails", "--json")))


@pytest.mark.usefixtures("undrawn")
def test_simulated_sessions_make_no_person_simulated_and_are_left_out(folder: Folder) -> None:
    results = folder(PEOPLE, SIMULATED)
    told = printed("report", results, "--no-thumbnails")
    assert "2 observers, 24 comparisons" in told
    assert "--with-simulated" in told
    page = (results / "report.html").read_text(encoding="utf-8")
    assert "2 observers took part in 2 sessions." in page
    assert "3 simulated observers left out" in page


@pytest.mark.nightly
@pytest.mark.usefixtures("undrawn")
def test_asked_for_they_count_and_a_shared_code_stays_two_observers(folder: Folder) -> None:
    results = folder(PEOPLE, SIMULATED)
    values = _reported(results, "--with-simulated")
    assert "5 sessions; 3 of them were simulated" in (results / "report.html").read_text(encoding="utf-8")
    assert sorted(values["observers"]) == ["01", "01 (simulated)", "02", "91", "92"]
    assert values["simulated_observers"] == ["01 (simulated)", "91", "92"]
    assert (values["trials"], values["simulated"], values["left_out"]["simulated"]) == (60, False, [])


@pytest.mark.nightly
@pytest.mark.usefixtures("undrawn")
def test_simulated_observers_alone_are_reported_as_such(folder: Folder) -> None:
    alone = folder((), SIMULATED)
    values = _reported(alone)
    assert (values["trials"], values["simulated"]) == (36, True)
    assert "all of them were simulated" in (alone / "report.html").read_text(encoding="utf-8")


def _scored(answers: Any) -> tuple[str, ...]:
    scores: Any = cyclopean.scores(answers).value
    return tuple(scores.comparisons.observers)


def test_trials_say_who_was_simulated_and_are_not_pooled(folder: Folder, tmp_path: Path) -> None:
    results = folder(PEOPLE, SIMULATED)
    trials = cyclopean.read_results(results)
    assert trials.groupby("simulated")["session"].nunique().to_dict() == {False: 2, True: 3}
    with pytest.raises(InputError, match="people and of simulated"):
        cyclopean.scores(trials)
    table = tmp_path / "trials.csv"
    trials.to_csv(table, index=False)
    refused = invoked("scores", table)
    assert isinstance(refused.exception, InputError)
    assert "people and of simulated" in str(refused.exception)
    assert _scored(trials[~trials["simulated"]]) == PEOPLE
    assert _scored(trials[trials["simulated"]]) == SIMULATED
    assert _scored(results) == PEOPLE
    assert [line["observer"] for line in cyclopean.observers(results).rows] == list(PEOPLE)


def _participants(dataset: Path) -> dict[str, str]:
    with (dataset / "participants.tsv").open(encoding="utf-8") as file:
        return {row["participant_id"]: row["simulated"] for row in csv.DictReader(file, delimiter="\t")}


def _trials(dataset: Path) -> set[tuple[str, str]]:
    found = set()
    for table in dataset.glob("sub-*/ses-*/beh/*_beh.tsv"):
        with table.open(encoding="utf-8") as file:
            found |= {(table.parts[-3], row["simulated"]) for row in csv.DictReader(file, delimiter="\t")}
    return {(session.removeprefix("ses-"), simulated) for session, simulated in found}


def test_a_dataset_has_simulated_observers_only_where_asked_for(folder: Folder, tmp_path: Path) -> None:
    results, dataset = folder(PEOPLE, SIMULATED), tmp_path / "bids"
    told = printed("export", results, "-o", dataset)
    assert "3 sessions of simulated observers are left out" in told
    assert _participants(dataset) == {"sub-01": "false", "sub-02": "false"}
    told = printed("export", results, "-o", dataset, "--with-simulated")
    assert "share the code 01" in told
    assert _participants(dataset) == {"sub-01": "some", "sub-02": "false", "sub-91": "true", "sub-92": "true"}
    assert ("s01simulated", "true") in _trials(dataset)
    assert ("s01", "false") in _trials(dataset)


def test_a_shared_code_is_told_only_where_there_is_one(folder: Folder, tmp_path: Path) -> None:
    words = ("-o", tmp_path / "bids", "--with-simulated")
    told = printed("export", folder(PEOPLE, ("91", "92")), *words)
    assert "2 of 4 sessions are simulated" in told
    assert "share the code" not in told
    named = ("--license", "CC0", "--author", "B. A.", "--author", "A. B.", "--name", "Plates")  # in any order
    assert "note:" not in printed("export", folder(PEOPLE, ()), "-o", tmp_path / "people", *named)
    about = json.loads((tmp_path / "people" / "dataset_description.json").read_text("utf-8"))
    assert (about["Name"], about["Authors"], about["License"]) == ("Plates", ["B. A.", "A. B."], "CC0")


def test_earlier_answers_for_power_are_those_of_people(folder: Folder, tmp_path: Path) -> None:
    from extensions.power.assumed import earlier_answers

    results = folder(PEOPLE, SIMULATED)
    answers, notes = earlier_answers(results)
    assert (answers.observers, len(notes)) == (PEOPLE, 1)
    answers, notes = earlier_answers(results, with_simulated=True)
    assert (len(answers.observers), notes) == (5, ())


@pytest.mark.parametrize("form", ["folder", "table"])
def test_functions_count_simulated_observers_beside_people_when_asked(folder: Folder, form: str) -> None:
    """As the command's `--with-simulated`: 24 answers of people, 60 with those of simulated observers."""
    results = folder(PEOPLE, SIMULATED)
    answers = results if form == "folder" else cyclopean.read_results(results)
    factors = None if form == "folder" else {name: {"size": float(place)} for place, name in enumerate(NAMES)}
    fitted = cyclopean.scores(answers, with_simulated=True).to_frame()
    assert fitted["comparisons"].sum() == 2 * 60
    both = cyclopean.observers(answers, with_simulated=True).to_frame()
    assert sorted(both["observer"]) == ["01", "01 (simulated)", "02", "91", "92"]
    assert both["answers"].sum() == 60
    (effect,) = cyclopean.effects(answers, factors, with_simulated=True).to_frame().to_dict("records")
    if form == "table":
        with pytest.raises(InputError, match="people and of simulated observers"):
            cyclopean.scores(answers)
        return
    assert cyclopean.scores(answers).to_frame()["comparisons"].sum() == 2 * 24
    assert sorted(cyclopean.observers(answers).to_frame()["observer"]) == list(PEOPLE)
    assert cyclopean.effects(answers, factors).to_frame()["estimate"][0] != effect["estimate"]


def test_people_alone_count_as_they_are_when_simulated_observers_are_asked_for(folder: Folder) -> None:
    results = folder(PEOPLE, ())
    for answers in (results, cyclopean.read_results(results)):
        asked, plain = (cyclopean.scores(answers, with_simulated=each).to_frame() for each in (True, False))
        assert asked.equals(plain)
