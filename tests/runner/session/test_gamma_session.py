"""Sessions in a real window whose gamma table really changes: refused, accepted, stopped in the middle, resumed."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analysis.records import SessionLog, read_session, session_files
from devices.display import GammaTable
from documents.yaml import yaml_lines
from runner.check import CheckOptions, check_file
from runner.errors import SessionError, SessionStoppedError
from runner.presenter.gamma_check import GammaWatch
from runner.session import SessionOptions, SessionStatus, run_session, station
from tests.runner.every_kind import OnStatus

Study = Any  # tests/conftest.py
Load = Callable[[float], None]
pytestmark = pytest.mark.window


@pytest.fixture(autouse=True)
def timed_briefly(monkeypatch: pytest.MonkeyPatch) -> None:
    """Time swaps for a moment: a screen that does not wait keeps the processor busy."""
    monkeypatch.setattr(station, "TIMED_S", 0.05)


def measured_with(study: Study, exponent: float | None) -> None:
    """State in the display file that it was measured with this power of the code as gamma table."""
    shares = np.linspace(0.0, 1.0, 256)
    table = GammaTable.unreadable("nobody looked") if exponent is None else GammaTable.from_shares(shares**exponent)
    lines = "".join(f"    {line}\n" for line in yaml_lines({"gamma_table": table.to_json()}))
    study.edit("display.yaml", "    source: made up for tests\n", f"    source: made up for tests\n{lines}")


def options(study: Study, **more: Any) -> SessionOptions:
    settings: dict[str, Any] = {"results": study.results, "simulate": study.observers, "backend": "window"}
    return SessionOptions(**settings, windowed=True, **more)


def log_of(study: Study) -> SessionLog:
    (file,) = session_files(study.results)
    return read_session(file)


def test_the_measured_table_lets_a_session_run_and_is_recorded(study: Study, load_table: Load) -> None:
    measured_with(study, 1.1)
    said: list[str] = []
    assert run_session(study.experiment, "01", options(study, notify=said.append)).ending == "completed"
    assert not [line for line in said if "gamma" in line]
    log = log_of(study)
    held = log.header.presentation.gamma_table.given()
    table = GammaTable.from_shares(np.linspace(0, 1, 256) ** 1.1)
    assert held["measured"]["both"]["hash"] == held["loaded"]["both"]["hash"] == table.sha256
    assert held["loaded"]["both"]["departure_codes"] == pytest.approx(table.departure_codes, abs=1e-3)
    assert (held["accepted"], held["set"], held["loaded"]["both"]["monitor"]) == (False, None, "screen")
    end = json.loads(log.file.read_text().splitlines()[-1])
    assert 1 <= end["work"]["gamma_table_reads"] <= 1 + len(log.trials) + 2


def test_another_table_is_refused_and_accepted_where_asked(study: Study, load_table: Load) -> None:
    measured_with(study, 1.0)
    with pytest.raises(SessionError, match="is not the one"):
        run_session(study.experiment, "01", options(study))
    assert not list(session_files(study.results)) if study.results.exists() else True
    window = ("--backend", "window", "--windowed")
    assert "--accept-gamma-table" in study.run(*window, expect=2).stderr
    assert "warning: the gamma table loaded" in study.run(*window, "--accept-gamma-table").stderr
    header = log_of(study).header
    assert header.presentation.gamma_table.accepted is True
    assert any("is not the one" in remark for remark in header.remarks)


@pytest.mark.nightly
def test_check_refuses_the_table_that_a_session_would(study: Study, load_table: Load) -> None:
    def checked(**more: Any) -> tuple[str, str]:
        report = check_file(study.experiment, CheckOptions(results=study.results, pictures=False, **more))
        assert "gamma_tables" in report.facts["screen"]
        errors, warnings = ("\n".join(map(str, found)) for found in (report.errors, report.warnings))
        return errors, warnings

    assert "is not known" in checked()[1]
    measured_with(study, 1.0)
    errors, warnings = checked()
    assert "is not the one" in errors
    errors, warnings = checked(accept_gamma_table=True)
    assert (errors, "is not the one" in warnings) == ("", True)
    load_table(1.0)
    errors, warnings = checked()
    assert "gamma" not in errors + warnings
    load_table(1.1)
    study.edit("rig.yaml", "distance_mm: 700\n", "distance_mm: 700\ngamma_table: identity\n")
    errors, warnings = checked()
    assert "gamma" not in errors + warnings


@pytest.fixture
def at_every_trial(monkeypatch: pytest.MonkeyPatch) -> None:
    """Look at the table at every trial: a simulated observer answers many times in a second."""
    monkeypatch.setattr(station, "GammaWatch", partial(GammaWatch, every_s=0.0))


def change_at(answered: int, load_table: Load, exponent: float) -> tuple[OnStatus]:
    def on_trial(status: SessionStatus) -> None:
        if status.answered == answered:
            load_table(exponent)

    return (OnStatus(on_trial),)


@pytest.mark.nightly
def test_a_change_stops_the_session_loses_nothing_and_is_resumed(
    study: Study, load_table: Load, at_every_trial: None
) -> None:
    measured_with(study, 1.1)
    changes = options(study, listeners=change_at(2, load_table, 0.9))
    with pytest.raises(SessionStoppedError, match=r"changed: .*before this is saved.*--resume"):
        run_session(study.experiment, "01", changes)
    log = log_of(study)
    assert not log.complete
    assert sum(trial.kind == "all_pairs" for trial in log.trials) == 2
    (note,) = log.notes
    assert (note.by, "the gamma table on 'screen' changed" in note.text) == ("program", True)
    with pytest.raises(SessionError, match="is not the one"):
        run_session(study.experiment, "01", options(study, resume=True))
    load_table(1.1)
    assert run_session(study.experiment, "01", options(study, resume=True)).ending == "completed"
    log = log_of(study)
    assert sum(trial.kind == "all_pairs" for trial in log.trials) == 6
    assert log.complete


@pytest.mark.nightly
def test_on_a_nominal_display_another_table_is_noted_and_refuses_nothing(
    study: Study, load_table: Load, at_every_trial: None
) -> None:
    """Not in mid-session, and not when it is resumed; nobody measured it with any."""
    panel = "panel: {resolution_px: [640, 480], pixel_pitch_mm: 0.25}"
    study.edit("rig.yaml", "display: display.yaml", f"display: {{nominal: srgb, white_cd_m2: 100, {panel}}}")
    changed = options(study, listeners=change_at(2, load_table, 0.9))
    assert run_session(study.experiment, "01", changed).ending == "completed"
    log = log_of(study)
    assert [note.by for note in log.notes] == ["program"]
    log.file.write_bytes(b"".join(log.file.read_bytes().splitlines(keepends=True)[:5]))  # killed
    load_table(0.8)
    said: list[str] = []
    done = run_session(study.experiment, "01", options(study, resume=True, notify=said.append))
    assert done.ending == "completed"
    (resumption,) = log_of(study).resumptions
    assert set(resumption.accepted_changes) == {"gamma_table"}
    assert [line for line in said if "another gamma table" in line]


@pytest.mark.nightly
def test_a_rig_sets_the_identity_for_its_sessions(study: Study, load_table: Load) -> None:
    measured_with(study, 1.0)
    study.edit("rig.yaml", "distance_mm: 700\n", "distance_mm: 700\ngamma_table: identity\n")
    assert run_session(study.experiment, "01", options(study)).ending == "completed"
    held = log_of(study).header.presentation.gamma_table.given()
    assert held["set"] == "identity"
    assert held["loaded"]["both"]["departure_codes"] == 0.0
    study.edit("rig.yaml", "gamma_table: identity\n", "")
    with pytest.raises(SessionError, match="is not the one"):
        run_session(study.experiment, "02", options(study))


def test_another_table_in_the_display_file_is_another_display(study: Study, tmp_path: Path) -> None:
    from runner.protocol import read_experiment
    from runner.session import build_stimuli, hashes

    def digests() -> dict[str, str]:
        design = read_experiment(study.experiment)
        return hashes(design, build_stimuli(design))

    plain = digests()
    measured_with(study, 1.2)
    stated = digests()
    assert {name for name, digest in stated.items() if digest != plain[name]} == {"display"}
    study.edit("rig.yaml", "distance_mm: 700\n", "distance_mm: 700\ngamma_table: identity\n")
    assert {name for name, digest in digests().items() if digest != stated[name]} == {"rig"}
