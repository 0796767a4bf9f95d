"""Whatever is done to a session, to its disk and to its clock: each answer is kept once, and it ends as it would."""

from __future__ import annotations

from hypothesis import HealthCheck, settings

from tests.runner.session_machine import SessionMachine

# More and longer: tests/stress.
TestSession = SessionMachine.TestCase
TestSession.settings = settings(max_examples=16, stateful_step_count=30, suppress_health_check=[HealthCheck.too_slow])
