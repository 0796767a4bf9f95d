"""Thousands of damaged pictures, and those made to do harm: read or refused in one line, in 10 s and 1 GB each."""

from __future__ import annotations

import pytest

from tests.stress.how_many import how_many
from tests.stress.mutants import keys_of, read_all

MODULE = "tests.stress.picture_formats"
# A build of each is most of the time; what costs less is mutated more.
NUMBERS = {
    "exr": how_many(400, 1000),
    "png": how_many(300, 700),
    "jpeg": how_many(300, 800),
    "webp": how_many(250, 600),
    "tiff": how_many(400, 1000),
    "dng": how_many(400, 1000),
    "envi": how_many(150, 400),
    "codes": how_many(120, 300),
    "own": how_many(80, 200),
}


@pytest.mark.stress
def test_thousands_of_damaged_pictures_are_read_or_refused() -> None:
    outcome = read_all(MODULE, keys_of(MODULE, {name: range(100, 100 + most) for name, most in NUMBERS.items()}))
    assert not outcome.faults, str(outcome)
    assert all(outcome.counts[name, "refused"] > most // 5 for name, most in NUMBERS.items()), str(outcome)
