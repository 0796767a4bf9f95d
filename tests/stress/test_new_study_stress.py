"""`cyclopean new` at its edges: every wrong picture is one clear message, and every kind, mode and size runs."""

from __future__ import annotations

from itertools import cycle, product
from pathlib import Path

import pytest

from devices.display import PanelSpec
from documents import InputError
from runner.check import CheckOptions, check_file
from runner.presenter import MODES, find_mode
from runner.session import simulate
from runner.studies import Kind, StudyOptions, new_study
from runner.studies.contents import KINDS
from tests.runner.studies.drawn_pictures import draw_flat, draw_pairs
from tests.stress.how_many import how_many

pytestmark = pytest.mark.stress
PANEL = PanelSpec(resolution_px=(640, 480), pixel_pitch_mm=0.5)


@pytest.fixture(autouse=True)
def cache_of_its_own(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """Build stimuli into a folder that no other test and no user has."""
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path_factory.mktemp("cache")))


# Every mode with some kind, and every kind with some modes; WHOLE=1: each with each.
MIXED = [(kind, mode) for kind, mode in product(KINDS, MODES)][:: how_many(3, 1)]


@pytest.mark.parametrize(("kind", "mode"), MIXED)
def test_every_kind_and_mode_passes_and_runs(tmp_path: Path, kind: Kind, mode: str) -> None:
    names = ("x_1", "x_2", "y_1", "y_2")
    folder = draw_flat(tmp_path / "photos", names[:1], (16, 16))
    draw_flat(folder, names[1:2], (200, 500))
    (draw_flat if mode == "flat" else draw_pairs)(folder, names[2:], (900, 300))
    study = new_study(tmp_path / "my_study", [folder], StudyOptions(kind, mode, panel=PANEL))
    report = check_file(study.experiment, CheckOptions(screen=False))
    assert [str(error) for error in report.errors] == []
    if find_mode(mode).needs_stereo:
        return  # drivers without stereo buffers cannot draw it
    done = simulate(study.experiment, study.folder / "simulated.yaml", 1, results=tmp_path / "results")
    assert done.folders[0].is_dir()


@pytest.mark.parametrize("panel", ["320x240,0.2", "640x480,0.5", "1080x1920,0.27", "3840x2160,0.18", "10240x4320,0.1"])
def test_every_panel_is_planned_for_in_every_mode(tmp_path: Path, panel: str) -> None:
    """One kind of study for each mode, in turn: every kind in some mode."""
    folder = draw_flat(tmp_path / "photos", ("a_1",), (16, 16))
    draw_flat(folder, ("a_2",), (4000, 3000))
    draw_flat(folder, ("b_1", "b_2"), (300, 1000))
    for mode, kind in zip(MODES, cycle(KINDS)):
        options = StudyOptions(kind, mode, panel=PanelSpec.parse(panel))
        study = new_study(tmp_path / mode, [folder], options)
        report = check_file(study.experiment, CheckOptions(screen=False, pictures=False))
        assert [str(error) for error in report.errors] == []


def test_two_hundred_pictures_and_more_than_a_recipe_holds(tmp_path: Path) -> None:
    folder = draw_flat(tmp_path / "photos", [f"p{number}" for number in range(200)], (16, 16))
    for kind in KINDS[:3]:
        study = new_study(tmp_path / kind, [folder], StudyOptions(kind, panel=PANEL))
        report = check_file(study.experiment, CheckOptions(screen=False, pictures=False))
        assert [str(error) for error in report.errors] == []
    draw_flat(folder, [f"q{number}" for number in range(801)], (16, 16))
    with pytest.raises(InputError, match="1000"):
        new_study(tmp_path / "too_many", [folder], StudyOptions(panel=PANEL))
