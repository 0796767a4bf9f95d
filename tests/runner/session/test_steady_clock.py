"""The record's clock goes on evenly while the machine's is set back."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

from runner.session.steady_clock import SteadyClock


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
