"""Measuring pushed: many kills, a panel of 4K in every mode, a long measurement with spectra."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from devices.diagnostics import MeasuredSet, examine
from devices.readings import Faults, MeasurementLog, Patch, PatchSet, Reading, read_session, step_facts, steps
from devices.readings.read import measurements_of
from documents import InputError
from runner.measuring.code_screen import CodeScreen, EyeCodes
from runner.presenter import MODES, find_mode, open_surface
from tests.devices.readings.test_sets import read_sets
from tests.runner.measuring.displays import write_rig
from tests.runner.measuring.test_commands import DISPLAY
from tests.stress.killed_measurement import kill_and_resume

pytestmark = pytest.mark.stress


@pytest.mark.parametrize("seed", range(10, 18))
def test_killed_again_and_again(tmp_path: Path, seed: int) -> None:
    kill_and_resume(write_rig(tmp_path, DISPLAY), seed)


@pytest.mark.parametrize("mode", [mode for mode in MODES if mode != "quad-buffered"])
def test_every_pixel_of_a_4k_panel(mode: str) -> None:
    try:
        surface = open_surface("egl", (3840, 2160), windows=find_mode(mode).windows)
    except InputError as error:
        pytest.skip(str(error))
    with surface, CodeScreen(surface, find_mode(mode)) as screen:
        right = (3, 100, 254) if not screen.shared else (200, 1, 77)
        both = [(red / 255, green / 255, blue / 255) for red, green, blue in ((200, 1, 77), right)]
        screen.show(EyeCodes(both[0], both[1]))
        assert np.all(screen.seen_by("left") == (200, 1, 77))
        assert np.all(screen.seen_by("right") == right)


def test_five_thousand_readings_with_spectra(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    patches = tuple(Patch(f"p{number}", tuple(codes)) for number, codes in enumerate(rng.random((5000, 3)).tolist()))
    order = steps(PatchSet("many", patches), 1, 50)
    facts = {"begun_utc": "2026-01-02T03:04:05+00:00", "instrument": "", "mode": "flat", "eye": "both"}
    facts |= {"set": "many", "set_source": ""}
    header = {**facts, "seed": 1, "highest_code": 255, "steps": step_facts(order)}
    wavelengths = tuple(float(nm) for nm in range(380, 781))
    file = tmp_path / "m.jsonl"
    with MeasurementLog.create(file, header) as log:
        for step in order:
            log.keep(step, step.position, Reading((1.0, 2.0, 3.0), tuple(rng.random(401).tolist()), wavelengths))
    begun_s = time.process_time()
    table = measurements_of(read_session(file))
    took_s = time.process_time() - begun_s
    assert table.spectra is not None
    assert table.spectra.shape == (len(order), 401)
    assert took_s < 20.0


@pytest.mark.parametrize("seed", range(40))
def test_any_faults_of_the_display_are_found_by_the_sets_and_none_is_made_up(seed: int) -> None:
    """Faults drawn at random, each nothing or twice its limit: every check says which there are."""
    rng = np.random.default_rng(seed)
    twice = {"crosstalk": 0.1, "edge_loss": 0.45, "surround_gain": 0.04, "additivity_loss": 0.06, "angle_loss": 1.8}
    checks = {
        "crosstalk": "crosstalk",
        "edge_loss": "uniformity",
        "surround_gain": "pixel_independence",
        "additivity_loss": "additivity",
        "angle_loss": "angular_luminance",
    }
    planted = {name: value for name, value in twice.items() if rng.random() < 0.5}
    table = read_sets(("all",), Faults(noise=0.002, glasses_loss=0.8, **planted), "left", seed)
    judged = {one.name: one for one in examine([MeasuredSet("m", table)])}
    assert {checks[name] for name in planted} == {name for name in checks.values() if judged[name].passed is False}
    assert judged["glasses_transmittance"].passed is True
