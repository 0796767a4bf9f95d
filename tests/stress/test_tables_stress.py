"""Exports, tables, sparse scores and simulated power at their edges: in bounded time and memory."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
import time
import tracemalloc
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analysis.comparisons import read_any
from analysis.comparisons.layouts import LAYOUTS
from analysis.errors import ResultsError
from analysis.kinds import Trial
from analysis.records import FILE_NAME, new_header
from analysis.simulation import Plan
from analysis.simulation.studies import run
from benchmarks.power import by_report
from extensions.bids import export_dataset
from extensions.power import differing_pairs, simulate_power, spread_theta
from tests.analysis.simulation.test_simulation import report_on
from tests.answers import new_answer
from tests.kept import known
from tests.stress.memory import command_alone, run_alone

pytestmark = pytest.mark.stress


# The BIDS export pushed to the edges: many sessions, long sessions, wide records, one folder for all.

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


# Tables of all layouts with bytes changed at random: each is read or refused by findings, in bounded time.

TABLES = {
    "winner-loser": "winner,loser,count,observer\n" + "a,b,2,o1\nb,a,1,o2\n" * 20,
    "pwcmp": "observer,scene,condition_A,condition_B,is_A_selected\n" + "o1,s,a,b,1\no2,s,b,c,0\n" * 20,
    "items": "observer,item_a,item_b,choice\n" + "o1,x,y,a\no2,y,z,z\no3,x,y,tie\n" * 20,
    "options": "option_1,option_2,option_3,choice\n" + "a,b,c,b\nb,c,d,3\n" * 20,
    "matrix": ",a,b,c\na,0,3,1\nb,2,0,4\nc,1,5,0\n",
    "trials": "experiment,observer,kind,first,second,answer,chosen,rejected\n"
    + "e,o1,all_pairs,x,y,x,x,y\ne,o1,all_pairs,y,z,z,z,y\ne,o2,rating,x,,3,,\n" * 20,
}
BYTES = b',\n"\r;\x00\xff0123456789ab.-e \t'


@pytest.mark.parametrize("layout", TABLES)
def test_changed_tables_are_read_or_refused(layout: str) -> None:
    assert list(TABLES) == list(LAYOUTS)
    random, whole = np.random.default_rng(len(layout)), TABLES[layout].encode()
    outcomes = [0, 0]
    for _ in range(3000):
        changed = bytearray(whole)
        for place in random.integers(len(whole), size=random.integers(1, 6)):
            changed[place] = BYTES[random.integers(len(BYTES))]
        cut = bytes(changed[: random.integers(1, len(whole)) if random.random() < 0.2 else len(whole)])
        start = time.process_time()
        try:
            told = read_any(io.BytesIO(cut), "t.csv").comparisons
        except ResultsError:
            outcomes[1] += 1
        else:
            outcomes[0] += 1
            assert np.isfinite(told.count).all()
            assert (told.count > 0).all()
            assert told.wins.diagonal().sum() == 0
        assert time.process_time() - start < 1
    assert min(outcomes) > 30  # of a matrix nearly every byte matters


def test_a_million_choices_and_a_matrix_of_a_thousand_items() -> None:
    lines = ["item_a,item_b,choice\n", *(["x,y,a\n", "y,x,x\n", "x,z,tie\n", "z,x,b\n"] * 250_000)]
    told = read_any(lines, "t.csv").comparisons
    assert (told.count.sum(), told.ties) == (750_000, 250_000)
    names = [f"n{number}" for number in range(1000)]
    rows = (f"{name},{','.join('0' if other == name else '2' for other in names)}\n" for name in names)
    told = read_any([f",{','.join(names)}\n", *rows], "t.csv").comparisons
    assert told.wins.sum() == 2 * 1000 * 999
    assert told.items == tuple(names)


# `cyclopean scores` on two thousand items of which few pairs were compared: within its memory and time.

ITEMS, PAIRS, COMPARISONS = 2000, 10_000, 20


@pytest.mark.parametrize("options", [(), ("--json",), ("--method", "map"), ("--model", "thurstone")])
def test_few_pairs_of_many_items_take_little_memory_and_time(tmp_path: Path, options: tuple[str, ...]) -> None:
    """Two seconds of processor on a quiet machine; the test allows for a busy one."""
    random = np.random.default_rng(3)
    theta = random.normal(0, 1, ITEMS)
    first = random.integers(ITEMS, size=PAIRS)
    second = (first + 1 + random.integers(ITEMS - 1, size=PAIRS)) % ITEMS
    won = random.binomial(COMPARISONS, 1 / (1 + np.exp(theta[second] - theta[first])))
    lines = [f"{i},{j},{w}\n{j},{i},{COMPARISONS - w}\n" for i, j, w in zip(first, second, won, strict=True)]
    table = tmp_path / "table.csv"
    table.write_text("winner,loser,count\n" + "".join(lines), encoding="utf-8")
    said, seconds, megabytes = command_alone("scores", table, *options)
    assert megabytes <= 200
    assert seconds <= 6
    if "--json" in options:
        items = json.loads(said)["items"]
        estimate = np.array([item["theta"] for item in sorted(items, key=lambda item: int(item["name"]))])
        error = np.array([item["se"] for item in sorted(items, key=lambda item: int(item["name"]))])
        assert np.abs((estimate - theta + theta.mean()) / error).std() < 1


# Power simulated at its edges: many stimuli in bounded memory, scores far apart, workers that keep dying.

STUDIES = 300

MANY = """
import numpy as np
from extensions.power import differing_pairs, simulate_power, spread_theta
from analysis.simulation import Plan
from tests.stress.memory import forget_peak, peak_kb
theta = spread_theta(100, 3)
plan = Plan(tuple(map(str, range(100))), theta, np.ones(4950, dtype=np.int64), differing_pairs(theta), observer_sd=0.5)
before = forget_peak()
found = simulate_power(plan, [200], replicates=20, workers=1)
assert np.isfinite(found.separates).all() and np.isfinite(found.mean_width).all()
print((peak_kb() - before) // 1024)
"""


def plan_of(theta: np.ndarray[tuple[int, ...], np.dtype[np.float64]], **fields: Any) -> Plan:
    """Return a plan of all pairs, each once."""
    names = tuple(f"item {item}" for item in range(len(theta)))
    return Plan(
        names, theta, np.ones(len(theta) * (len(theta) - 1) // 2, dtype=np.int64), differing_pairs(theta), **fields
    )


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells the peak of a process's memory so")
def test_a_hundred_stimuli_and_two_hundred_observers_fit_into_half_a_gigabyte() -> None:
    assert int(run_alone(MANY)) < 512


@pytest.mark.parametrize("nats", [0.0, 12.0, 30.0])
@pytest.mark.parametrize("fields", [{}, {"covariance": "model"}, {"adjust": "maxz"}, {"observer_sd": 5.0}])
def test_scores_far_apart_and_not_at_all_stay_finite(nats: float, fields: dict[str, Any]) -> None:
    found = simulate_power(plan_of(spread_theta(8, nats), **fields), [2, 30], replicates=200, workers=1)
    for name in ("separates", "reversed", "width", "recovery", "alike"):
        assert np.isfinite(getattr(found, name)).all(), name
    assert (found.unfitted == 0).all()
    if nats == 12.0 and not fields.get("observer_sd"):
        assert found.separated[0] > 0.9


@pytest.mark.parametrize(("observers", "observer_sd"), [(5, 0.7), (10, 0.0), (10, 0.7), (20, 1.5)])
def test_power_is_the_share_of_reports_that_separate_a_pair(observers: int, observer_sd: float) -> None:
    design = plan_of(spread_theta(6, 3), observer_sd=observer_sd, scores_of="average")
    found = simulate_power(design, [observers], replicates=4000, workers=1).separates[0]
    share = by_report(design, observers, STUDIES)
    error = np.sqrt(np.maximum(found * (1 - found), 0.01) * (1 / STUDIES + 1 / 4000))
    assert (np.abs(share - found) < 4.5 * error).all()
    assert found.max() > 0.3


@pytest.mark.parametrize(("observers", "observer_sd"), [(5, 0.0), (5, 0.7), (10, 1.5), (20, 0.7)])
@pytest.mark.parametrize("covariance", ["auto", "sandwich"])
def test_one_quantile_of_the_largest_z_serves_ten_items(observers: int, observer_sd: float, covariance: str) -> None:
    design = plan_of(spread_theta(10, 2), observer_sd=observer_sd, adjust="maxz", covariance=covariance)
    studies = run(design, observers, 20, np.random.default_rng(2))
    found = studies.significant(design.critical_z(observers))
    own = []
    for study in range(20):
        classes = known(report_on(studies, study, "maxz").scores.classes)
        own.append(classes.pair_p <= 0.05)
    assert (found == np.array(own)).mean() > 0.97
