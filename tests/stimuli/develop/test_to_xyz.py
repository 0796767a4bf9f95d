"""Camera RGB to XYZ: for which observer, with which dark frames and flat fields."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.typing import NDArray

from devices.camera import CameraModel, Exposure, read_camera, read_reference, write_camera
from devices.errors import DeviceError
from devices.readings import xyz_from_spectra
from documents import InputError
from extensions.photo import ChartOptions, fit_camera_to_chart
from runner.cli.main import group
from stimuli.build import build_set
from stimuli.develop import (
    CameraImage,
    DevelopOptions,
    clipped_variance,
    read_calibration,
    read_camera_image,
    to_xyz,
    write_camera_exr,
)
from stimuli.develop.photograph import develop_photograph
from stimuli.errors import StimulusError
from stimuli.pictures import read_exr
from tests.stimuli.develop.dng import Tag, camera_tags, exposure_tags, save_dng, save_linear_dng

MATRIX = np.array([[60.0, 25.0, 15.0], [25.0, 80.0, -5.0], [1.0, -10.0, 120.0]])
FITTED = Exposure(1 / 15, 8.0, 200.0)


def camera(form: str = "linear", **changes: object) -> CameraModel:
    options: dict[str, object] = {"exposure": FITTED, "safe_luminance_cd_m2": (9.41, 120.8), "name": "test", **changes}
    offset = np.array([0.1, 0.2, 0.3]) if form == "affine" else np.zeros(3)
    return CameraModel(MATRIX, offset, np.zeros(3), form=form, **options)  # type: ignore[arg-type]  # keywords by name


def picture(rgb: NDArray[np.floating], exposure: Exposure | None = FITTED) -> CameraImage:
    values = np.asarray(rgb, np.float32)
    return CameraImage(values, values >= 1, exposure, "photo.nef", ({"step": "read"},))


def test_known_light_comes_back_at_any_exposure() -> None:
    """The signal of a linear camera grows with time, ISO and aperture; the XYZ found stays the same."""
    rng = np.random.default_rng(0)
    light = rng.uniform(0.05, 0.2, (20, 30, 3))
    truth = light @ MATRIX.T
    for exposure in (FITTED, Exposure(4 / 15, 8.0, 200.0), Exposure(1 / 15, 4.0, 200.0), Exposure(1 / 15, 8.0, 800.0)):
        signal = light * exposure.relative_to(FITTED)
        found = to_xyz(picture(signal, exposure), camera())
        np.testing.assert_allclose(found.xyz, truth, rtol=2e-6, atol=1e-5)
        assert found.xyz.dtype == np.float32


def test_the_safe_zone_moves_with_the_exposure() -> None:
    grey = np.linspace(0.01, 0.999, 200)
    rgb = np.repeat(grey[None, :, None], 3, axis=2)
    found = to_xyz(picture(rgb), camera())
    luminance = grey * MATRIX[1].sum()
    assert found.below_safe == int((luminance < 9.41).sum()) > 0
    assert found.above_safe == 0
    double = to_xyz(picture(rgb, Exposure(2 / 15, 8.0, 200.0)), camera())
    assert double.below_safe == found.below_safe, "the same signal, half the light, half the zone"
    assert double.safe_cd_m2 == pytest.approx((9.41 / 2, 60.4))
    bright = to_xyz(picture(rgb * 1.5), camera())
    assert bright.above_safe == int((1.5 * luminance > 120.8).sum()) > 0
    none = to_xyz(picture(rgb), camera(safe_luminance_cd_m2=None))
    assert (none.below_safe, none.above_safe, none.safe_cd_m2) == (0, 0, None)


def test_what_falls_below_0_is_counted_or_refused() -> None:
    rgb = np.full((4, 5, 3), 0.2)
    rgb[1, 2] = (-0.01, -0.01, -0.01)
    rgb[2, 3] = (0.0, 0.5, 0.0)  # beyond the camera's gamut: Z is below 0
    found = to_xyz(picture(rgb), camera())
    assert found.clipped == 2
    assert found.lowest == pytest.approx(-5.0)
    assert found.xyz.min() == 0.0
    assert found.steps[-1]["negative_pixels_set_to_0"] == 2
    with pytest.raises(StimulusError, match="2 pixels have negative XYZ"):
        to_xyz(picture(rgb), camera(), negative="refuse")


def test_full_photosites_are_marked() -> None:
    rgb = np.full((4, 5, 3), 0.2)
    rgb[1, 2, 0] = rgb[3, 3, 2] = 1.0
    found = to_xyz(picture(rgb), camera())
    assert {tuple(place) for place in np.argwhere(found.saturated).tolist()} == {(1, 2), (3, 3)}
    assert found.steps[-1]["saturated_pixels"] == 2
    assert found.steps[0] == {"step": "read"}


def test_an_exposure_that_nobody_tells_is_refused() -> None:
    with pytest.raises(StimulusError, match=r"photo\.nef: .* no exposure"):
        to_xyz(picture(np.full((2, 2, 3), 0.2), None), camera())
    unknown = camera(exposure=None)
    assert to_xyz(picture(np.full((2, 2, 3), 0.2), None), unknown).xyz.shape == (2, 2, 3)


def test_an_affine_model_serves_its_own_exposure_alone() -> None:
    rgb = np.full((2, 2, 3), 0.2)
    assert to_xyz(picture(rgb), camera("affine")).xyz[0, 0, 1] == pytest.approx(20.2, rel=1e-6)
    with pytest.raises(DeviceError, match="affine"):
        to_xyz(picture(rgb, Exposure(1.0, 8.0, 200.0)), camera("affine"))


# A camera file names the observer of its XYZ; what is developed by it is of that observer, and never mixed.

TEN = "CIE 2015 10"
ROOT = Path(__file__).parents[3]
OBSERVER_MATRIX = np.array([[41.0, 36.0, 18.0], [21.0, 72.0, 7.0], [2.0, 12.0, 95.0]])
WAVES = np.arange(380.0, 781.0, 5.0)


def _camera(path: Path, observer: str = TEN) -> Path:
    write_camera(CameraModel(OBSERVER_MATRIX, np.zeros(3), np.zeros(3), observer=observer), path)
    return path


def _photo(path: Path) -> Path:
    rgb = np.random.default_rng(3).uniform(0.1, 0.4, (180, 240, 3)).astype(np.float32)
    write_camera_exr(path, CameraImage(rgb, rgb >= 1, None, path.name, ()))
    return path


def _chart() -> tuple[np.ndarray, np.ndarray]:
    """Return camera RGB (24, 3) and spectra (24, 81) of patches, each a mixture of three lights."""
    bases = np.exp(-0.5 * ((WAVES - np.array([[620.0], [530.0], [460.0]])) / 50.0) ** 2)
    spectra = np.random.default_rng(5).uniform(0.001, 0.01, (24, 3)) @ bases
    sensor = np.exp(-0.5 * ((WAVES[:, None] - [600.0, 540.0, 450.0]) / 35.0) ** 2)
    rgb = spectra @ sensor
    return 0.9 * rgb / rgb.max(), spectra


def _table(path: Path, observer: str) -> Path:
    rgb, spectra = _chart()
    table = np.hstack([rgb, xyz_from_spectra(spectra, WAVES, observer)])
    np.savetxt(path, table, delimiter=",", header="R,G,B,X,Y,Z", comments="")
    return path


def test_a_camera_file_keeps_its_observer_and_says_nothing_of_1931(tmp_path: Path) -> None:
    assert read_camera(_camera(tmp_path / "ten.yaml")).observer == TEN
    assert read_camera(ROOT / "configs/cameras/nikon_d800.yaml").observer == "CIE 1931 2"
    assert "observer" not in _camera(tmp_path / "plain.yaml", "CIE 1931 2").read_text()
    text = (tmp_path / "ten.yaml").read_text()
    (tmp_path / "aged.yaml").write_text(text.replace(TEN, "{kind: cie2006, age_years: 45, field_deg: 4}"))
    assert read_camera(tmp_path / "aged.yaml").observer == "CIE 2006 4 age 45"
    (tmp_path / "none.yaml").write_text(text.replace(TEN, "me"))
    with pytest.raises(InputError, match=r"'observer' is 'me' \(write CIE 1931 2, CIE 1964 10, ") as caught:
        read_camera(tmp_path / "none.yaml")
    assert len(caught.value.findings) == 1


def test_a_developed_photograph_declares_the_observer_of_its_camera_file(tmp_path: Path) -> None:
    photo, camera = _photo(tmp_path / "p.exr"), read_camera(_camera(tmp_path / "c.yaml"))
    developed = develop_photograph(photo, tmp_path / "out.exr", DevelopOptions(camera=camera))
    assert developed.steps[-1]["observer"] == TEN
    rgb = np.random.default_rng(3).uniform(0.1, 0.4, (180, 240, 3))
    np.testing.assert_allclose(read_exr(tmp_path / "out.exr", observer=TEN).left, rgb @ OBSERVER_MATRIX.T, rtol=2e-3)
    with pytest.raises(InputError, match="CIE 2015 10; CIE 1931 2 is wanted"):
        read_exr(tmp_path / "out.exr")
    plain = read_camera(_camera(tmp_path / "d.yaml", "CIE 1931 2"))
    assert "observer" not in develop_photograph(photo, tmp_path / "o.exr", DevelopOptions(camera=plain)).steps[-1]


def _recipe(folder: Path, line: str) -> Path:
    _photo(folder / "p.exr")
    stimuli = "camera: c.yaml\nstimuli: [{name: a, center: p.exr, flat_eye: null}]\n"
    recipe = folder / "recipe.yaml"
    recipe.write_text(f"schema_version: 1\nkind: photographs\nviews: [flat]\n{line}{stimuli}")
    return recipe


@pytest.mark.parametrize(("camera", "line"), [(TEN, ""), ("CIE 1931 2", f"observer: {TEN}\n")])
def test_a_recipe_refuses_a_camera_file_of_another_observer(tmp_path: Path, camera: str, line: str) -> None:
    _camera(tmp_path / "c.yaml", camera)
    recipe = _recipe(tmp_path, line)
    with pytest.raises(InputError, match=rf"c.yaml: .*{camera}, ") as caught:
        build_set(recipe, 0.2768)
    assert len(caught.value.findings) == 1
    result = CliRunner().invoke(group, ["check", str(recipe)])
    assert result.exit_code == 2
    assert f"observer {camera}" in " ".join(result.output.split())


def test_a_table_that_names_its_observer_is_taken_at_its_word(tmp_path: Path) -> None:
    plain, ten = _table(tmp_path / "plain.csv", "CIE 1931 2"), _table(tmp_path / "chart.csv", TEN)
    ten.write_text("# observer: 2012_10\n" + ten.read_text())
    assert fit_camera_to_chart(ten).fit.model.observer == TEN
    assert fit_camera_to_chart(ten, ChartOptions(observer=TEN)).fit.model.observer == TEN
    assert fit_camera_to_chart(plain).fit.model.observer == "CIE 1931 2"
    with pytest.raises(InputError, match=r"chart.csv: .* CIE 2015 10; CIE 1931 2") as caught:
        fit_camera_to_chart(ten, ChartOptions(observer="CIE 1931 2"))
    assert len(caught.value.findings) == 1
    assert read_reference(ten).observer == TEN
    with pytest.raises(InputError, match="CIE 1964 10 is wanted"):
        fit_camera_to_chart(_photo(tmp_path / "p.exr"), ChartOptions(reference=(ten,), observer="1964_10"))
    ten.write_text(ten.read_text().replace("2012_10", "me"))
    with pytest.raises(InputError, match=r"chart.csv:1: .*'me'"):
        fit_camera_to_chart(ten)


def test_published_chart_colours_are_of_1931_alone(tmp_path: Path) -> None:
    photo = _photo(tmp_path / "chart.exr")
    words = ["camera", "fit", str(photo), "--white", "90,100,80", "--observer", TEN]
    result = CliRunner().invoke(group, words)
    assert isinstance(result.exception, InputError)
    assert "the chart's published colours are for CIE 1931 2" in str(result.exception)


def test_a_recipe_of_photographs_is_of_its_camera_files_observer(tmp_path: Path) -> None:
    _camera(tmp_path / "c.yaml")
    built = build_set(_recipe(tmp_path, f"observer: {TEN}\n"), 0.2768)
    assert read_exr(built.path(built.names[0]), observer=TEN).left.shape == (180, 240, 3)
    first = built.manifest["stimuli"][0]["key"]
    _camera(tmp_path / "c.yaml", "CIE 1931 2")
    assert build_set(_recipe(tmp_path, ""), 0.2768).manifest["stimuli"][0]["key"] != first


def test_camera_rgb_of_a_spectral_picture_takes_no_observer(tmp_path: Path) -> None:
    words = ["camera", "spectral", "p.exr", "-o", str(tmp_path / "o.exr"), "--sensitivities", "s.csv"]
    result = CliRunner().invoke(group, [*words, "--full-scale", "100", "--observer", TEN])
    assert isinstance(result.exception, InputError)
    assert "--observer" in str(result.exception)


# Dark frames and flat fields: what is planted comes out again, and what does not go together is refused.

HEIGHT, WIDTH, BLACK, WHITE = 60, 80, 512, 15872
SPAN = WHITE - BLACK
AT = exposure_tags((1, 8), (8, 1), 200)


def codes(light: NDArray[np.float64], pattern: NDArray[np.float64] | float = 0.0) -> NDArray[np.uint16]:
    return np.clip(np.rint(BLACK + pattern + light * SPAN), 0, 65535).astype(np.uint16)


def save(path: Path, values: NDArray[np.uint16], tags: list[Tag] | None = None) -> Path:
    return save_dng(path, values, black=(BLACK,), white=WHITE, tags=AT if tags is None else tags)


def vignette() -> NDArray[np.float64]:
    rows, columns = np.mgrid[-1 : 1 : HEIGHT * 1j, -1 : 1 : WIDTH * 1j]
    return np.asarray(1 - 0.3 * (rows**2 + columns**2))


def fixed_pattern() -> NDArray[np.float64]:
    return np.random.default_rng(3).normal(20, 6, (HEIGHT, WIDTH))


def test_dark_and_flat_are_undone(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    scene = np.kron(rng.uniform(0.2, 0.5, (6, 8)), np.ones((10, 10)))
    photo = save(tmp_path / "photo.dng", codes(scene * vignette(), fixed_pattern()))
    darks = [save(tmp_path / f"d{i}.dng", codes(np.zeros((HEIGHT, WIDTH)), fixed_pattern())) for i in range(2)]
    flats = [save(tmp_path / f"f{i}.dng", codes(0.6 * vignette(), fixed_pattern())) for i in range(2)]
    calibration = read_calibration(darks, flats)
    image = read_camera_image(photo, demosaic="superpixel", calibration=calibration)
    # of photosites whose four are in one square of the scene; the centre of the flat field is 1 by definition
    truth = scene[::2, ::2, None] * np.mean(vignette()[24:36, 32:48])
    assert np.abs(image.rgb / truth - 1).max() < 2e-3
    plain = read_camera_image(photo, demosaic="superpixel")
    assert np.abs(plain.rgb / truth - 1).max() > 0.3
    assert [step["step"] for step in image.steps] == [
        "read",
        "linearise",
        "dark",
        "flat",
        "demosaic",
        "rotate",
        "exposure",
    ]


def test_frames_are_averaged_and_their_noise_is_found(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    folder = tmp_path / "darks"
    folder.mkdir()
    zero = np.zeros((HEIGHT, WIDTH))
    for number in range(16):
        save(folder / f"{number}.dng", codes(zero, fixed_pattern() + rng.normal(0, 4, zero.shape)))
    dark = read_calibration([folder]).dark
    assert dark is not None
    assert len(dark) == 16
    off = dark.mean * SPAN - fixed_pattern()
    assert off.std() == pytest.approx(np.sqrt(4**2 + 1 / 12) / 4, rel=0.05)  # the mean of 16, with the codes' rounding
    # 15 differences of 1200 photosites a colour, each with its neighbour: 1.5 % is two standard errors
    np.testing.assert_allclose(dark.noise * SPAN, np.sqrt(4**2 + 1 / 12), rtol=0.02)


@pytest.mark.parametrize("spread", [0.3, 0.7, 3.0, 50.0])
def test_the_clipped_variance_is_that_of_normal_noise(spread: float) -> None:
    """Of whole codes too, and with a hundredth of outliers."""
    rng = np.random.default_rng(2)
    values = np.rint(rng.normal(0.37, spread, 200_000))
    truth = spread**2 + 1 / 12 if spread > 0.5 else values.var()
    assert clipped_variance(values) == pytest.approx(truth, rel=0.02)
    values[::200] += 100 * spread
    assert clipped_variance(values) == pytest.approx(truth, rel=0.04)
    assert clipped_variance(np.ones(50)) == 0


def refused(tmp_path: Path, kind: str, frame: Path) -> str:
    photo = save(tmp_path / "photo.dng", codes(np.full((HEIGHT, WIDTH), 0.3)), [*AT, *camera_tags("Acme", "Mk I")])
    with pytest.raises(StimulusError) as caught:
        read_camera_image(photo, calibration=read_calibration(**{kind: [frame]}))  # type: ignore[arg-type]
    (finding,) = caught.value.findings
    assert finding.file == str(frame)
    assert finding.remedy
    return finding.message


@pytest.mark.parametrize(
    ("tags", "kind", "words"),
    [
        (exposure_tags((1, 8), (8, 1), 400), "dark", "ISO 400, and photo.dng at ISO 200"),
        (exposure_tags((4, 1), (8, 1), 200), "dark", "taken at 4 s"),
        (exposure_tags((1, 8), (4, 1), 200), "flat", "f/4, and photo.dng at f/8"),
        ([*AT, *camera_tags("Acme", "Mk II")], "flat", "of a Acme Mk II"),
        ([*AT, *camera_tags("Acme", "Mk II")], "dark", "of a Acme Mk II"),
    ],
)
def test_frames_of_other_settings_are_refused(tmp_path: Path, tags: list[Tag], kind: str, words: str) -> None:
    light = np.full((HEIGHT, WIDTH), 0.5 if kind == "flat" else 0.0)
    assert words in refused(tmp_path, kind, save(tmp_path / "frame.dng", codes(light), tags))


def test_frames_that_cannot_be_are_refused(tmp_path: Path) -> None:
    even = np.full((HEIGHT, WIDTH), 0.5)
    assert "brighter than photo.dng" in refused(tmp_path, "dark", save(tmp_path / "a.dng", codes(even)))
    assert "saturated at" in refused(tmp_path, "flat", save(tmp_path / "b.dng", codes(even * 2.1)))
    half = even * (np.arange(WIDTH) > 8)
    assert "dark at" in refused(tmp_path, "flat", save(tmp_path / "c.dng", codes(half)))
    assert "60 × 60 photosites" in refused(tmp_path, "dark", save(tmp_path / "d.dng", codes(even[:, :60] * 0)))
    assert "pixels of R, G and B" in refused(
        tmp_path, "flat", save_linear_dng(tmp_path / "e.dng", codes(np.full((HEIGHT, WIDTH, 3), 0.5)))
    )
    unlike = [save(tmp_path / "f.dng", codes(even * 0))]
    unlike.append(save(tmp_path / "g.dng", codes(even * 0), exposure_tags((1, 4), (8, 1), 200)))
    with pytest.raises(StimulusError, match="was taken at 1/4 s"):
        read_calibration(unlike)
    (tmp_path / "empty").mkdir()
    with pytest.raises(StimulusError, match="no files"):
        read_calibration([tmp_path / "empty"])


def test_photosites_full_in_the_dark_are_marked(tmp_path: Path) -> None:
    hot = np.zeros((HEIGHT, WIDTH))
    hot[30, 40] = 1.2
    dark = save(tmp_path / "dark.dng", codes(hot))
    photo = save(tmp_path / "photo.dng", codes(np.full((HEIGHT, WIDTH), 0.3) + hot))
    image = read_camera_image(photo, demosaic="superpixel", calibration=read_calibration([dark]))
    assert image.saturated[15, 20].tolist() == [True, False, False]
    assert image.saturated.sum() == 1


def test_a_linear_dng_has_frames_too(tmp_path: Path) -> None:
    light = np.repeat(vignette()[..., None], 3, axis=-1)
    photo, flat = (
        save_linear_dng(tmp_path / f"{name}.dng", codes(share * light), black=(BLACK,) * 3, white=WHITE, tags=AT)
        for name, share in (("photo", 0.3), ("flat", 0.6))
    )
    image = read_camera_image(photo, calibration=read_calibration(flat=[flat]))
    assert np.ptp(image.rgb) < 1e-3


def test_short_dark_frames_serve_other_short_times(tmp_path: Path) -> None:
    dark = save(tmp_path / "dark.dng", codes(np.zeros((HEIGHT, WIDTH))), exposure_tags((1, 250), (8, 1), 200))
    photo = save(tmp_path / "photo.dng", codes(np.full((HEIGHT, WIDTH), 0.3)))
    image = read_camera_image(photo, calibration=read_calibration([dark]))
    assert image.exposure == Exposure(1 / 8, 8, 200)
