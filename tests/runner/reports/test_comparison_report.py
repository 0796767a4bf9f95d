"""The comparison is reported from Python: a page, an experiment, and a typed result."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

import cyclopean as house
from documents import InputError
from runner.reports import ComparisonOptions, report_comparison
from tests.pages import policy_of
from tests.stimuli.comparison.scenes import PLATE, RIG, Cyclopean, few, spots, written

NOTHING = ComparisonOptions()


@pytest.mark.usefixtures("undrawn")
def test_a_page_and_an_experiment_are_written_where_they_are_asked_for(tmp_path: Path) -> None:
    photo = written(tmp_path / "photo.exr", spots())
    page = tmp_path / "out" / "page.html"
    options = ComparisonOptions(rig=RIG, page=page, experiment="plate")
    report = report_comparison(photo, photo, PLATE, options, root=tmp_path / "study")
    assert report.exit_status == 0
    assert report.page == page
    assert policy_of(page.read_text(encoding="utf-8"))
    assert report.experiment[0] == tmp_path / "study" / "experiments" / "plate.yaml"
    assert all(file.is_file() for file in report.experiment)
    record = report.to_json()
    assert record["decision"] == "validated"
    assert record["written"] == {"experiment": [str(file) for file in report.experiment], "page": str(page)}
    assert [*report.told()][-1] == f"Page: {page}"


@pytest.mark.parametrize("measures", [("delta-e-2000",), pytest.param((), marks=pytest.mark.nightly)])
def test_a_page_has_a_section_on_measures_where_they_are_asked_for(tmp_path: Path, measures: tuple[str, ...]) -> None:
    photo, page = written(tmp_path / "photo.exr", few()), tmp_path / "page.html"
    options = replace(NOTHING, rig=RIG, page=page, compare=replace(NOTHING.compare, measures=measures))
    assert (report_comparison(photo, photo, PLATE, options).comparison.measures is None) == (not measures)
    assert ('id="measures"' in page.read_text(encoding="utf-8")) == bool(measures)


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (replace(NOTHING, experiment="plate"), "experiment needs rig"),
        (replace(NOTHING, experiment="a b", rig=RIG), "cannot be called"),
        (replace(NOTHING, experiment="", rig=RIG), "cannot be called ''"),
        (replace(NOTHING, page=Path("page.txt")), r"no \.html file"),
        (replace(NOTHING, rig=RIG, display=RIG), "one of display and rig"),
        (replace(NOTHING, display=RIG), "needs distance-mm"),
        (replace(NOTHING, distance_mm=700.0), "needs display or rig"),
    ],
)
def test_what_does_not_go_together_is_refused_before_anything_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, options: ComparisonOptions, complaint: str
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=complaint):
        report_comparison("a.exr", "b.exr", PLATE, options)
    assert list(tmp_path.iterdir()) == []


def test_the_command_and_python_ask_for_the_same(
    tmp_path: Path, cyclopean: Cyclopean, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The record holds what was given, by the names that it always had; texts stand for files and exposures."""
    monkeypatch.chdir(tmp_path)
    photo, other = (written(Path(name), one) for name, one in (("a.exr", few()), ("b.exr", few(gain=1.01))))
    here, there = ((1.0, 1.0), (170.0, 1.0), (170.0, 130.0), (1.0, 130.0)), ["1,1", "170,1", "170,130", "1,130"]
    corners = ("--photo-corners", *there, "--rendering-corners", *there)
    words = ("--register", "corners", *corners, "--exposure", "1/15,8,200", "--limit", 2, "--rig", RIG)
    typed = cyclopean("compare", photo, other, "--regions", PLATE, *words, "--json", expect=None)
    asked = house.compare(
        photo,
        other,
        PLATE,
        register="corners",
        photo_corners_px=here,
        rendering_corners_px=here,
        exposure="1/15,8,200",
        delta_e_limit=2,
        rig=str(RIG),
    ).value.to_json()
    found = json.loads(typed.stdout)
    assert {key: found[key] for key in asked} == json.loads(json.dumps(asked))
    assert asked["settings"]["photo_corners"] == there
    assert set(found["settings"]) >= {"limit", "registering", "exposure", "rig", "regions"}
    with pytest.raises(InputError, match="exposure"):
        house.compare(photo, other, PLATE, exposure="1,2,3,4")
