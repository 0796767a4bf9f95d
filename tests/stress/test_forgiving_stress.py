"""Sessions that forgive, at their edges: hundreds of observers to name, a day of intervals, desktops of any shape."""

from __future__ import annotations

import random
import time
from pathlib import Path

import pytest

from analysis.records import new_header
from runner.errors import SessionError
from runner.presenter import IntervalSummary
from runner.session import Recorder
from runner.session.folders import observer_folder, to_resume
from tests.answers import altered, new_answer

pytestmark = pytest.mark.stress
STIMULI = ({"name": "a"}, {"name": "b"})
CHOICE = {"first": "a", "second": "b", "answer": "first", "chosen": "a", "rejected": "b"}
HEADER = new_header("e", "01", "s", "2026-01-01T00:00:00.000+00:00", question="Which?", simulated=True, stimuli=STIMULI)


def test_resuming_nothing_beside_four_hundred_unfinished_sessions_names_some_of_them_soon(tmp_path: Path) -> None:
    for number in range(400):
        name = f"{number:03d}"
        folder = observer_folder(tmp_path, "e", name) / "ses-20260101T000000abcd"
        with Recorder.create(folder, altered(HEADER, observer=name)) as recorder:
            recorder.append(new_answer(0, 0, "all_pairs", (("up", 1.0),), 1.0, "2026-01-01T00:00:01.000+00:00", CHOICE))
    began_s = time.process_time()
    with pytest.raises(SessionError) as told:
        to_resume(tmp_path, "e", "nobody")
    assert time.process_time() - began_s < 5.0
    assert "000 (1 answer), 001 (1 answer)" in str(told.value)
    assert ", ..." in str(told.value)
    assert len(str(told.value)) < 1000


def test_a_day_of_intervals_is_counted_to_the_frame() -> None:
    draw = random.Random(5)
    refreshes = [1 if draw.random() < 0.999 else draw.randint(2, 6000) for _ in range(1_000_000)]
    intervals = [1000.0 * (each + draw.gauss(0.0, 0.02)) / 119.88 for each in refreshes]
    for refresh_hz in (None, 119.0, 120.0):
        summary = IntervalSummary.of(intervals, refresh_hz)
        assert summary.late == sum(each > 1 for each in refreshes)
        assert summary.missed == pytest.approx(sum(refreshes) - len(refreshes), rel=1e-4)  # the median is not exact
