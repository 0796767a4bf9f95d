"""A camera file names the observer of its XYZ; what is developed by it is of that observer, and never mixed."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from devices.camera import CameraModel, Correspondences, fit_camera, read_camera, read_reference, write_camera
from devices.readings import xyz_from_spectra
from documents import InputError
from runner.cli.main import group
from stimuli.build import build_set
from stimuli.chart import ChartOptions, fit_camera_to_chart
from stimuli.comparison import CompareOptions, ReadOptions, compare_pictures
from stimuli.develop import CameraImage, DevelopOptions, write_camera_exr
from stimuli.develop.photograph import develop_photograph
from stimuli.pictures import read_exr

TEN = "CIE 2015 10"
ROOT = Path(__file__).parents[3]
MATRIX = np.array([[41.0, 36.0, 18.0], [21.0, 72.0, 7.0], [2.0, 12.0, 95.0]])
WAVES = np.arange(380.0, 781.0, 5.0)


REGIONS = ROOT / "configs/regions/plate.yaml"


def _camera(path: Path, observer: str = TEN) -> Path:
    write_camera(CameraModel(MATRIX, np.zeros(3), np.zeros(3), observer=observer), path)
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


@pytest.mark.nightly
def test_camera_fit_writes_the_observer_of_the_chart(tmp_path: Path) -> None:
    table, file = _table(tmp_path / "chart.csv", TEN), tmp_path / "camera.yaml"
    words = ["camera", "fit", str(table), "--observer", "2012_10", "-o", str(file), "--json"]
    result = CliRunner().invoke(group, words)
    assert result.exit_code == 0, result.output
    assert json.loads(result.output)["observer"] == TEN
    assert read_camera(file).observer == TEN
    plain = CliRunner().invoke(group, ["camera", "fit", str(table), "--observer", "me"])
    assert "observer 'me'" in str(plain.exception)
    page = tmp_path / "page.html"
    assert CliRunner().invoke(group, [*words[:-3], "--report", str(page)]).exit_code == 0
    assert TEN in page.read_text()


def test_a_developed_photograph_declares_the_observer_of_its_camera_file(tmp_path: Path) -> None:
    photo, camera = _photo(tmp_path / "p.exr"), read_camera(_camera(tmp_path / "c.yaml"))
    developed = develop_photograph(photo, tmp_path / "out.exr", DevelopOptions(camera=camera))
    assert developed.steps[-1]["observer"] == TEN
    rgb = np.random.default_rng(3).uniform(0.1, 0.4, (180, 240, 3))
    np.testing.assert_allclose(read_exr(tmp_path / "out.exr", observer=TEN).left, rgb @ MATRIX.T, rtol=2e-3)
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


def test_a_camera_fitted_for_an_observer_sees_as_that_observer() -> None:
    rgb, spectra = _chart()
    for observer in (TEN, "CIE 1964 10"):
        XYZ = xyz_from_spectra(spectra, WAVES, observer)
        names = tuple(f"patch {number}" for number in range(24))
        fit = fit_camera(Correspondences(rgb, XYZ, names, rgb > 1), observer=observer)
        assert fit.model.observer == observer
        np.testing.assert_allclose(fit.model.xyz(rgb), XYZ, rtol=1e-6)


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


def test_a_comparison_refuses_a_photograph_and_a_rendering_of_two_observers(tmp_path: Path) -> None:
    photo = _photo(tmp_path / "p.exr")
    plain, ten = (
        DevelopOptions(camera=read_camera(_camera(tmp_path / f"{name}.yaml", observer)))
        for name, observer in (("plain", "CIE 1931 2"), ("ten", TEN))
    )
    develop_photograph(photo, tmp_path / "ten.exr", ten)
    develop_photograph(photo, tmp_path / "plain.exr", plain)
    options = CompareOptions(reading=ReadOptions(camera=ten.camera), register="none")
    with pytest.raises(InputError, match="the photograph is of CIE 2015 10, the rendering of CIE 1931 2") as caught:
        compare_pictures(photo, tmp_path / "plain.exr", REGIONS, options)
    assert len(caught.value.findings) == 1
    result = compare_pictures(photo, tmp_path / "ten.exr", REGIONS, options)
    assert result.photo.observer == TEN


def test_camera_rgb_of_a_spectral_picture_takes_no_observer(tmp_path: Path) -> None:
    words = ["camera", "spectral", "p.exr", "-o", str(tmp_path / "o.exr"), "--sensitivities", "s.csv"]
    result = CliRunner().invoke(group, [*words, "--full-scale", "100", "--observer", TEN])
    assert isinstance(result.exception, InputError)
    assert "--observer" in str(result.exception)
