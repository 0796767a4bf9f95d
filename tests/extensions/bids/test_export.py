"""`cyclopean export`: what stands in the tables is what was recorded, and the official validator agrees."""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from analysis.errors import ResultsError
from analysis.records import Change, Mark, Note, Resumption, read_session
from extensions.bids import About, export_dataset, unescape
from tests.answers import changed

# From sessions to a dataset: what stands in the tables is what was recorded.

Lab = Any  # conftest.py
NAME = "sub-01_ses-20260102T030405abcd_task-dynamicrange"
PLACE = f"sub-01/ses-20260102T030405abcd/beh/{NAME}"


def table(file: Path) -> list[dict[str, str]]:
    """Read a table the plain way: BIDS knows no quotes."""
    header, *lines = file.read_bytes().decode("utf-8").split("\n")[:-1]
    return [dict(zip(header.split("\t"), line.split("\t"), strict=True)) for line in lines]


def exported(lab: Lab, **about: Any) -> Path:
    return export_dataset([lab.folder / "results"], lab.folder / "bids", About(**about)).folder


def test_a_row_holds_what_its_trial_recorded(lab: Lab) -> None:
    lab.session()
    row = table(exported(lab) / f"{PLACE}_beh.tsv")[1]
    assert row["onset"] == "1.25"
    assert (row["block"], row["trial"], row["attempt"]) == ("0", "1", "0")
    assert (row["trial_type"], row["response_time"]) == ("all_pairs", "1.25")
    assert row["utc"] == "2026-01-02T03:04:01.250+00:00"
    assert json.loads(row["events"]) == [["up", 1.25]]
    assert (row["first"], row["second"], row["chosen"]) == ("two", "three", "two")
    assert row["clipping_first_left_percent_any"] == row["clipping_second_right_percent_any"] == "0.75"


def test_every_column_is_described_and_stands_in_every_table_of_the_task(lab: Lab) -> None:
    lab.session()
    lab.session(
        [lab.trial("rating", {"stimulus": "one", "ratings": {"quality": 4}, "rating_times_s": {"quality": 0.5}})],
        observer="02",
        session="s2",
    )
    folder = exported(lab)
    described = json.loads((folder / "task-dynamicrange_beh.json").read_text())
    files = sorted(folder.glob("sub-*/ses-*/beh/*_beh.tsv"))
    assert len(files) == 2
    for file in files:
        assert list(table(file)[0]) == list(described)
    for definition in described.values():
        assert len(definition["Description"]) > 10
    assert table(files[1])[0]["first"] == table(files[0])[0]["ratings_quality"] == "n/a"
    assert set(described["trial_type"]["Levels"]) == {"all_pairs", "rating"}


def test_only_last_attempts_count_and_the_rest_is_told_as_events(lab: Lab) -> None:
    again = changed(
        lab.pair(0, attempt=1, chosen="two", rejected="one", answer="second"),
        events=(("down", 1.25),),
        utc="2026-01-02T03:05:01.250+00:00",
    )
    lab.session(
        [
            lab.pair(0),
            lab.pair(1),
            Note(text="dim\tlight\u202e", by="experimenter", block=0, trial=2, utc="2026-01-02T03:04:20.000+00:00"),
            Mark(block=0, trial=0, by="observer", utc="2026-01-02T03:04:30.000+00:00"),
            Resumption(utc="2026-01-02T03:05:00.000+00:00", accepted_changes={"rig": Change(before="a", now="b")}),
            again,
        ]
    )
    folder = exported(lab)
    rows = table(folder / f"{PLACE}_beh.tsv")
    assert [(row["trial"], row["attempt"], row["chosen"]) for row in rows] == [("0", "1", "two"), ("1", "0", "two")]
    events = table(folder / f"{PLACE}_events.tsv")
    assert [event["trial_type"] for event in events] == ["superseded_answer", "note", "mark", "resumption"]
    assert [float(event["onset"]) for event in events] == [0.25, 20, 30, 60]
    assert json.loads(events[0]["value"])["chosen"] == "one"
    assert unescape(events[1]["value"]) == "dim\tlight\u202e"
    assert (events[2]["block"], events[2]["trial"], events[2]["by"]) == ("0", "0", "observer")
    assert json.loads(events[3]["value"]) == {
        "rig": {"before": "a", "now": "b"},
        "gap_s": 30.0,
        "clock_behind_s": 0.0,
    }
    described = json.loads((folder / "task-dynamicrange_events.json").read_text())
    assert list(described) == list(events[0])


def test_a_session_without_such_events_has_no_table_of_them(lab: Lab) -> None:
    lab.session()
    assert not list(exported(lab).rglob("*_events.*"))


