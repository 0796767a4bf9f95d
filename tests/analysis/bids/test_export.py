"""From sessions to a dataset: what stands in the tables is what was recorded."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from analysis.bids import About, export_dataset, unescape
from analysis.errors import ResultsError
from analysis.records import Change, Mark, Note, Resumption, read_session
from tests.answers import changed

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
# The keys of a trial's own fields are the runner's.
KEYS = st.text().filter(
    lambda key: key not in {"record", "block", "trial", "kind", "events", "response_time_s", "utc", "attempt"}
)


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
