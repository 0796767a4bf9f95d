"""Golden outputs: what two runs never have in common is left out, and nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest

from tools.golden import plain, shortened

FOLDER = Path("/some/folder")


@pytest.mark.parametrize(
    ("said", "kept"),
    [
        ("results in /some/folder/results", "results in FOLDER/results"),
        ('"time":"2026-11-29T09:36:02.752Z"', '"time": MEASURED'),
        ("begun 2026-11-29 09:36", "begun DATE"),
        ("sub-01/ses-20261129T093602x8p25ypp/beh", "sub-01/ses-SESSION/beh"),
        ("a9425587e0efa31c9ee0831e", "DIGEST"),
        ('"OperatingSystem": "Linux-6.18.44"', '"OperatingSystem": MEASURED'),
        ('"theta": 0.123456789012', '"theta": 0.12346'),
        ('"theta": -7.2e-17 | 4e-13', '"theta": 0 | 0'),
        ('"shown_ms":3.2,"missed_frames":0', '"shown_ms": MEASURED,"missed_frames":0'),
        ('"chosen": "first", "score": 0.125', '"chosen": "first", "score": 0.125'),
    ],
)
def test_what_varies_is_left_out(said: str, kept: str) -> None:
    assert plain(said, FOLDER) == kept


def test_a_change_in_the_middle_of_a_long_text_is_seen() -> None:
    lines = [f"line {number}" for number in range(1000)]
    long = shortened("\n".join(lines))
    assert len(long.splitlines()) < 100
    lines[500] = "another"
    assert shortened("\n".join(lines)) != long
