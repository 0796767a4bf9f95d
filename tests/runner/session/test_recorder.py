"""Nothing answered is lost, nothing is counted twice."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from analysis.kinds import Trial
from analysis.records import FILE_NAME, new_header
from runner.errors import SessionError
from runner.session import Recorder
from tests.answers import new_answer

STIMULI = ({"name": "a"}, {"name": "b é"})
HEADER = new_header("e", "01", "s", "2026-01-01T00:00:00+00:00", question="Which — µ?", simulated=True, stimuli=STIMULI)


def _trial(number: int) -> Trial:
    data = {"first": "a", "second": "b é", "answer": "first", "chosen": "a", "rejected": "b é"}
    return new_answer(0, number, "all_pairs", (("up", 1.25),), 1.25, "2026-01-01T00:00:01+00:00", data)


def _session(folder: Path, trials: int) -> Path:
    with Recorder.create(folder, HEADER) as recorder:
        for number in range(trials):
            recorder.append(_trial(number))
    return folder / FILE_NAME


def test_an_answer_is_synced_before_append_returns(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[int] = []
    log = tmp_path / "s" / FILE_NAME
    with Recorder.create(log.parent, HEADER) as recorder:
        real = os.fsync

        def counted(descriptor: int) -> None:
            real(descriptor)
            if (written := os.fstat(descriptor)).st_ino == log.stat().st_ino:  # not a copy that is made meanwhile
                synced.append(written.st_size)

        monkeypatch.setattr(os, "fsync", counted)
        recorder.append(_trial(0))
        assert synced == [log.stat().st_size]


def test_an_existing_session_is_never_overwritten(tmp_path: Path) -> None:
    file = _session(tmp_path / "s", 1)
    before = file.read_bytes()
    with pytest.raises(SessionError, match="exists already"):
        Recorder.create(tmp_path / "s", HEADER)
    assert file.read_bytes() == before
