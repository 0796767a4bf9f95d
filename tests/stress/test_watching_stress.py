"""Logs that are watched while they are written: cut after any byte, they show a session or nothing, and no fault."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from analysis.records import FILE_NAME
from runner.session import Watch, simulate

pytestmark = pytest.mark.stress
Study = Any  # tests/conftest.py


def test_a_log_cut_after_any_byte_is_no_fault(study: Study, tmp_path: Path) -> None:
    (folder,) = simulate(study.experiment, study.observers, 1, results=study.results).folders
    whole = (folder / FILE_NAME).read_bytes()
    place = tmp_path / "seen" / FILE_NAME
    place.parent.mkdir()
    header_bytes = whole.index(b"\n") + 1
    answered = 0
    for length in range(len(whole) + 1):
        place.write_bytes(whole[:length])
        found = Watch(place.parent).look()
        assert not found.findings
        if length != header_bytes - 1:  # the line end alone is missing
            assert len(found.sessions) == (length >= header_bytes)
        if found.sessions:
            assert found.sessions[0].answered >= answered
            answered = found.sessions[0].answered
    (last,) = Watch(place.parent).look().sessions
    assert answered == last.trials
    assert answered > 0
    assert last.complete
