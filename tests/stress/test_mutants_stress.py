"""Damaged files of every kind, and pictures made to do harm: read or refused in one line, never a traceback."""

from __future__ import annotations

import pytest

from tests.stress.how_many import how_many
from tests.stress.mutants import formats, keys_of, read_all

pytestmark = pytest.mark.stress


# Files that people and other programs write, changed in a few places: read or refused, never a traceback.

MODULE = "tests.stress.foreign_formats"
# A check of a YAML file reads what it names as well, and takes ten times as long as a table.
COUNTS = {
    name: how_many(150, 350) if form.suffix == ".yaml" else how_many(500, 1200)
    for name, form in formats(MODULE).items()
}


@pytest.mark.parametrize("name", sorted(COUNTS))
def test_mutants_are_read_or_refused(name: str) -> None:
    keys = keys_of(MODULE, {form: range(100, 100 + COUNTS[form]) for form in COUNTS})
    outcome = read_all(MODULE, [key for key in keys if key[0] == name])
    assert not outcome.faults, str(outcome)
    for what in ("read", "refused"):
        assert outcome.counts[name, what] >= COUNTS[name] / 50, str(outcome)


# Thousands of damaged pictures, and those made to do harm: read or refused in one line, in 10 s and 1 GB each.

PICTURES_MODULE = "tests.stress.picture_formats"
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
    outcome = read_all(
        PICTURES_MODULE, keys_of(PICTURES_MODULE, {name: range(100, 100 + most) for name, most in NUMBERS.items()})
    )
    assert not outcome.faults, str(outcome)
    assert all(outcome.counts[name, "refused"] > most // 5 for name, most in NUMBERS.items()), str(outcome)
