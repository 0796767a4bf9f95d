"""Files that people and other programs write, changed in a few places: read or refused, never a traceback."""

from __future__ import annotations

import pytest

from tests.stress.how_many import how_many
from tests.stress.mutants import formats, keys_of, read_all

pytestmark = pytest.mark.stress

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
