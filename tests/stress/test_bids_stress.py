"""The BIDS export pushed to the edges: many sessions, long sessions, wide records, one folder for all."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tracemalloc
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from analysis.bids import export_dataset
from analysis.kinds import Trial
from analysis.records import FILE_NAME, new_header
from tests.answers import new_answer

pytestmark = pytest.mark.stress
STIMULI = tuple(f"s{index}" for index in range(10))
COST = {f"percent_{what}": 0.5 for what in ("red", "green", "blue", "any", "above_full")} | {"delta_e_00_mean": 0.1}


def _pair(number: int, more: dict[str, Any]) -> Trial:
    first, second = STIMULI[number % 10], STIMULI[(number + 3) % 10]
    clipping = {name: {"left": COST, "right": COST} for name in (first, second)}
    data = {"first": first, "second": second, "answer": "first", "chosen": first, "rejected": second}
    utc = (datetime(2026, 1, 2, 3, tzinfo=UTC) + timedelta(seconds=number)).isoformat(timespec="milliseconds")
    return new_answer(0, number, "all_pairs", (("up", 1.0),), 1.0, utc, {**data, "clipping": clipping, **more})


def _leave(folder: Path, number: int, trials: int, **more: Any) -> None:
    described = tuple({"name": name, "factors": {}} for name in STIMULI)
    started = "2026-01-02T03:00:00+00:00"
    label = f"o{number:04d}"
    header = new_header("big", label, f"s{number}", started, question="Which?", simulated=True, stimuli=described)
    file = folder / f"station{number % 7}" / f"sub-{label}" / FILE_NAME
    file.parent.mkdir(parents=True)
    with open(file, "w") as stream:
        for line in (header.to_json(), *(_pair(n, more).to_json() for n in range(trials)), {"record": "end"}):
            stream.write(json.dumps(line) + "\n")


def _peak(folder: Path, target: Path) -> int:
    tracemalloc.start()
    try:
        export_dataset([folder], target)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.alone
def test_hundreds_of_sessions_do_not_sit_in_memory(tmp_path: Path) -> None:
    """A session of 20 trials takes 84 kB once read; what is kept of each is its labels, some 2 kB."""
    for number in range(400):
        _leave(tmp_path / ("few" if number < 20 else "many"), number, 20)
    few = _peak(tmp_path / "few", tmp_path / "bids few")
    many = _peak(tmp_path / "many", tmp_path / "bids many")
    assert (many - few) / 360 < 10_000
    assert len(list((tmp_path / "bids many").glob("sub-*"))) == 380


def test_the_validator_passes_hundreds_of_sessions(tmp_path: Path) -> None:
    validator = Path(sys.executable).with_name("bids-validator-deno")
    if not validator.exists():
        pytest.skip("the BIDS validator is not installed (package bids-validator-deno)")
    for number in range(300):
        _leave(tmp_path / "results", number, 45)
    target = export_dataset([tmp_path / "results"], tmp_path / "bids").folder
    command = [str(validator), "--format", "json", "--ignoreWarnings", "--max-rows=-1", str(target)]
    told = subprocess.run(command, capture_output=True, text=True, timeout=900, env={**os.environ, "NO_COLOR": "1"})
    said = json.loads(told.stdout)
    assert said["issues"]["issues"] == []
    assert len(said["summary"]["subjects"]) == 300


def test_a_session_of_a_hundred_thousand_trials_is_one_table(tmp_path: Path) -> None:
    _leave(tmp_path / "results", 1, 100_000)
    assert export_dataset([tmp_path / "results"], tmp_path / "bids").trials == 100_000
    (file,) = (tmp_path / "bids").glob("sub-*/ses-*/beh/*_beh.tsv")
    with open(file) as stream:
        assert sum(1 for _ in stream) == 100_001


def test_records_of_ten_thousand_keys_stay_one_column(tmp_path: Path) -> None:
    wide = {"by_name": {f"n{index}": index for index in range(10_000)}}
    _leave(tmp_path / "results", 1, 20, **wide)
    done = export_dataset([tmp_path / "results"], tmp_path / "bids")
    described = json.loads((done.folder / "task-big_beh.json").read_text())
    assert "by_name" in described
    assert len(described) < 60
