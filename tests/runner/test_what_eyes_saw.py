"""What the eyes saw: check, report with its captions, tables and Methods, DataFrame and export agree."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import dataclass
from functools import cache
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import cyclopean
from analysis.records import Header
from analysis.records import read_results as read_logs
from devices.display import read_panel
from runner.session import simulate
from runner.studies import StudyOptions, new_study
from tests.invoked import printed

RED_CUP, GREY_CUP = (200, 20, 30), (130, 130, 130)
FILTERS = ("filters_delta_e_00_mean", "filters_delta_e_00_worst_mean", "filters_delta_e_00_max")


@dataclass(frozen=True, slots=True)
class Tried:
    """A study of four pictures that one simulated observer has judged."""

    experiment: Path
    results: Path

    @property
    def log(self) -> Header:
        """The header of its session."""
        (session,) = read_logs(self.results)
        return session.header

    def costs(self, key: str) -> list[float]:
        """What its log says of each stimulus and eye."""
        return [one.given()["clipping"][eye][key] for one in self.log.stimuli for eye in ("left", "right")]


@pytest.fixture(scope="module")
def tried(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Return what makes a study of cups of a colour in a mode."""
    root = tmp_path_factory.mktemp("seen")

    @cache
    def make(cup: tuple[int, int, int], mode: str) -> Tried:
        folder = root / f"{mode}-{cup[0]}"
        for name, size in (("one", 24), ("two", 16), ("three", 20), ("four", 28)):
            for eye, left in (("L", 12), ("R", 10)):
                pixels = np.full((36, 48, 3), (150, 150, 150), np.uint8)
                pixels[6 : 6 + size, left : left + size] = cup
                (folder / "photos").mkdir(parents=True, exist_ok=True)
                end = "" if mode == "flat" else f"_{eye}"
                Image.fromarray(pixels).save(folder / "photos" / f"{name}{end}.png")
        options = StudyOptions(mode=mode, panel=read_panel("320x240,0.5"))
        study = new_study(folder / "study", [folder / "photos"], options)
        simulate(study.experiment, study.folder / "simulated.yaml", 1, results=folder / "results")
        return Tried(study.experiment, folder / "results")

    return make


def _checked(study: Tried) -> dict[str, Any]:
    (report,) = json.loads(printed("check", study.experiment, "--no-screen", "--json"))
    return dict(report)


def _warned_of_filters(study: Tried) -> list[str]:
    return [str(warning) for warning in _checked(study)["warnings"] if "anaglyph's filters" in str(warning)]


def _sections(page: Path) -> dict[str, str]:
    """Return the text of each section of a page, and of its head."""
    html = page.read_text(encoding="utf-8")
    parts = dict(re.findall(r'<section id="([^"]+)">(.*?)</section>', html, re.DOTALL)) | {
        "notes": "".join(re.findall(r'<ul class="notes".*?</ul>', html, re.DOTALL))
    }
    return {key: unescape(re.sub(r"<[^>]+>", " ", text)) for key, text in parts.items()}


def _reported(study: Tried) -> tuple[dict[str, Any], dict[str, str]]:
    """Return the numbers of the report, and its sections."""
    values = json.loads(printed("report", study.results, "--experiment", study.experiment, "--json"))
    return dict(values), _sections(study.results / "report.html")


