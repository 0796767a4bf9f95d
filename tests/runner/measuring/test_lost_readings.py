"""A measurement's log is removed, cut off or changed while it is written: no reading is lost, and it is said."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from analysis.seals import check_log
from devices.readings import MeasurementLog, read_session
from tests.choice import nightly
from tests.runner.harms import HARMS
from tests.runner.measuring.displays import write_rig

Cyclopean = Callable[..., Any]
READINGS = 39  # of the set grey
SOME = ("removed", "cut off", "edited", "folder moved")


pytestmark = pytest.mark.usefixtures("egl")


def _words(folder: Path) -> list[object]:
    simulated = ["--instrument", "simulated", "--backend", "egl", "--settle", "0", "--set", "grey"]
    return ["display", "measure", folder / "rig.yaml", *simulated, "-o", folder / "a/b/c/d/m.jsonl"]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_rig(tmp_path)


def _harm_after(monkeypatch: pytest.MonkeyPatch, readings: int, what: str) -> list[bytes]:
    """Harm the log once so many readings were kept; return what it held before."""
    held: list[bytes] = []
    keep, kept = MeasurementLog.keep, 0

    def then_harmed(self: MeasurementLog, *given: Any) -> None:
        nonlocal kept
        keep(self, *given)
        kept += 1
        if kept == readings:
            held.append(self.file.read_bytes())
            HARMS[what](self.file)

    monkeypatch.setattr(MeasurementLog, "keep", then_harmed)
    return held


@pytest.mark.parametrize("after", [20, *(pytest.param(after, marks=pytest.mark.stress) for after in (1, READINGS))])
@pytest.mark.parametrize("what", [*SOME, *nightly(*(what for what in HARMS if what not in SOME))])
def test_no_reading_is_lost_and_the_measurement_stops(
    folder: Path, cyclopean: Cyclopean, monkeypatch: pytest.MonkeyPatch, what: str, after: int
) -> None:
    if (what, after) == ("replaced", READINGS):
        pytest.skip("what is replaced by the same bytes after the last reading is whole")
    file = folder / "a/b/c/d/m.jsonl"
    with monkeypatch.context() as patch:
        held = _harm_after(patch, after, what)
        told = cyclopean(*_words(folder), expect=None)
    assert told.returncode != 0
    assert str(file) in told.stderr
    assert "another program" in told.stderr
    assert "readings are in" not in told.stdout
    assert file.read_bytes().startswith(held[0])
    assert check_log(file).findings == ()
    assert after <= len(read_session(file).readings) <= after + 1
    shutil.rmtree(file.parent.with_name("away"), ignore_errors=True)
    cyclopean(*_words(folder), "--resume")
    assert len(read_session(file).readings) == READINGS


def test_an_undisturbed_measurement_says_nothing(folder: Path, cyclopean: Cyclopean) -> None:
    told = cyclopean(*_words(folder))
    assert "another program" not in told.stderr
    assert f"{READINGS} readings are in" in told.stdout
