"""XYZ are read for CIE 1931 2°: a display for another observer is verified and judged by spectra, never by them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from devices.characterise import fit_display, table_c1_codes
from devices.diagnostics import judge_display
from devices.display import DisplayModel, EyeModels, PanelSpec, ToneCurve
from devices.errors import DeviceError, MeasuringError
from devices.readings import (
    KeptReading,
    Measurements,
    PatchTurn,
    Reading,
    ReadingRun,
    SimulatedDisplay,
    asked_of,
    read_measurements,
    write_csv,
    xyz_from_spectra,
)
from devices.readings.ti3 import write_ti3
from documents.pages import write_page
from runner.measuring import Dialogue, InstrumentOptions, ShowPatches, VerifyOptions, verify_display
from runner.measuring.target import read_target, wiring_of
from runner.measuring.verification import judge, patches_of
from runner.reports.display.page import page_of


@pytest.fixture
def display(tmp_path: Path) -> Path:
    """A display file with a mode for each of two observers."""
    mode = (
        "    black_XYZ_cd_m2: [0.1, 0.1, 0.1]\n    primaries_XYZ_cd_m2:\n      red: [41.2, 21.3, 1.9]\n"
        "      green: [35.8, 71.5, 11.9]\n      blue: [18, 7.2, 95]\n"
        "    curve: {kind: gamma, red: {gamma: 2.2}, green: {gamma: 2.2}, blue: {gamma: 2.2}}\n"
    )
    file = tmp_path / "display.yaml"
    file.write_text(
        "schema_version: 1\npanel: {resolution_px: [64, 48], pixel_pitch_mm: 0.28}\nmodes:\n"
        f"  flat:\n{mode}    observer: CIE 1964 10\n  side-by-side:\n{mode}"
    )
    return file


SAYS = "the mode 'flat' is for the observer CIE 1964 10; .* for CIE 1931 2"


def test_it_is_not_verified_without_spectra(display: Path) -> None:
    with pytest.raises(MeasuringError, match=SAYS) as caught:
        verify_display(VerifyOptions(display=display, instrument=InstrumentOptions("simulated"), mode="flat"))
    assert len(caught.value.findings) == 1


def test_an_instrument_that_reads_spectra_verifies_it() -> None:
    waves = np.arange(380.0, 781.0, 4)
    spectra = np.stack([np.exp(-(((waves - mid) / 25) ** 2)) for mid in (620, 535, 460)]) * 2e-3
    curve = ToneCurve(1.0, 0.0, 2.2)
    ten = DisplayModel(np.zeros(3), xyz_from_spectra(spectra, waves, "CIE 1964 10").T, (curve, curve, curve))
    asked = asked_of(ten)
    light = [ten.linear(colour.XYZ_cd_m2) @ spectra for colour in asked]
    steps = tuple(PatchTurn(n, patch.name, patch) for n, patch in enumerate(patches_of(asked, ten).patches))

    def session(*, with_spectra: bool) -> ReadingRun:
        kept = {}
        for place, seen in enumerate(light):
            X, Y, Z = map(float, xyz_from_spectra(seen, waves)[0])
            whole = (tuple(seen.tolist()), tuple(waves.tolist())) if with_spectra else ((), ())
            kept[place] = KeptReading(place, 0.0, Reading((X, Y, Z), *whole))
        return ReadingRun(Path("m.jsonl"), {}, steps, kept, {})

    display = SimulatedDisplay(EyeModels(ten, ten))
    assert judge(session(with_spectra=True), asked, display, "both", "CIE 1964 10").achieved.largest < 1e-6
    # Taken for XYZ of CIE 1931 2°, the same readings would be far off.
    assert judge(session(with_spectra=True), asked, display, "both").achieved.largest > 2
    with pytest.raises(MeasuringError, match="the readings have no spectra, which XYZ for CIE 1964 10 need"):
        judge(session(with_spectra=False), asked, display, "both", "CIE 1964 10")


def test_it_is_not_simulated(display: Path) -> None:
    for mode, refused in (("flat", True), ("side-by-side", False)):
        target = read_target(display, mode)
        if refused:
            with pytest.raises(MeasuringError, match=SAYS):
                wiring_of(target, ShowPatches(), InstrumentOptions("simulated"), Dialogue())
        else:
            wiring_of(target, ShowPatches(), InstrumentOptions("simulated"), Dialogue())
    # Another instrument reads the panel itself, whatever was known of it.
    wiring_of(read_target(display, "flat"), ShowPatches(), InstrumentOptions("spotread"), Dialogue())


def test_readings_without_spectra_are_not_compared_with_it(display: Path, tmp_path: Path) -> None:
    write_csv(Measurements(np.eye(3)[:2], np.array([[0.1, 0.1, 0.1], [95, 100, 108]])), tmp_path / "r.csv")
    with pytest.raises(DeviceError, match=SAYS) as caught:
        judge_display([tmp_path / "r.csv"], display=display, mode="flat")
    assert len(caught.value.findings) == 1
    verdicts = judge_display([tmp_path / "r.csv"], display=display, mode="side-by-side")
    assert not any("observer" in note for note in verdicts.notes)


@pytest.mark.nightly
@pytest.mark.usefixtures("undrawn")
def test_readings_with_spectra_are_compared_with_it_for_its_observer_and_the_page_says_so(tmp_path: Path) -> None:
    waves = np.arange(380.0, 781.0, 5.0)
    spectra = np.stack([np.exp(-(((waves - mid) / 25) ** 2)) for mid in (620, 535, 460)]) * 2e-3
    codes = table_c1_codes()[::2]  # half of them tell as much here

    def readings(blue: float) -> Path:
        light = (0.002 + codes**2.2) * [1.0, 1.0, blue] @ spectra
        table = Measurements(codes, xyz_from_spectra(light, waves), mode="flat", spectra=light, wavelengths_nm=waves)
        write_ti3(table, tmp_path / f"{blue:g}.ti3")
        return tmp_path / f"{blue:g}.ti3"

    same, dimmer = readings(1.0), readings(0.7)
    file = tmp_path / "display.yaml"
    fit = fit_display(read_measurements(same), model="gamma", observer="CIE 1964 10")
    fit.write(file, PanelSpec(resolution_px=(64, 48), pixel_pitch_mm=0.28))
    for table, fits in ((same, True), (dimmer, False)):
        verdicts = judge_display([table], display=file)
        found = {diagnosis.name: diagnosis for diagnosis in verdicts.diagnoses}
        assert found["model_difference"].passed is fits
        assert sum("the display file is for CIE 1964 10" in note for note in verdicts.notes) == 1
    write_page(page_of(verdicts), tmp_path / "page.html")
    assert "all other checks are for CIE 1931 2" in (tmp_path / "page.html").read_text()
