"""A session on a nominal display: no permission is needed, and check, record, report and exports all say so."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from analysis.records import read_session
from analysis.report import describe
from analysis.report.notes import on_sessions
from runner.presenter import MODES
from runner.protocol import read_experiment
from tests.answers import altered, changed

Study = Any  # tests/conftest.py
SAID = "nominal, not measured"
NOMINAL = "{nominal: srgb, white_cd_m2: 100, panel: {resolution_px: [640, 480], pixel_pitch_mm: 0.3}}"
WORDS = "sRGB: white 100 cd/m², black 0.1 cd/m² (assumed), without glasses"


@pytest.fixture
def nominal(study: Study) -> Study:
    """The small study, its rig's display nominal."""
    study.edit("rig.yaml", "display: display.yaml", f"display: {NOMINAL}")
    return study


@pytest.mark.promise("said")
@pytest.mark.usefixtures("undrawn")
def test_every_record_says_that_the_display_was_not_measured(nominal: Study, tmp_path: Path) -> None:
    checked = nominal.cyclopean("check", nominal.experiment)
    assert checked.stdout.count(SAID) == 2
    assert "measure it: cyclopean display measure" in checked.stdout
    assert WORDS in " ".join(checked.stdout.split())
    ran = nominal.run()
    assert SAID in ran.stderr
    log = read_session(nominal.log_file())
    assert log.trials
    assert all(trial.nominal == "srgb" and "uncharacterised" not in trial.details() for trial in log.trials)
    display = log.header.display.given()
    assert (display["nominal"]["kind"], display["nominal"]["words"]) == ("srgb", WORDS)
    assert display["black_XYZ_cd_m2"]["left"][1] == pytest.approx(0.1)
    assert display["white_XYZ_cd_m2"]["left"][1] == pytest.approx(100.0)
    assert SAID in display["source"]
    (remark,) = [remark for remark in log.header.remarks if SAID in remark]
    assert "cyclopean display measure" in remark

    page = tmp_path / "report.html"
    told = nominal.cyclopean("report", nominal.results, "-o", page)
    assert SAID in told.stdout + told.stderr
    text = page.read_text()
    assert text.index(SAID) < text.index("<table")
    report = json.loads(nominal.cyclopean("report", nominal.results, "-o", page, "--json").stdout)
    said = [note for note in report["notes"] if SAID in note]
    assert len(said) == 1
    assert "cyclopean display measure" in said[0]

    dataset = tmp_path / "bids"
    nominal.cyclopean("export", nominal.results, "-o", dataset)
    sidecars = [json.loads(file.read_text()) for file in dataset.rglob("*_beh.json")]
    assert sidecars
    held = [sidecar for sidecar in sidecars if "NominalDisplay" in sidecar]
    assert held
    assert all(SAID in sidecar["NominalDisplay"] for sidecar in held)
    assert any("not measured" in sidecar.get("nominal", {}).get("Description", "") for sidecar in sidecars)
    (table,) = dataset.rglob("*_beh.tsv")
    head, *rows = (line.split("\t") for line in table.read_text().splitlines())
    assert {row[head.index("nominal")] for row in rows} == {"srgb"}

    import cyclopean

    assert set(cyclopean.read_results(nominal.results)["nominal"]) == {"srgb"}


@pytest.mark.parametrize("mode", sorted(MODES))
def test_it_serves_every_mode_without_permission(mode: str, nominal: Study) -> None:
    design = read_experiment(nominal.experiment, mode)
    assert design.rig.nominal is not None
    assert design.rig.characterised_as == mode
    assert design.rig.stamps == {"nominal": "srgb"}


def test_a_display_measured_since_is_noticed_when_the_session_is_resumed(nominal: Study) -> None:
    nominal.run()
    file = nominal.log_file()
    file.write_bytes(b"\n".join(file.read_bytes().split(b"\n")[:4]) + b"\n")
    nominal.edit("rig.yaml", f"display: {NOMINAL}", "display: display.yaml")
    refused = nominal.run("--resume", expect=2)
    assert "display" in refused.stderr
    assert "changed since this session began" in refused.stderr
    nominal.run("--resume", "--accept-changes")
    log = read_session(nominal.log_file())
    assert {trial.nominal for trial in log.trials} == {"srgb", None}
    assert "display" in log.resumptions[0].accepted_changes
    (note,) = [note for note in on_sessions([log]) if SAID in note]
    assert "in 3 of 7 trials, and measured in the others" in note


