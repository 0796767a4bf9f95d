"""A report on sessions of every kind of block, by one observer and by four, with every figure drawn."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.runner.every_kind import VARIANTS
from tests.runner.test_report_every_kind import make_a_page

pytestmark = pytest.mark.stress


@pytest.mark.parametrize("observers", [1, 4])
@pytest.mark.parametrize(("kind", "variant"), VARIANTS)
def test_sessions_of_every_kind_make_a_page(kind: str, variant: int, observers: int, tmp_path: Path) -> None:
    make_a_page(kind, variant, observers, tmp_path)
