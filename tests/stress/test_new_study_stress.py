"""`cyclopean new` at its edges: every wrong picture is one clear message, and every kind, mode and size runs."""

from __future__ import annotations

import io
from collections.abc import Callable
from itertools import cycle, product
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from devices.display import PanelSpec
from documents import InputError
from runner.check import CheckOptions, check_file
from runner.cli.main import group
from runner.presenter import MODES, find_mode
from runner.session import simulate
from runner.studies import Kind, StudyOptions, new_study
from runner.studies.contents import KINDS
from tests.runner.studies.drawn_pictures import draw, draw_flat, draw_pairs
from tests.stress.how_many import how_many

pytestmark = pytest.mark.stress
PANEL = PanelSpec(resolution_px=(640, 480), pixel_pitch_mm=0.5)


@pytest.fixture(autouse=True)
def cache_of_its_own(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """Build stimuli into a folder that no other test and no user has."""
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path_factory.mktemp("cache")))


def _left_alone(folder: Path) -> str:
    draw_pairs(folder, ("a", "b"))
    (folder / "b_R.jpg").unlink()
    return "without the right eye's"


def _sizes_differ(folder: Path) -> str:
    draw_pairs(folder, ("a",))
    draw(folder / "a_R.jpg", (61, 40))
    return "60 × 40 pixels and the right eye's 61 × 40"


def _cmyk(folder: Path) -> str:
    draw(folder / "a.png")
    Image.new("CMYK", (60, 40)).save(folder / "b.jpg")
    return "CMYK"


def _one_bit(folder: Path) -> str:
    draw(folder / "a.png")
    Image.new("1", (60, 40)).save(folder / "b.png")
    return "1 bit"


def _palette(folder: Path) -> str:
    draw(folder / "a.png")
    Image.open(folder / "a.png").quantize(16).save(folder / "b.png")
    return "palette"


def _animated(folder: Path) -> str:
    draw(folder / "a.png")
    frames = [Image.new("RGB", (60, 40), (shade, 0, 0)) for shade in (10, 200)]
    frames[0].save(folder / "b.webp", save_all=True, append_images=frames[1:], lossless=True)
    return "animated"


def _broken_profile(folder: Path) -> str:
    draw(folder / "a.png")
    Image.new("RGB", (60, 40)).save(folder / "b.png", icc_profile=b"no profile at all")
    return "profile"


def _panorama(folder: Path) -> str:
    draw(folder / "a.png")
    Image.new("RGB", (30_000, 8)).save(folder / "b.png")
    return "too large"


def _empty(folder: Path) -> str:
    folder.mkdir()
    return "no pictures"


def _case_alone(folder: Path) -> str:
    draw_flat(folder, ("Plate", "plate"))
    return "upper and lower case"


def _torn(folder: Path) -> str:
    draw(folder / "a.png")
    data = io.BytesIO()
    Image.fromarray(np.zeros((40, 60, 3), np.uint8)).save(data, "PNG")
    (folder / "b.png").write_bytes(data.getvalue()[:20])
    return "damaged"


def _text(folder: Path) -> str:
    draw(folder / "a.png")
    (folder / "b.jpg").write_text("no picture")
    return "no picture"


WRONG: dict[str, Callable[[Path], str]] = {
    make.__name__.strip("_"): make
    for make in (
        _left_alone,
        _sizes_differ,
        _cmyk,
        _one_bit,
        _palette,
        _animated,
        _broken_profile,
        _panorama,
        _empty,
        _case_alone,
        _torn,
        _text,
    )
}


@pytest.mark.parametrize("make", WRONG.values(), ids=WRONG)
def test_wrong_pictures_are_one_message_and_nothing_is_written(tmp_path: Path, make: Callable[[Path], str]) -> None:
    expected = make(tmp_path / "photos")
    # The command's own ending turns what was raised into lines, exit status 2.
    called = CliRunner().invoke(
        group, ["new", str(tmp_path / "my_study"), str(tmp_path / "photos"), "--panel", "640x480,0.5"]
    )
    assert isinstance(called.exception, InputError), called.output
    assert len(called.exception.findings) == 1
    finding = called.exception.findings[0]
    assert expected in str(finding)
    assert finding.file is not None
    assert finding.remedy
    assert [file.name for file in tmp_path.iterdir()] == ["photos"]


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
