"""Cameras, charts, brackets and raw files at their edges: light comes back, or one clear finding."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from devices.camera import Correspondences, Loss, ReferenceColours, fit_camera
from devices.chart import COLORCHECKER, perspective, project
from devices.colour import XYZ_from_xyY, delta_e_2000, xyz_to_lab
from devices.readings import colorchecker_xyY
from documents import InputError
from extensions.photo import BracketOptions, NoiseModel, bracket_photographs, merge_exposures
from extensions.photo.camera_fit import read_chart
from stimuli.develop import Demosaic, DevelopOptions, Levels, read_camera_image
from stimuli.develop.raw_files import DEMOSAICS
from stimuli.errors import StimulusError
from stimuli.spectral import read_spectral
from stimuli.spectral.convert import spectral_to_xyz
from tests.extensions.photo.sensor import BLACK, TIMES, WHITE, codes, record, scene
from tests.stimuli.develop.dng import exposure_tags, save_dng, smooth, write_dng
from tests.stimuli.spectral.pictures import WAVES, bumps, save_envi, save_exr
from tests.stress.how_many import how_many
from tests.stress.memory import run_alone

pytestmark = pytest.mark.stress


# Brackets at their edges: many kinds of sensor and scene, planted motion at every place, and 36 megapixels.

T = [time[0] / time[1] * 250 for time in TIMES]
SUPERPIXEL = BracketOptions(develop=DevelopOptions(demosaic="superpixel"))


@pytest.mark.parametrize(("full_e", "read_e"), [(1500.0, 3.0), (8000.0, 20.0), (30000.0, 0.0), (120000.0, 2.0)])
def test_the_bound_is_attained_by_every_sensor_over_fourteen_stops(full_e: float, read_e: float) -> None:
    noise = NoiseModel.of_electrons(full_e, read_e)
    many = 20_000
    for number, light in enumerate(np.geomspace(2e-4, 0.7, 24)):
        values = [record(np.full(many, light), time, 100 * number + i, full_e, read_e) for i, time in enumerate(T)]
        merged = merge_exposures([np.minimum(part, 1) for part in values], [part >= 1 for part in values], T, noise)
        clear = [time for time in T if light * time + 5 * np.sqrt(light * time / full_e) < 1]
        beyond = [time for time in T if light * time - 5 * np.sqrt(light * time / full_e) < 1]
        best, worst = (
            1 / np.sqrt(sum(time**2 / (light * time / full_e + noise.read**2) for time in times))
            for times in (beyond, clear)
        )
        # 20000 values: four standard errors of a standard deviation are 2 %
        assert 0.98 * best < merged.value.std() < 1.02 * worst
        if len(clear) == len(beyond):
            # half an electron of all exposures together is what weights by the estimate itself may take or give
            assert abs(merged.value.mean() - light) < 4 * worst / np.sqrt(many) + 0.5 / full_e / sum(clear)


def _saved(folder: Path, lights: list[np.ndarray], seed: int) -> list[Path]:
    return [
        save_dng(
            folder / f"{number}.dng",
            codes(record(light, time[0] / time[1], 1000 * seed + number)),
            black=(BLACK,),
            white=WHITE,
            tags=exposure_tags(time, (8, 1), 200),
        )
        for number, (light, time) in enumerate(zip(lights, TIMES[1:4], strict=True))
    ]


def test_motion_is_found_wherever_it_is_and_never_where_it_is_not(tmp_path: Path) -> None:
    """One change of a third on 16 × 16 photosites, anywhere in 60 scenes of 7 stops; and the same scenes without."""
    rng = np.random.default_rng(0)
    missed = false = 0
    for seed in range(60):
        light = scene(64, 80, stops=7, seed=seed) / 4
        row, column = rng.integers(0, (48, 64))
        moved = light.copy()
        moved[row : row + 16, column : column + 16] *= rng.choice([2 / 3, 1.5])
        lights = [light] * 3
        false += bool(
            bracket_photographs(_saved(tmp_path, lights, seed), tmp_path / "a.exr", SUPERPIXEL).merge["moved"]
        )
        lights[int(rng.integers(0, 3))] = moved
        try:
            bracket_photographs(_saved(tmp_path, lights, seed), tmp_path / "a.exr", SUPERPIXEL)
        except InputError as error:
            said = error.findings[0].message
            x, y = (int(said.split(f"{axis} ")[1].split(",")[0].split(";")[0]) for axis in ("at x", "y"))
            missed += not (abs(x - column) <= 16 and abs(y - row) <= 16)
        else:
            missed += 1
    print("missed", missed, "false", false)
    assert false == 0
    # Beside a patch a hundred times as bright, the shift by 0.3 pixels that is let pass is worth more than the change.
    assert missed <= 3


@pytest.mark.parametrize(("full_e", "read_e"), [(1500.0, 3.0), (3000.0, 20.0), (100000.0, 2.0)])
def test_no_motion_with_other_sensors_nor_among_sparkles(tmp_path: Path, full_e: float, read_e: float) -> None:
    """Twelve brackets each of 12 stops, every third of sparkles through a lens of one pixel; the gain is found."""
    for seed in range(12):
        light = scene(128, 160, stops=12, seed=seed)
        if seed % 3 == 2:
            rng = np.random.default_rng(seed)
            points = np.where(rng.random(light.shape) < 0.01, rng.lognormal(1, 1, light.shape), 0)
            light = 300 * np.clip(0.04 + gaussian_filter(points, 1.0), 0, 1)
        photos = [
            save_dng(
                tmp_path / f"{number}.dng",
                codes(record(light, time[0] / time[1], 1000 * seed + number, full_e, read_e)),
                black=(BLACK,),
                white=WHITE,
                tags=exposure_tags(time, (8, 1), 200),
            )
            for number, time in enumerate(TIMES)
        ]
        step = bracket_photographs(photos, tmp_path / "a.exr", SUPERPIXEL).merge
        assert step["moved"] == []
        assert step["noise"]["green"]["full_scale_electrons"] == pytest.approx(full_e, rel=0.1)


def test_six_raw_files_of_thirty_six_megapixels(tmp_path: Path) -> None:
    """A whole bracket of a D800, with 1.5 GB at most, in a program by itself."""
    light = np.tile(scene(2456, 1840, seed=1), (2, 4))
    for number, taken in enumerate(TIMES):
        rng = np.random.default_rng(number)
        values = light * (taken[0] / taken[1])
        values += rng.normal(0, 1, values.shape) * np.sqrt(values / 30000 + 4e-8)
        save_dng(
            tmp_path / f"{number}.dng",
            codes(values),
            black=(BLACK,),
            white=WHITE,
            tags=exposure_tags(taken, (8, 1), 200),
        )
    photos = [str(tmp_path / f"{number}.dng") for number in range(len(TIMES))]
    program = (
        "import sys, time; from pathlib import Path; from devices.camera import read_camera;"
        "from extensions.photo import BracketOptions, bracket_photographs; from stimuli.develop import DevelopOptions;"
        "start = time.perf_counter(); camera = read_camera('configs/cameras/nikon_d800.yaml');"
        "options = BracketOptions(develop=DevelopOptions(camera=camera));"
        f"bracket_photographs([Path(p) for p in sys.argv[1:]], Path({str(tmp_path / 'a.exr')!r}), options);"
        "peak = int(open('/proc/self/status').read().split('VmHWM:')[1].split()[0]);"
        "print(peak / 1e6, time.perf_counter() - start)"
    )
    assert float(run_alone(program, *photos).split()[0]) < 1.5


# Cameras and charts pushed to their edges: many sensors, outliers, thousands of colours, charts at every angle.

NAMES, XYY = colorchecker_xyY()
XYZ = XYZ_from_xyY(XYY) * 100
PLAIN = np.array([[220.0, 37.0, 3.0], [84.0, 146.0, -46.0], [12.0, -35.0, 220.0]])


def _camera(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.asarray(PLAIN * rng.uniform(0.8, 1.2, (3, 3)) * 10 ** rng.uniform(-2, 3))


@pytest.mark.parametrize("seed", range(how_many(40, 100)))
def test_any_camera_with_any_outliers(seed: int) -> None:
    """Half a percent of noise, up to four outliers: each is found, hardly anything else is left out."""
    rng = np.random.default_rng(seed)
    M = _camera(seed)
    light = XYZ * float(np.abs(M).max()) / 220
    rgb = light @ np.linalg.inv(M).T
    rgb *= 0.9 / rgb.max()
    scale = float((light @ np.linalg.inv(M).T).max()) / 0.9
    rgb = np.maximum(rgb, 1e-4) * (1 + 0.005 * rng.standard_normal(rgb.shape))
    off = rng.choice(24, rng.integers(0, 5), replace=False)
    rgb[off] *= np.where(rng.random((len(off), 1)) < 0.5, 1.6, 0.55)
    rgb = np.minimum(rgb, 1.0)
    found = fit_camera(Correspondences(rgb, light, NAMES, rgb >= 0.995))
    gone = {NAMES.index(patch.name) for patch in found.left_out}
    # 1.6 times the light of a patch that is nearly black is less than 6 ΔE00.
    dark = {i for i in off.tolist() if XYY[i, 2] < 0.05}
    assert set(off.tolist()) - dark <= gone
    assert len(gone - set(off.tolist())) <= 1
    assert np.abs(found.model.matrix - M * scale).max() < 0.06 * np.abs(M * scale).max()


@pytest.mark.parametrize("loss", ["xyz", "delta-e"])
def test_thousands_of_colours(loss: Loss) -> None:
    rng = np.random.default_rng(1)
    rgb = rng.uniform(0.02, 0.9, (5000, 3)) @ np.array([[0.6, 0.3, 0.1], [0.3, 0.5, 0.2], [0.1, 0.2, 0.7]])
    light = np.maximum(rgb @ PLAIN.T, 0.01) * (1 + 0.01 * rng.standard_normal((5000, 3)))
    start = time.process_time()
    found = fit_camera(Correspondences(rgb, light, tuple(str(i) for i in range(5000)), rgb > 1), "affine", loss)
    print(f"{loss}: {time.process_time() - start:.1f} s")
    assert found.held_out is not None
    assert np.abs(found.model.matrix - PLAIN).max() < 2
    assert time.process_time() - start < 120


@pytest.mark.parametrize("seed", range(how_many(15, 30)))
def test_charts_at_every_angle_are_read_right_or_refused(seed: int) -> None:
    """A chart turned, tilted and sized at random: what is read is right to noise, or the photograph is refused."""
    rng = np.random.default_rng(seed)
    rgb = XYZ @ np.linalg.inv(PLAIN).T
    turn, size = rng.uniform(0, 2 * np.pi), rng.uniform(0.45, 0.9)
    spin = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    outline = (COLORCHECKER.outline() / COLORCHECKER.size[0] - [0.5, 0.33]) * 480 * size
    corners = outline @ spin.T + [360, 360] + rng.uniform(-0.05, 0.05, (4, 2)) * 480 * size
    x, y = np.meshgrid(np.arange(720) + 0.5, np.arange(720) + 0.5)
    at = project(np.asarray(np.linalg.inv(perspective(COLORCHECKER.outline(), corners))), np.stack([x, y], axis=-1))
    cell, within = np.divmod(at, 1 + COLORCHECKER.gap)
    on_patch = np.all((within < 1) & (cell >= 0) & (cell < [6, 4]), axis=-1)
    number = np.clip(cell[..., 1] * 6 + cell[..., 0], 0, 23).astype(int)
    on_card = np.all((at > -0.4) & (at < np.array(COLORCHECKER.size) + 0.4), axis=-1)
    picture = np.where(on_patch[..., None], rgb[number], np.where(on_card[..., None], 0.01, 0.12))
    picture = (picture + 0.004 * rng.standard_normal(picture.shape)).astype(np.float32)
    try:
        read = read_chart(picture, np.zeros(picture.shape, dtype=bool), ReferenceColours(XYZ, NAMES))
    except InputError as error:
        pytest.xfail(f"refused, as it may be: {error}")
    assert np.abs(read.colours.rgb - rgb).max() < 0.004
    found = fit_camera(read.colours)
    white = XYZ[18]
    off = delta_e_2000(xyz_to_lab(found.model.xyz(rgb), white), xyz_to_lab(XYZ, white))
    assert off.max() < 1.0


def test_a_chart_in_24_megapixels() -> None:
    rgb = XYZ @ np.linalg.inv(PLAIN).T
    small = np.full((400, 600, 3), 0.12, np.float32)
    small[60:345, 60:505] = 0.012
    for index, colour in enumerate(rgb):
        row, column = divmod(index, 6)
        small[75 + 69 * row : 135 + 69 * row, 75 + 69 * column : 135 + 69 * column] = colour
    picture = small.repeat(10, axis=0).repeat(10, axis=1)
    start = time.process_time()
    read = read_chart(picture, np.zeros(picture.shape, dtype=bool), ReferenceColours(XYZ, NAMES))
    print(f"24 megapixels: {time.process_time() - start:.1f} s")
    assert read.colours.rgb == pytest.approx(rgb, abs=1e-5)


# Camera files and spectral pictures at their edges: linear light comes back, or one clear finding.
def one_finding(path: Path) -> str:
    with pytest.raises(StimulusError) as caught:
        read_camera_image(path, demosaic="superpixel")
    (finding,) = caught.value.findings
    assert finding.file == str(path)
    assert finding.remedy
    return finding.message


def test_every_cut_of_a_raw_file_is_refused(tmp_path: Path) -> None:
    content = write_dng(tmp_path / "whole.dng", smooth()[:24, :26]).read_bytes()
    path = tmp_path / "cut.dng"
    for length in range(len(content)):
        path.write_bytes(content[:length])
        one_finding(path)


@pytest.mark.parametrize("method", DEMOSAICS)
def test_no_unmarked_value_owes_anything_to_a_full_photosite(tmp_path: Path, method: Demosaic) -> None:
    """Many pictures, each with one full photosite that gets another value: only what is marked may move."""
    rng = np.random.default_rng(7)
    columns, rows = np.arange(48), np.arange(48)
    for trial in range(150):
        waves = 750 + 500 * np.sin(columns / rng.uniform(0.8, 5))[None, :] * np.cos(rows / rng.uniform(0.8, 5))[:, None]
        noise = rng.normal(0, 60, waves.shape) if trial % 2 else rng.uniform(-700, 700, waves.shape)
        codes = np.clip(waves + noise, 0, 1490).astype(np.uint16)
        place = tuple(rng.integers(0, 48, 2))
        images = []
        for value in (1500, 4095):
            codes[place] = value
            path = save_dng(tmp_path / f"{value}.dng", codes, white=4095)
            images.append(read_camera_image(path, demosaic=method, levels=Levels(saturated=1500)))
        moved = np.abs(images[0].rgb - images[1].rgb) > 1e-9
        assert moved.any()
        assert not (moved & ~images[0].saturated).any()


@pytest.mark.parametrize("size", [(22, 22), (23, 31), (22, 401), (401, 22), (64, 65)])
@pytest.mark.parametrize("method", DEMOSAICS)
def test_odd_sizes(tmp_path: Path, size: tuple[int, int], method: Demosaic) -> None:
    rgb = np.broadcast_to(np.array([0.2, 0.5, 0.3]), (*size, 3)).copy()
    image = read_camera_image(write_dng(tmp_path / "a.dng", rgb), demosaic=method)
    assert image.rgb.shape[:2] == ((size[0] // 2, size[1] // 2) if method == "superpixel" else size)
    assert np.abs(image.rgb - [0.2, 0.5, 0.3]).max() < 1e-4


def test_thirty_six_megapixels(tmp_path: Path) -> None:
    """A whole D800 picture, and no more memory than 45 bytes a pixel beside the program, 60 through LibRaw."""
    path = tmp_path / "large.dng"
    codes = np.random.default_rng(0).integers(590, 15600, (4912, 7360), dtype=np.uint16)
    save_dng(path, codes, black=(600,), white=15520)
    program = (
        "import sys; from pathlib import Path; import rawpy, scipy.ndimage;"
        "from stimuli.develop.read import read_camera_image;"
        f"from tests.stress.memory import peak_kb; before = peak_kb();"
        f"image = read_camera_image(Path({str(path)!r}), demosaic=sys.argv[1]);"
        "print((peak_kb() - before) * 1024 / image.rgb[..., 0].size)"
    )
    for method, most_bytes in (("malvar", 45.0), ("ahd", 60.0)):
        assert float(run_alone(program, method)) < most_bytes


def test_dark_frames_and_flat_fields_of_thirty_six_megapixels(tmp_path: Path) -> None:
    """Two of each, and the photograph, to XYZ: at most 1.5 GB."""
    rng = np.random.default_rng(0)
    even = rng.integers(0, 40, (4912, 7360), dtype=np.uint16)
    for name, level in (("d0", 590), ("d1", 590), ("f0", 8000), ("f1", 8000), ("photo", 6000)):
        tags = exposure_tags((1, 15), (8, 1), 800)
        save_dng(tmp_path / f"{name}.dng", even + np.uint16(level), black=(600,), white=15520, tags=tags)
    program = (
        "from pathlib import Path; from devices.camera import read_camera;"
        "from stimuli.develop import DevelopOptions, develop_photographs;"
        f"from tests.stress.memory import peak_kb; at = Path({str(tmp_path)!r});"
        "camera = read_camera('configs/cameras/nikon_d800.yaml');"
        "options = DevelopOptions(camera=camera, dark=(at/'d0.dng', at/'d1.dng'), flat=(at/'f0.dng', at/'f1.dng'));"
        "report = develop_photographs([at/'photo.dng'], at/'a.exr', options); assert not report.findings, report;"
        "print(peak_kb() / 1e6)"
    )
    assert float(run_alone(program)) < 1.5


def test_a_large_spectral_picture_does_not_fill_memory(tmp_path: Path) -> None:
    """Of 660 MB of bands only blocks of 32 MB are held at a time."""
    row = bumps(WAVES, (1, 1000)).astype(np.float32)
    values = np.broadcast_to(row, (2000, 1000, len(WAVES)))
    for path in (save_envi(tmp_path / "a.hdr", np.asarray(values)), save_exr(tmp_path / "a.exr", values, form="{}nm")):
        program = (
            "from pathlib import Path; import colour, spectral, OpenImageIO;"
            "from stimuli.spectral.convert import spectral_to_xyz; from stimuli.spectral.bands import read_spectral;"
            f"from tests.stress.memory import peak_kb; before = peak_kb();"
            f"found = spectral_to_xyz(read_spectral(Path({str(path)!r}), 'radiance'));"
            "print((peak_kb() - before) / 1024)"
        )
        assert float(run_alone(program)) < 330


@pytest.mark.parametrize("kind", ["exr", "hdr"])
def test_every_cut_of_a_spectral_picture_is_refused(tmp_path: Path, kind: str) -> None:
    values = bumps(WAVES, (3, 4)).astype(np.float32)
    path = save_exr(tmp_path / "a.exr", values) if kind == "exr" else save_envi(tmp_path / "a.hdr", values)
    cut = path if kind == "exr" else path.with_suffix(".img")
    content = cut.read_bytes()
    for length in range(0, len(content), 7):
        cut.write_bytes(content[:length])
        with pytest.raises(StimulusError) as caught:
            spectral_to_xyz(read_spectral(path, "radiance"))
        assert len(caught.value.findings) == 1
        assert caught.value.findings[0].file == str(path)
