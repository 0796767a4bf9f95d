"""Observers of pictures: metamerism between them, and declared, kept and never mixed."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from devices.colour import white_point
from devices.colour_matching import (
    ColorimetricObserver,
    Departure,
    categorical_observers,
    colorimetric_observer,
    individual_observer,
    individual_observers,
)
from devices.diagnostics import ScreenSpectra, observer_metamerism, screen_spectra
from devices.errors import DeviceError
from devices.readings import Measurements, xyz_from_spectra
from devices.readings.ti3 import write_ti3
from documents import InputError
from documents.pages import Table
from runner.cli.main import group
from runner.presenter import show_picture
from runner.protocol import read_experiment
from stimuli.build import build_set
from stimuli.comparison import CompareOptions, ReadOptions, compare_pictures
from stimuli.errors import StimulusError
from stimuli.measures import ViewingConditions
from stimuli.pictures import StereoImage, read_exr, write_exr
from stimuli.recipes import DisplaySetup
from stimuli.spectral import MetamerismOptions, SpectralOptions, convert_spectral, metamerism_of_files
from tests.kept import known
from tests.stimuli.spectral.pictures import save_envi

# Observer metamerism: the differences are those of an independent computation, and arise where they must.

WAVES = np.arange(390.0, 781.0)
BLUE_PAINT = 0.05 + 0.5 * np.exp(-(((WAVES - 470) / 40) ** 2)) + 0.15 / (1 + np.exp((700 - WAVES) / 8))
PAINTS = {"grey": np.full(len(WAVES), 0.3), "blue paint": BLUE_PAINT}


def _light(waves: np.ndarray) -> np.ndarray:
    return 1.0 + 0.001 * (waves - 560)


def _screen(width_nm: float = 14.0, spacing: float = 1.0) -> ScreenSpectra:
    waves = np.arange(390.0, 781.0, spacing)
    primaries = np.stack([np.exp(-(((waves - mid) / width_nm) ** 2)) for mid in (628, 532, 458)])
    return ScreenSpectra(waves, np.full(len(waves), 1e-6), 0.02 * primaries)


def _persons() -> tuple[ColorimetricObserver, ...]:
    return individual_observers(40, 2.0, seed=3)


def test_each_observers_difference_is_that_of_colour_science() -> None:
    from colour.colorimetry import MultiSpectralDistributions, SpectralDistribution, sd_to_XYZ_integration
    from colour.difference import delta_E_CIE2000
    from colour.models import XYZ_to_Lab, XYZ_to_xy

    persons, screen = categorical_observers(2.0), _screen()
    match = colorimetric_observer("CIE 1931 2")
    found = observer_metamerism(PAINTS, _light(WAVES), WAVES, screen, persons, matched_for=match)

    def colour_xyz(observer: ColorimetricObserver, spectrum: np.ndarray) -> np.ndarray:
        table = {int(w): row for w, row in zip(WAVES, observer.functions_at(WAVES), strict=True)}
        cmfs = MultiSpectralDistributions(table)
        # The first and last nm count half, as in the trapezium rule.
        ends = spectrum.copy()
        ends[[0, -1]] *= 0.5
        sd = SpectralDistribution({int(w): value for w, value in zip(WAVES, ends, strict=True)})
        return np.asarray(sd_to_XYZ_integration(sd, cmfs, k=observer.efficacy_lm_W))

    lamp = _light(WAVES) * found.white_luminance_cd_m2 / colour_xyz(match, _light(WAVES))[1]
    for row, paint in enumerate(PAINTS.values()):
        shown = screen.black + found.drive[row] @ screen.primaries
        np.testing.assert_allclose(colour_xyz(match, shown), colour_xyz(match, lamp * paint), rtol=1e-9)
        for column, person in enumerate(persons):
            white = colour_xyz(person, lamp)
            labs = [XYZ_to_Lab(colour_xyz(person, s) / white[1], XYZ_to_xy(white)) for s in (lamp * paint, shown)]
            assert found.delta_e_00[row, column] == pytest.approx(float(delta_E_CIE2000(labs[0], labs[1])), abs=1e-6)
            np.testing.assert_allclose(found.lab_difference[row, column], labs[1] - labs[0], atol=1e-6)


def _readings(spacing: float = 5.0) -> Measurements:
    screen = _screen(spacing=spacing)
    codes = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1], [0.5, 0.5, 0.5]])
    spectra = screen.black + (codes**2.2) @ screen.primaries
    waves = screen.wavelengths_nm
    return Measurements(codes, xyz_from_spectra(spectra, waves), spectra=spectra, wavelengths_nm=waves)


def test_the_screen_comes_from_readings_with_spectra() -> None:
    found, screen = screen_spectra(_readings()), _screen(spacing=5.0)
    np.testing.assert_allclose(found.black, screen.black, rtol=1e-9)
    np.testing.assert_allclose(found.primaries, screen.primaries, rtol=1e-6, atol=1e-12)
    assert found.notes == ()
    readings = _readings()
    with pytest.raises(DeviceError, match="blue at full drive"):
        screen_spectra(readings.select([0, 1, 2]))
    with pytest.raises(DeviceError, match=r"d\.csv: .* no spectra"):
        screen_spectra(Measurements(readings.codes, readings.XYZ), "d.csv")
    assert "black was not read" in screen_spectra(readings.select([1, 2, 3])).notes[0]
    bright = np.array(known(readings.spectra))
    bright[4] *= 1.2
    more = Measurements(readings.codes, readings.XYZ, spectra=bright, wavelengths_nm=readings.wavelengths_nm)
    assert "not additive" in screen_spectra(more).notes[0]


@pytest.mark.parametrize("waves", [np.arange(420.0, 681.0), np.arange(390.0, 781.0, 30)])
def test_spectra_too_short_or_too_coarse_are_refused(waves: np.ndarray) -> None:
    match = colorimetric_observer("CIE 2015 10")
    flat = {"flat": np.full(len(waves), 0.5)}
    with pytest.raises(DeviceError, match=r"run over .*400\.\.700 nm") as caught:
        observer_metamerism(flat, np.ones(len(waves)), waves, _screen(), (match,), matched_for=match)
    assert len(caught.value.findings) == 1


def test_what_determines_no_colour_is_refused() -> None:
    match = colorimetric_observer("CIE 1931 2")
    red = _screen().primaries[0]
    alike = ScreenSpectra(WAVES, np.zeros(len(WAVES)), np.stack([red, red, red]))
    for paints, screen, says in (
        (PAINTS, alike, "nearly alike"),
        ({"ink": np.full(len(WAVES), -0.1)}, _screen(), "the reflectance of ink is negative"),
    ):
        with pytest.raises(DeviceError, match=says):
            observer_metamerism(paints, _light(WAVES), WAVES, screen, (match,), matched_for=match)


def _files(folder: Path) -> tuple[str, str]:
    rows = [f"{w:.0f},{g:.5f},{b:.5f}" for w, g, b in zip(WAVES, *PAINTS.values(), strict=True)][::5]
    (folder / "paints.csv").write_text("\n".join(["wavelength_nm,grey,blue paint", *rows]) + "\n")
    write_ti3(_readings(), folder / "screen.ti3")
    return str(folder / "paints.csv"), str(folder / "screen.ti3")


def test_the_command_reports_each_object(tmp_path: Path) -> None:
    def run(*options: str) -> Result:
        return CliRunner().invoke(group, ["display", "metamerism", *_files(tmp_path), "--illuminant", "D65", *options])

    ran = run("--persons", "20", "--observer", "1964_10")
    assert ran.exit_code == 0, ran.output
    assert "Matched for CIE 1964 10" in ran.output
    assert "field of 10°" in ran.output
    assert "blue paint" in ran.output
    read = json.loads(run("--categories", "--field", "4", "--json").output)
    assert len(read["objects"]["grey"]["observers"]) == 10
    assert read["objects"]["grey"]["standard_observers"]["CIE 1931 2"] < 1e-9
    wrong = run("--ages", "20-60")
    assert wrong.exit_code == 2
    assert "FROM..TO" in wrong.output


def test_an_object_outside_the_gamut_has_a_row_without_numbers(tmp_path: Path) -> None:
    objects, readings = map(Path, _files(tmp_path))
    head, *rows = objects.read_text().splitlines()
    objects.write_text("\n".join([f"{head},vivid", *(f"{row},{int(n == 20)}" for n, row in enumerate(rows))]))
    found = metamerism_of_files(objects, readings, MetamerismOptions("D65", categories=True))
    (table,) = (part for part in found.told() if not isinstance(part, str))
    assert isinstance(table, Table)
    assert {len(row) for row in table.rows} == {len(table.columns)}
    assert found.outside == ("vivid",)


def test_narrow_primaries_divide_observers_more_than_broad_ones() -> None:
    match = colorimetric_observer("CIE 2015 2")
    worst = [
        observer_metamerism(PAINTS, _light(WAVES), WAVES, _screen(width), _persons(), matched_for=match).summary(0)
        for width in (5.0, 45.0)
    ]
    assert worst[0]["p95"] > 1.3 * worst[1]["p95"]
    assert worst[0]["median"] <= worst[0]["p90"] <= worst[0]["p95"] <= worst[0]["worst"]


def test_a_denser_lens_sees_the_screen_more_off_than_the_average() -> None:
    match = colorimetric_observer("CIE 2015 2")
    average = individual_observer("average", 2, 32, Departure())
    old = individual_observer("old", 2, 75, Departure(lens=0.2))
    found = observer_metamerism(PAINTS, _light(WAVES), WAVES, _screen(), (average, old), matched_for=match)
    assert found.delta_e_00[0, 0] < 0.05
    assert found.delta_e_00[0, 1] > 1
    assert found.summary(0)["worst_observer"] == "old"


def test_white_is_as_bright_as_the_screen_allows_and_what_it_cannot_show_is_named() -> None:
    match = colorimetric_observer("CIE 1931 2")
    red = np.exp(-(((WAVES - 700) / 10) ** 2))
    paints = {**PAINTS, "spectral": np.exp(-(((WAVES - 500) / 3) ** 2)), "deep red": red}
    found = observer_metamerism(paints, _light(WAVES), WAVES, _screen(), _persons(), matched_for=match)
    assert "spectral" in found.outside
    assert np.isnan(found.delta_e_00[2]).all()
    assert found.summary(2)["median"] is None
    assert json.loads(json.dumps(found.to_json(), allow_nan=False))["outside_gamut"] == list(found.outside)
    brighter = observer_metamerism(
        PAINTS,
        _light(WAVES),
        WAVES,
        _screen(),
        _persons(),
        matched_for=match,
        white_luminance_cd_m2=20 * found.white_luminance_cd_m2,
    )
    assert brighter.outside == ("grey", "blue paint")


def test_wrong_files_have_one_message_each(tmp_path: Path) -> None:
    objects, screen = _files(tmp_path)
    readings = Path(screen)
    for change, says in (
        (("wavelength_nm", "nm"), "no wavelength_nm"),
        (("blue paint", "grey"), "stands twice"),
        (("395,0.30000", "395,-0.3"), "grey is '-0.3'"),
    ):
        wrong = tmp_path / "wrong.csv"
        wrong.write_text(Path(objects).read_text().replace(*change))
        with pytest.raises(InputError, match=says) as caught:
            metamerism_of_files(wrong, readings, MetamerismOptions("D65", categories=True))
        assert len(caught.value.findings) == 1
    with pytest.raises(DeviceError, match="no colorimetric observer"):
        metamerism_of_files(Path(objects), readings, MetamerismOptions("D65", observer="CIE 1999 2"))


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
