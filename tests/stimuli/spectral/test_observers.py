"""Observers of pictures: declared, kept and never mixed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from devices.colour import white_point
from devices.readings import xyz_from_spectra
from documents import InputError
from runner.presenter import show_picture
from runner.protocol import read_experiment
from stimuli.build import build_set
from stimuli.comparison import CompareOptions, ReadOptions, compare_pictures
from stimuli.errors import StimulusError
from stimuli.measures import ViewingConditions
from stimuli.pictures import StereoImage, read_exr, write_exr
from stimuli.recipes import DisplaySetup
from stimuli.spectral import SpectralOptions, convert_spectral
from tests.kept import known
from tests.stimuli.spectral.pictures import save_envi

# The colorimetric observer of pictures: declared in their files, kept by recipes, and never mixed.

TEN = "CIE 2015 10"
ROOT = Path(__file__).parents[3]
REGIONS = ROOT / "configs/regions/plate.yaml"


def _declared(file: Path) -> object:
    import OpenImageIO as oiio

    picture = known(oiio.ImageInput.open(str(file)))
    return picture.spec().getattribute("colorimetricObserver")


def _carried_light(seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).uniform(10, 40, (180, 240, 3)).astype(np.float32)


def _picture(path: Path, observer: str = "CIE 1931 2") -> Path:
    write_exr(path, StereoImage.flat(_carried_light()), observer)
    return path


def test_a_picture_file_declares_its_observer_unless_it_is_1931(tmp_path: Path) -> None:
    plain, ten = _picture(tmp_path / "a.exr"), _picture(tmp_path / "b.exr", "2012_10")
    assert (_declared(ten), _declared(plain)) == (TEN, None)
    np.testing.assert_array_equal(read_exr(plain).left, read_exr(ten, observer=TEN).left)
    read_exr(ten, observer=None)
    with pytest.raises(StimulusError, match="CIE 2015 10; CIE 1931 2 is wanted"):
        read_exr(ten)


def _recipe(folder: Path, picture_observer: str, recipe_line: str) -> Path:
    _picture(folder / "plate.exr", picture_observer)
    recipe = folder / "recipe.yaml"
    stimuli = "stimuli:\n- {name: plate, file: plate.exr}\n"
    recipe.write_text(f"schema_version: 1\nkind: pictures\n{recipe_line}{stimuli}")
    return recipe


def test_a_recipe_keeps_the_observer_of_its_pictures(tmp_path: Path) -> None:
    recipe = _recipe(tmp_path, TEN, "observer: CIE 2015 10\n")
    built = build_set(recipe, 0.2768)
    assert built.manifest["recipe"]["observer"] == TEN
    assert _declared(built.path("plate")) == TEN


@pytest.mark.parametrize(("picture", "line"), [(TEN, ""), ("CIE 1931 2", "observer: CIE 2015 10\n")])
def test_a_recipe_refuses_pictures_of_another_observer(tmp_path: Path, picture: str, line: str) -> None:
    with pytest.raises(InputError, match=r"plate.exr: its XYZ are for the observer") as caught:
        build_set(_recipe(tmp_path, picture, line), 0.2768)
    assert len(caught.value.findings) == 1


def _display(folder: Path, observer: str) -> None:
    (folder / "display.yaml").write_text(
        "schema_version: 1\npanel: {resolution_px: [1920, 1080], pixel_pitch_mm: 0.2768}\nmodes:\n  flat:\n"
        "    black_XYZ_cd_m2: [0.1, 0.1, 0.1]\n    primaries_XYZ_cd_m2:\n      red: [41.2, 21.3, 1.9]\n"
        "      green: [35.8, 71.5, 11.9]\n      blue: [18, 7.2, 95]\n    curve: {kind: gamma, red: {gamma: 2.2}, "
        f"green: {{gamma: 2.2}}, blue: {{gamma: 2.2}}}}\n    observer: {observer}\n"
    )
    (folder / "rig.yaml").write_text(
        f"schema_version: 1\ndisplay: display.yaml\nmode: flat\ndistance_mm: 700\nobserver: {observer}\n"
    )


def test_an_experiment_refuses_stimuli_for_another_observer_than_its_rig(tmp_path: Path) -> None:
    _display(tmp_path, TEN)
    _recipe(tmp_path, "CIE 1931 2", "")
    experiment = tmp_path / "experiment.yaml"
    experiment.write_text(
        "schema_version: 1\nname: mixed\nrig: rig.yaml\nstimuli: recipe.yaml\nquestion: Which?\n"
        "layout: {arrangement: vertical, size_mm: [20, 20], gap_mm: 5, reference: physical}\n"
        "blocks: [{kind: instructions, text: Look.}]\n"
    )
    with pytest.raises(InputError) as caught:
        read_experiment(experiment)
    assert [(finding.line, finding.message) for finding in caught.value.findings] == [
        (4, "the pictures are for the observer CIE 1931 2, and the rig for CIE 2015 10")
    ]
    from devices.display import read_rig

    setup = DisplaySetup.of(read_rig(tmp_path / "rig.yaml"))
    with pytest.raises(InputError, match="and the rig for CIE 2015 10"):
        build_set(tmp_path / "recipe.yaml", 0.2768, setup=setup)
    with pytest.raises(InputError, match="CIE 1931 2; CIE 2015 10 is wanted"):
        show_picture(tmp_path / "plate.exr", tmp_path / "display.yaml", "flat")


def test_a_comparison_refuses_pictures_of_two_observers_and_takes_the_white_of_one(tmp_path: Path) -> None:
    plain, ten = _picture(tmp_path / "a.exr"), _picture(tmp_path / "b.exr", TEN)
    with pytest.raises(InputError, match="the photograph is of CIE 1931 2") as caught:
        compare_pictures(plain, ten, REGIONS)
    assert len(caught.value.findings) == 1
    _display(tmp_path, "CIE 1931 2")
    on_rig = CompareOptions(viewing=ViewingConditions.on_rig(tmp_path / "rig.yaml"))
    with pytest.raises(InputError, match="the display of CIE 1931 2"):
        compare_pictures(ten, ten, REGIONS, on_rig)
    compare_pictures(plain, plain, REGIONS, on_rig)
    result = compare_pictures(ten, ten, REGIONS)
    white = np.array(result.eyes["both"].table.white_XYZ)
    np.testing.assert_allclose(white / white[1], white_point("d50", 1.0, TEN), rtol=1e-9)
    assert any(f"icc-d50 for {TEN}" in note for note in result.eyes["both"].notes)
    assert result.to_json()["photograph"]["observer"] == TEN


def test_spectral_pictures_become_xyz_for_the_observer_that_is_asked(tmp_path: Path) -> None:
    waves = np.arange(380.0, 781.0, 10)
    values = np.random.default_rng(2).uniform(0.001, 0.01, (180, 240, len(waves))).astype(np.float32)
    spectral = save_envi(tmp_path / "s.hdr", values, waves)
    report = convert_spectral(spectral, tmp_path / "s.exr", SpectralOptions("radiance", observer="2012_10"))
    assert report.step["observer"] == TEN
    truth = xyz_from_spectra(values.reshape(-1, len(waves)), waves, TEN).reshape(180, 240, 3)
    np.testing.assert_allclose(read_exr(tmp_path / "s.exr", observer=TEN).left, truth, rtol=1e-3)
    reading = ReadOptions(rendering_holds="spectral", quantity="radiance")
    ten, plain = (CompareOptions(replace(reading, observer=name), register="none") for name in (TEN, None))
    assert compare_pictures(tmp_path / "s.exr", spectral, REGIONS, ten).eyes["both"].per_pixel.mean < 0.05
    with pytest.raises(InputError, match="the photograph is of CIE 2015 10"):
        compare_pictures(tmp_path / "s.exr", spectral, REGIONS, plain)


# CIE 15:2018, Tables T.3: A and D65 for 10°.
@pytest.mark.parametrize(("name", "XYZ"), [("a", (111.14, 100.0, 35.20)), ("d65", (94.81, 100.0, 107.32))])
def test_whites_of_another_observer_are_those_published(name: str, XYZ: tuple[float, float, float]) -> None:
    np.testing.assert_allclose(white_point(name, 100.0, "CIE 1964 10"), XYZ, atol=0.03)
    np.testing.assert_allclose(white_point("e", 1.0, TEN), 1.0, atol=1e-6)
    np.testing.assert_array_equal(white_point("icc-d50", 1.0, TEN), white_point("d50", 1.0, TEN))


def test_an_observer_that_nobody_knows_is_refused(tmp_path: Path) -> None:
    import OpenImageIO as oiio

    file = _picture(tmp_path / "a.exr")
    source = oiio.ImageBuf(str(file))
    source.specmod().attribute("colorimetricObserver", "me")
    source.write(str(tmp_path / "b.exr"))
    with pytest.raises(StimulusError, match=r"b.exr: it declares the observer me .*CIE 1964 10") as caught:
        read_exr(tmp_path / "b.exr")
    assert len(caught.value.findings) == 1


def test_a_contact_sheet_adapts_to_the_observers_white(tmp_path: Path) -> None:
    from stimuli.build.report import contact_sheet

    recipe = _recipe(tmp_path, TEN, f"observer: {TEN}\n")
    light = np.tile(white_point("d65", 20.0, TEN).astype(np.float32), (40, 60, 1))
    write_exr(tmp_path / "plate.exr", StereoImage.flat(light), TEN)
    sheet = np.asarray(contact_sheet(build_set(recipe, 0.2768)))
    codes = sheet[sheet.shape[0] - 15, 15]
    assert codes[0] == codes[1] == codes[2] > 100


@pytest.mark.nightly
def test_a_comparison_says_that_the_eyes_channels_are_for_1931(tmp_path: Path) -> None:
    says = f"they take XYZ for {TEN} here"
    for observer in ("CIE 1931 2", TEN):
        picture = _picture(tmp_path / "a.exr", observer)
        for density in (None, 60.0):
            viewing = None if density is None else ViewingConditions(density)
            result = compare_pictures(picture, picture, REGIONS, CompareOptions(viewing=viewing))
            found = [note for note in result.eyes["both"].notes if says in note]
            assert len(found) == (observer == TEN and density is not None)


def test_the_experiment_of_a_comparison_is_for_the_pictures_observer(tmp_path: Path) -> None:
    from runner.reports import ComparisonOptions, report_comparison

    _display(tmp_path, TEN)
    pictures = _picture(tmp_path / "a.exr", TEN), _picture(tmp_path / "b.exr", TEN)
    asked = ComparisonOptions(experiment="ten", rig=tmp_path / "rig.yaml")
    report_comparison(*pictures, REGIONS, asked, root=tmp_path)
    assert read_experiment(tmp_path / "experiments/ten.yaml").rig.observer == TEN
    assert set(build_set(tmp_path / "configs/stimuli/ten.yaml", 0.2768).names) == {"photograph", "rendering"}


def test_the_face_for_python_refuses_another_observer_unless_it_is_named(tmp_path: Path) -> None:
    import cyclopean

    cyclopean.write_picture(tmp_path / "a.exr", _carried_light(), observer=TEN)
    with pytest.raises(InputError, match="its XYZ are for the observer CIE 2015 10; CIE 1931 2 is wanted"):
        cyclopean.read_picture(tmp_path / "a.exr")
    np.testing.assert_allclose(
        cyclopean.read_picture(tmp_path / "a.exr", observer=TEN).left, _carried_light(), rtol=1e-3
    )