def test_the_sidecar_says_how_the_session_was_made(lab: Lab) -> None:
    file = lab.session(complete=False)
    folder = exported(lab)
    made = json.loads((folder / f"{PLACE}_beh.json").read_text())
    assert made["TaskName"] == "dynamic_range"
    screen = made["StimulusPresentation"]
    assert (screen["ScreenDistance"], screen["ScreenRefreshRate"]) == (0.7, 120.0)
    assert screen["ScreenResolution"] == [1920, 1080]
    assert screen["ScreenSize"] == pytest.approx([0.531456, 0.298944])
    assert (made["StereoMode"], made["Glasses"]) == ("side-by-side", "Nvidia 3D Vision")
    assert made["SHA256"] == {"experiment": "ab" * 32}
    assert made["SessionComplete"] is False
    assert made["SimulatedObserver"] is True
    raw = folder / made["RawRecord"]["URI"].removeprefix("bids::")
    assert raw.read_bytes() == file.read_bytes()


def test_participants_carry_codes_only(lab: Lab) -> None:
    lab.session(observer="b", session="s1")
    lab.session(observer="a", session="s2")
    lab.session(observer="a", session="s3")
    folder = exported(lab)
    assert (folder / "participants.tsv").read_text() == ("participant_id\tsimulated\nsub-a\ttrue\nsub-b\ttrue\n")
    assert list(json.loads((folder / "participants.json").read_text())) == ["participant_id", "simulated"]


def test_the_description_holds_what_people_gave(lab: Lab) -> None:
    lab.session()
    made = json.loads(
        (exported(lab, name="A\u202eB", authors=("C D", "E F"), license="CC0") / "dataset_description.json").read_text()
    )
    assert (made["Name"], made["Authors"], made["License"]) == ("A\u202eB", ["C D", "E F"], "CC0")
    assert made["DatasetType"] == "raw"
    assert made["GeneratedBy"][0]["Name"] == "cyclopean"
    assert "\u202e" not in (lab.folder / "bids" / "README").read_text()


def test_one_observer_in_two_experiments_is_one_participant(lab: Lab) -> None:
    lab.session()
    lab.session(station="results/more", experiment="gloss")
    done = export_dataset([lab.folder / "results"], lab.folder / "bids")
    assert (done.participants, done.sessions) == (1, 2)
    assert done.tasks == {"dynamicrange": "dynamic_range", "gloss": "gloss"}


def test_a_log_that_something_else_wrote_is_refused(lab: Lab) -> None:
    file = lab.session()
    file.write_text(file.read_text().replace('"response_time_s": 1.25', '"response_time_s": "fast"'))
    with pytest.raises(ResultsError, match="should be a valid number"):
        exported(lab)
    assert not (lab.folder / "bids").exists()


def test_a_session_that_goes_on_meanwhile_is_not_half_exported(lab: Lab) -> None:
    file = lab.session(complete=False)

    def answer(what: str, done: int, of: int) -> None:
        if (what, done) == ("Writing sessions", 0):
            file.write_text(file.read_text() + json.dumps(lab.pair(3).to_json()) + "\n")

    with pytest.raises(ResultsError, match="changed while it was exported"):
        export_dataset([lab.folder / "results"], lab.folder / "bids", progress=answer)
    assert not (lab.folder / "bids").exists()


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)
# Keys that are no field's, nor but for a letter.
KEYS = st.text().map(lambda key: key + "\N{SNOWMAN}" * 2)


def _leaves(value: Any) -> list[Any]:
    if isinstance(value, dict) and value:
        return [leaf for inner in value.values() for leaf in _leaves(inner)]
    return [value]


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.dictionaries(KEYS, JSON, max_size=4), min_size=1, max_size=4), st.text())
def test_whatever_was_recorded_stands_in_the_table(lab: Lab, trials: list[dict[str, Any]], note: str) -> None:
    with tempfile.TemporaryDirectory(dir=lab.folder) as place:
        here = type(lab)(Path(place))
        records = [here.trial("instructions", data, trial=number) for number, data in enumerate(trials)]
        log = read_session(
            here.session(
                [*records, Note(text=note, by="observer", block=0, trial=1, utc="2026-01-02T03:04:06Z")], question=note
            )
        )
        folder = exported(here)
        rows = table(folder / f"{PLACE}_beh.tsv")
        described = json.loads((folder / "task-dynamicrange_beh.json").read_text())
        assert len(rows) == len(log.trials)
        for row, trial in zip(rows, log.trials, strict=True):
            assert list(row) == list(described)
            assert unescape(row["trial_type"]) == trial.kind
            cells = list(row.values())[8:]
            for leaf in _leaves(dict(trial.details())) if trial.details() else []:
                assert any(_reads_as(cell, leaf) for cell in cells)
        (event,) = table(folder / f"{PLACE}_events.tsv")
        assert unescape(event["value"]) == note


