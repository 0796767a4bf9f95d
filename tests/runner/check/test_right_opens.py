"""Whatever `check` calls right opens, and all that it draws lies in the view and beside the pictures."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings

from tests.runner.generated_experiments import experiments, what_check_calls_right_opens

PLAIN = {
    "panel": (800, 600),
    "mode": "side-by-side",
    "stereo": True,
    "question": "Which?",
    "layout": {"arrangement": "vertical", "size_mm": [20, 15], "gap_mm": 1, "reference": "none"},
    "blocks": [{"kind": "instructions", "text": "Look."}, {"kind": "all_pairs"}],
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("drawn")


# More of them: tests/stress.
@pytest.mark.promise("check-runs")
@given(drawn=experiments())
@settings(max_examples=4, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_what_check_calls_right_opens(drawn: dict[str, object], folder: Path) -> None:
    what_check_calls_right_opens(drawn, folder, screens=2)


def test_a_plain_experiment_is_right_and_a_long_question_wrong(folder: Path) -> None:
    assert what_check_calls_right_opens(PLAIN, folder)
    assert not what_check_calls_right_opens({**PLAIN, "question": "Which of the two is closer? " * 10}, folder)
    assert not what_check_calls_right_opens({**PLAIN, "mode": "flat"}, folder)
    assert what_check_calls_right_opens({**PLAIN, "mode": "flat", "stereo": False}, folder)
