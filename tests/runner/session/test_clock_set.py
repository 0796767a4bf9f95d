"""A session that is resumed on a machine whose clock was set meanwhile, back or forward."""

from __future__ import annotations

import json
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from analysis.records import FILE_NAME, SessionLog, read_session
from analysis.report import describe
from extensions.bids import export_dataset
from runner.observers import plain_key
from runner.ports import Ask, KeyPress, WindowClosed
from runner.protocol import read_experiment
from runner.session import SessionOptions
from runner.session.clocks import SteadyClock
from runner.session.folders import to_resume
from runner.session.station import Station
from stimuli.build import build_set

Study = Any  # tests/conftest.py


class Leaves:
    """Gives plain answers, and closes the window after some."""

    def __init__(self, answers: int) -> None:
        self.left = answers

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        if not self.left:
            raise WindowClosed
        self.left -= 1
        return KeyPress(plain_key(ask), onset_s + 1.0)


def resumed(study: Study, monkeypatch: pytest.MonkeyPatch, set_by: timedelta) -> tuple[SessionLog, tuple[str, ...]]:
    design = read_experiment(study.experiment)
    stimuli = build_set(design.recipe_file, design.rig.display.panel.pixel_pitch_mm)
    with Station.open(design, stimuli, SessionOptions(study.results, backend="egl")) as station:
        with pytest.raises(WindowClosed):
            station.run("01", Leaves(4), simulated=True)
        clock = partial(SteadyClock, lambda: datetime.now(UTC) + set_by)
        monkeypatch.setattr("runner.session.folders.SteadyClock", clock)
        folder = station.run("01", Leaves(99), simulated=True, resume=to_resume(study.results, "small", "01"))
        return read_session(folder / FILE_NAME), station.resume_remarks


def onsets(folder: Path) -> list[float]:
    (table,) = folder.rglob("*_beh.tsv")
    return [float(row.split("\t")[0]) for row in table.read_text().splitlines()[1:]]


def test_a_clock_that_was_set_back_leaves_times_rising(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    log, remarks = resumed(study, monkeypatch, -timedelta(days=1))
    times = [log.header.started_utc, *(record.utc for record in log.records)]
    assert times == sorted(times)
    (resumption,) = log.resumptions
    assert 86390 < resumption.clock_behind_s <= 86400
    (note,) = log.notes
    assert (note.text,) == remarks
    assert note.by == "program"
    assert "stood 23 hours 59 minutes before the last record" in note.text or "stood 1 day before" in note.text
    folder = export_dataset([study.results], study.folder / "bids").folder
    assert onsets(folder) == sorted(onsets(folder))
    assert 0 <= onsets(folder)[0] <= onsets(folder)[-1] < 3600
    (sidecar,) = folder.rglob("sub-01*_beh.json")
    (stop,) = json.loads(sidecar.read_text())["Resumptions"]
    assert stop["Gap"] is None
    assert stop["ClockBehind"] == resumption.clock_behind_s
    assert any("the clock had been set back" in note for note in describe([log]).notes)


@pytest.mark.nightly
def test_a_clock_that_was_set_forward_is_stated(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    log, (remark,) = resumed(study, monkeypatch, timedelta(days=365))
    assert remark.startswith("the session was resumed 365 days")
    assert log.resumptions[0].clock_behind_s == 0
    assert "it was resumed after 365 days" in "\n".join(describe([log]).notes)


def test_a_clock_that_was_not_set_is_no_remark(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    log, remarks = resumed(study, monkeypatch, timedelta())
    assert (remarks, log.notes) == ((), ())
