"""Clocks of a session: one that nobody can set back, and when the next scene of a timed sequence is due."""

from __future__ import annotations

import json
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.records import FILE_NAME, SessionLog, read_session
from analysis.report import describe
from extensions.bids import export_dataset
from runner.observers import plain_key
from runner.ports import Ask, Holding, KeyPress, WindowClosed
from runner.protocol import read_experiment
from runner.session import SessionOptions
from runner.session.clocks import Pace, SteadyClock
from runner.session.folders import to_resume
from runner.session.station import Station
from stimuli.build import build_set


def test_a_machine_s_clock_that_is_set_back_leaves_the_record_s_alone() -> None:
    walls = [datetime(2026, 3, 1, 12, tzinfo=UTC)]
    passed = [100.0]
    clock = SteadyClock(lambda: walls[-1], lambda: passed[-1])
    told = [clock()]
    passed.append(101.25)
    walls.append(walls[0] - timedelta(hours=2))
    told.append(clock())
    assert told == ["2026-03-01T12:00:00.000+00:00", "2026-03-01T12:00:01.250+00:00"]


class _Screen:
    """A screen of 100 Hz whose swaps return at the next frame's start, or at once; sleeping overshoots a little."""

    def __init__(self, waits: bool) -> None:
        self.now_s = 0.0
        self.waits = waits

    def swap(self) -> float:
        if self.waits:
            self.now_s = (int(self.now_s / 0.01 + 1e-9) + 1) * 0.01
        return self.now_s

    def sleep(self, seconds: float) -> None:
        self.now_s += seconds + 1e-4


@pytest.mark.parametrize("waits", [True, False])
@given(frames=st.lists(st.integers(1, 50), min_size=1, max_size=20))
def test_every_scene_stands_for_the_frames_it_was_given(waits: bool, frames: list[int]) -> None:
    screen = _Screen(waits)
    pace = Pace(0.01, swaps_wait=waits)
    onset_s = screen.swap()
    for count in frames:
        pace.wait(onset_s, count, clock=lambda: screen.now_s, sleep=screen.sleep)
        next_s = screen.swap()
        assert round((next_s - onset_s) / 0.01) == count
        assert Holding(onset_s, count, 0.01).missed(next_s) == 0
        onset_s = next_s


def test_a_late_swap_is_counted_in_frames() -> None:
    holding = Holding(1.0, 6, 0.01)
    assert holding.missed(1.0600) == 0
    assert holding.missed(1.0702) == 1
    assert holding.missed(1.1) == 4
    assert holding.missed(1.05) == 0


def test_times_are_rounded_to_whole_frames() -> None:
    pace = Pace(1 / 120, swaps_wait=True)
    assert [pace.frames(seconds) for seconds in (0.0, 0.004, 0.1, 0.5)] == [1, 1, 12, 60]


def test_simulated_observers_do_not_wait() -> None:
    Pace(1.0, swaps_wait=False, instantly=True).wait(0.0, 100, clock=lambda: 0.0, sleep=lambda s: pytest.fail("slept"))


def test_it_begins_no_earlier_than_a_log_ends() -> None:
    walls = datetime(2026, 3, 1, 12, tzinfo=UTC)
    passed = [5.0]
    clock = SteadyClock(lambda: walls, lambda: passed[-1], not_before=walls + timedelta(days=1))
    assert clock() == "2026-03-02T12:00:00.000+00:00"
    assert clock.behind_s == 86400
    passed.append(6.5)
    assert clock() == "2026-03-02T12:00:01.500+00:00"
    ahead = SteadyClock(lambda: walls, lambda: 0.0, not_before=walls - timedelta(days=1))
    assert (ahead(), ahead.behind_s) == ("2026-03-01T12:00:00.000+00:00", 0)


# A session that is resumed on a machine whose clock was set meanwhile, back or forward.


Study = Any  # tests/conftest.py


class Leaves:
    """Gives plain answers, and closes the window after some."""

    def __init__(self, answers: int) -> None:
        self.left = answers

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        if not self.left:
            raise WindowClosed
        self.left -= 1
        return KeyPress(plain_key(ask), onset_s + 1.0)


def resumed(study: Study, monkeypatch: pytest.MonkeyPatch, set_by: timedelta) -> tuple[SessionLog, tuple[str, ...]]:
    design = read_experiment(study.experiment)
    stimuli = build_set(design.recipe_file, design.rig.display.panel.pixel_pitch_mm)
    with Station.open(design, stimuli, SessionOptions(study.results, backend="egl")) as station:
        with pytest.raises(WindowClosed):
            station.run("01", Leaves(4), simulated=True)
        clock = partial(SteadyClock, lambda: datetime.now(UTC) + set_by)
        monkeypatch.setattr("runner.session.folders.SteadyClock", clock)
        folder = station.run("01", Leaves(99), simulated=True, resume=to_resume(study.results, "small", "01"))
        return read_session(folder / FILE_NAME), station.resume_remarks


def onsets(folder: Path) -> list[float]:
    (table,) = folder.rglob("*_beh.tsv")
    return [float(row.split("\t")[0]) for row in table.read_text().splitlines()[1:]]


def test_a_clock_that_was_set_back_leaves_times_rising(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    log, remarks = resumed(study, monkeypatch, -timedelta(days=1))
    times = [log.header.started_utc, *(record.utc for record in log.records)]
    assert times == sorted(times)
    (resumption,) = log.resumptions
    assert 86390 < resumption.clock_behind_s <= 86400
    (note,) = log.notes
    assert (note.text,) == remarks
    assert note.by == "program"
    assert "stood 23 hours 59 minutes before the last record" in note.text or "stood 1 day before" in note.text
    folder = export_dataset([study.results], study.folder / "bids").folder
    assert onsets(folder) == sorted(onsets(folder))
    assert 0 <= onsets(folder)[0] <= onsets(folder)[-1] < 3600
    (sidecar,) = folder.rglob("sub-01*_beh.json")
    (stop,) = json.loads(sidecar.read_text())["Resumptions"]
    assert stop["Gap"] is None
    assert stop["ClockBehind"] == resumption.clock_behind_s
    assert any("the clock had been set back" in note for note in describe([log]).notes)


@pytest.mark.nightly
def test_a_clock_that_was_set_forward_is_stated(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    log, (remark,) = resumed(study, monkeypatch, timedelta(days=365))
    assert remark.startswith("the session was resumed 365 days")
    assert log.resumptions[0].clock_behind_s == 0
    assert "it was resumed after 365 days" in "\n".join(describe([log]).notes)


def test_a_clock_that_was_not_set_is_no_remark(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    log, remarks = resumed(study, monkeypatch, timedelta())
    assert (remarks, log.notes) == ((), ())
