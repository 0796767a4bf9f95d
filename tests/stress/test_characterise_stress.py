"""Fits pushed to their edges: many displays, many faults. A right model, or a clear refusal."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from devices.characterise import table_c1_codes, thesis_display
from devices.characterise.choose import Characterisation, characterise
from devices.colour import delta_e_2000, xyz_to_lab
from devices.display import DisplayModel, ToneCurve
from devices.errors import DeviceError
from devices.readings import Faults, Measurements
from devices.readings.simulated import simulated_XYZ
from tests.devices.display.test_residual import smooth
from tests.example_displays import liquid_crystal_XYZ, noisy
from tests.stress.how_many import how_many

pytestmark = pytest.mark.stress

CODES = table_c1_codes()
FRESH = np.random.default_rng(99).uniform(0, 1, (500, 3))
COMMAND = "from runner.cli.main import main; main()"
SRGB = np.array([[41.2, 35.8, 18.0], [21.3, 71.5, 7.2], [1.9, 11.9, 95.0]])


def _display(seed: int) -> DisplayModel:
    rng = np.random.default_rng(seed)
    matrix = (SRGB if rng.random() < 0.5 else thesis_display().primaries_XYZ_cd_m2) * rng.uniform(0.9, 1.1, (3, 3))
    black = matrix.sum(axis=1) * rng.choice([0.0, 1e-4, 1e-3, 5e-3])
    offsets, gammas = rng.uniform(-0.05, 0.05, 3), rng.uniform(1.5, 2.8, 3)
    red, green, blue = (ToneCurve(1 - o, o, g) for o, g in zip(offsets.tolist(), gammas.tolist(), strict=True))
    return DisplayModel(black, matrix * 10 ** rng.uniform(-0.5, 1.5), (red, green, blue))


def _off(found: Characterisation, truth: np.ndarray) -> float:
    """Mean ΔE00 of the chosen model on fresh codes, against light without noise."""
    white = found.patches.white
    return float(delta_e_2000(xyz_to_lab(found.chosen.model.xyz(FRESH), white), xyz_to_lab(truth, white)).mean())


@pytest.mark.parametrize("seed", range(how_many(10, 20)))
def test_any_gogo_display_is_found(seed: int) -> None:
    display = _display(seed)
    found = characterise(Measurements(CODES, noisy(display.xyz(CODES), 0.002, seed)))
    assert _off(found, display.xyz(FRESH)) < 0.3


@pytest.mark.parametrize("seed", range(10))
def test_held_out_figures_foretell_fresh_colours(seed: int) -> None:
    rng = np.random.default_rng(seed)
    faults = Faults(interaction=float(rng.uniform(0, 0.02)), additivity_loss=float(rng.uniform(0, 0.04)))
    display = _display(seed)
    found = characterise(Measurements(CODES, noisy(simulated_XYZ(display, CODES, faults), 0.002, seed)))
    fresh = _off(found, simulated_XYZ(display, FRESH, faults))
    assert fresh < 3 * found.chosen.held_out.mean + 0.3
    for candidate in found.candidates:
        if candidate.name in ("table", "plvc") and not candidate.unusable:
            asked = np.maximum(FRESH, 0.06)
            np.testing.assert_allclose(candidate.model.code(candidate.model.xyz(asked)), asked, atol=1e-6, rtol=0)


@pytest.mark.parametrize("order", [o for o in itertools.permutations(range(3)) if o != (0, 1, 2)])
@pytest.mark.parametrize("seed", [1])
def test_every_swap_of_channels_or_coordinates_is_refused(order: tuple[int, int, int], seed: int) -> None:
    XYZ = noisy(_display(seed).xyz(CODES), 0.002, seed)
    with pytest.raises(DeviceError):
        characterise(Measurements(CODES[:, order], XYZ))
    with pytest.raises(DeviceError):
        characterise(Measurements(CODES, XYZ[:, order]))


@pytest.mark.parametrize("share", [0.01, 0.05, 0.1, 0.2, 0.3])
@pytest.mark.parametrize("seed", range(how_many(2, 4)))
def test_wrong_readings_never_bend_a_model_without_a_word(share: float, seed: int) -> None:
    display = thesis_display()
    rng = np.random.default_rng(seed)
    XYZ = noisy(display.xyz(CODES), 0.002, seed)
    rows = rng.choice(len(CODES), max(1, round(share * len(CODES))), replace=False)
    XYZ[rows] *= np.exp(rng.normal(0, 0.7, (len(rows), 1)))
    try:
        found = characterise(Measurements(CODES, XYZ))
    except DeviceError:
        return
    told = any("left out" in sentence or "errs by" in sentence for sentence in found.notes)
    assert _off(found, display.xyz(FRESH)) < 0.6 or told


@pytest.mark.parametrize("count", [8, 15, 25, 40, 70])
@pytest.mark.parametrize("seed", range(3))
def test_few_patches_give_a_right_model_or_a_refusal(count: int, seed: int) -> None:
    display = _display(seed)
    rows = np.random.default_rng(seed).choice(120, count, replace=False)
    try:
        found = characterise(Measurements(CODES[rows], noisy(display.xyz(CODES[rows]), 0.002, seed)))
    except DeviceError:
        return
    told = any("too few" in sentence or "errs by" in sentence for sentence in found.notes)
    assert _off(found, display.xyz(FRESH)) < 1.5 or told


# PLVC; a residual; and one for which nearly every residual that is tried cannot be undone.
TIMED = {
    "interaction": liquid_crystal_XYZ,
    "smooth": smooth(2, 0.02, 8).xyz,
    "not undone": smooth(1, 0.05, 30, 0.4).xyz,
}


def _of_process_s(function: Callable[[], object]) -> float:
    """Return the processor's time that ``function`` takes in this process and in those that it starts and waits for."""
    before = os.times()
    function()
    return sum(after - begun for after, begun in zip(os.times()[:4], before[:4], strict=True))


