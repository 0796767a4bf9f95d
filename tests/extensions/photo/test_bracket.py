"""Brackets as raw files: the light comes back with its error, and planted faults are found and named."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, shift
from scipy.optimize import brentq
from scipy.stats import norm

from devices.camera import CameraModel, Exposure
from documents import InputError
from extensions.photo import BracketOptions, BracketReport, NoiseModel, bracket_photographs, merge_exposures
from extensions.photo.noise import estimate_noise
from runner.cli.main import group
from stimuli.develop import DevelopOptions, read_camera_image
from stimuli.errors import StimulusError
from stimuli.pictures import RowFile, read_exr
from tests.extensions.photo.sensor import BLACK, FULL_E, READ_E, SPAN, TIMES, WHITE, bracket, codes, record, scene
from tests.kept import known
from tests.stimuli.develop.dng import camera_tags, exposure_tags, save_dng, save_linear_dng

# Brackets as raw files: the light comes back, and planted faults are found and named, and none where there is none.

SUPERPIXEL = DevelopOptions(demosaic="superpixel")
MATRIX = np.array([[60.0, 25.0, 15.0], [25.0, 80.0, 5.0], [1.0, 10.0, 120.0]])


def merge(folder: Path, photos: Sequence[Path], **options: Any) -> BracketReport:
    options.setdefault("develop", SUPERPIXEL)
    return bracket_photographs(photos, folder / "merged.exr", BracketOptions(**options))


def refusal(folder: Path, photos: Sequence[Path], **options: Any) -> str:
    before = sorted(folder.iterdir())
    with pytest.raises(InputError) as caught:
        merge(folder, photos, **options)
    (finding,) = caught.value.findings
    assert finding.remedy
    assert sorted(folder.iterdir()) == before, "nothing is written"
    return f"{Path(finding.file or '').name}: {finding.message}"


def halves(light: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return red, the mean of both greens, and blue of each 2 × 2 photosites."""
    return np.stack([light[::2, ::2], (light[::2, 1::2] + light[1::2, ::2]) / 2, light[1::2, 1::2]], axis=-1)


def test_the_light_of_the_scene_comes_back(tmp_path: Path) -> None:
    light = scene()
    report = merge(tmp_path, bracket(tmp_path, light)[::-1])
    image = read_camera_image(tmp_path / "merged.exr")
    assert known(image.exposure).time_s == pytest.approx(1 / 250, rel=0.002)
    truth = halves(light / 250)
    unsaturated = ~image.saturated
    off = (image.rgb / truth - 1)[unsaturated]
    # 1 % of noise in the median of these patches, over 9216 values
    assert abs(off.mean()) < 0.001
    median = np.mean([report.merge["relative_standard_error"][name]["median"] for name in ("red", "green", "blue")])
    assert 0.003 < median < 0.012
    assert report.merge["moved"] == []
    steps = [step["step"] for step in report.developed.steps]
    assert steps == ["read", "merge", "demosaic", "rotate", "exposure"] == [step["step"] for step in image.steps[:5]]
    noise = report.merge["noise"]["green"]
    assert noise["full_scale_electrons"] == pytest.approx(FULL_E, rel=0.05)
    assert noise["read_noise_electrons"] == pytest.approx(READ_E, rel=0.2)
    full = report.merge["saturated_everywhere"]
    assert sum(full.values()) == np.count_nonzero(codes(record(light, 1 / 250, seed=0)) == WHITE) > 0
    assert any("full at every exposure" in note for note in report.notes)


def test_with_a_camera_file_it_is_absolute_light_at_the_level_of_its_exposure(tmp_path: Path) -> None:
    """Shutters round their times: 1/15 is 1/16. The camera file was fitted at what the camera calls 1/15."""
    light = scene(stops=5) / 4
    times, actual = ((1, 125), (1, 30), (1, 15)), (1 / 128, 1 / 32, 1 / 16)
    photos = bracket(tmp_path, light, times, actual=actual)
    camera = CameraModel(MATRIX, np.zeros(3), np.zeros(3), Exposure(1 / 15, 8, 200), name="test")
    develop = DevelopOptions(demosaic="superpixel", camera=camera)
    report = merge(tmp_path, photos, develop=develop)
    truth = halves(light / 16) @ MATRIX.T
    xyz = read_exr(tmp_path / "merged.exr").left
    assert abs((xyz / truth - 1).mean()) < 0.002
    assert report.merge["reference"] == "1_15.dng"
    assert any("as the shutter's exact times" in note for note in report.notes)
    assert not any("light changed" in note for note in report.notes)
    ratios = [photo["measured_relative_exposure"] for photo in report.merge["photographs"]]
    np.testing.assert_allclose(ratios, [1, 4, 8], rtol=0.002)
    stated = merge(tmp_path, photos, develop=develop, ratios="stated")
    assert stated.merge["ratios"] == "stated"
    assert abs((read_exr(tmp_path / "merged.exr").left / truth - 1).mean()) > 0.01


