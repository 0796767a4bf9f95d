"""Two people with one code are noted in report and export, and parted by renaming a folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from analysis.bids import export_dataset
from analysis.errors import ResultsError
from analysis.records import Resumption, read_results
from analysis.records.results import refuse_mixtures
from analysis.report.notes import on_sessions
from tests.answers import changed

Lab = Any  # conftest.py
MONDAY, TUESDAY = "20260102T030400", "20260103T030400"


def notes(*places: Path) -> list[str]:
    """Return the report's and the export's notes on codes, which are the same."""
    reported = [note for note in on_sessions(read_results(*places)) if "code" in note or "counted as" in note]
    exported = list(export_dataset(places, places[0].parent / "dataset").doubts)
    assert reported == exported
    return reported


def leave(lab: Lab, station: str = "results", session: str = f"{MONDAY}abcd", **more: Any) -> Path:
    """Leave a session of a person, begun when its label says."""
    day = session[6:8]
    made = [changed(lab.pair(number), utc=f"2026-01-{day}T03:0{number + 4}:30.000+00:00") for number in range(3)]
    begun = f"2026-01-{day}T03:04:00+00:00"
    values = {"records": made, "simulated": False, "started_utc": begun, **more}
    file: Path = lab.session(station=station, session=session, **values)
    return file


def test_sessions_on_two_stations_are_noted_with_the_remedy(lab: Lab, tmp_path: Path) -> None:
    leave(lab, recorded_on="aaaa1111")
    leave(lab, session=f"{TUESDAY}efgh", recorded_on="bbbb2222")
    leave(lab, session=f"{TUESDAY}efgh", recorded_on="bbbb2222", observer="02")
    (note,) = notes(tmp_path / "results")
    assert note.startswith("Observer 01 may be two people")
    assert "2 stations (aaaa1111, bbbb2222)" in note
    assert "rename the folder of one, sub-01" in note


def test_a_renamed_folder_parts_them_and_the_dataset_keeps_it(lab: Lab, tmp_path: Path) -> None:
    leave(lab, "a", recorded_on="aaaa1111")
    file = leave(lab, "b", f"{TUESDAY}efgh", recorded_on="bbbb2222")
    before = file.read_bytes()
    file.parents[1].rename(file.parents[1].with_name("sub-01b"))
    (told,) = notes(tmp_path / "a", tmp_path / "b")
    assert "observer 01 are counted as 01b" in told
    assert {log.header.observer for log in read_results(tmp_path / "a", tmp_path / "b")} == {"01", "01b"}
    dataset = tmp_path / "dataset"
    assert (dataset / "participants.tsv").read_text().split()[2::2] == ["sub-01", "sub-01b"]
    (copied,) = (dataset / "sourcedata").rglob("sub-01b/*/session.jsonl")
    assert copied.read_bytes() == before
    assert {log.header.observer for log in read_results(dataset / "sourcedata")} == {"01", "01b"}


def test_sessions_at_the_same_time_are_noted(lab: Lab, tmp_path: Path) -> None:
    leave(lab)
    leave(lab, session=f"{MONDAY}efgh")
    (note,) = notes(tmp_path / "results")
    assert f"sessions overlap in time ({MONDAY}abcd and {MONDAY}efgh)" in note


def test_a_session_between_stop_and_resumption_does_not_overlap(lab: Lab, tmp_path: Path) -> None:
    stopped = [changed(lab.pair(0), utc="2026-01-02T03:10:00+00:00")]
    later = [changed(lab.pair(1), utc="2026-01-04T03:10:00+00:00")]
    leave(lab, records=[*stopped, Resumption(utc="2026-01-04T03:00:00+00:00"), *later])
    leave(lab, session=f"{TUESDAY}efgh")
    assert notes(tmp_path / "results") == []


def test_old_logs_in_two_folders_of_results_are_noted(lab: Lab, tmp_path: Path) -> None:
    leave(lab, "a")
    leave(lab, "b", f"{TUESDAY}efgh")
    (note,) = notes(tmp_path / "a", tmp_path / "b")
    assert f"({tmp_path / 'a'}, {tmp_path / 'b'})" in note


def test_nothing_is_noted_of_one_station_or_of_simulated_observers(lab: Lab, tmp_path: Path) -> None:
    leave(lab, "a", recorded_on="aaaa1111")
    leave(lab, "b", f"{TUESDAY}efgh", recorded_on="aaaa1111")
    for station in ("a", "b"):
        leave(lab, station, f"{MONDAY}{station * 4}", observer="sim", simulated=True)
    assert notes(tmp_path / "a", tmp_path / "b") == []


def test_a_copy_under_another_code_is_no_second_person(lab: Lab, tmp_path: Path) -> None:
    file = leave(lab)
    copy = tmp_path / "results/dynamic_range/sub-02" / file.parent.name / file.name
    copy.parent.mkdir(parents=True)
    copy.write_bytes(file.read_bytes())
    done = export_dataset([tmp_path / "results"], tmp_path / "dataset")
    assert (done.participants, len(done.copies)) == (1, 1)
    with pytest.raises(ResultsError, match="its answers would count twice"):
        refuse_mixtures(read_results(tmp_path / "results"))
