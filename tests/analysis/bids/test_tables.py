"""Times and numbers of a row."""

from __future__ import annotations

import pytest

from analysis.bids.export import seconds_between, time_cell

START = "2026-01-02T03:04:05+00:00"


@pytest.mark.parametrize(
    ("utc", "expected"),
    [
        ("2026-01-02T03:04:06.250+00:00", 1.25),
        ("2026-01-02T03:04:06Z", 1.0),
        ("2026-01-02T05:04:06+02:00", 1.0),
        ("2026-01-02T03:04:06", 1.0),
        ("2026-01-02T03:03:05Z", -60.0),
        ("yesterday", None),
        (None, None),
        (7, None),
    ],
)
def test_onsets_count_from_the_start(utc: object, expected: float | None) -> None:
    assert seconds_between(START, utc) == expected


def test_only_a_time_of_day_is_written_as_one() -> None:
    assert time_cell(START) == START
    assert time_cell("2026-01-02T03:04:05.123456Z") == "2026-01-02T03:04:05.123456Z"
    assert time_cell("2026") == time_cell(None) == time_cell("2026-01-02T03:04:05Z\n") == "n/a"
