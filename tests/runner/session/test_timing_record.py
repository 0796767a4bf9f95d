"""Intervals between frames, and what is said of them."""

from __future__ import annotations

import hashlib
import json
import random
import time
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from analysis.records import SurfaceFacts, read_session
from devices.display import read_verification
from runner.cli.main import group
from runner.presenter import IntervalSummary
from runner.session.timing_record import NOT_VERIFIED, explain, judge, swap_intervals

Study = Any  # tests/conftest.py
RECORD = """\
schema_version: 1
date: 2026-03-14
instrument: photodiode and oscilloscope
mode: {mode}
refresh_hz: 60
renderer: A card
onsets: 200
onset_error_ms: {{mean: 4.3, standard_deviation: 0.2, worst: 5.1}}
"""
HERE = SurfaceFacts(backend="window", display_server="X11", renderer="A card", vsync=True)


def test_a_late_frame_is_counted_once_and_each_refresh_that_it_missed() -> None:
    summary = IntervalSummary.of([10.0] * 97 + [20.0, 31.0, 14.0])
    assert (summary.frames, summary.median_ms, summary.longest_ms, summary.p99_ms) == (100, 10.0, 31.0, 20.0)
    assert (summary.late, summary.missed) == (2, 1 + 2)
    _, counts, *_ = explain(summary, True)
    assert "2 of 100 frames came late" in counts
    assert "3 of 103 refreshes" in counts
    assert IntervalSummary.of([16.7]).missed == 0


@given(
    st.lists(st.integers(1, 400), min_size=3, max_size=60),
    st.sampled_from([50.0, 59.94, 60.0, 120.0, 143.98, 240.0]),
    st.sampled_from(["reported", "not reported"]),
)
def test_there_are_never_more_late_frames_than_frames_nor_refreshes_missed_than_passed(
    refreshes: list[int], rate_hz: float, reported: str
) -> None:
    steady = [1] * (len(refreshes) + 1)  # the median is one refresh
    intervals = [1000.0 * each / rate_hz for each in steady + refreshes]
    summary = IntervalSummary.of(intervals, round(rate_hz) if reported == "reported" else None)
    assert summary.missed == sum(refreshes) - len(refreshes)
    assert summary.late == sum(each > 1 for each in refreshes) <= summary.frames
    assert summary.frames + summary.missed == len(steady) + sum(refreshes)  # all refreshes that passed


def test_frames_that_all_take_two_refreshes_are_all_late() -> None:
    assert IntervalSummary.of([33.3] * 20, 60.0).late == 20
    assert IntervalSummary.of([33.3] * 20).late == 0  # nothing says that the screen is faster


def _drawn(usual_ms: float, spread: float) -> list[float]:
    """Return intervals of a virtual screen: as long as the drawing took, now and then very long."""
    draw = random.Random(3)
    return [usual_ms * draw.lognormvariate(0.0, spread) for _ in range(80)] + [86.6] * 20


@pytest.mark.parametrize(
    ("refresh_hz", "usual_ms", "spread"),
    [(None, 0.29, 0.1), (None, 2.35, 0.5), (None, 12.0, 0.5), (60.0, 0.29, 0.1), (60.0, 4.7, 0.01), (60.0, 16.7, 0.5)],
)
def test_without_a_screen_to_wait_for_no_frame_is_late(
    refresh_hz: float | None, usual_ms: float, spread: float
) -> None:
    """On a virtual screen 4352 "late frames" were counted in 4160 intervals."""
    summary = IntervalSummary.of(_drawn(usual_ms, spread), refresh_hz)
    assert (summary.missed, summary.late) == (None, None)
    told = " ".join(explain(summary, True))
    assert "Late frames cannot be counted" in told
    assert "came late" not in told


@pytest.mark.parametrize("jitter", [0.0, 0.02, 0.05])
def test_swaps_that_wait_for_a_screen_may_jitter(jitter: float) -> None:
    draw = random.Random(4)
    intervals = [16.68 * (refreshes + draw.gauss(0.0, jitter)) for refreshes in [1] * 70 + [2] * 20 + [5] * 10]
    for refresh_hz in (None, 59.0, 60.0):
        summary = IntervalSummary.of(intervals, refresh_hz)
        assert (summary.late, summary.missed) == (30, 20 + 40)


def test_the_explanation_says_when_nothing_waits_for_a_screen() -> None:
    assert any("do not wait for the screen" in line for line in explain(IntervalSummary.of([0.5] * 10), True))
    steady = explain(IntervalSummary.of([16.7] * 100), True)
    assert not any("do not wait" in line for line in steady)
    assert "59.9 frames per second" in steady[0]
    assert "not verified with a photodiode" in steady[-2]
    assert "photodiode_verification" in steady[-1]


def _record(folder: Path, mode: str = "side-by-side") -> Path:
    (folder / "photodiode.yaml").write_text(RECORD.format(mode=mode))
    return folder / "photodiode.yaml"


