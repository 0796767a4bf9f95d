"""Small pictures of the stimuli: right colours, small, and only of what was shown."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from analysis.records import Header
from devices.colour import srgb
from devices.display import DisplayModel, read_rig
from runner.errors import SessionError
from runner.protocol import Experiment, read_experiment
from runner.reports import find_shown, results
from runner.reports.results import print_pdf
from runner.reports.thumbnails import png, small, thumbnails
from runner.session import hashes
from runner.session.header import make_header
from stimuli.build import StimulusSet, build_set
from stimuli.pictures import StereoImage, write_exr
from tests.answers import altered

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def model() -> DisplayModel:
    return read_rig(ROOT / "configs/rigs/asus_vg248qe_3dvision.yaml").models.left


@pytest.fixture
def shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Experiment, StimulusSet]:
    """An experiment with one picture in stereo and one flat, built."""
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    rng = np.random.default_rng(1)
    left, right = (rng.uniform(1, 20, (60, 90, 3)).astype(np.float32) for _ in range(2))
    write_exr(tmp_path / "a.exr", StereoImage(left, right))
    write_exr(tmp_path / "b.exr", StereoImage.flat(left))
    (tmp_path / "recipe.yaml").write_text(
        "schema_version: 1\nkind: pictures\nstimuli:\n  - {name: a, file: a.exr}\n  - {name: b, file: b.exr}\n"
    )
    file = tmp_path / "two.yaml"
    file.write_text(
        f"schema_version: 1\nname: two\nrig: {ROOT / 'configs/rigs/asus_vg248qe_3dvision.yaml'}\n"
        "stimuli: recipe.yaml\nquestion: Which?\n"
        "layout: {arrangement: vertical, size_mm: [60, 40], gap_mm: 10}\n"
        "blocks:\n  - {kind: all_pairs, stimuli: all}\n"
    )
    experiment = read_experiment(file)
    return experiment, build_set(experiment.recipe_file, experiment.rig.display.panel.pixel_pitch_mm)


def header_of(experiment: Experiment, stimuli: StimulusSet) -> Header:
    return make_header(experiment, stimuli, "01", "s", (), {}, simulated=True)


def test_colours_are_those_of_an_eye_adapted_to_the_displays_white(model: DisplayModel) -> None:
    """Held against colour-science's Bradford adaptation and sRGB."""
    import colour

    white = model.white_XYZ_cd_m2
    xyz = model.xyz(np.random.default_rng(3).uniform(0, 1, (200, 3)))
    page_white = colour.xy_to_XYZ([0.3127, 0.3290])
    adapted = colour.adaptation.chromatic_adaptation_VonKries(xyz / white[1], white / white[1], page_white, "Bradford")
    primaries = colour.RGB_COLOURSPACES["sRGB"].primaries
    matrix = np.linalg.inv(colour.normalised_primary_matrix(primaries, [0.3127, 0.3290]))
    light = np.clip(adapted @ matrix.T, 0, 1)
    expected = colour.models.eotf_inverse_sRGB(light)
    assert srgb(xyz, white) == pytest.approx(expected, abs=2e-4)
    assert srgb(white, white) == pytest.approx(np.ones(3), abs=1e-12)


def test_light_is_averaged_after_the_displays_clipping(model: DisplayModel) -> None:
    xyz = np.random.default_rng(5).uniform(0, 60, (31, 47, 3))
    step = 12  # 47 pixels into at most 4
    expected = np.array(
        [
            [
                np.mean(
                    [
                        model.xyz(model.code(xyz[row, column]))
                        for row in range(top * step, (top + 1) * step)
                        for column in range(left * step, (left + 1) * step)
                    ],
                    axis=0,
                )
                for left in range(3)
            ]
            for top in range(2)
        ]
    )
    assert small(model, xyz, 4) == pytest.approx(expected)


@pytest.mark.parametrize("size", [(1, 1), (1, 500), (500, 1), (7, 200)])
def test_any_shape_becomes_a_picture(model: DisplayModel, size: tuple[int, int]) -> None:
    picture = png(small(model, np.full((*size, 3), 5.0), 96), model)
    with Image.open(io.BytesIO(picture)) as image:
        assert image.mode == "RGB"
        assert min(image.size) >= 1


def test_each_eye_has_its_picture_and_flat_ones_have_one(shown: tuple[Experiment, StimulusSet]) -> None:
    found = thumbnails(*shown)
    assert {name: sorted(views) for name, views in found.items()} == {"a": ["left", "right"], "b": ["both"]}
    assert found["a"]["left"] == found["b"]["both"] != found["a"]["right"]


def test_only_the_pictures_and_the_display_of_the_session_are_shown(shown: tuple[Experiment, StimulusSet]) -> None:
    experiment, stimuli = shown
    header = header_of(experiment, stimuli)
    found = find_shown(header, experiment.file)
    assert found is not None
    assert hashes(*found) == hashes(experiment, stimuli)
    for key in ("stimuli", "display"):
        assert find_shown(altered(header, hashes={**header.hashes, key: "00"}), experiment.file) is None
    assert find_shown(header, experiment.file.with_name("recipe.yaml")) is None


def test_a_damaged_cache_shows_nothing(shown: tuple[Experiment, StimulusSet]) -> None:
    experiment, stimuli = shown
    header = header_of(experiment, stimuli)
    stimuli.manifest_path.write_text("{")
    assert find_shown(header, experiment.file) is None


# Printing a page to PDF.


def test_without_a_browser_the_remedy_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(results, "BROWSERS", ())
    monkeypatch.setattr(results, "OUTSIDE_PATH", ())
    with pytest.raises(SessionError, match="install Chromium or Chrome"):
        print_pdf(tmp_path / "page.html", tmp_path / "page.pdf")
    assert not list(tmp_path.iterdir())


def test_a_browser_that_fails_leaves_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for command in ("true", "false"):
        monkeypatch.setattr(results, "BROWSERS", (command,))
        with pytest.raises(SessionError, match="did not print"):
            print_pdf(tmp_path / "page.html", tmp_path / "page.pdf")
    assert not list(tmp_path.iterdir())
