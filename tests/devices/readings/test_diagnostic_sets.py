"""The sets for single diagnoses: read with a simulated display, each is judged, passes, and finds its own fault.

Sets of patches, read with a simulated instrument as a measurement reads them, without a screen.
"""

from __future__ import annotations

import itertools
import re

import numpy as np
import pytest
from numpy.typing import ArrayLike

from devices.diagnostics import Diagnosis, MeasuredSet, examine
from devices.diagnostics.room_light import room_lights
from devices.display import EyeModels
from devices.errors import DeviceError
from devices.readings import (
    Arrangement,
    Faults,
    Measurements,
    Patch,
    PatchEye,
    Place,
    Showing,
    Simulated,
    SimulatedDisplay,
    find_sets,
    steps,
)
from devices.readings.sets import DIAGNOSTIC
from tests.devices.diagnostics.simulated import MODEL


def read_sets(
    names: tuple[str, ...], faults: Faults, eye: PatchEye = "both", seed: int = 1, room: ArrayLike = (0.0, 0.0, 0.0)
) -> Measurements:
    """Read the sets as `display measure` does, 15 s a patch."""
    model = MODEL.in_room(room)
    instrument = Simulated(SimulatedDisplay(EyeModels(model, model)), seed, faults, eye)
    taken, time_s, now_s = [], [], 0.0
    shown = steps(find_sets(names), seed, eye=eye)
    for step in shown:
        patch = step.patch
        now_s += max(15.0, patch.wait_s)
        black = (0.0, 0.0, 0.0)
        other = patch.other if patch.other is not None else patch.codes if eye == "both" else black
        place = (0.5, 0.5) if patch.place is None else patch.place.centre
        showing = Showing(step.label, patch.codes, step.position, now_s, other, patch, place)
        taken.append(instrument.read(showing).XYZ_cd_m2)
        time_s.append(now_s)
    return Measurements(
        np.array([step.patch.codes for step in shown]), np.array(taken), tuple(step.patch.name for step in shown),
        np.array(time_s), tuple(step.patch.eye or eye for step in shown),
        area=np.array([step.patch.filled for step in shown]),
        surround=np.array([step.patch.surround for step in shown]),
    )  # fmt: skip


def _judged(table: Measurements) -> dict[str, Diagnosis]:
    return {one.name: one for one in examine([MeasuredSet("m", table)])}


@pytest.mark.parametrize("eye", ["both", pytest.param("left", marks=pytest.mark.nightly)])
def test_all_sets_let_every_check_be_made_and_a_display_without_fault_passes(eye: PatchEye) -> None:
    found = _judged(read_sets(("all",), Faults(noise=0.001, glasses_loss=0.85), eye))
    undecided = {name for name, one in found.items() if one.passed is None}
    # Spectra are not simulated; a gamut, a contrast and primaries of a standard are numbers without a verdict.
    assert undecided == {"spectral_overlap", "observer_metamerism", "gamut", "room_light", "standard_primaries"}
    failed = {name: one.value for name, one in found.items() if one.passed is False}
    # Taking the glasses off moves the gamut by nothing here; nothing else is planted either.
    assert failed == {}


@pytest.mark.parametrize(
    ("name", "check", "fault", "value"),
    [
        ("crosstalk", "crosstalk", {"crosstalk": 0.08}, 8.0),
        ("uniformity", "uniformity", {"edge_loss": 0.5}, 100 * 0.5 * 4 / 9),
        ("on-white", "pixel_independence", {"surround_gain": 0.05}, 5.0),
        ("additivity", "additivity", {"additivity_loss": 0.08}, 8.7),
        ("repeatability", "repeatability", {"noise": 0.01}, 1.0),
        ("warm-up", "warm_up", {"warm_up_loss": 0.9}, None),
        ("glasses", "glasses_transmittance", {"glasses_loss": 0.4}, 60.0),
        ("angles", "angular_luminance", {"angle_loss": 1.0}, 9.5),
    ],
)  # fmt: skip
def test_each_set_finds_its_own_fault(name: str, check: str, fault: dict[str, float], value: float | None) -> None:
    found = _judged(read_sets((name,), Faults(**{"noise": 0.001, **fault})))[check]
    assert found.passed is False
    if value is not None:
        assert found.value == pytest.approx(value, rel=0.15)


