"""Crosstalk is cancelled through the whole path: file, compensation, shader, framebuffer, and the eyes' own mixture."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from analysis.records import SessionLog, read_session, session_files
from analysis.report.shown import clipping_section
from devices.colour import delta_e_2000, xyz_to_lab
from devices.compensation.crosstalk_cancel import seen_XYZ
from devices.display import EYES, Eye, read_rig
from documents.pages import Table
from runner.protocol import read_experiment
from stimuli.pictures import read_exr
from tests.choice import nightly

Study = Any  # tests/conftest.py
CROSSTALK = """    crosstalk:
      left: [[0.05, 0, 0], [0, 0.04, 0], [0, 0, 0.06]]
      right: [[0.03, 0, 0], [0, 0.05, 0], [0, 0, 0.02]]
"""


def _leaky(study: Study) -> None:
    study.edit("display.yaml", "    source: made up for tests\n", f"    source: made up for tests\n{CROSSTALK}")


UPPER = slice(240 - 30 - 20, 240 - 30 + 20), slice(160 - 40, 160 + 40)


def _previewed(study: Study) -> dict[Eye, Path]:
    """Preview the first pair and return each eye's picture of it."""
    study.cyclopean("preview", study.experiment, "-o", study.folder / "preview", "--first", "1")
    return {eye: study.folder / "preview" / f"block-02_screen-001_{eye}.png" for eye in EYES}


def _codes(study: Study) -> dict[Eye, NDArray[np.uint8]]:
    return {eye: np.asarray(Image.open(file)) for eye, file in _previewed(study).items()}


def _first_pair(study: Study) -> tuple[str, ...]:
    steps = read_experiment(study.experiment).blocks("01")[1].steps()
    return tuple(next(iter(steps)).scene.stimuli)  # type: ignore[union-attr]  # an Ask or a Hold


def _run(study: Study) -> SessionLog:
    study.cyclopean(
        *("run", study.experiment, "--observer", "01", "--simulate", study.observers, "--results", study.results)
    )
    (file,) = session_files(study.results)
    return read_session(file)


def _mean_delta_e(study: Study) -> list[float]:
    """Return, per eye, how far what it sees of the upper picture is from what was asked."""
    codes = {eye: shown[UPPER] / 255 for eye, shown in _codes(study).items()}
    rig = read_rig(study.folder / "rig.yaml")
    image = read_exr(study.folder / f"{_first_pair(study)[0]}.exr")
    seen = seen_XYZ(rig.models, rig.crosstalk, codes["left"], codes["right"])
    differences = []
    for eye, light in zip(EYES, seen, strict=True):
        white = rig.models.eye(eye).white_XYZ_cd_m2
        asked = xyz_to_lab(image.eye(eye), white)
        differences.append(float(np.mean(delta_e_2000(asked, xyz_to_lab(light, white)))))
    return differences


@pytest.fixture
def inside(study: Study) -> Study:
    """The study with pictures well inside the gamut, so that nothing but crosstalk moves a colour."""
    from stimuli.pictures import StereoImage, write_exr

    white = read_rig(study.folder / "rig.yaml").models.left.white_XYZ_cd_m2
    rng = np.random.default_rng(1)
    for name in ("one", "two", "three", "four"):
        left, right = ((rng.uniform(0.2, 0.8, (40, 80, 1)) * white).astype(np.float32) for _ in range(2))
        write_exr(study.folder / f"{name}.exr", StereoImage(left, right))
    return study


def test_each_eye_sees_what_was_asked_of_leaking_glasses(inside: Study) -> None:
    plain = _mean_delta_e(inside)
    _leaky(inside)
    cancelled = _mean_delta_e(inside)
    # Only the rounding to 8 bits is left, with crosstalk as without.
    assert max(plain) < 0.4
    assert max(cancelled) < 1.1 * max(plain)


def _report(study: Study) -> dict[str, Any]:
    log = _run(study)
    assert log.header.display.crosstalk_cancelled is True
    trial = next(trial for trial in log.trials if trial.kind == "all_pairs")
    assert set(trial.details()["clipping"][trial.details()["first"]]) == {"left", "right", "crosstalk"}
    json.dumps(log.header.to_json())
    return {stimulus.name: stimulus.given()["clipping"]["crosstalk"] for stimulus in log.header.stimuli}


