"""`cyclopean display new`: the file of a nominal display, its panel asked of the monitor, and nothing overwritten."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import pytest

from devices.display import PanelSpec, ReportedMonitor, read_display
from tests.choice import nightly

Cyclopean = Callable[..., "CompletedProcess[str]"]
PANEL = ("--panel", "1920x1080,0.2768,60,10")
SMALL = ("--panel", "192x108,0.2768,60,10")  # each patch is soon drawn


@pytest.mark.parametrize("kind", ["bt1886", *nightly("srgb", "gamma2.2", "display-p3")])
def test_it_writes_a_display_that_stays_known_as_nominal(kind: str, tmp_path: Path, cyclopean: Cyclopean) -> None:
    file = tmp_path / "monitor.yaml"
    done = cyclopean("display", "new", "-o", file, "--nominal", kind, "--white-cd-m2", "250", *PANEL)
    assert "nominal, not measured" in done.stdout
    assert "cyclopean display measure" in done.stdout
    display = read_display(file)
    assert display.panel == PanelSpec(resolution_px=(1920, 1080), pixel_pitch_mm=0.2768, bits=10)
    assert display.nominal is not None
    assert (display.nominal.kind, display.nominal.white_cd_m2) == (kind, 250.0)
    assert display.nominal.black_assumed
    assert "# black_cd_m2: 0.25" in file.read_text()
    checked = cyclopean("check", file)
    assert "valid, 1 warning" in checked.stdout
    assert checked.stdout.count("nominal, not measured") == 2
    told = cyclopean("display", "convert", "-", "--display", file, "--to", "xyz", text="red,green,blue\n255,255,255\n")
    assert float(told.stdout.splitlines()[1].split(",")[-2]) == pytest.approx(250.0, abs=0.01)


def test_nothing_is_overwritten(tmp_path: Path, cyclopean: Cyclopean) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text("mine")
    refused = cyclopean("display", "new", "-o", file, *PANEL, expect=2)
    assert "not overwritten" in refused.stderr
    assert file.read_text() == "mine"
    refused = cyclopean("display", "new", "-o", tmp_path / "no" / "mine.yaml", *PANEL, expect=2)
    assert "cannot be written" in refused.stderr


def test_the_panel_comes_from_the_monitor_or_is_asked_for(
    tmp_path: Path, cyclopean: Cyclopean, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "monitor.yaml"
    monkeypatch.setattr("runner.presenter.primary_monitor", lambda names=(): None, raising=False)
    refused = cyclopean("display", "new", "-o", file, expect=2)
    assert "--panel 1920x1080,0.2768" in refused.stderr
    assert not file.exists()
    monitor = ReportedMonitor("DP-1\nx", (2560, 1440), (597, 336), 144.0)
    monkeypatch.setattr("runner.presenter.primary_monitor", lambda names=(): monitor)
    done = json.loads(cyclopean("display", "new", "-o", file, "--black-cd-m2", "0.3", "--json").stdout)
    assert done["panel"]["resolution_px"] == [2560, 1440]
    assert done["nominal"]["panel_from"] == "the monitor 'DP-1 x', 597 x 336 mm"
    assert read_display(file).panel.refresh_hz == 144.0
    nominal = read_display(file).nominal
    assert nominal is not None
    assert (nominal.black_cd_m2, nominal.black_assumed) == (0.3, False)


def test_in_python_it_has_its_white_its_black_and_its_name(tmp_path: Path, cyclopean: Cyclopean) -> None:
    from cyclopean import display

    file = tmp_path / "monitor.yaml"
    cyclopean("display", "new", "-o", file, "--white-cd-m2", "250", *PANEL)
    rows = display(file).rows
    assert {row["mode"] for row in rows} == {"any (nominal)"}
    for row in rows:
        assert row["white_luminance_cd_m2"] == pytest.approx(250.0)
        assert row["black_luminance_cd_m2"] == pytest.approx(0.25)
        assert row["source"].startswith("nominal, not measured: sRGB")


@pytest.mark.usefixtures("undrawn")
def test_readings_are_compared_with_its_light_black_included(tmp_path: Path, cyclopean: Cyclopean) -> None:
    file, readings = tmp_path / "monitor.yaml", tmp_path / "readings.csv"
    cyclopean("display", "new", "-o", file, "--black-cd-m2", "1", *SMALL)
    measuring = ("--instrument", "simulated", "--backend", "egl", "--settle", "0", "--set", "grey")
    cyclopean("display", "measure", file, "--mode", "flat", "-o", tmp_path / "readings.jsonl", *measuring)
    words = ("display", "report", readings, "--display", file, "-o", tmp_path / "page.html")
    told = cyclopean(*words)
    assert "nominal, not measured" in told.stdout
    found = {check["name"]: check for check in json.loads(cyclopean(*words, "--json").stdout)["diagnoses"]}
    assert found["model_difference"]["value"] < 0.8  # mean ΔE00: 0.36 by noise, 1.59 with its black left out
