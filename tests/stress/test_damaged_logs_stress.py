"""Thousands of damaged logs: no traceback in whatever reads them, and no answer believed that was not given."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from analysis.records import read_session
from tests.runner.log_mutants import mutants
from tests.runner.test_damaged_logs import LOGS, NOT_NOTICED, made, put, read, use, what_counts
from tests.stress.how_many import how_many

pytestmark = pytest.mark.stress
MUTANTS = how_many(6000, 12_000)


def test_thousands_of_damaged_logs_are_refused_or_say_what_they_said(tmp_path: Path) -> None:
    original = {name: what_counts(read_session(log)) for name, log in LOGS.items()}
    believed: Counter[str] = Counter()
    for name, mutant in made(range(1000, 1000 + MUTANTS)):
        damaged = read(mutant.content, tmp_path)
        if damaged is not None and what_counts(damaged) != original[name]:
            believed[mutant.change] += 1
    assert sum(count for change, count in believed.items() if change not in NOT_NOTICED) <= MUTANTS // 1000, believed


def test_of_flipped_bits_only_what_is_recorded_once_is_believed(tmp_path: Path) -> None:
    """A rating whose key was pressed once, and the words and numbers of a test's outcome, are compared with nothing."""
    believed = 0
    for log in LOGS.values():
        original = what_counts(read_session(log))
        for mutant in mutants(log.read_bytes(), range(1500), ["flip a bit"]):
            damaged = read(mutant.content, tmp_path)
            if damaged is not None and what_counts(damaged) != original:
                changed = set(what_counts(damaged)) ^ set(original)
                assert {kind for _, _, kind, *_ in changed} <= {"rating", "screening"}, mutant.seed
                believed += 1
    assert believed <= 20


def test_whatever_reads_damaged_logs_comes_to_its_end(tmp_path: Path, cyclopean: Callable[..., Any]) -> None:
    for name, mutant in made(range(20_000, 20_000 + how_many(300, 1000))):
        if read(mutant.content, tmp_path) is not None:
            use(put(mutant.content, tmp_path, name), cyclopean)