def test_only_the_same_nominal_display_is_the_same(nominal: Study) -> None:
    """Of the same curve and white, a display that was measured, or has another black, has another digest."""
    from runner.session import hashes
    from stimuli.build import build_set

    def digest() -> str:
        design = read_experiment(nominal.experiment)
        return hashes(design, build_set(design.recipe_file, 0.3))["display"]

    before = digest()
    nominal.edit("rig.yaml", "white_cd_m2: 100", "white_cd_m2: 100, black_cd_m2: 0.1")
    assert digest() == before
    nominal.edit("rig.yaml", "black_cd_m2: 0.1", "black_cd_m2: 0.2")
    assert digest() != before
    nominal.edit("rig.yaml", "srgb", "display-p3")
    assert digest() != before


def test_without_a_monitor_the_panel_is_asked_for(nominal: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    nominal.edit("rig.yaml", ", panel: {resolution_px: [640, 480], pixel_pitch_mm: 0.3}", "")
    for command in ("check", "run"):
        words = ("check", nominal.experiment) if command == "check" else ()
        refused = nominal.cyclopean(*words, expect=2) if words else nominal.run(expect=2)
        assert "rig.yaml:2:10" in refused.stderr
        assert "panel: {resolution_px: [1920, 1080]" in refused.stderr
    assert not nominal.results.exists()


@pytest.mark.nightly
def test_sessions_before_and_after_a_measurement_are_told_apart(nominal: Study) -> None:
    nominal.run()
    log = read_session(nominal.log_file())
    measured = replace(
        log,
        header=altered(
            log.header, display={k: v for k, v in log.header.display.given().items() if k != "nominal"}, remarks=()
        ),
        records=tuple(
            changed(trial, data={k: v for k, v in trial.details().items() if k != "nominal"}) for trial in log.answers
        ),
    )
    assert not any(SAID in note for note in on_sessions([measured]))
    (note,) = [note for note in on_sessions([log, measured]) if SAID in note]
    assert "in 7 of 14 trials" in note
    header = altered(measured.header, observer="other", session="other")
    measured = replace(measured, header=header, file=log.file.parent.with_name("ses-other") / log.file.name)
    assert "in some of the sessions" in json.dumps(describe([log, measured]).methods.to_json())


@pytest.mark.promise("said")
def test_preview_and_show_say_it_too(nominal: Study, tmp_path: Path) -> None:
    words = ("preview", nominal.experiment, "-o", tmp_path / "screens")
    assert SAID in nominal.cyclopean(*words).stderr
    display = tmp_path / "nominal.yaml"
    nominal.cyclopean("display", "new", "-o", display, "--panel", "640x480,0.3")
    picture = ("show", nominal.folder / "one.exr", "--display", display, "--mode", "side-by-side")
    shown = nominal.cyclopean(*picture, "--headless", "--screenshot", tmp_path / "codes.png")
    assert SAID in shown.stderr


def test_where_the_panel_is_the_monitors_a_report_elsewhere_shows_the_pictures(
    nominal: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The panel is then that of the record: the report may be written on a machine without the monitor."""
    from devices.display import ReportedMonitor
    from runner.protocol import experiment
    from runner.reports import find_shown
    from runner.session import simulate

    nominal.edit("rig.yaml", ", panel: {resolution_px: [640, 480], pixel_pitch_mm: 0.3}", "")
    monitor = ReportedMonitor("DP-1", (640, 480), (192, 146), 60.0)
    defaults = dict(experiment.read_experiment.__kwdefaults__ or {})
    monkeypatch.setattr(
        experiment.read_experiment, "__kwdefaults__", defaults | {"ask_monitor": lambda names=(): monitor}
    )
    simulate(nominal.experiment, nominal.observers, 1, results=nominal.results)
    monkeypatch.setattr(experiment.read_experiment, "__kwdefaults__", defaults | {"ask_monitor": lambda names=(): None})
    header = read_session(nominal.log_file()).header
    assert header.display.given()["nominal"]["panel_from"] == "the monitor 'DP-1', 192 x 146 mm"
    found = find_shown(header, nominal.experiment)
    assert found is not None
    assert found[0].rig.display.panel.model_dump(mode="json") == header.display.panel.given()
