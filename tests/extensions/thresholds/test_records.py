"""Records of thresholds: each contradiction in them is named, and what answers say is reported and exported."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from analysis.errors import ResultsError
from analysis.records import SessionLog, read_session
from analysis.report import write_report
from runner.observers import BradleyTerryObserver
from runner.observers.behaviour import BehaviourSpec, PsychometricSpec
from runner.session import Session
from tests.answers import altered, changed
from tests.runner.changed_logs import recorded
from tests.runner.every_kind import HEADER, Stage, blocks_of

Line = dict[str, Any]
PLACES, STAIRS, SCENES, CATCH = range(4)


def _changed(folder: Path, variant: int, change: Callable[[list[Line]], None]) -> str:
    """Return what is said of a log without checksums after a change to its trials."""
    lines = [json.loads(line) for line in recorded(folder, "threshold", variant, "01")]
    trials = [line for line in lines if line.get("kind") == "threshold"]
    change(trials)
    for line in lines:
        for key in ("line", "chain", "lines", "chained"):
            line.pop(key, None)
    file = folder / "session.jsonl"
    file.write_text("".join(json.dumps(line) + "\n" for line in lines))
    try:
        read_session(file)
    except ResultsError as error:
        (finding,) = error.findings
        return finding.message
    return ""


def _set(number: int, **values: Any) -> Callable[[list[Line]], None]:
    return lambda trials: trials[number].update(values)


def _other(trials: list[Line]) -> None:
    trials[2]["correct"] = not trials[2]["correct"]


def _swapped(trials: list[Line]) -> None:
    other = {"first": "second", "second": "first"}[trials[2]["answer"]]
    trials[2].update(answer=other, correct=other == trials[2]["correct_answer"])


def _no_track(trials: list[Line]) -> None:
    del trials[2]["track"]


@pytest.mark.parametrize(
    ("variant", "change", "told"),
    [
        (PLACES, lambda trials: None, ""),
        (PLACES, _other, "and 'correct' is"),
        (PLACES, _swapped, "but the key"),
        (PLACES, _set(1, answer="yes"), "the answer is 'yes', which the task two_places has not"),
        (PLACES, _set(1, level=7.5), "its level is 7.5, but the codec of"),
        (PLACES, _set(1, level=None, track=None, track_trial=None), "a forced choice has a 'level'"),
        (PLACES, _set(1, reference="a", stimulus="a"), "it compares 'a' with itself"),
        (PLACES, _set(1, first_position="interval_1"), "the task two_places has no place 'interval_1'"),
        (PLACES, _set(1, correct=None), "belong to a forced choice, all of them"),
        (PLACES, _set(3, track_trial=5), "trial 5 of track 0 follows its trial 2"),
        (PLACES, _set(3, function="logistic"), "track 0 is of another task, factor, group, method or function"),
        (PLACES, _no_track, "'track' and 'track_trial' belong to trials with a 'level'"),
        (PLACES, _set(0, track_trial=1), "track 0 begins with its trial 1"),
        (SCENES, _set(0, group="harbour"), "its group is 'harbour', but the scene of"),
        (SCENES, _set(0, group=None), "'group' and 'group_factor' are there together or not at all"),
        (STAIRS, _set(0, method="guess"), "'method' is"),
        (CATCH, _set(0, correct=True), "belong to a forced choice, all of them"),
    ],
)
def test_each_contradiction_is_named(variant: int, change: Any, told: str, tmp_path: Path) -> None:
    said = _changed(tmp_path, variant, change)
    assert told in said
    assert bool(said) == bool(told)


def _log(observer: str, threshold: float, variant: int = PLACES) -> SessionLog:
    """Return the log of someone who sees codec 2 in half of the cases beyond guessing."""
    import random

    seen = {"codec": PsychometricSpec(threshold=threshold, slope=6)}
    simulated = BradleyTerryObserver({}, random.Random(observer), behaviour=BehaviourSpec(psychometric=seen))
    stage = Stage()
    for times in range(6):  # six sessions' worth of trials: the block is short
        Session(blocks_of("threshold", variant, f"{observer}-{times}")[1:2], stage, simulated, stage).run()
    trials = tuple(changed(trial, block=number) for number, trial in enumerate(stage.trials))
    stimuli = tuple({"name": name, "factors": {}, "flat": True} for name in "abcdef")
    return SessionLog(Path(f"{observer}.jsonl"), altered(HEADER, observer=observer, stimuli=stimuli), trials, True)


@pytest.mark.usefixtures("undrawn")
def test_a_report_has_each_observer_and_the_mean(tmp_path: Path) -> None:
    sessions = [_log("01", 1.9), _log("02", 2.1), _log("03", 1e-6)]
    report = write_report(sessions, tmp_path / "report.html", csv_folder=tmp_path / "tables")
    (question,) = report.to_json()["thresholds"]
    numbers = {each["observer"]: each for each in question["observers"]}
    assert numbers["03"]["threshold"] is None
    assert numbers["03"]["reason"].startswith("all answers are right")
    own = [numbers[observer]["threshold"] for observer in ("01", "02")]
    assert all(1.2 < value < 2.8 for value in own)
    mean = question["over_observers"]["threshold"]
    assert (mean["observers"], mean["value"]) == (2, pytest.approx((own[0] * own[1]) ** 0.5))
    assert mean["low"] <= mean["value"] <= mean["high"]
    assert question["over_observers"]["guess"] == {
        **question["over_observers"]["guess"],
        "value": 0.5,
        "low": None,
        "high": None,
    }
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "1 of 3 thresholds cannot be estimated." in page
    assert numbers["03"]["reason"] in page
    table = (tmp_path / "tables" / "thresholds_1.csv").read_text().splitlines()
    assert table[0].startswith("observer,threshold,threshold_low,threshold_high,slope,")
    assert [row.split(",")[0] for row in table[1:]] == ["01", "02", "03"]
    assert table[3].split(",")[1:4] == ["", "", ""]


@pytest.mark.usefixtures("undrawn")
def test_a_report_says_what_a_level_of_zero_does_to_the_axis(tmp_path: Path) -> None:
    log = _log("01", 1.9)
    lowest = min(trial.details()["level"] for trial in log.trials)
    trials = [changed(t, data={**t.details(), "level": 0}) if t.details()["level"] == lowest else t for t in log.trials]
    for session, said in ((log, 0), (SessionLog(log.file, log.header, tuple(trials), True), 1)):
        told = write_report([session], tmp_path / f"{said}.html").to_json()
        (question,) = told["thresholds"]
        notes = [note for note in told["notes"] if "blanks=(" in note]
        assert len(notes) == said
        assert (question["warning"] != "") == bool(said)
        assert ("blanks=(" in (tmp_path / f"{said}.html").read_text("utf-8")) == bool(said)