def test_a_lamp_that_drifted_is_named_and_taken_out(tmp_path: Path) -> None:
    light = scene(stops=5) / 4
    times = TIMES[1:4]
    photos = bracket(tmp_path, [light, light, light * 1.08], times)
    report = merge(tmp_path, photos, reference=photos[0])
    (note,) = [note for note in report.notes if "light changed" in note]
    assert note.startswith("1_30.dng has 1.080 × the light")
    image = read_camera_image(tmp_path / "merged.exr")
    assert abs((image.rgb / halves(light / 125) - 1).mean()) < 0.002
    steady = merge(tmp_path, bracket(tmp_path / "steady", light, times))
    assert not any("light" in note for note in steady.notes)


def moving(light: NDArray[np.float64], at: tuple[int, int], size: int, factor: float) -> NDArray[np.float64]:
    other = light.copy()
    other[at[0] : at[0] + size, at[1] : at[1] + size] *= factor
    return other


@pytest.mark.parametrize(("size", "factor"), [(16, 0.8), (6, 4.0)])
def test_a_moved_object_is_found_and_its_place_named(tmp_path: Path, size: int, factor: float) -> None:
    light = scene(stops=5) / 4
    lights = [light, moving(light, (40, 64), size, factor), light]
    said = refusal(tmp_path, bracket(tmp_path, lights, TIMES[1:4]))
    assert "something moved between " in said
    assert "1_60.dng" in said  # it differs from the one before and from the one after
    x, y = (int(said.split(f"{axis} ")[1].split(",")[0].split(";")[0]) for axis in ("at x", "y"))
    assert abs(x - 64) <= 8
    assert abs(y - 40) <= 8


def test_the_reference_alone_counts_where_something_moved(tmp_path: Path) -> None:
    light = scene(stops=5) / 4
    lights = [light, moving(light, (40, 64), 16, 0.5), light]
    photos = bracket(tmp_path, lights, TIMES[1:4])
    report = merge(tmp_path, photos, ghosts="keep-reference", reference=photos[1])
    truth = halves(lights[1] / 125)
    off = read_camera_image(tmp_path / "merged.exr").rgb / truth - 1
    assert np.abs(off[20:28, 32:40]).mean() < 0.03
    assert abs(off.mean()) < 0.002
    assert report.merge["moved"][0]["x_px"] == 64
    assert any("the reference exposure alone" in note for note in report.notes)


def test_other_scenes_and_a_moved_camera_are_refused(tmp_path: Path) -> None:
    one, other = scene(stops=5) / 4, scene(stops=5, seed=9) / 4
    assert "another scene than 1_125.dng" in refusal(tmp_path, bracket(tmp_path, [one, other], TIMES[1:3]))
    far = np.roll(one, (30, 40), axis=(0, 1))
    assert "or the camera was moved" in refusal(tmp_path, bracket(tmp_path, [one, far], TIMES[1:3]))
    assert "× the light of 1_125.dng" in refusal(tmp_path, bracket(tmp_path, [one, one * 2], TIMES[1:3]))


@pytest.mark.parametrize(("right", "down"), [(0.5, 0.0), pytest.param(1.5, 1.0, marks=pytest.mark.nightly)])
def test_a_camera_that_moved_is_named_with_its_shift(tmp_path: Path, right: float, down: float) -> None:
    sharp = gaussian_filter(scene(192, 192, stops=5) / 4, 1.0)
    moved = shift(sharp, (down, right), order=3, mode="nearest").clip(1e-6)
    said = refusal(tmp_path, bracket(tmp_path, [sharp, moved], TIMES[1:3]))
    assert "the camera moved between 1_125.dng and it" in said
    found = [float(word) for word in re.findall(r"[+-][0-9.]+", said)]
    assert found == pytest.approx([right, down], abs=0.2)