def _reads_as(cell: str, value: Any) -> bool:
    if value is None:
        return cell == "n/a"
    if isinstance(value, str):
        return unescape(cell) == value
    if cell in ("n/a", '""'):
        return False
    try:
        return bool(json.loads(cell) == value)
    except ValueError:
        return False


# `cyclopean export`: what it says, and how it ends.

Cyclopean = Callable[..., subprocess.CompletedProcess[str]]  # tests/conftest.py


def test_it_says_what_it_wrote(lab: Lab, cyclopean: Cyclopean) -> None:
    note = Note(text="tired", by="observer", block=0, trial=1, utc="2026-01-02T03:04:05Z")
    lab.session([lab.pair(0), note])
    copy = lab.session([lab.pair(0), note], station="other")
    told = cyclopean("export", lab.folder / "results", lab.folder / "other", "-o", lab.folder / "bids").stdout
    assert "1 session of 1 participant, 1 trial" in told
    assert f"note: {copy} is a copy of" in told
    assert "1 note in free text is" in told


def test_simulated_sessions_beside_a_person_s_are_told(lab: Lab, cyclopean: Cyclopean) -> None:
    lab.session()
    words = ("export", lab.folder / "results", "-o", lab.folder / "bids")
    assert "note: all sessions are of simulated" in cyclopean(*words).stdout
    lab.session(session="20260103T030405abcd", simulated=False)
    done = json.loads(cyclopean(*words, "--json").stdout)
    assert (done["sessions"], done["simulated"], done["simulated_left_out"]) == (1, 0, 1)
    told = cyclopean(*words, "--with-simulated").stdout
    assert "note: 1 of 2 sessions is simulated" in told
    assert "share the code 01" in told
    lab.session(simulated=False)
    assert "are simulated" not in cyclopean(*words, "--with-simulated").stdout


def test_wrong_input_ends_with_2_and_writes_nothing(lab: Lab, cyclopean: Cyclopean) -> None:
    told = cyclopean("export", lab.folder / "nowhere", "-o", lab.folder / "bids", expect=2)
    assert "there is no such folder" in told.stderr
    assert not (lab.folder / "bids").exists()


def test_a_place_that_cannot_be_written_ends_with_1(lab: Lab, cyclopean: Cyclopean) -> None:
    lab.session()
    (lab.folder / "file").write_text("")
    told = cyclopean("export", lab.folder / "results", "-o", lab.folder / "file" / "bids", expect=1)
    assert "cannot be written" in told.stderr


# The official BIDS validator on what the export writes.

Issues = Callable[[Path], list[dict[str, Any]]]
ABOUT = About("Car paints", ("A. Author", "B. Author"), "CC0")
# docs/bids.md says of each why it is left.
WARNED = {
    ("JSON_KEY_RECOMMENDED", "HEDVersion"),
    ("SIDECAR_KEY_RECOMMENDED", "Instructions"),
    ("SIDECAR_KEY_RECOMMENDED", "CogAtlasID"),
    ("SIDECAR_KEY_RECOMMENDED", "CogPOID"),
    ("SIDECAR_KEY_RECOMMENDED", "InstitutionName"),
    ("SIDECAR_KEY_RECOMMENDED", "InstitutionAddress"),
    ("SIDECAR_KEY_RECOMMENDED", "InstitutionalDepartmentName"),
}
HOSTILE = (
    "a\tb\nc\r\nd",
    "\u202eright to left\u2066",
    "n/a",
    "",
    " ",
    "=cmd|' /C calc'!A0",
    '"open quote',
    "<script>alert(1)</script>",
    "\x00\x1b[31m\x7f\x85\u2028\u2029\ufeff",
    "back\\slash\\t",
    "é" * 3000,
    "\U0001f469\u200d\U0001f52c \U000e0041",
)


def check(issues: list[dict[str, Any]]) -> None:
    """No error, and no warning that the documentation does not name."""
    errors = [issue for issue in issues if issue["severity"] == "error"]
    assert not errors, json.dumps(errors[:5], indent=1)
    warned = {(issue["code"], issue.get("subCode", "")) for issue in issues if issue["severity"] == "warning"}
    assert warned <= WARNED


