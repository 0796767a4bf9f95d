"""Intervals between frames, and what is said of them."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from runner.presenter.timing import IntervalSummary
from runner.timing_record import explain


def test_late_frames_are_counted_in_frames() -> None:
    summary = IntervalSummary.of([10.0] * 97 + [20.0, 31.0, 14.0])
    assert summary.frames == 100
    assert summary.median_ms == 10.0
    assert summary.longest_ms == 31.0
    assert summary.p99_ms == 20.0
    assert summary.missed == 1 + 2
    assert IntervalSummary.of([16.7]).missed == 0


def test_the_explanation_says_when_nothing_waits_for_a_screen() -> None:
    assert any("do not wait for the screen" in line for line in explain(IntervalSummary.of([0.5] * 10), True))
    steady = explain(IntervalSummary.of([16.7] * 100), True)
    assert not any("do not wait" in line for line in steady)
    assert "59.9 frames per second" in steady[0]
    assert "not verified with a photodiode" in steady[-1]


@pytest.mark.window
def test_doctor_measures_a_real_window(xvfb: str) -> None:
    code = "from runner.cli.main import main; main()"
    told = subprocess.run(
        [sys.executable, "-c", code, "doctor", "--timing", "--seconds", "0.5"],
        capture_output=True,
        text=True,
        env={**os.environ, "DISPLAY": xvfb},
    )
    assert told.returncode == 0, told.stderr
    assert "median" in told.stdout
    assert "X11 without a compositing manager" in told.stdout
