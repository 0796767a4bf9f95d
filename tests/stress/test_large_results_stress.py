"""Large results: 500 sessions or 200 stimuli in a report, 19,850 trials resumed, a million answers in a DataFrame.

Time is in proportion, and memory is bounded.

Seconds depend on the machine: `benchmarks/large_results.py` has them. Here a result is beside a part of it, in one run,
so that what grows faster than the result is seen on any.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from analysis.records import read_results
from benchmarks.large_results import (
    MOST_BESIDE_FIT,
    SCORED,
    beside_fit,
    measured,
    write_sessions,
    write_stopped_session,
)
from tests.kept import known

pytestmark = [
    pytest.mark.stress,
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the peak of memory is read from /proc"),
]
MOST_MB = 400.0
SLACK = 1.5


@pytest.mark.parametrize(
    ("whole", "part", "trials"),
    [((500, 10, 2), (125, 10, 2), 4.0), ((1, 200, 1), (1, 100, 1), 4.0)],
    ids=["sessions", "stimuli"],
)
def test_a_report_on_large_results_takes_no_longer_than_its_share(
    tmp_path: Path, whole: tuple[int, int, int], part: tuple[int, int, int], trials: float
) -> None:
    """Of ``trials`` times as many trials, the start of the program included in both."""
    taken = {}
    for name, size in (("whole", whole), ("part", part)):
        write_sessions(tmp_path / name / "results", *size)
        taken[name], peak_mb = measured(["report", "results"], tmp_path / name)
        print(f"{name}: {taken[name]:.1f} s, {peak_mb} MB")
        assert (tmp_path / name / "results" / "report.html").is_file()
        assert known(peak_mb) <= MOST_MB
    assert taken["whole"] <= SLACK * trials * taken["part"]


def test_a_long_session_is_resumed(tmp_path: Path) -> None:
    """19,850 trials, beside a quarter of them."""
    taken = {}
    for stimuli, missing in ((200, 50), (100, 50)):
        folder = tmp_path / str(stimuli)
        words = write_stopped_session(folder / "pictures", stimuli, missing)
        taken[stimuli], peak_mb = measured(words, folder)
        print(f"{stimuli} stimuli: {taken[stimuli]:.1f} s, {peak_mb} MB")
        (log,) = read_results(folder / "results")
        assert log.complete
        assert len(log.trials) == stimuli * (stimuli - 1) // 2
        assert known(peak_mb) <= MOST_MB
    assert taken[200] <= SLACK * 4 * taken[100]


@pytest.mark.parametrize("items", [150, 1000])
def test_a_million_answers_of_20_000_observers_in_a_data_frame(tmp_path: Path, items: int) -> None:
    taken = {}
    for answers in (1_000_000, 250_000):
        taken[answers], peak_mb = measured([str(answers), str(items), "20000"], tmp_path, SCORED)
        print(f"{answers} answers to {items} items: {taken[answers]:.1f} s, {peak_mb} MB")
        assert known(peak_mb) <= 1000.0
    assert taken[1_000_000] <= SLACK * 4 * taken[250_000]


@pytest.mark.parametrize(("items", "observers"), [(300, 100), (300, 20_000), (1000, 1000), (1000, 20_000), (2000, 500)])
def test_scores_take_little_more_than_reading_and_the_fit(items: int, observers: int) -> None:
    found = beside_fit(200_000, items, observers)
    assert found["scores"] <= MOST_BESIDE_FIT * (found["reading"] + found["fit"])