def _kinds(lab: Lab, text: str) -> list[Any]:
    """A trial of each kind, as the runner may record it, with words from people in it."""
    words = text or "none"
    rated = {"ratings": {words: 4}, "rating_times_s": {words: 0.5}}
    data: dict[str, dict[str, Any]] = {
        "instructions": {},
        "break": {"text": text},
        "best_of_series": {
            "series": words,
            "stimuli": ["one", "two", "three"],
            "start": 1,
            "chosen": "two",
            "chosen_index": 1,
            "path": [[1, 0.5]],
            "dwell_s": [0.0, 0.5, 0.0],
            "ratings": {},
            "rating_times_s": {},
        },
        "rating": {"stimulus": "one", **rated, "scale": {"low": text, "high": "glossy"}},
        "questionnaire": {"name": words, "question": text, "answer": text, "answered_by": "choice", "comment": text},
        "preference": {
            "answer": "second",
            "first": "one",
            "second": "two",
            "chosen": "two",
            "rejected": "one",
            "chosen_view": "flat",
            "first_view": "stereo",
            "stim_file": "x.exr",
        },
        "screening": {
            "test": words,
            "series": words,
            "level": 40.0,
            "unit": text,
            "presentation": 0,
            "correct_answer": "up",
            "answer": "up",
            "correct": True,
            "passed": False,
            "HED": "Event",
        },
        "active_pairs": {
            "first": "one",
            "second": "two",
            "answer": "not_sure",
            "batch": 0,
            "expected_information_bits": 0.25,
        },
        "threshold": {
            "task": "two_places",
            "factor": words,
            "stimulus": "one",
            "level": 0.5,
            "answer": "first",
            "method": "quest_plus",
            "function": "weibull",
            "easier": "higher",
            "reference": "two",
            "first_position": "top",
            "correct_answer": "first",
            "correct": True,
            "track": 0,
            "track_trial": 0,
            "group": words,
            "group_factor": words,
        },
        "practice": {
            "practice_of": "rating",
            "stimulus": "one",
            **rated,
            words: text,
            "duration": -1,
            "practice": True,
            "age": "old",
        },
    }
    return [lab.trial(kind, fields, block=n) for n, (kind, fields) in enumerate(data.items())]


@pytest.mark.nightly
def test_every_kind_of_trial_with_hostile_words_passes(lab: Lab, bids_issues: Issues) -> None:
    for number, text in enumerate(HOSTILE):
        records = [
            *_kinds(lab, text),
            lab.pair(20, block=10, trial=0),
            lab.pair(21, block=10, trial=1),
            Note(text=text, by="observer", block=10, trial=1, utc="2026-01-02T03:04:22Z"),
            Note(text=text, by="experimenter", block=10, trial=2, utc="2026-01-02T03:04:22.500+00:00"),
            Mark(block=10, trial=0, by="observer", utc="2026-01-02T03:04:23Z"),
            Resumption(utc="2026-01-02T03:08:00Z", accepted_changes={"rig": Change(before=text, now=None)}),
        ]
        words = {"question": text, "remarks": (text,), "analysis": {text: text}}
        lab.session(records, observer=f"{number:02d}", session=f"s{number}", complete=number % 2 == 0, **words)
    done = export_dataset([lab.folder / "results"], lab.folder / "bids", ABOUT)
    assert done.sessions == len(HOSTILE)
    check(bids_issues(done.folder))


@pytest.mark.nightly
def test_simulated_observers_pass(study: Any, bids_issues: Issues) -> None:
    """Sessions that the runner recorded, through the command line."""
    for observer in ("01", "02"):
        simulated = ("--simulate", study.observers, "--results", study.results, "--json")
        study.cyclopean("run", study.experiment, "--observer", observer, *simulated)
    folder = study.folder / "bids"
    names = ("--author", "A. Author", "--author", "B. Author", "--license", "CC0")
    study.cyclopean("export", study.results, "-o", folder, *names)
    check(bids_issues(folder))
    tables = sorted(folder.glob("sub-*/ses-*/beh/*_beh.tsv"))
    assert len(tables) == 2
    kinds = Counter(line.split("\t")[4] for line in tables[0].read_text().splitlines()[1:])
    assert kinds["all_pairs"] == 6


@pytest.mark.nightly
def test_the_validator_does_find_faults(lab: Lab, bids_issues: Issues) -> None:
    """The oracle is awake: what is spoilt on purpose is told."""
    lab.session()
    folder = export_dataset([lab.folder / "results"], lab.folder / "bids", ABOUT).folder
    (file,) = folder.glob("sub-*/ses-*/beh/*_beh.tsv")
    file.write_text(file.read_text().replace("1.25", "soon"))
    os.rename(file.with_suffix(".json"), file.with_name("notes.json"))
    codes = {issue["code"] for issue in bids_issues(folder) if issue["severity"] == "error"}
    assert {"TSV_VALUE_INCORRECT_TYPE", "NOT_INCLUDED"} <= codes
