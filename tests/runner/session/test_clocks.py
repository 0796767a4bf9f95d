"""Clocks of a session: one that nobody can set back, and when the next scene of a timed sequence is due."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import pytest
from hypothesis import given
from hypothesis import strategies as st

from runner.ports import Holding
from runner.session.clocks import Pace, SteadyClock


def test_a_machine_s_clock_that_is_set_back_leaves_the_record_s_alone() -> None:
    walls = [datetime(2026, 3, 1, 12, tzinfo=UTC)]
    passed = [100.0]
    clock = SteadyClock(lambda: walls[-1], lambda: passed[-1])
    told = [clock()]
    passed.append(101.25)
    walls.append(walls[0] - timedelta(hours=2))
    told.append(clock())
    assert told == ["2026-03-01T12:00:00.000+00:00", "2026-03-01T12:00:01.250+00:00"]


def test_it_begins_at_the_time_of_day() -> None:
    told = datetime.fromisoformat(SteadyClock()())
    assert abs(datetime.now(UTC) - told) < timedelta(seconds=5)


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
