"""Differences that were planted come back: found, named and measured."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.stimuli.comparison.scenes import (
    CHART,
    PLATE,
    RIG,
    Cyclopean,
    chart,
    compared,
    few,
    said,
    spots,
    written,
)


@pytest.fixture
def chart_file(tmp_path: Path) -> Path:
    (tmp_path / "chart.yaml").write_text(CHART, encoding="utf-8")
    return tmp_path / "chart.yaml"


def test_a_rendering_beside_itself_differs_by_nothing(tmp_path: Path, cyclopean: Cyclopean, chart_file: Path) -> None:
    for picture, regions in ((few(), PLATE), (chart(), chart_file)):
        file = written(tmp_path / "a.exr", picture)
        found = compared(cyclopean, file, file, "--regions", regions, "--rig", RIG)
        one = found["eyes"]["both"]
        assert found["decision"] == "validated"
        white = "the display's" if regions == PLATE else "that of the chart's white patch, 'chart 19 white 9.5'"
        assert one["said"][0].endswith(white)
        assert not one["registration"]["moved"]
        assert one["registration"]["residual_px"] == 0
        for sums in (one["per_pixel"], one["as_seen"]):
            assert sums["largest"] == sums["mean"] == 0
        for row in one["regions"]["rows"]:
            assert (row["delta_e"], row["delta_xy"], row["luminance_ratio"]) == (0, 0, 1)
        for area in one["sparkle"]:
            assert all(pair["relative"] == 0 for pair in area["pairs"])


def test_four_tenths_of_a_pixel(tmp_path: Path, cyclopean: Cyclopean) -> None:
    files = written(tmp_path / "a.exr", few()), written(tmp_path / "b.exr", few(dx=0.4))
    found = compared(cyclopean, *files, "--regions", PLATE, "--rig", RIG)
    lies = found["eyes"]["both"]["registration"]
    assert lies["shift_px"] == pytest.approx([0.4, 0.0], abs=0.02)
    assert lies["residual_px"] < 0.1
    assert any("(0.4" in line and "px beside" in line for line in said(found, "noted"))
    assert found["decision"] == "validated"
    told = cyclopean("compare", *files, "--regions", PLATE, "--register", "none", expect=2)
    assert "lie 0.4 px apart" in told.stderr
    assert told.stderr.count("\n") == 1


@pytest.mark.parametrize("angle_deg", [0.1, pytest.param(25.0, marks=pytest.mark.nightly)])
def test_a_turned_plate(tmp_path: Path, cyclopean: Cyclopean, angle_deg: float) -> None:
    regions = tmp_path / "middle.yaml"
    text = "schema_version: 1\nregions:\n  - {kind: plate, corners: [[60, 45], [180, 45], [180, 135], [60, 135]]}\n"
    regions.write_text(text, encoding="utf-8")
    files = written(tmp_path / "a.exr", spots()), written(tmp_path / "b.exr", spots(3.0, -2.0, angle_deg))
    found = compared(cyclopean, *files, "--regions", regions)
    lies = found["eyes"]["both"]["registration"]
    assert lies["rotation_deg"] == pytest.approx(angle_deg, abs=0.01)
    assert lies["shift_px"] == pytest.approx([3.0, -2.0], abs=0.02)
    assert lies["residual_px"] < 0.05
    assert any("turned by" in line for line in said(found, "noted"))
    assert found["eyes"]["both"]["per_pixel"]["mean"] < 0.3