def _dark_against_bright(folder: Path) -> None:
    from stimuli.pictures import StereoImage, write_exr

    white = read_rig(folder / "rig.yaml").models.left.white_XYZ_cd_m2
    dark, bright = (np.full((40, 80, 3), share * white, dtype=np.float32) for share in (0.002, 0.9))
    write_exr(folder / "one.exr", StereoImage(dark, bright))


def test_check_and_report_tell_of_ghosts(study: Study) -> None:
    _leaky(study)
    check = ("check", study.experiment, "--no-screen", "--observers", "5")
    plain = study.cyclopean(*check).stdout
    _dark_against_bright(study.folder)
    words = study.cyclopean(*check).stdout
    assert "most in 'one', where 100.00 %" not in plain
    assert "most in 'one', where 100.00 %" in " ".join(words.split())
    assert "write lift_black: true" in " ".join(words.split())
    assert "ghosts of crosstalk" in words
    told = _report(study)["one"]
    assert told["left"]["percent_negative"] == 100.0
    assert told["left"]["delta_e_00_mean"] > 1.0
    assert told["right"]["percent_negative"] == 0.0
    (file,) = session_files(study.results)
    log = read_session(file)
    section = clipping_section(log.header, ["one", "two"])
    assert section is not None
    table = next(block for block in section.blocks if isinstance(block, Table) and block.name == "ghosts")
    assert [row[:2] for row in table.rows] == [("one", "left"), ("one", "right"), ("two", "left"), ("two", "right")]
    assert table.rows[0][2] == 100.0


def test_lifting_the_black_level_leaves_nothing_to_clip(study: Study) -> None:
    _leaky(study)
    _dark_against_bright(study.folder)
    study.edit("rig.yaml", "distance_mm: 700\n", "distance_mm: 700\nlift_black: true\n")
    told = _report(study)
    assert told["one"]["lift_share"] > 0.01
    assert all(picture[eye]["percent_negative"] == 0.0 for picture in told.values() for eye in ("left", "right"))


def test_the_room_s_light_is_taken_off_what_is_asked_and_stands_in_the_header(inside: Study) -> None:
    plain = _mean_delta_e(inside)
    inside.edit("display.yaml", "modes:\n", "ambient_XYZ_cd_m2: [0.4, 0.5, 0.3]\nmodes:\n")
    assert max(_mean_delta_e(inside)) < 1.1 * max(plain)
    display = _run(inside).header.display.given()
    black = read_rig(inside.folder / "rig.yaml").models.left.black_XYZ_cd_m2
    assert display["ambient_XYZ_cd_m2"]["left"] == [0.4, 0.5, 0.3]
    assert display["black_XYZ_cd_m2"]["left"] == pytest.approx(black.tolist(), abs=1e-6)
    text = inside.cyclopean("check", inside.folder / "display.yaml", "--json").stdout
    assert "contrast_in_the_room" in text
    assert '"contrast"' in text


def test_mode_options_of_the_rig_reach_the_screen(study: Study) -> None:
    before = _codes(study)
    study.edit("rig.yaml", "distance_mm: 700\n", "distance_mm: 700\nmode_options: {left_mirror: horizontal}\n")
    after = _codes(study)
    assert np.array_equal(before["left"][:, ::-1], after["left"])
    assert np.array_equal(before["right"], after["right"])


GAIN = """    gain_map:
      luminance: [[0.7, 0.8, 0.75], [0.9, 1.0, 0.95], [0.8, 0.9, 0.85]]
      positions: cells
      normalise: centre
"""


def _panel_gain(study: Study) -> np.ndarray:
    gain_map = read_rig(study.folder / "rig.yaml").gain_map
    assert gain_map is not None
    x, y = np.meshgrid(np.arange(640) + 0.5, np.arange(480) + 0.5)
    return gain_map.gain(x, y)


