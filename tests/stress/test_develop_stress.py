"""Camera files and spectral pictures at their edges: linear light comes back, or one clear finding."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from stimuli.develop import Demosaic, Levels, read_camera_image
from stimuli.develop.raw_files import DEMOSAICS
from stimuli.errors import StimulusError
from stimuli.spectral import read_spectral
from stimuli.spectral.convert import spectral_to_xyz
from tests.stimuli.develop.dng import exposure_tags, save_dng, smooth, write_dng
from tests.stimuli.spectral.pictures import WAVES, bumps, save_envi, save_exr
from tests.stress.memory import run_alone

pytestmark = pytest.mark.stress


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


@pytest.mark.parametrize("orientation", [1, 6])
def test_thirty_six_megapixels_become_xyz_in_a_gigabyte_and_a_half(tmp_path: Path, orientation: int) -> None:
    """A raw file of 36 megapixels to an OpenEXR of XYZ, turned upright too: the peak of a program by itself."""
    path = tmp_path / "large.dng"
    codes = np.random.default_rng(0).integers(590, 15600, (4912, 7360), dtype=np.uint16)
    tags = [(274, "H", 1, orientation, True), *exposure_tags((1, 15), (8, 1), 800)]
    save_dng(path, codes, black=(600,), white=15520, tags=tags)
    program = (
        "from pathlib import Path; from devices.camera import read_camera;"
        "from stimuli.develop import DevelopOptions, develop_photographs;"
        f"from tests.stress.memory import peak_kb; camera = read_camera('configs/cameras/nikon_d800.yaml');"
        f"develop_photographs([Path({str(path)!r})], Path({str(tmp_path / 'a.exr')!r}), DevelopOptions(camera=camera));"
        "print(peak_kb() / 1e6)"
    )
    assert float(run_alone(program)) < 1.5


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