def _readings(display: str, more: int) -> Measurements:
    codes = np.concatenate([CODES, np.random.default_rng(0).integers(0, 256, (more, 3)) / 255])
    return Measurements(codes, noisy(TIMED[display](codes), 0.002, 1))


@pytest.mark.parametrize(
    ("display", "more", "most"),
    [
        ("interaction", 0, 2.5),
        ("smooth", 1949, 1.6),
        ("not undone", 1949, 1.6),
    ],
)
def test_the_command_takes_little_more_than_its_fit(display: str, more: int, most: float, tmp_path: Path) -> None:
    """Start, reading, words and files take the processor 0.8 to 1.7 s, at most ``most`` times the fit with it."""
    readings = _readings(display, more)
    file = tmp_path / "readings.csv"
    rows = np.column_stack([np.arange(len(readings)), 255 * readings.codes, readings.XYZ])
    header = "# codes: 0..255\nname,red,green,blue,X,Y,Z"
    np.savetxt(file, rows, fmt=["%d", *["%.6f"] * 6], delimiter=",", header=header, comments="")
    command = [sys.executable, "-c", COMMAND, "display", "fit", str(file)]
    characterise(_readings("interaction", 0))  # imports what the fit needs
    fit_s = _of_process_s(lambda: characterise(readings))
    taken_s = _of_process_s(lambda: subprocess.run(command, check=True, capture_output=True))
    print(f"{display}, {len(readings)} readings: {taken_s:.1f} s, of which the fit {fit_s:.1f} s")
    assert taken_s <= most * fit_s


def test_seventeen_times_the_readings_take_at_most_ten_times_as_long() -> None:
    characterise(_readings("interaction", 0))
    few_s = _of_process_s(lambda: characterise(_readings("interaction", 0)))
    many_s = {display: _of_process_s(partial(characterise, _readings(display, 1949))) for display in TIMED}
    print(f"{few_s:.2f} s, {many_s}")
    assert max(many_s.values()) <= 10 * few_s
