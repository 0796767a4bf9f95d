"""Brackets at their edges: many kinds of sensor and scene, planted motion at every place, and 36 megapixels."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from documents import InputError
from stimuli.bracket import BracketOptions, NoiseModel, bracket_photographs, merge_exposures
from stimuli.develop import DevelopOptions
from tests.stimuli.bracket.sensor import BLACK, TIMES, WHITE, codes, record, scene
from tests.stimuli.develop.dng import exposure_tags, save_dng
from tests.stress.memory import run_alone

pytestmark = pytest.mark.stress


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
    for number, time in enumerate(TIMES):
        rng = np.random.default_rng(number)
        values = light * (time[0] / time[1])
        values += rng.normal(0, 1, values.shape) * np.sqrt(values / 30000 + 4e-8)
        save_dng(
            tmp_path / f"{number}.dng",
            codes(values),
            black=(BLACK,),
            white=WHITE,
            tags=exposure_tags(time, (8, 1), 200),
        )
    photos = [str(tmp_path / f"{number}.dng") for number in range(len(TIMES))]
    program = (
        "import sys, time; from pathlib import Path; from devices.camera import read_camera;"
        "from stimuli.bracket import BracketOptions, bracket_photographs; from stimuli.develop import DevelopOptions;"
        "start = time.perf_counter(); camera = read_camera('configs/cameras/nikon_d800.yaml');"
        "options = BracketOptions(develop=DevelopOptions(camera=camera));"
        f"bracket_photographs([Path(p) for p in sys.argv[1:]], Path({str(tmp_path / 'a.exr')!r}), options);"
        "peak = int(open('/proc/self/status').read().split('VmHWM:')[1].split()[0]);"
        "print(peak / 1e6, time.perf_counter() - start)"
    )
    assert float(run_alone(program, *photos).split()[0]) < 1.5
