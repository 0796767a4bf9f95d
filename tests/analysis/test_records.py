"""Records of sessions: ambiguous ones, their times, and what is kept of them."""

from __future__ import annotations

import json
import sys
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.errors import ResultsError
from analysis.kinds import Trial
from analysis.records import (
    CONFIGURATION_LIST,
    Mark,
    Note,
    Resumption,
    SessionLog,
    SessionTimes,
    duration,
    in_time,
    kept_files,
    latest_utc,
    new_header,
    read_results,
    read_session,
)
from analysis.report.notes import on_sessions
from documents.files import DurableLog
from tests.answers import new_answer

# Records that can be read in two ways are read in the way that agrees with them.

NAMES = ("a", "b", "c")
AMBIGUOUS_UTC = "2026-01-31T09:30:00.000+00:00"
HEADER = new_header("views", "01", "s1", AMBIGUOUS_UTC, simulated=True, stimuli=[{"name": name} for name in NAMES])


def read(folder: Path, *trials: Trial) -> SessionLog:
    file = folder / "session.jsonl"
    lines = [HEADER.to_json(), *(trial.to_json() for trial in trials)]
    file.write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8")
    return read_session(file)


def best(number: int, keys: tuple[str, ...], chosen: int) -> Trial:
    """Return a choice after a page that took as long as each step of the path."""
    path = [[index, 0.5] for index in range(chosen + 1)]
    data = {
        "series": "one",
        "stimuli": list(NAMES),
        "start": 0,
        "chosen": NAMES[chosen],
        "chosen_index": chosen,
        "path": path,
        "dwell_s": [0.5 if index <= chosen else 0.0 for index in range(3)],
        "ratings": {},
        "rating_times_s": {},
    }
    events = tuple((key, 0.5) for key in keys)
    utc = f"2026-01-31T09:3{number + 1}:00.000+00:00"
    return new_answer(0, number, "best_of_series", events, 0.5 * (chosen + 1), utc, data)


def test_presses_of_a_page_before_may_have_the_times_of_the_path(tmp_path: Path) -> None:
    log = read(tmp_path, best(0, ("space", "right", "space"), 1), best(1, ("right", "right", "enter", "7"), 2))
    assert [trial.details()["chosen"] for trial in log.trials] == ["b", "c"]


def test_presses_that_do_not_lead_along_the_path_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ResultsError, match="the key 'left' means 'previous'"):
        read(tmp_path, best(0, ("left", "space"), 1))


def test_either_of_two_pictures_may_be_the_stereo_one(tmp_path: Path) -> None:
    def preferred(number: int, first: str, second: str) -> Trial:
        data = {"first": first, "second": second, "answer": "first", "chosen": first, "rejected": second}
        data |= {"chosen_view": "stereo", "first_view": "stereo"}
        utc = f"2026-01-31T09:3{number + 1}:00.000+00:00"
        return new_answer(0, number, "preference", (("1", 0.8),), 0.8, utc, data)

    log = read(tmp_path, preferred(0, "a", "b"), preferred(1, "b", "a"))
    assert [trial.details()["chosen"] for trial in log.trials] == ["a", "b"]


@pytest.mark.parametrize("digits", [100, 4000, 5000])
def test_a_whole_number_of_thousands_of_digits_is_refused_with_its_line(tmp_path: Path, digits: int) -> None:
    """Also where no field of this version has it: a report would print it."""
    file = tmp_path / "session.jsonl"
    trial = json.dumps(best(0, ("right", "space"), 1).to_json())
    file.write_text(json.dumps(HEADER.to_json()) + "\n" + trial[:-1] + ', "later": 1' + "0" * digits + "}\n")
    with pytest.raises(ResultsError) as refused:
        read_session(file)
    assert refused.value.findings[0].line == 2


def test_what_logs_have_alike_is_one_object_and_no_other_type_is_taken_for_it(tmp_path: Path) -> None:
    stimuli = [{"name": name, "flat": name == "a", "factors": {"level": 1}} for name in NAMES]
    changed: dict[str, dict[str, Any]] = {"3": {"flat": 1}, "4": {"factors": {"level": 1.0}}}
    files = []
    for observer in ("1", "2", "3", "4"):
        line = HEADER.to_json() | {"observer": observer, "stimuli": [{**stimuli[0], **changed.get(observer, {})}]}
        files.append(tmp_path / observer / "session.jsonl")
        DurableLog.create(files[-1], files[-1].with_name(".lock"), line).close()
    with pytest.raises(ResultsError) as refused:
        read_results(*files)
    assert refused.value.findings[0].file == str(files.pop(2))
    logs = read_results(*files)
    assert logs == tuple(read_session(file) for file in files)
    assert logs[0].header.stimuli[0] is logs[1].header.stimuli[0]
    assert logs[0].header.display is logs[1].header.display
    assert [type(log.header.stimuli[0].factors["level"]) for log in logs] == [int, int, float]


# Times of a session rise, also in old logs of machines whose clock was set back before they were resumed.

START = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)
Record = Trial | Note | Mark | Resumption


def utc(seconds: float) -> str:
    return (START + timedelta(seconds=seconds)).isoformat(timespec="milliseconds")


def trial(number: int, seconds: float) -> Trial:
    return new_answer(0, number, "all_pairs", (), 1.0, utc(seconds))


def log(*records: Record, session: str = "s", started_utc: str = START.isoformat()) -> SessionLog:
    header = new_header("e", "01", session, started_utc)
    return SessionLog(Path("s"), header, records, complete=True)


def onsets(session: SessionLog) -> list[Any]:
    times = SessionTimes.of(session)
    return [times.onset_s(record) for record in session.records]


