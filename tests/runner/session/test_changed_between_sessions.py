"""Files that change between observers: named and refused before a session, told in its record and in the report."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from analysis.records import FILE_NAME, SessionLog, read_session, session_files
from runner.reports import ReportOptions, report_results
from runner.session import simulate

Study = Any  # tests/conftest.py

CHANGES = {
    "display": ("display.yaml", "gamma: 2.3", "gamma: 2.4", "display.yaml"),
    "rig": ("rig.yaml", "distance_mm: 700", "distance_mm: 600", "rig.yaml"),
    "experiment": ("small.yaml", "break_every: 4", "break_every: 3", "small.yaml"),
    "stimuli": (
        "recipe.yaml",
        "name: four, file: four.exr",
        "name: four, file: three.exr",
        "recipe.yaml, the picture four",
    ),
}


@pytest.fixture
def by_people(study: Study, unchained: Callable[[Path], None]) -> Study:
    """The study with a session of observer 01 that is called one of a person."""
    study.run(observer="01")
    of_people(study, unchained)
    return study


def of_people(study: Study, unchained: Callable[[Path], None]) -> None:
    for file in session_files(study.results):
        unchained(file)
        header, *lines = file.read_text(encoding="utf-8").splitlines(keepends=True)
        file.write_text(json.dumps(json.loads(header) | {"simulated": False}) + "\n" + "".join(lines), encoding="utf-8")


def checked(study: Study, *more: str) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    words = ("check", study.experiment, "--results", study.results, "--no-screen", "--json", *more)
    ((found,), _) = (json.loads(study.cyclopean(*words, expect=None).stdout), None)
    of_logs = [[one for one in found[kind] if "session.jsonl" in str(one["file"])] for kind in ("findings", "warnings")]
    return of_logs[0], of_logs[1]


def run_by_a_person(study: Study, *more: str) -> Any:
    """Refused without a window: there is no display in tests that open none."""
    return study.cyclopean("run", study.experiment, "--observer", "02", "--results", study.results, *more, expect=2)


@pytest.mark.parametrize(
    "what",
    [pytest.param(what, marks=[] if what in ("display", "stimuli") else pytest.mark.nightly) for what in CHANGES],
)
def test_what_changed_is_named_and_refused(by_people: Study, what: str) -> None:
    file, old, new, name = CHANGES[what]
    (log,) = session_files(by_people.results)
    before = log.read_bytes()
    by_people.edit(file, old, new)
    (error,), warnings = checked(by_people)
    assert warnings == []
    assert error["file"] == str(log)
    assert f"the {what} changed since observer 01's session" in error["message"]
    assert error["message"].endswith(f" UTC: {name}")
    assert "--accept-changes" in error["remedy"]
    errors, (warning,) = checked(by_people, "--accept-changes")
    assert (errors, warning["message"]) == ([], error["message"])
    assert error["message"] in run_by_a_person(by_people).stderr
    assert list(session_files(by_people.results)) == [log]
    assert log.read_bytes() == before


def test_what_did_not_change_is_not_named(by_people: Study) -> None:
    """A comment is nothing, also beside a change of another file, and neither is a study that was moved."""
    by_people.edit("rig.yaml", "distance_mm: 700", "distance_mm: 700 # measured with a tape")
    assert checked(by_people) == ([], [])
    by_people.edit("display.yaml", "gamma: 2.3", "gamma: 2.4")
    by_people.edit("small.yaml", "name: small", "name: small # of four pictures")
    ((error,), _) = checked(by_people)
    assert "small.yaml" not in error["message"]


def test_without_sessions_or_with_others_alone_nothing_is_said(study: Study) -> None:
    assert checked(study) == ([], [])
    study.run(observer="01")
    study.edit(*CHANGES["display"][:3])
    assert checked(study) == ([], [])  # a trial run by simulated observers keeps nobody from beginning


def test_an_earlier_log_that_cannot_be_read_is_named_and_keeps_nobody_from_beginning(study: Study) -> None:
    """The one between is read: it is compared with no more than the latest, and those after it are named."""
    for observer in ("01", "02", "03"):
        study.run(observer=observer)
    assert "cannot be read" not in study.run(observer="04").stderr
    for observer in ("01", "04"):  # before and after the session that the next one is compared with
        (file,) = session_files(study.results / "small" / f"sub-{observer}")
        when = file.stat()
        file.write_bytes(file.read_bytes().replace(b'"record":"trial"', b'"record":"trail"', 1))
        os.utime(file, ns=(when.st_atime_ns, when.st_mtime_ns))  # which parts sessions of one second
    told = [line for line in study.run(observer="05").stderr.splitlines() if "cannot be read" in line]
    assert len(told) == 1
    assert told[0].startswith(f"warning: {file}:")
    (log,) = session_files(study.results / "small" / "sub-05")
    (remark,) = [remark for remark in read_session(log).header.remarks if "cannot be read" in remark]
    assert told[0] == f"warning: {remark}"
    errors, warnings = checked(study)
    assert errors == []
    files = [warning["file"] for warning in warnings]
    assert str(file) in files
    assert len(files) == len(set(files))
    assert f"warning: {file}:" in run_by_a_person(study).stderr


def test_another_mode_or_another_station_s_display_is_no_change(
    by_people: Study, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    assert checked(by_people, "--mode", "quad-buffered") == ([], [])
    (log,) = session_files(by_people.results)
    header, rest = log.read_text(encoding="utf-8").split("\n", 1)
    log.write_text(json.dumps(json.loads(header) | {"station": "0123abcd"}) + "\n" + rest, encoding="utf-8")
    by_people.edit(*CHANGES["display"][:3])
    assert checked(by_people) == ([], [])
    by_people.edit(*CHANGES["experiment"][:3])
    ((error,), _) = checked(by_people)
    assert "the experiment changed" in error["message"]


def test_a_log_from_before_there_were_hashes_says_nothing(by_people: Study) -> None:
    (log,) = session_files(by_people.results)
    header, rest = log.read_text(encoding="utf-8").split("\n", 1)
    log.write_text(json.dumps(json.loads(header) | {"hashes": {}}) + "\n" + rest, encoding="utf-8")
    by_people.edit(*CHANGES["stimuli"][:3])
    assert checked(by_people) == ([], [])


@pytest.mark.usefixtures("undrawn")
def test_a_simulated_session_goes_on_and_its_record_and_the_report_say_it(study: Study) -> None:
    study.run(observer="01")
    study.edit(*CHANGES["stimuli"][:3])
    study.edit(*CHANGES["display"][:3])
    told = study.run(observer="02")
    study.run(observer="03")
    logs: dict[str, SessionLog] = {}
    for file in session_files(study.results):
        log = read_session(file)
        logs[log.header.observer] = log
    (remark,) = logs["02"].header.remarks
    assert "since observer 01's session" in remark
    assert remark.endswith(": recipe.yaml, display.yaml, the picture four")
    assert remark in told.stderr
    assert logs["03"].header.remarks == ()  # it is compared with the latest
    notes = report_results([study.results], options=ReportOptions(pictures=False)).report.notes
    (note,) = [note for note in notes if "changed between sessions" in note]
    assert "recipe.yaml, display.yaml, the picture " in note
    assert note.endswith("observers 01; 02 and 03.")
    study.edit(*CHANGES["rig"][:3])
    (folder,) = simulate(study.experiment, study.observers, ["04"], results=study.results).folders
    (remark,) = read_session(folder / FILE_NAME).header.remarks
    assert remark.endswith(": rig.yaml")


def test_a_resume_names_what_changed_since_it_began(study: Study) -> None:
    study.run(observer="01")
    (file,) = session_files(study.results)
    file.write_bytes(b"".join(file.read_bytes().splitlines(keepends=True)[:4]))
    study.edit(*CHANGES["stimuli"][:3])
    told = study.run("--resume", expect=2)
    assert "began: recipe.yaml, the picture four" in told.stderr


@pytest.mark.window
@pytest.mark.nightly
def test_accepted_the_session_runs_and_its_record_says_so(person: Any, unchained: Callable[[Path], None]) -> None:
    person.study.run(observer="03")
    of_people(person.study, unchained)
    person.study.edit(*CHANGES["display"][:3])
    person.refused_to_sit_down("the display changed since observer 03's session")
    person.sit_down("--accept-changes")
    person.turn("space", "the first pair")
    person.answer("Up")
    person.turn("Escape")
    person.press("s")
    told = person.leave()
    assert "--accept-changes" not in told.split("Continue:")[-1]
    logs = [read_session(file) for file in session_files(person.study.results)]
    (remarks,) = [log.header.remarks for log in logs if log.header.observer == "07"]
    (remark,) = [remark for remark in remarks if "changed since" in remark]
    assert remark.endswith("UTC: display.yaml (--accept-changes)")
