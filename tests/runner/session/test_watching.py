"""Running sessions of several stations, from their logs alone: what is shown, and that nothing is written."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest

from analysis.errors import ResultsError
from analysis.kinds import Trial
from analysis.records import FILE_NAME, Header, new_header, read_session
from runner.protocol import read_experiment
from runner.session import Watch, simulate
from tests.answers import altered, new_answer

Study = Any  # tests/conftest.py

NOW_S = 2_000_000.0
PLANNED = (
    {"kind": "all_pairs", "trials": 10, "expected_s": 100.0},
    {"kind": "instructions", "trials": 0, "expected_s": 20.0},
)
STIMULI = ({"name": "a", "factors": {}}, {"name": "b", "factors": {}})
HEADER = new_header("views", "01", "s1", "2026-01-31T09:30:00Z", seed=1, stimuli=STIMULI, planned=PLANNED)


def trial(number: int, at_s: int) -> Trial:
    """Return an answer, so many seconds after the start, with two missed frames."""
    data = {"first": "a", "second": "b", "answer": "first", "chosen": "a", "rejected": "b", "first_position": "top"}
    timed = [{"what": "fixation", "frames": 12, "asked_ms": 100.0, "shown_ms": 100.0, "missed_frames": 2}]
    utc = f"2026-01-31T09:{30 + at_s // 60:02}:{at_s % 60:02}Z"
    return new_answer(0, number, "all_pairs", (("up", 1.5),), 1.5, utc, {**data, "timed": timed})


def write(folder: Path, header: Header, answers: int, *, idle_s: float = 5.0, every_s: int = 5, end: str = "") -> Path:
    """Write a log to which the last line was written ``idle_s`` ago; an answer comes each ``every_s`` seconds."""
    lines = [header.to_json(), *(trial(number, every_s * (number + 1)).to_json() for number in range(answers))]
    file = folder / f"sub-{header.observer}" / f"ses-{header.session}" / FILE_NAME
    file.parent.mkdir(parents=True)
    file.write_text("".join(json.dumps(line) + "\n" for line in lines) + end)
    os.utime(file, (NOW_S - idle_s, NOW_S - idle_s))
    return file


def watch(folder: Path) -> Watch:
    """Return who looks at a folder at `NOW_S`."""
    return Watch(folder, now=lambda: NOW_S)


def test_each_running_session_says_how_far_it_is_at_its_own_pace(tmp_path: Path) -> None:
    write(tmp_path / "a", altered(HEADER, station="aaaa0000"), 4)
    write(tmp_path / "b", altered(HEADER, observer="02", station="bbbb0000"), 5, every_s=20, idle_s=2.0)
    slow, usual = watch(tmp_path).look().sessions
    assert (usual.observer, usual.station, usual.answered, usual.trials) == ("01", "aaaa0000", 4, 10)
    assert usual.last == ("first 1.5 s",) * 3
    assert usual.missed_frames == 8
    assert usual.idle_s == 5.0
    assert not usual.complete
    # Answers take half the 10 s expected of a trial here, and twice that there: of the page, and of what is left.
    assert usual.minutes_left == pytest.approx(0.5 * (20 + 60) / 60, abs=0.01)
    assert slow.minutes_left == pytest.approx(2.0 * (20 + 50) / 60, abs=0.01)
    assert usual.line().startswith("views, observer 01, station aaaa0000 · trial 4 of 10")


def test_sessions_of_long_ago_are_left_out_and_finished_ones_are_complete(tmp_path: Path) -> None:
    write(tmp_path, HEADER, 1, idle_s=1801.0)
    done = altered(HEADER, observer="02")
    write(tmp_path, done, 10, end=json.dumps({"record": "end", "utc": "2026-01-31T09:40:00Z"}) + "\n")
    (found,) = watch(tmp_path).look().sessions
    assert found.observer == "02"
    assert found.complete
    assert "trial 10 of 10 · complete" in found.line()


def test_logs_of_older_versions_say_how_many_answers_there_are(tmp_path: Path) -> None:
    write(tmp_path, altered(HEADER, planned=()), 3)
    (found,) = watch(tmp_path).look().sessions
    assert (found.answered, found.trials, found.minutes_left) == (3, None, None)
    assert "trial 3 · missed frames 6" in found.line()


def test_a_line_that_is_being_written_waits_and_a_damaged_log_hides_no_other(tmp_path: Path) -> None:
    write(tmp_path, HEADER, 2, end='{"record":"tri')
    bad = write(tmp_path, altered(HEADER, observer="02"), 2)
    bad.write_text(bad.read_text().replace('"first"', '"nobody"', 1))
    os.utime(bad, (NOW_S, NOW_S))
    empty = tmp_path / "sub-03" / "ses-s1" / FILE_NAME
    empty.parent.mkdir(parents=True)
    empty.touch()
    os.utime(empty, (NOW_S, NOW_S))
    found = watch(tmp_path).look()
    assert [(one.observer, one.answered) for one in found.sessions] == [("01", 2)]
    assert [finding.file for finding in found.findings] == [str(bad)]


def test_nothing_is_written_and_a_log_that_did_not_change_is_not_read_again(tmp_path: Path) -> None:
    files = [write(tmp_path, altered(HEADER, observer=f"{number:02}"), 2) for number in range(3)]
    before = {file: file.read_bytes() for file in tmp_path.rglob("*") if file.is_file()}
    looking = watch(tmp_path)
    first = looking.look()
    assert looking.look() == first
    assert looking.read == 3
    with files[0].open("a") as log:
        log.write(json.dumps(trial(2, 15).to_json()) + "\n")
    os.utime(files[0], (NOW_S, NOW_S))
    assert looking.look().sessions[0].answered == 3
    assert looking.read == 4
    assert {file for file in tmp_path.rglob("*") if file.is_file()} == set(before)
    assert all(file.read_bytes() == before[file] for file in files[1:])


def test_the_command_prints_lines_or_json_once(tmp_path: Path, cyclopean: Any) -> None:
    file = write(tmp_path, HEADER, 4)
    os.utime(file)
    assert "trial 4 of 10" in cyclopean("watch", tmp_path, "--once").stdout
    (one,) = json.loads(cyclopean("watch", tmp_path, "--once", "--json").stdout)["sessions"]
    assert (one["answered"], one["trials"], one["file"]) == (4, 10, str(file))
    os.utime(file, (0, 0))
    assert "in the last 30 min" in cyclopean("watch", tmp_path, "--once").stdout
    with pytest.raises(ResultsError, match="there is no such folder"):
        Watch(tmp_path / "none").look()


def test_a_session_states_what_it_plans_and_is_complete_in_the_end(study: Study) -> None:
    (folder,) = simulate(study.experiment, study.observers, 1, results=study.results).folders
    blocks = read_experiment(study.experiment).blocks("01")
    planned = read_session(folder / FILE_NAME).header.planned
    assert [(one.trials, one.expected_s) for one in planned] == [(b.trials, round(b.expected_s, 1)) for b in blocks]
    (one,) = Watch(study.results).look().sessions
    assert one.complete
    assert one.answered == one.trials == sum(block.trials for block in blocks) > 0
    assert one.minutes_left == 0