def test_times_are_those_of_the_log_where_they_rise() -> None:
    session = log(trial(0, 1.25), Resumption(utc=utc(100)), trial(1, 101))
    assert onsets(session) == [1.25, 100, 101]
    (stop,) = SessionTimes.of(session).stops
    assert (stop.gap_s, stop.clock_behind_s) == (98.75, 0)
    assert stop.sentence == "it was resumed after 1 minute 39 s"
    assert SessionTimes.of(session).moved_s == 0


def test_a_clock_set_back_before_an_old_log_was_resumed_leaves_times_rising() -> None:
    session = log(trial(0, 10), trial(1, 20), Resumption(utc=utc(-86400)), trial(2, -86396), trial(3, -86390.5))
    assert onsets(session) == [10, 20, 20, 24, 29.5]
    times = SessionTimes.of(session)
    assert times.moved_s == 86420
    assert [(stop.gap_s, stop.clock_behind_s) for stop in times.stops] == [(None, 86420)]
    assert "had been set back by 1 day 20 s" in "\n".join(on_sessions([session]))


def test_a_clock_set_back_is_stated_where_times_count_on() -> None:
    session = log(trial(0, 10), Resumption(utc=utc(10), accepted_changes={}, clock_behind_s=3600.0), trial(1, 14))
    assert onsets(session) == [10, 10, 14]
    assert SessionTimes.of(session).moved_s == 0
    assert "set back by 1 hour when it was resumed" in on_sessions([session])[-1]


def test_a_session_resumed_on_another_day_is_noted() -> None:
    year_s = 365 * 86400
    session = log(trial(0, 10), Resumption(utc=utc(year_s + 10)), trial(1, year_s + 14))
    assert "01's session s: it was resumed after 365 days" in "\n".join(on_sessions([session]))
    assert onsets(session)[-1] == year_s + 14
    assert not any("resumed" in note for note in on_sessions([log(trial(0, 10), Resumption(utc=utc(600)))]))


def test_a_note_that_was_written_a_moment_late_moves_nothing() -> None:
    session = log(trial(0, 10), Note(text="dim", by="experimenter", block=0, trial=1, utc=utc(9.5)), trial(1, 11))
    assert onsets(session) == [10, 10, 11]


@pytest.mark.parametrize("wrong", ["yesterday", "", "2026-13-01"])
def test_a_time_that_is_not_valid_has_no_onset(wrong: str) -> None:
    odd = Note(text="dim", by="experimenter", block=0, trial=0, utc=utc(0)).model_copy(update={"utc": wrong})
    stop = Resumption(utc=utc(0)).model_copy(update={"utc": wrong})
    assert onsets(log(trial(0, 1), odd, trial(1, 2))) == [1, None, 2]
    assert onsets(log(trial(0, 1), stop)) == [1, None]
    assert latest_utc(log(odd, trial(1, 2))) == START + timedelta(seconds=2)


steps = st.lists(st.tuples(st.floats(-1e8, 1e8), st.booleans()), max_size=20)


@given(steps)
def test_times_always_rise(drawn: list[tuple[float, bool]]) -> None:
    records: list[Record] = [
        Resumption(utc=utc(seconds)) if resumed else trial(number, seconds)
        for number, (seconds, resumed) in enumerate(drawn)
    ]
    rising = onsets(log(*records))
    assert rising == sorted(rising)
    assert all(onset >= 0 for onset in rising)


def test_sessions_come_in_the_order_in_which_they_began() -> None:
    """Labels rise where the clock was set back between sessions; sessions without such labels sort by their start."""
    first = log(session="20260102T030405abc", started_utc="2026-01-02T03:04:05+00:00")
    second = log(session="20260102T030406xyz", started_utc="2025-12-31T03:04:05+00:00")
    third = log(session="later", started_utc="2026-01-02T03:04:07.250+00:00")
    assert in_time([third, second, first]) == [first, second, third]


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0.25, "0.25 s"), (59.4, "59.4 s"), (60, "1 minute"), (3600, "1 hour"), (7384, "2 hours 3 minutes")],
)
def test_durations_in_words(seconds: float, words: str) -> None:
    assert duration(seconds) == words


# Files that sessions were made with are only those in their folder, whatever the list of them says or links to.
@pytest.mark.skipif(sys.platform == "win32", reason="links need rights there")
def test_files_elsewhere_are_not_taken_along(tmp_path: Path) -> None:
    (tmp_path / "secret.yaml").write_text("a: 1\n")
    results = tmp_path / "results" / "views"
    folder = results / "configuration" / "0123456789abcdef"
    folder.mkdir(parents=True)
    (folder / "views.yaml").write_text("b: 2\n")
    (folder / "link.yaml").symlink_to(tmp_path / "secret.yaml")
    (folder / "up").symlink_to(tmp_path)
    secret = str(tmp_path / "secret.yaml")
    names = ["views.yaml", "link.yaml", "up/secret.yaml", "../../../../secret.yaml", secret, "a\0b", "", 3, "none.yaml"]
    (folder / CONFIGURATION_LIST).write_text(json.dumps({"files": names}))
    linked = results / "configuration" / "fedcba9876543210"
    linked.mkdir()
    (linked / CONFIGURATION_LIST).symlink_to(tmp_path / "secret.yaml")
    log = results / "sub-01" / "ses-1" / "session.jsonl"
    kept = {"configuration/0123456789abcdef/views.yaml", f"configuration/0123456789abcdef/{CONFIGURATION_LIST}"}
    assert set(kept_files(log)) == kept
