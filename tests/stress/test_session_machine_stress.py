"""Whatever is done to a session, to its disk and to its clock: longer, and far more often."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, settings
from hypothesis.stateful import run_state_machine_as_test

from tests.runner.session_machine import SessionMachine
from tests.stress.how_many import how_many

pytestmark = pytest.mark.stress


def test_what_is_done_to_a_session_loses_no_answer() -> None:
    run_state_machine_as_test(
        SessionMachine,
        settings=settings(
            max_examples=how_many(250, 600), stateful_step_count=60, suppress_health_check=list(HealthCheck)
        ),
    )