def test_negative_crosstalk_is_found_and_told_in_words() -> None:
    found = _judged(read_sets(("crosstalk",), Faults(noise=0.001, crosstalk=-0.03)))["crosstalk"]
    assert found.passed is True
    assert found.value == pytest.approx(3.0, abs=0.4)
    assert "negative crosstalk" in found.words
    assert "were left out of the matrix" in found.words
    numbers = [float(number) for number in re.findall(r"-?\d\.\d{6}", found.output)]
    assert numbers[0] == pytest.approx(-0.03, abs=0.004)
    assert _judged(read_sets(("crosstalk",), Faults(noise=0.001, crosstalk=-0.08)))["crosstalk"].passed is False
    none = _judged(read_sets(("crosstalk",), Faults(noise=0.005)))["crosstalk"]
    assert "negative" not in none.words


def test_the_room_s_light_is_read_with_the_display_switched_off() -> None:
    ambient = np.array([0.3, 0.32, 0.27])
    table = read_sets(("grey", "ambient"), Faults(noise=0.001), room=ambient)
    found = room_lights(table)["both"]
    assert found.readings == 3
    assert found.held
    assert found.ambient_XYZ_cd_m2 == pytest.approx(ambient, rel=0.01)
    start = Arrangement("left")
    off = Arrangement("left", screen_off=True)
    assert "switch the display off" in off.request(start)
    assert start.request(off).startswith("Switch the display on again")


def test_a_set_leaves_the_plain_readings_alone() -> None:
    """What is read for a diagnosis never looks like a reading of the display as it is characterised."""
    from devices.diagnostics import plain

    told = ("crosstalk", "uniformity", "on-white", "warm-up", "angles")
    assert len(plain(read_sets(told, Faults()))) == 0
    assert {name for name in plain(read_sets(("glasses",), Faults())).name if "@" in name} == set()


@pytest.mark.parametrize("eye", ["both", "left", "right"])
def test_the_instrument_is_moved_once_for_each_arrangement(eye: PatchEye) -> None:
    order = steps(find_sets(("all",)), 3, eye=eye)
    stood = [arrangement for arrangement, _ in itertools.groupby(step.patch.arrangement(eye) for step in order)]
    assert len(stood) == len(set(stood))
    assert stood[0] == Arrangement(eye)
    assert len({step.label for step in order}) == len(order)


START, CORNER, SIDE = Arrangement("left"), Arrangement("left", Place(1, 3)), Arrangement("left", angle="v-10deg")

BARE = Arrangement("left", glasses=False)


@pytest.mark.parametrize(
    ("before", "after", "request_"),
    [
        (START, START, "^$"),
        (START, CORNER, "at the patch .row 1, column 3: top right"),
        (CORNER, START, "at the middle of the screen"),
        (START, Arrangement("right"), "^Put the right lens"),
        (START, BARE, "^Take the glasses away"),
        (BARE, START, "^Put the glasses .* again. Put the left lens"),
        (START, SIDE, "middle of the screen from 10° below"),
        (SIDE, START, "straight ahead"),
    ],
)
def test_what_a_person_must_do_is_told(before: Arrangement, after: Arrangement, request_: str) -> None:
    assert re.search(request_, after.request(before))


def test_wrong_patches_are_refused() -> None:
    with pytest.raises(DeviceError, match="which eye is read"):
        Patch("a", (0.0, 0.0, 0.0), other=(1.0, 1.0, 1.0))
    with pytest.raises(DeviceError, match="cannot wait"):
        Patch("a", (0.0, 0.0, 0.0), wait_s=float("inf"))
    with pytest.raises(DeviceError, match="three in"):
        Patch("a", (0.0, 0.0, 0.0), around=(2.0, 0.0, 0.0))
    with pytest.raises(DeviceError, match="no row 4"):
        Place(4, 1)
    with pytest.raises(DeviceError, match="did you mean 'uniformity'"):
        find_sets(("unifomity",))
    with pytest.raises(DeviceError, match="no set"):
        find_sets(())


def test_sets_are_named_once_and_all_holds_one_for_each_diagnosis() -> None:
    assert [one.name for one in find_sets(("grey", "uniformity", "grey"))] == ["grey", "uniformity"]
    assert set(DIAGNOSTIC) - {"warm-up-places"} <= {one.name for one in find_sets(("all",))}


def test_the_places_of_a_warm_up_are_read_round_after_round() -> None:
    (places,) = find_sets(("warm-up-places",), every_s=60.0)
    order = steps((places, find_sets(("warm-up",))[0]), 5)
    assert [step.label for step in order[:4]] == [
        "gray120@warm-up-r2c1",
        "gray120@warm-up-r2c2",
        "gray120@warm-up-r2c3",
        "gray120@warm-up-r2c1#2",
    ]
    assert [step.patch.wait_s for step in order[:4]] == [60.0, 0.0, 0.0, 60.0]
    assert len(order) == 21 + 31
    assert steps(places, 1) == steps(places, 2)
