"""Labels of sessions: never twice, and in the order in which the sessions began."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.records import new_header, session_files
from runner.errors import SessionError
from runner.session import Recorder
from runner.session.folders import new_label, observer_folder, to_resume, unfinished
from tests.answers import altered, new_answer

NOON = datetime(2026, 3, 1, 12, tzinfo=UTC)
STIMULI = ({"name": "a"}, {"name": "b"})
HEADER = new_header("e", "01", "s", "2026-01-01T00:00:00.000+00:00", question="Which?", simulated=True, stimuli=STIMULI)


def _begin(results: Path, now: datetime, *, complete: bool) -> str:
    folder = observer_folder(results, "e", "01")
    label = new_label(folder, now)
    with Recorder.create(folder / f"ses-{label}", altered(HEADER, session=label)) as recorder:
        if complete:
            recorder.end({})
    return label


def test_many_stations_in_one_second_make_labels_that_never_collide() -> None:
    labels = [new_label(now=NOON) for _ in range(2000)]
    assert len(set(labels)) == len(labels)
    assert len({label.casefold() for label in labels}) == len(labels)  # folders of some systems know no capitals


@given(st.datetimes(min_value=datetime(2000, 1, 1), max_value=datetime(9990, 1, 1)))
def test_a_label_is_the_time_and_a_bids_label(now: datetime) -> None:
    label = new_label(now=now)
    assert label.isalnum()
    assert label.isascii()
    assert datetime.strptime(label[:15], "%Y%m%dT%H%M%S") == now.replace(microsecond=0)


def test_sessions_sort_as_they_began_although_the_clock_was_set_back(tmp_path: Path) -> None:
    times = [NOON, NOON - timedelta(hours=2), NOON - timedelta(days=400), NOON, NOON + timedelta(minutes=1)]
    labels = [_begin(tmp_path, now, complete=True) for now in times]
    assert labels == sorted(labels)
    assert len({label[:15] for label in labels}) == 5
    assert labels[-1].startswith("20260301T120100")  # the clock is ahead again, and is believed again


def test_the_session_that_stopped_last_is_resumed_although_the_clock_was_set_back(tmp_path: Path) -> None:
    _begin(tmp_path, NOON, complete=True)
    stopped = _begin(tmp_path, NOON - timedelta(hours=2), complete=False)
    assert to_resume(tmp_path, "e", "01").header.session == stopped
    _begin(tmp_path, NOON - timedelta(hours=1), complete=True)
    assert unfinished(tmp_path, "e", "01") is None


def _answer(results: Path, label: str, *kinds: str) -> None:
    recorder, _ = Recorder.reopen(observer_folder(results, "e", "01") / f"ses-{label}")
    with recorder:
        for block, kind in enumerate(kinds):
            data = {} if kind == "instructions" else {"first": "a", "second": "b", "answer": "not_sure"}
            recorder.append(new_answer(block, 0, kind, (("space", 1.0),), 1.0, "2026-01-01T00:00:00.000+00:00", data))


def _resumed(results: Path) -> str:
    return to_resume(results, "e", "01").header.session


def test_a_session_begun_without_resume_by_mistake_does_not_stand_before_the_one_that_stopped(tmp_path: Path) -> None:
    crashed = _begin(tmp_path, NOON, complete=False)
    _answer(tmp_path, crashed, "instructions", "all_pairs")
    left_at_once = _begin(tmp_path, NOON, complete=False)
    assert _resumed(tmp_path) == crashed
    _answer(tmp_path, left_at_once, "instructions")
    assert _resumed(tmp_path) == crashed
    begun = _begin(tmp_path, NOON, complete=False)
    _answer(tmp_path, begun, "instructions", "all_pairs")
    assert _resumed(tmp_path) == begun


def test_what_was_begun_before_a_completed_session_is_not_resumed(tmp_path: Path) -> None:
    _answer(tmp_path, _begin(tmp_path, NOON, complete=False), "all_pairs")
    _begin(tmp_path, NOON, complete=True)
    assert unfinished(tmp_path, "e", "01") is None
    _begin(tmp_path, NOON, complete=False)
    empty = _begin(tmp_path, NOON, complete=False)
    assert _resumed(tmp_path) == empty


def test_who_has_sessions_is_named_where_the_observer_has_none(tmp_path: Path) -> None:
    _begin(tmp_path, NOON, complete=False)
    with pytest.raises(SessionError, match=r"sub-1: .*sessions of .e. there are of the observers 01 \(0 answers\);"):
        to_resume(tmp_path, "e", "1")


def test_folders_named_by_hand_do_not_disturb(tmp_path: Path) -> None:
    folder = observer_folder(tmp_path, "e", "01")
    _begin(tmp_path, NOON, complete=True)
    for name in ("ses-99999999T999999abcd", "ses-pilot", "notes"):
        (folder / name).mkdir(parents=True)
    assert new_label(folder, NOON).startswith("20260301T120001")


def test_folders_of_two_stations_copied_together_hold_every_session(tmp_path: Path) -> None:
    one, other = tmp_path / "one", tmp_path / "other"
    for station in (one, other):
        for _ in range(3):
            _begin(station, NOON, complete=True)
    for file in list(session_files(other)):
        target = one / file.parent.relative_to(other)
        target.mkdir(parents=True)
        (target / file.name).write_bytes(file.read_bytes())
    assert len(list(session_files(one))) == 6
