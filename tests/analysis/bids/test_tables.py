"""Times and numbers of a row."""

from __future__ import annotations

from analysis.bids.export import time_cell

START = "2026-01-02T03:04:05+00:00"


def test_only_a_time_of_day_is_written_as_one() -> None:
    assert time_cell(START) == START
    assert time_cell("2026-01-02T03:04:05.123456Z") == "2026-01-02T03:04:05.123456Z"
    assert time_cell("2026") == time_cell(None) == time_cell("2026-01-02T03:04:05Z\n") == "n/a"
