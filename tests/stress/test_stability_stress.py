"""Every numeric routine against arithmetic of 80 digits: errors within their limits, and as docs/stability.md says."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.stress.stability.page import PAGE, measured, read_rows
from tests.stress.stability.registry import routines
from tests.stress.stability.routine import Routine

pytestmark = pytest.mark.stress
# Another processor's or library's logarithm may err by a last place more.
TIMES = 3.0


@pytest.mark.parametrize("routine", routines(), ids=lambda routine: routine.name)
def test_errors_are_within_their_limit_and_as_the_page_states(routine: Routine) -> None:
    row, stated = measured(routine), read_rows(PAGE.read_text(encoding="utf-8"))[routine.name]
    assert row.error <= routine.limit
    assert row.error <= TIMES * stated.error
    assert stated.condition / 2.0 <= row.condition <= 2.0 * stated.condition
    assert replace(row, error=stated.error, condition=stated.condition) == stated
    routine.check_outside()
