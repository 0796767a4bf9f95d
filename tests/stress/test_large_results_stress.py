"""Large results: 500 sessions or 200 stimuli in a report, 19,850 trials resumed, each within time and memory.

Times are of the processor, and generous: a busy machine takes up to twice what a quiet one does.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from analysis.records import read_results
from benchmarks.large_results import measured, write_sessions, write_stopped_session

pytestmark = [
    pytest.mark.stress,
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the peak of memory is read from /proc"),
]
MOST_S, MOST_RESUMED_S, MOST_MB = 16.0, 8.0, 400.0


@pytest.mark.parametrize(("observers", "stimuli", "repeats"), [(500, 10, 2), (1, 200, 1)])
def test_a_report_on_large_results(tmp_path: Path, observers: int, stimuli: int, repeats: int) -> None:
    write_sessions(tmp_path / "results", observers, stimuli, repeats)
    taken, peak_mb = measured(["report", "results"], tmp_path)
    print(f"{taken:.1f} s, {peak_mb} MB")
    assert (tmp_path / "results" / "report.html").is_file()
    assert taken <= MOST_S
    assert peak_mb is not None
    assert peak_mb <= MOST_MB


def test_a_long_session_is_resumed(tmp_path: Path) -> None:
    words = write_stopped_session(tmp_path / "pictures", 200, 50)
    taken, peak_mb = measured(words, tmp_path)
    print(f"{taken:.1f} s, {peak_mb} MB")
    (log,) = read_results(tmp_path / "results")
    assert log.complete
    assert len(log.trials) == 19_900
    assert taken <= MOST_RESUMED_S
    assert peak_mb is not None
    assert peak_mb <= MOST_MB