@pytest.mark.parametrize("crosstalk", [*nightly(False), True])
def test_an_uneven_panel_is_evened_out_where_each_picture_stands(inside: Study, crosstalk: bool) -> None:
    inside.edit("display.yaml", "    source: made up for tests\n", f"    source: made up for tests\n{GAIN}")
    if crosstalk:
        _leaky(inside)
    codes, rig, gain = _codes(inside), read_rig(inside.folder / "rig.yaml"), _panel_gain(inside)
    panel = dict(zip(EYES, (gain[:, :320, None], gain[:, 320:, None]), strict=True))
    sent: dict[Eye, Any] = {eye: rig.models.eye(eye).xyz(codes[eye] / 255) * panel[eye] for eye in EYES}
    black = rig.models.left.black_XYZ_cd_m2
    if rig.crosstalk:
        lights = rig.crosstalk.seen(sent["left"] - black, sent["right"] - black)
        sent = {"left": lights[0] + black, "right": lights[1] + black}
    white = rig.models.left.white_XYZ_cd_m2
    for name, middle in zip(_first_pair(inside), (240 - 30, 240 + 30), strict=True):
        image = read_exr(inside.folder / f"{name}.exr")
        for eye in EYES:
            seen = sent[eye][middle - 20 : middle + 20, 160 - 40 : 160 + 40]
            asked = image.eye(eye)
            fits = (asked[..., 1] < 0.6 * white[1])[..., None]  # where the dimmest part of the panel reaches it
            difference = delta_e_2000(xyz_to_lab(asked, white), xyz_to_lab(seen, white))
            assert float(difference[fits[..., 0]].mean()) < 0.35
    plain = sent["left"] / gain[:, :320, None]
    assert np.ptp(plain) > 0


def test_the_costs_count_where_the_panel_is_too_dim(inside: Study) -> None:
    def clipped() -> float:
        told = inside.cyclopean("check", inside.experiment, "--observers", "5", "--json").stdout
        return float(json.loads(told)[0]["clipped_percent"]["one"][0])

    assert clipped() == 0.0
    dim = GAIN.replace("[0.9, 1.0, 0.95]", "[0.4, 1.0, 0.5]")
    inside.edit("display.yaml", "    source: made up for tests\n", f"    source: made up for tests\n{dim}")
    assert clipped() > 0.0


def test_a_panel_of_ten_bits_gets_codes_of_ten_bits(study: Study) -> None:
    import OpenImageIO as oiio

    study.edit("display.yaml", "pixel_pitch_mm: 0.25}", "pixel_pitch_mm: 0.25, bits: 10}")
    png = oiio.ImageBuf(str(_previewed(study)["left"]))
    shown = (np.asarray(png.get_pixels("uint16")) >> 6)[UPPER]
    model = read_rig(study.folder / "rig.yaml").models.left
    reference = model.code(read_exr(study.folder / f"{_first_pair(study)[0]}.exr").left) * 1023
    assert np.abs(shown - reference).max() <= 0.501
    assert _run(study).header.presentation.bits == 10


def test_the_costs_of_an_anaglyph_counts_the_mixed_picture(study: Study) -> None:
    from runner.presenter import find_mode

    study.edit("display.yaml", "  quad-buffered: {same_as", "  anaglyph-red-cyan: {same_as")
    study.edit("rig.yaml", "mode: side-by-side", "mode: anaglyph-red-cyan")
    checked = study.cyclopean("check", study.experiment, "--observers", "5", "--json").stdout
    told = json.loads(checked)[0]["clipped_percent"]["one"]
    rig = read_rig(study.folder / "rig.yaml")
    mixture = find_mode("anaglyph-red-cyan").mixture(rig.models)
    assert mixture is not None
    image = read_exr(study.folder / "one.exr")
    light = mixture.light(image.left, image.right)
    outside = ((light < -1e-6) | (light > 1 + 1e-6)).any(axis=-1)
    assert told == [pytest.approx(100 * outside.mean(), abs=1e-3)] * 2
    assert 0 < outside.mean() < 1


def test_dithering_of_the_rig_reaches_the_screen_and_keeps_the_mean_light(study: Study) -> None:
    from stimuli.pictures import StereoImage, write_exr

    model = read_rig(study.folder / "rig.yaml").models.left
    between = model.xyz(np.full(3, 20.4 / 255))  # between two codes
    for name in ("one", "two", "three", "four"):
        flat = np.broadcast_to(between, (40, 80, 3)).astype(np.float32)
        write_exr(study.folder / f"{name}.exr", StereoImage.flat(np.ascontiguousarray(flat)))
    assert set(np.unique(_codes(study)["left"][UPPER])) == {20}
    study.edit("rig.yaml", "distance_mm: 700\n", "distance_mm: 700\ndither: shared\n")
    dithered = _codes(study)["left"][UPPER]
    assert set(np.unique(dithered)) == {20, 21}
    mean = model.xyz(dithered / 255).mean(axis=(0, 1))
    assert np.abs(mean / between - 1).max() < 0.002