def test_onsets_are_verified_only_where_the_record_holds(tmp_path: Path) -> None:
    record = read_verification(_record(tmp_path))
    held = judge(record, "side-by-side", HERE, 59.94)
    assert held.remarks == ()
    assert held.words.startswith("verified with a photodiode on 2026-03-14")
    assert "verified with a photodiode on 2026-03-14" in explain(IntervalSummary.of([16.7] * 9), True, held)[-1]
    for mode, surface, rate_hz, said in (
        ("flat", HERE, 59.94, "not 'flat'"),
        ("side-by-side", HERE, 75.0, "not 75 Hz"),
        ("side-by-side", HERE.model_copy(update={"renderer": "llvmpipe"}), 59.94, "not 'llvmpipe'"),
        ("side-by-side", HERE, None, "no screen"),
    ):
        judgement = judge(record, mode, surface, rate_hz)
        assert judgement.words == NOT_VERIFIED
        (remark,) = judgement.remarks
        assert said in remark
        assert "photodiode.yaml does not hold here" in remark
        told = explain(IntervalSummary.of([16.7] * 9), True, judgement)
        assert any(said in line for line in told)
        assert any(NOT_VERIFIED in line for line in told[-2:])
    assert judge(None, "side-by-side", HERE, 60.0).words == NOT_VERIFIED


def test_a_session_s_header_holds_the_record_and_says_that_it_does_not_hold_without_a_screen(study: Study) -> None:
    record = _record(study.folder)
    study.edit("rig.yaml", "mode: side", "photodiode_verification: photodiode.yaml\nmode: side")
    assert "there is no screen here" in study.run().stderr
    header = read_session(study.log_file()).header
    timing = header.presentation.timing.given()
    assert timing["verification"] == NOT_VERIFIED
    kept = timing["verification_record"]
    assert kept["sha256"] == hashlib.sha256(record.read_bytes()).hexdigest()
    assert kept["onset_error_ms"] == {"mean": 4.3, "standard_deviation": 0.2, "worst": 5.1}
    assert any("photodiode.yaml does not hold here" in remark for remark in header.remarks)


def test_a_session_without_a_record_says_so_and_remarks_nothing(study: Study) -> None:
    study.run()
    header = read_session(study.log_file()).header
    assert header.presentation.timing.verification == NOT_VERIFIED
    assert "verification_record" not in header.presentation.timing.given()
    assert header.remarks == ()


def _check(*files: Path) -> Any:
    return CliRunner().invoke(group, ["check", *map(str, files), "--json"])


def test_check_tells_what_a_record_says_and_whether_it_is_of_this_rig(study: Study) -> None:
    record = _record(study.folder)
    study.edit("rig.yaml", "mode: side", "photodiode_verification: photodiode.yaml\nmode: side")
    files = json.loads(_check(record, study.folder / "rig.yaml", study.experiment).stdout)
    assert all(facts["onsets"].startswith("verified with a photodiode") for facts in files)
    _record(study.folder, "flat")
    for facts in json.loads(_check(study.folder / "rig.yaml", study.experiment).stdout):
        assert facts["onsets"] == NOT_VERIFIED
        messages = [warning["message"] for warning in facts["warnings"]]
        assert any("'flat', not 'side-by-side'" in message for message in messages)


def test_check_and_run_refuse_a_missing_and_a_wrong_record(study: Study) -> None:
    study.edit("rig.yaml", "mode: side", "photodiode_verification: photodiode.yaml\nmode: side")
    for text, place in ((None, ("rig.yaml", 3, 26)), ("date: today\n", ("photodiode.yaml", 1, 7))):
        if text:
            (study.folder / "photodiode.yaml").write_text(text)
        done = _check(study.experiment)
        assert done.exit_code == 2
        findings = json.loads(done.stdout)[0]["findings"]
        assert place in {(Path(one["file"]).name, one["line"], one["column"]) for one in findings}
        ran = study.cyclopean("run", study.experiment, "--observer", "01", "--results", study.results, expect=2)
        assert f"{place[0]}:{place[1]}:{place[2]}: " in ran.stderr
        assert not study.results.exists()


@pytest.mark.window
@pytest.mark.nightly
def test_doctor_says_that_a_record_of_another_machine_does_not_hold(
    xvfb: str, study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    _record(study.folder)
    study.edit("rig.yaml", "mode: side", "photodiode_verification: photodiode.yaml\nmode: side")
    monkeypatch.setenv("DISPLAY", xvfb)
    told = study.cyclopean("doctor", "--timing", "--seconds", "0.5", "--json", "--rig", study.folder / "rig.yaml")
    facts = json.loads(told.stdout)
    assert facts["verification"] == NOT_VERIFIED
    assert any("measured with the renderer 'A card'" in line for line in facts["meaning"])


def test_swaps_are_timed_as_long_as_asked_and_at_least_two_of_them() -> None:
    assert swap_intervals(lambda: None, 0.0).frames == 2
    told: list[float] = []
    asked_s = 0.05
    summary = swap_intervals(lambda: time.sleep(0.002), asked_s, told.append)
    assert summary.frames == len(told) > 2
    assert told[-2] < asked_s <= told[-1]


# A session's record holds how the monitor was set when it was measured and when it was used.


def test_the_header_has_both_and_the_remarks_say_what_differs(study: Study) -> None:
    study.edit("display.yaml", "    source:", "    monitor_settings: {brightness_percent: 35}\n    source:")
    with (study.folder / "rig.yaml").open("a") as rig:
        rig.write("monitor_settings: {brightness_percent: 40, local_dimming: true}\n")
    study.run()
    header = read_session(study.log_file()).header
    assert header.display.monitor_settings == {
        "measured": {"brightness_percent": 35.0},
        "used": {"brightness_percent": 40.0, "local_dimming": True},
    }
    dimming, differs = header.remarks
    assert dimming.startswith("local dimming is on")
    assert differs.endswith("brightness_percent 35, not 40")
