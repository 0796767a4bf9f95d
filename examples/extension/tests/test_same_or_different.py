"""The block keeps every promise, and d' is what the tables say."""

from __future__ import annotations

from pathlib import Path

import pytest
from same_or_different.report import d_prime

from cyclopean.testing import prove_block, prove_report_part

ENTRY = "kind: same_or_different, trials: 6, exposure_s: 0.1"


def test_it_keeps_the_promises(tmp_path: Path) -> None:
    """Two pages of words stand around the six trials."""
    assert prove_block(ENTRY, tmp_path).trials == 8


def test_so_does_its_part_of_the_report(tmp_path: Path) -> None:
    """All that is promised of every part."""
    assert len(prove_report_part("same_or_different", ENTRY, tmp_path)) == 6


def test_d_prime_of_a_table() -> None:
    """An unbiased proportion correct of 0.75 is a d' of 2.10."""
    assert d_prime(7499, 10000, 2499, 10000) == pytest.approx(2.10, abs=0.01)
    assert d_prime(5, 10, 5, 10) == 0.0