def test_photographs_that_do_not_go_together_are_refused(tmp_path: Path) -> None:
    light = scene(48, 64, stops=5) / 4
    (one,) = bracket(tmp_path, light, TIMES[1:2], tags=camera_tags("Acme", "Mk I"))
    other = tmp_path / "other"
    assert "at ISO 400, and 1_125.dng at ISO 200" in refusal(
        tmp_path, [one, *bracket(other, light, TIMES[2:3], iso=400)]
    )
    assert "of a Acme Mk II" in refusal(
        tmp_path, [one, *bracket(other, light, TIMES[2:3], tags=camera_tags("Acme", "Mk II"))]
    )
    assert "it has 60 × 48 pixels" in refusal(tmp_path, [one, *bracket(other, light[:, :60], TIMES[2:3])])
    wide = save_dng(other / "wide.dng", codes(light / 60), tags=exposure_tags((1, 60), (4, 1), 200))
    assert "f/4, and 1_125.dng at f/8" in refusal(tmp_path, [one, wide])
    bare = save_dng(other / "bare.dng", codes(light / 60))
    assert "no exposure" in refusal(tmp_path, [one, bare])
    assert "two photographs or more" in refusal(tmp_path, [one])
    assert "named twice" in refusal(tmp_path, [one, one])
    given = (Exposure(1 / 8, 8, 200),)
    assert "1 exposures are given for 2" in refusal(tmp_path, [one, bare], exposures=given)
    assert "none of the photographs" in refusal(tmp_path, [one, bare], reference=tmp_path / "no.dng")


def test_the_steps_are_written_and_equal_brackets_make_equal_files(tmp_path: Path) -> None:
    photos = bracket(tmp_path, scene(48, 64, stops=5) / 4, TIMES[1:4])
    merge(tmp_path, photos)
    first = (tmp_path / "merged.exr").read_bytes()
    steps = json.loads((tmp_path / "merged.steps.json").read_text(encoding="utf-8"))
    assert [photo["file"] for photo in steps["steps"][1]["photographs"]] == [photo.name for photo in photos]
    merge(tmp_path, photos)
    assert (tmp_path / "merged.exr").read_bytes() == first


