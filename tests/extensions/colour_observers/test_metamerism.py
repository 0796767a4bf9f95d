"""Observers who differ: persons as published, metamerism as an independent computation has it, the command."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from devices.colour_matching import ColorimetricObserver, Departure, colorimetric_observer
from devices.diagnostics import MeasuredSet, examine
from devices.errors import DeviceError
from devices.readings import Measurements, xyz_from_spectra
from devices.readings.ti3 import write_ti3
from documents import InputError
from documents.pages import Table
from extensions.colour_observers import (
    OBSERVERS_DIFFER,
    MetamerismOptions,
    ScreenSpectra,
    categorical_observers,
    individual_observer,
    individual_observers,
    metamerism_of_files,
    observer_metamerism,
    screen_spectra,
)
from runner.cli.main import group
from tests.devices.diagnostics.simulated import MODEL, characterisation
from tests.kept import known

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


# A display's readings.


def test_primaries_that_divide_observers_are_found_and_broad_ones_are_not() -> None:
    clean = characterisation()
    linear = np.stack([curve.linear(clean.codes[:, i]) for i, curve in enumerate(MODEL.curves)], axis=1)
    waves = np.arange(380.0, 781.0, 4)
    values = []
    for width in (8.0, 50.0):
        narrow = np.array([np.exp(-(((waves - peak) / width) ** 2)) for peak in (630.0, 532.0, 460.0)])
        found = OBSERVERS_DIFFER.judge(replace(clean, spectra=0.01 * linear @ narrow, wavelengths_nm=waves))
        assert found.verdict == "no_limit"
        values.append(known(found.value))
    assert values[0] > 1.5 * values[1] > 0
    assert "without spectra" in OBSERVERS_DIFFER.judge(clean).words
    too_little = OBSERVERS_DIFFER.judge(clean.select(np.arange(3)))
    assert (too_little.passed, too_little.value) == (None, None)


def test_it_stands_after_the_overlap_of_spectra() -> None:
    found = [one.name for one in examine([MeasuredSet("m", characterisation())])]
    at = found.index("observer_metamerism")
    assert found[at - 1 : at + 2] == ["spectral_overlap", "observer_metamerism", "gamut"]


# Individual observers: the average is that of CIE 170, persons scatter as published, and the seed fixes them.
@pytest.mark.parametrize("field_deg", [2.0, 10.0])
def test_nobody_in_particular_at_32_is_the_observer_of_cie_170(field_deg: float) -> None:
    average = individual_observer("average", field_deg, 32, Departure())
    published = colorimetric_observer(f"CIE 2015 {field_deg:g}")
    assert np.abs(average.functions - published.functions).max() < 3e-5
    assert average.efficacy_lm_W == pytest.approx(published.efficacy_lm_W, rel=3e-5)


def test_the_seed_fixes_the_persons_and_more_persons_begin_with_the_same() -> None:
    few, many = individual_observers(3, 10, seed=5), individual_observers(6, 10, seed=5)
    for one, other in zip(few, many, strict=False):
        assert one == other
        np.testing.assert_array_equal(one.functions, other.functions)
    assert not np.array_equal(few[0].functions, individual_observers(1, 10, seed=6)[0].functions)


@pytest.mark.nightly
def test_persons_scatter_about_the_average() -> None:
    persons = individual_observers(400, 10, ages_years=(32, 32), seed=2)
    functions = np.array([person.functions for person in persons])
    average = colorimetric_observer("CIE 2015 10").functions
    assert np.abs(functions.mean(axis=0) - average).max() < 0.03
    scatter = functions.std(axis=0).max(axis=0)
    assert np.all(scatter > 0.02)
    assert np.all(scatter < 0.25)
    # Light of equal energy looks the same to all by the scaling.
    areas = functions.sum(axis=1)
    np.testing.assert_allclose(areas, np.broadcast_to(areas[0], areas.shape), rtol=1e-9)


def test_ten_categories() -> None:
    categories = categorical_observers(2)
    assert len({observer.name for observer in categories}) == 10
    first = individual_observer("", 2, 38, Departure())
    np.testing.assert_allclose(categories[0].functions, first.functions, rtol=1e-12)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: individual_observers(0, 10),
        lambda: individual_observers(1, 0.5),
        lambda: individual_observers(1, 10, ages_years=(10, 30)),
        lambda: individual_observers(1, 10, ages_years=(40, 30)),
        lambda: individual_observer("x", 10, 32, Departure(macula=-1.5)),
        lambda: individual_observer("x", 10, 32, Departure(density_M=-1.0)),
        lambda: individual_observer("x", 10, 32, Departure(shift_L_nm=float("nan"))),
    ],
)
def test_what_is_out_of_range_is_refused(wrong: object) -> None:
    assert callable(wrong)
    with pytest.raises(DeviceError):
        wrong()
