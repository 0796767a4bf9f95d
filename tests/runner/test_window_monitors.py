"""Sessions on a chosen monitor, and on a screen that is smaller than the rig's panel."""

from __future__ import annotations

import json
import os
from typing import Any

import pytest

Person = Any  # tests/conftest.py
pytestmark = pytest.mark.window


def answer_one_and_stop(person: Person) -> str:
    person.turn("space", "the first pair")
    person.answer("Up")
    person.press("Escape")
    person.until(lambda: person.process.poll() is not None or person.press("s"), "the session to end")
    return str(person.leave())


@pytest.mark.nightly
def test_a_panel_larger_than_the_screen_is_refused_and_goes_on_if_asked_with_every_record_saying_so(
    person: Person, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = person.study
    study.edit("display.yaml", "[640, 480]", "[2600, 480]")
    person.refused_to_sit_down("no screen shows 2600 × 480 px (there: 1920 × 1080)")
    person.refused_to_sit_down("--wrong-screen", "--windowed")
    assert not study.results.exists()
    monkeypatch.setenv("DISPLAY", person.screen)
    checked = json.loads(study.cyclopean("check", study.experiment, "--no-pictures", "--json").stdout)[0]
    assert any("a session is refused here" in warning["message"] for warning in checked["warnings"])
    person.sit_down("--wrong-screen")
    told = answer_one_and_stop(person)
    assert "warning: no screen shows 2600 × 480 px" in told
    assert told.rstrip().endswith("--wrong-screen --resume")
    log = person.log()
    assert log.header.presentation.larger_than_screen is True
    assert log.header.presentation.monitors[0].startswith("1 'screen': 1920 x 1080 px")
    assert all(trial.details()["wrong_screen"] is True for trial in log.trials)
    beyond = "beyond the screen's edges"
    assert any(beyond in remark for remark in log.header.remarks)
    report = study.cyclopean("report", study.results, "--no-thumbnails")
    assert beyond in " ".join(report.stdout.split())


def test_a_session_opens_on_the_rigs_monitor_and_names_those_there_are_if_it_is_none(person: Person) -> None:
    study = person.study
    study.edit("display.yaml", "[640, 480]", "[1920, 1080]")
    study.edit("rig.yaml", "mode:", "monitor: screen\nmode:")
    person.before = f"import sys; sys.path.insert(0, {os.getcwd()!r})\n"
    person.before += "from tests.runner.two_monitors import add_laptop; add_laptop()"
    listed = "there are: 1 'eDP-1': 1366 x 768 px at 60 Hz, 344 x 194 mm, at -1366,0, primary; 2 'screen': 1920 x 1080"
    person.refused_to_sit_down(listed, "--monitor", "DP-9")
    person.refused_to_sit_down("the monitor 'eDP-1' shows 1366 × 768 px, not 1920 × 1080 px", "--monitor", "1")
    assert not study.results.exists()
    person.sit_down()
    answer_one_and_stop(person)
    log = person.log()
    assert log.header.presentation.monitors[0].startswith("2 'screen': 1920 x 1080 px")
    assert not any("full-screen" in remark for remark in log.header.remarks)
    assert "wrong_screen" not in log.trials[-1].details()