def test_a_bracket_full_throughout_and_a_full_disk_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    photos = bracket(tmp_path, np.full((32, 32), 1e4), TIMES[1:3])
    assert "full at every exposure" in refusal(tmp_path, photos)

    def no_room(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(RowFile, "write", no_room)
    with pytest.raises(InputError, match=r"disk of the folder .* is full"):
        merge(tmp_path, photos)


def test_a_lamp_that_changed_colour_is_named(tmp_path: Path) -> None:
    light = scene(stops=5) / 4
    redder = light.copy()
    redder[::2, ::2] *= 1.06
    report = merge(tmp_path, bracket(tmp_path, [light, light, redder], TIMES[1:4]))
    assert any("1_30.dng: the light's colour changed" in note for note in report.notes)


def test_the_place_is_named_in_the_upright_picture(tmp_path: Path) -> None:
    light = scene(stops=5) / 4
    lights = [light, moving(light, (0, 0), 16, 0.5), light]
    photos = bracket(tmp_path, lights, TIMES[1:4], tags=[(274, "H", 1, 6, True)])
    said = refusal(tmp_path, photos)
    assert "16 × 16 pixels at x 80, y 0" in said  # turned clockwise: 96 across


def test_hot_photosites_are_no_motion(tmp_path: Path) -> None:
    light = scene(stops=5) / 4
    hot = np.random.default_rng(0).random(light.shape) < 0.002
    lights = [light + 40 * hot * time[1] / 250 for time in TIMES[1:4]]  # not in proportion to time
    assert merge(tmp_path, bracket(tmp_path, lights, TIMES[1:4])).merge["moved"] == []


def test_a_tripod_that_gives_by_a_fifth_of_a_pixel_is_let_pass(tmp_path: Path) -> None:
    sharp = gaussian_filter(scene(192, 192, stops=5) / 4, 0.8)
    moved = shift(sharp, (0.1, 0.2), order=3, mode="nearest").clip(1e-6)
    assert merge(tmp_path, bracket(tmp_path, [sharp, moved], TIMES[1:3])).merge["moved"] == []


def test_given_exposures_take_the_place_of_the_files(tmp_path: Path) -> None:
    light = scene(48, 64, stops=5) / 4
    photos = [
        save_dng(tmp_path / f"{time[1]}.dng", codes(record(light, 1 / time[1], seed)), black=(BLACK,), white=WHITE)
        for seed, time in enumerate(TIMES[1:4])
    ]
    exposures = tuple(Exposure(1 / time[1], 8, 200) for time in TIMES[1:4])
    report = merge(tmp_path, photos, exposures=exposures, noise=NoiseModel.of_electrons(FULL_E, READ_E))
    assert report.merge["noise"]["source"] == "given"
    assert abs((read_camera_image(tmp_path / "merged.exr").rgb / halves(light / 125) - 1).mean()) < 0.003


def test_dark_frames_and_flat_fields_of_a_bracket(tmp_path: Path) -> None:
    light = scene(stops=5) / 4
    rows, columns = np.mgrid[-1 : 1 : light.shape[0] * 1j, -1 : 1 : light.shape[1] * 1j]
    vignette = 1 - 0.3 * (rows**2 + columns**2)
    pattern = np.random.default_rng(4).normal(0, 8, light.shape) / SPAN

    def saved(name: str, values: NDArray[np.float64], time: tuple[int, int] = (1, 60)) -> Path:
        tags = exposure_tags(time, (8, 1), 200)
        return save_dng(tmp_path / name, codes(values + pattern), black=(BLACK,), white=WHITE, tags=tags)

    photos = [
        saved(f"{time[1]}.dng", record(light * vignette, 1 / time[1], seed), time)
        for seed, time in enumerate(TIMES[1:4])
    ]
    darks = tuple(
        saved(f"d{i}.dng", np.random.default_rng(i).normal(0, READ_E / FULL_E, light.shape)) for i in range(8)
    )
    flat = saved("flat.dng", 0.6 * vignette)
    develop = DevelopOptions(demosaic="superpixel", dark=darks, flat=(flat,))
    report = merge(tmp_path, photos, develop=develop)
    truth = halves(light / 125) * vignette[38:58, 51:77].mean()
    off = read_camera_image(tmp_path / "merged.exr").rgb / truth - 1
    assert abs(off.mean()) < 0.002
    assert np.abs(off).mean() < 0.02
    assert report.merge["noise"]["source"] == "photographs and dark frames"
    assert report.merge["noise"]["red"]["read_noise_electrons"] == pytest.approx(READ_E, rel=0.05)
    full = DevelopOptions(demosaic="superpixel", flat=(saved("bright.dng", 2 * vignette),))
    assert "bright.dng: the flat field is saturated" in refusal(tmp_path, photos, develop=full)


def test_a_bracket_of_linear_dng(tmp_path: Path) -> None:
    light = scene(48, 64, stops=5)[..., None] / 4 * np.array([1.0, 0.8, 0.5])
    photos = [
        save_linear_dng(
            tmp_path / f"{time[1]}.dng",
            codes(record(light, 1 / time[1], seed)),
            black=(BLACK,) * 3,
            white=WHITE,
            tags=exposure_tags(time, (8, 1), 200),
        )
        for seed, time in enumerate(TIMES[1:4])
    ]
    report = merge(tmp_path, photos)
    assert abs((read_camera_image(tmp_path / "merged.exr").rgb / (light / 125) - 1).mean()) < 0.002
    assert report.merge["noise"]["blue"]["full_scale_electrons"] == pytest.approx(FULL_E, rel=0.15)


# The merged light is unbiased, its variance is the Cramér-Rao bound, and the standard error says so.

NOISE = NoiseModel.of_electrons(FULL_E, READ_E)
T = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0]
MANY = 40_000


def rms(values: np.ndarray, light: float) -> float:
    return float(np.sqrt(((values - light) ** 2).mean()))


def taken(light: float, t: list[float] = T, many: int = MANY) -> tuple[list[np.ndarray], list[np.ndarray]]:
    values = [record(np.full(many, light), time, seed=number) for number, time in enumerate(t)]
    clipped = [np.minimum(value, 1.0) for value in values]
    return clipped, [value >= 1.0 for value in values]


