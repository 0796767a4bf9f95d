"""A log cut at every byte of its last record, of each kind."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.runner.test_power_cut import KINDS, cut_the_last

pytestmark = pytest.mark.stress


@pytest.mark.parametrize("last", KINDS)
def test_a_cut_at_every_byte_of_the_last_record(tmp_path: Path, last: str) -> None:
    cut_the_last(tmp_path / "s", last, step=1)
