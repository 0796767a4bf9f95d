"""`cyclopean demo`, with few observers: the real job, with its work counted."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from analysis.records.session_record import read_session, session_files


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, object], Path]:
    """What the demo with three observers printed, and its results."""
    folder = tmp_path_factory.mktemp("demo")
    code = "from runner.cli.main import main; main()"
    told = subprocess.run(
        [sys.executable, "-c", code, "demo", "--observers", "3", "--results", str(folder / "results"), "--json"],
        capture_output=True,
        text=True,
        env={**os.environ, "CYCLOPEAN_CACHE": str(folder / "cache")},
        timeout=300,
    )
    assert told.returncode == 0, told.stderr
    return json.loads(told.stdout), folder / "results"


def test_every_observer_answers_every_pair_before_the_report(demo: tuple[dict[str, object], Path]) -> None:
    said, results = demo
    logs = [read_session(file) for file in session_files(results)]
    assert len(logs) == 3
    for log in logs:
        assert log.complete
        pairs = [trial for trial in log.trials if trial.kind == "all_pairs"]
        assert len({frozenset((t.data["first"], t.data["second"])) for t in pairs}) == 45
    html = Path(str(said["report"])).read_text()
    assert "<svg" in html
    assert "2.1-stereo" in html


def test_scores_add_up(demo: tuple[dict[str, object], Path]) -> None:
    scores = demo[0]["scores"]
    assert isinstance(scores, dict)
    items = scores["items"]
    assert len(items) == 10
    assert sum(item["wins"] for item in items) == 135
    assert scores["df"] == 36


def test_nothing_is_computed_that_the_scene_does_not_need(demo: tuple[dict[str, object], Path]) -> None:
    """Five stereo pairs and five flat pictures make 15 uploads and 15 colour passes, however many trials show them."""
    work = demo[0]["work"]
    assert isinstance(work, dict)
    assert work["decodes"] == 10
    assert work["uploads"] == 15
    assert work["colour_passes"] == 15
    # Per observer: instructions, 45 pairs, two breaks, each drawn once.
    assert work["frames_drawn"] == 3 * (1 + 45 + 2)
    assert work["evictions"] == 0