def bound(light: float, t: list[float] = T) -> float:
    """The Cramér-Rao bound on the standard deviation, of the exposures that the light does not fill."""
    clear = [time for time in t if light * time + 4.5 * np.sqrt(light * time / FULL_E) < 1]
    return float(1 / np.sqrt(sum(time**2 / (light * time / FULL_E + (READ_E / FULL_E) ** 2) for time in clear)))


@pytest.mark.parametrize("light", [0.0005, 0.02, 0.12, 0.8])
def test_the_variance_is_the_cramer_rao_bound_and_there_is_no_bias(light: float) -> None:
    merged = merge_exposures(*taken(light), T, NOISE)
    limit = bound(light)
    # of 40000 values the mean has a standard error of 1/200, a standard deviation one of 1/283: four of each
    assert abs(merged.value.mean() - light) < 4 * limit / np.sqrt(MANY)
    assert merged.value.std() == pytest.approx(limit, rel=4 / np.sqrt(2 * MANY))
    assert np.sqrt((merged.standard_error**2).mean()) == pytest.approx(limit, rel=0.01)
    assert not merged.saturated.any()


@pytest.mark.parametrize("light", [0.002, 0.0623, 0.5])
def test_the_iteration_is_the_solution_of_the_likelihood_equation(light: float) -> None:
    """The slow twin finds its root for each value by bisection, full exposures censored."""
    values, full = taken(light, T[:5], many=20)
    merged = merge_exposures(values, full, T[:5], NOISE)

    def slope(x: float, number: int) -> float:
        total = 0.0
        for time, value, is_full in zip(T[:5], values, full, strict=True):
            deviation = np.sqrt(max(x, 0.0) * time / FULL_E + (READ_E / FULL_E) ** 2)
            if is_full[number]:
                z = (time * x - 1) / deviation
                total += time / deviation * np.exp(norm.logpdf(z) - norm.logcdf(z))
            else:
                total += time * (value[number] - time * x) / deviation**2
        return float(total)

    exact = np.array([brentq(slope, 1e-3, 1.2, args=(number,), xtol=1e-14) for number in range(20)])
    np.testing.assert_allclose(merged.value, exact, atol=1e-3 * float(merged.standard_error.mean()))


def test_photon_noise_alone_needs_no_gain() -> None:
    values, full = taken(0.01)
    plain = sum(values) / sum(T)
    np.testing.assert_allclose(merge_exposures(values, full, T).value, plain, rtol=1e-12)
    np.testing.assert_allclose(merge_exposures(values, full, T, NoiseModel(1e-4, 0)).value, plain, rtol=1e-12)
    assert np.isnan(merge_exposures(values, full, T).standard_error).all()


def test_what_is_full_at_every_exposure_is_a_lower_bound() -> None:
    merged = merge_exposures([[0.97, 0.1], [1.0, 0.4]], [[True, False], [True, False]], [1, 4], NOISE)
    assert merged.saturated.tolist() == [True, False]
    assert merged.value[0] == 0.97
    assert merged.exposures.tolist() == [0, 2]


def test_one_exposure_alone() -> None:
    values = [[0.1, 0.1, 0.1], [0.5, 0.4, 1.0], [0.9, 1.0, 1.0]]
    full = [[False] * 3, [False, False, True], [False, True, True]]
    merged = merge_exposures(values, full, [1, 4, 8], NOISE, alone=[True, False, True], reference=1)
    assert merged.value[0] == pytest.approx(0.125)
    assert merged.value[2] == pytest.approx(0.1)
    assert merged.exposures.tolist() == [1, 2, 1]


@pytest.mark.parametrize(
    ("values", "t"), [([[0.1], [0.1, 0.2]], [1, 2]), ([[0.1], [0.2]], [1]), ([[0.1], [0.2]], [2, 1]), ([], [])]
)
def test_what_does_not_go_together_is_refused(values: list[list[float]], t: list[float]) -> None:
    with pytest.raises(StimulusError):
        merge_exposures(values, [np.zeros(len(part), bool) for part in values], t)