@pytest.mark.promise("one-place")
@pytest.mark.usefixtures("undrawn")
def test_what_filters_cost_is_said_by_all_that_says_what_was_shown(tried: Any, tmp_path: Path) -> None:
    study = tried(RED_CUP, "anaglyph-red-cyan")
    mean, largest = (study.costs(f"projection_delta_e_00_{key}") for key in ("mean", "max"))
    assert max(largest) > 20.0
    expected = (sum(mean) / len(mean), max(mean), max(largest))
    assert len(_warned_of_filters(study)) == 1
    values, page = _reported(study)
    (seen,) = values["what_eyes_saw"]
    assert [seen[key] for key in FILTERS] == pytest.approx(expected, abs=1e-4)
    assert (seen["left_filter"], seen["right_filter"]) == ("assumed", "assumed")
    said = f"ΔE₀₀ of {expected[0]:.3f}"
    assert said in page["notes"]
    assert said in page["seen"]
    assert f"of {expected[0]:.3f} per pixel" in page["methods"]
    assert any("anaglyph" in note for note in values["notes"])
    assert "As the display" not in page["stimuli"]
    assert "through its coloured filter" in page["stimuli"]
    printed("report", study.results, "--no-thumbnails", "--csv", tmp_path)
    with (tmp_path / "clipping.csv").open(encoding="utf-8-sig") as file:
        rows = list(csv.DictReader(file))
    assert sorted(float(row["filters_delta_e_00_max"]) for row in rows) == sorted(largest)
    table = cyclopean.read_results(study.results)
    assert table["seen.filters_delta_e_00_max"].unique() == pytest.approx([max(largest)])
    cyclopean.export_bids(study.results, folder=tmp_path / "bids")
    (sidecar,) = (tmp_path / "bids").rglob("sub-*_beh.json")
    exported = json.loads(sidecar.read_text(encoding="utf-8"))["WhatEyesSaw"]
    assert exported == {key: value for key, value in seen.items() if key != "sessions"}


def test_the_log_says_what_filters_were_taken_and_what_they_leave_of_white(tried: Any) -> None:
    display = tried(RED_CUP, "anaglyph-red-cyan").log.display
    filters = display.given()["filters"]
    assert filters["assumed"] == ["left", "right"]
    assert filters["left"] == [0.90, 0.05, 0.02]
    # Luminance of sRGB's red, green and blue, times what the filter passes of each.
    passed = np.array([0.212639, 0.715169, 0.072192]) @ np.array([filters["left"], filters["right"]]).T
    seen = [filters["white_XYZ_cd_m2"][eye][1] for eye in ("left", "right")]
    assert seen == pytest.approx(100.0 * passed, rel=1e-3)
    assert display.given()["surround_XYZ_cd_m2"]["left"][1] == pytest.approx(0.1 * passed[0], rel=1e-2)
    stimulus = tried(RED_CUP, "anaglyph-red-cyan").log.stimuli[0]
    assert (stimulus.size_px, stimulus.resampled) == ((48, 36), None)


@pytest.mark.nightly
@pytest.mark.usefixtures("undrawn")
def test_an_anaglyph_of_greys_is_named_and_not_warned_of(tried: Any) -> None:
    study = tried(GREY_CUP, "anaglyph-red-cyan")
    assert max(study.costs("projection_delta_e_00_mean")) < 1.0
    assert not _warned_of_filters(study)
    values, page = _reported(study)
    assert not any("anaglyph" in note for note in values["notes"])
    assert "coloured filter" in page["stimuli"]
    assert "coloured filter" in page["methods"]


@pytest.mark.parametrize("mode", [pytest.param("flat", marks=pytest.mark.nightly), "side-by-side"])
@pytest.mark.usefixtures("undrawn")
def test_without_filters_nothing_is_said_of_them(tried: Any, mode: str) -> None:
    study = tried(RED_CUP, mode)
    assert not _warned_of_filters(study)
    assert not any(fact.startswith("filters_cost") for fact in _checked(study))
    values, page = _reported(study)
    assert "filter" not in json.dumps(values["what_eyes_saw"])
    for key in ("notes", "stimuli", "seen", "clipping"):
        assert "filter" not in page[key]
    assert "coloured filter" not in page["methods"]
    assert not any("filter" in str(column) for column in cyclopean.read_results(study.results))
    assert study.log.display.given()["filters"] is None


@pytest.mark.parametrize(
    ("mode", "said"), [("anaglyph-red-cyan", True), pytest.param("side-by-side", False, marks=pytest.mark.nightly)]
)
def test_agreement_says_where_what_is_measured_is_not_what_was_seen(tried: Any, mode: str, said: bool) -> None:
    study = tried(RED_CUP, mode)
    words = ("--experiment", study.experiment, "--measures", "delta-e-2000", "--photograph", "one")
    notes = json.loads(printed("agreement", study.results, *words, "--json"))["notes"]
    assert any("through its coloured filter" in note for note in notes) is said
