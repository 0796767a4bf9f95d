"""What reports and scores read, fit and draw, counted: no more than they need."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from documents import count_work, counted_work
from runner.cli.main import group
from tests.runner.cli.sessions import write_session


def _work(*words: object) -> dict[str, int]:
    result = CliRunner().invoke(group, [*map(str, words), "--json"])
    assert result.exit_code == 0, result.output
    found: dict[str, Any] = json.loads(result.stdout)
    return dict(found["work"])


def test_work_is_counted_in_all_threads_and_in_every_count_that_is_open() -> None:
    count_work("pictures_read")  # nobody counts
    with counted_work() as whole:
        with counted_work() as part, ThreadPoolExecutor(4) as pool:
            list(pool.map(lambda _: count_work("pictures_read"), range(100)))
        count_work("pictures_read", 2)
    count_work("pictures_read")
    assert (dict(part), dict(whole)) == ({"pictures_read": 100}, {"pictures_read": 102})


@pytest.mark.promise("no-needless-work")
def test_a_report_reads_each_session_once_and_fits_no_model_twice(tmp_path: Path) -> None:
    for number in range(4):
        write_session(tmp_path / "results", f"{number:02d}")
    found = _work("report", tmp_path / "results", "-o", tmp_path / "report.html")
    # Which pairs differ is decided by bounds, for most of the 1000 bootstraps and 180 studies; the others are climbed.
    bounded, climbed = found.pop("profiles_bounded"), found.pop("profiles_climbed")
    assert 0 < 2 * climbed < bounded
    # One fit, 1000 bootstraps of it, and those with each observer left out, with other models and for each test; 199 of
    # studies simulated for the smallest difference, and 12 of the answers analysed in other ways; 6 are penalised.
    # Intervals of six pairs, of three neighbours and of one effect in two ways.
    draws = {"bootstrap_draws": 1000, "models_fitted": 1049 + 199 + 12 + 6, "classes_found": 1}
    assert found == {"sessions_read": 4, "trials_read": 48, "figures_drawn": 8, "profile_intervals": 11, **draws}


def test_scores_fit_one_model_and_one_for_the_tests_of_two_items(tmp_path: Path) -> None:
    table = tmp_path / "table.csv"
    table.write_text("winner,loser,count\n" + "".join(f"{a},{b},3\n" for a in "abc" for b in "abc" if a != b))
    assert _work("scores", table) == {"models_fitted": 2, "classes_found": 1, "profile_intervals": 2}