@pytest.mark.nightly
def test_noise_is_found_in_the_photographs() -> None:
    rng = np.random.default_rng(1)
    light = np.exp(rng.uniform(np.log(1e-4), 0, 200_000))
    values = [np.rint(14920 * record(light, time, seed=number)) / 14920 for number, time in enumerate(T)]
    full = [value >= 1 for value in values]
    noise = known(estimate_noise(values, full, T))
    assert 1 / noise.gain == pytest.approx(FULL_E, rel=0.02)
    coded = np.sqrt(READ_E**2 + (FULL_E / 14920) ** 2 / 12)  # whole codes add to the read noise
    assert noise.read / noise.gain == pytest.approx(coded, rel=0.05)
    given = known(estimate_noise(values, full, T, read=float(coded) / FULL_E))
    assert 1 / given.gain == pytest.approx(FULL_E, rel=0.02)
    assert given.read == pytest.approx(coded / FULL_E)
    assert estimate_noise([value[:100] for value in values], [part[:100] for part in full], T) is None
    still = [light * time for time in T]
    assert estimate_noise(still, [value >= 1 for value in still], T) == NoiseModel(0.0, 0.0)


@pytest.mark.parametrize("numbers", [(0, 3), (-1, 3), (30000, -1), (np.nan, 3), (30000, np.inf)])
def test_noise_that_cannot_be(numbers: tuple[float, float]) -> None:
    with pytest.raises(StimulusError):
        NoiseModel.of_electrons(*numbers)


@pytest.mark.parametrize("light", np.geomspace(0.24, 0.26, 9))
def test_an_exposure_that_is_nearly_full_helps_and_hardly_biases(light: float) -> None:
    """A quarter fills the exposure of 4. One censored value leaves a bias of at most a third of the standard error."""
    values, full = taken(float(light), [1.0, 4.0])
    ours, alone = merge_exposures(values, full, [1.0, 4.0], NOISE).value, values[0]
    assert rms(ours, light) < 1.01 * rms(alone, light)
    # beside the third, four standard errors of the mean of 40000
    assert abs(ours.mean() - light) < (0.33 + 4 / np.sqrt(MANY)) * ours.std()


# The command.


def typed(folder: Path, *words: str, output: str = "merged.exr") -> Result:
    photographs = bracket(folder, scene(48, 64, stops=5) / 4, TIMES[1:4])
    words = ("camera", "bracket", *map(str, photographs), "-o", str(folder / output), *words)
    return CliRunner().invoke(group, words)


def test_a_bracket_is_merged(tmp_path: Path) -> None:
    result = typed(tmp_path, "--demosaic", "superpixel")
    assert result.exit_code == 0, result.output
    lines = result.stdout.splitlines()
    assert lines[0].strip() == "Exposures beside the shortest"
    assert lines[2].split() == ["1_125.dng", "1/125", "s", "1", "1"]
    assert lines[3].split()[:4] == ["1_60.dng", "1/60", "s", "2.083"]
    assert lines[-1] == "Written: merged.exr, 32×24"
    assert any(line.startswith("Noise in green: ") for line in lines)


def test_json_holds_every_step(tmp_path: Path) -> None:
    facts = json.loads(typed(tmp_path, "--json", "--noise", "30000,6").stdout)
    assert facts["holds"] == "camera RGB"
    (step,) = [step for step in facts["steps"] if step["step"] == "merge"]
    assert step["noise"]["red"]["full_scale_electrons"] == pytest.approx(30000)
    assert read_camera_image(tmp_path / "merged.exr").rgb.shape == (48, 64, 3)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--noise", "3"], "the noise is '3'"),
        (["--exposure", "1/8,8,200"], "1 exposures are given for 3 photographs"),
        (["--dark", "no/such/frame.dng"], "there is no such file"),
    ],
)
def test_wrong_options_are_refused(tmp_path: Path, words: list[str], message: str) -> None:
    result = typed(tmp_path, *words)
    said = str(result.exception) if isinstance(result.exception, InputError) else result.output
    assert result.exit_code != 0
    assert message in said
    assert not (tmp_path / "merged.exr").exists()


def test_the_output_is_an_exr_file(tmp_path: Path) -> None:
    result = typed(tmp_path, output="merged.png")
    assert isinstance(result.exception, InputError)
    assert "no .exr file" in str(result.exception)
