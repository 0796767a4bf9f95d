"""Ten thousand flipped bits and a thousand edited lines over logs of every kind: each named with its line."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from analysis.records import FILE_NAME
from tests.runner.changed_logs import EDITS, edit, flip, recorded, refused
from tests.runner.every_kind import VARIANTS

pytestmark = pytest.mark.stress
FLIPS, EDITED = 10_000, 1_000


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[list[bytes], list[bytes]]]:
    """Two sessions of each kind, some without an end."""
    folder = tmp_path_factory.mktemp("logs")
    return [
        (
            recorded(folder, kind, variant, "01", end=number % 3 != 0),
            recorded(folder, kind, variant, "02", end=number % 3 != 0),
        )
        for number, (kind, variant) in enumerate(VARIANTS)
    ]


def test_ten_thousand_flipped_bits(logs: list[tuple[list[bytes], list[bytes]]], tmp_path: Path) -> None:
    rng = random.Random(18)
    for number in range(FLIPS):
        refused(tmp_path / FILE_NAME, *flip(rng, logs[number % len(logs)][0]))


def test_a_thousand_edited_lines(logs: list[tuple[list[bytes], list[bytes]]], tmp_path: Path) -> None:
    rng = random.Random(19)
    for number in range(EDITED):
        refused(tmp_path / FILE_NAME, *edit(rng, EDITS[number % len(EDITS)], *logs[number % len(logs)]))
