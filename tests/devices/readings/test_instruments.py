"""A person who types, a simulated instrument, and opening any by name."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from devices.display import DisplayModel, ToneCurve
from devices.errors import DeviceError
from devices.readings import (
    INSTRUMENTS,
    Faults,
    GarbledError,
    LostError,
    PatchOnScreen,
    RangeError,
    Reading,
    Simulated,
    Wiring,
    open_instrument,
)
from devices.readings.open import Manual
from devices.readings.simulated import simulated_XYZ

PRIMARIES = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])
CURVE = ToneCurve(1.0, 0.0, 2.2)
MODEL = DisplayModel(np.array([0.02, 0.02, 0.03]), PRIMARIES, (CURVE, CURVE, CURVE))
NONE = Faults(noise=0.0)


def _typing(*lines: str | None) -> tuple[Manual, list[str]]:
    told: list[str] = []
    typed = iter(lines)
    return Manual(lambda prompt: next(typed), told.append), told


def test_a_person_types_three_numbers_in_any_of_the_usual_ways() -> None:
    manual, told = _typing("1 2 3", "1.5, 2.5,3.5", " 1e1;2e1;3e1 ")
    showing = PatchOnScreen("a", (0.0, 0.0, 0.0), 0)
    assert [manual.read(showing).XYZ_cd_m2 for _ in range(3)] == [(1, 2, 3), (1.5, 2.5, 3.5), (10, 20, 30)]
    assert not told


def test_a_person_who_mistypes_is_asked_again() -> None:
    manual, told = _typing("", "1 2", "1 2 x", "1 2 -3", "1 2 nan", "1 2 3 4", "4 5 6")
    assert manual.read(PatchOnScreen("a", (0.0, 0.0, 0.0), 0)).XYZ_cd_m2 == (4, 5, 6)
    assert len(told) == 6


def test_a_person_skips_or_leaves() -> None:
    manual, _ = _typing("skip", None)
    with pytest.raises(RangeError, match="skipped"):
        manual.read(PatchOnScreen("a", (0.0, 0.0, 0.0), 0))
    with pytest.raises(LostError, match="nobody types"):
        manual.read(PatchOnScreen("a", (0.0, 0.0, 0.0), 0))


def test_a_simulated_instrument_without_faults_reads_the_model() -> None:
    for position, codes in enumerate(np.random.default_rng(1).random((20, 3)).tolist()):
        reading = Simulated(MODEL, 3, NONE).read(PatchOnScreen("a", tuple(codes), position, 900.0))
        np.testing.assert_allclose(reading.XYZ_cd_m2, MODEL.xyz(codes), rtol=1e-12)


def test_the_noise_is_as_large_as_said_and_the_same_for_a_seed() -> None:
    white = [PatchOnScreen("w", (1.0, 1.0, 1.0), position) for position in range(1000)]
    read = np.array([Simulated(MODEL, 7, Faults(noise=0.01)).read(one).XYZ_cd_m2 for one in white])
    share = read / MODEL.xyz([1.0, 1.0, 1.0]) - 1.0
    assert share.std(axis=0) == pytest.approx([0.01] * 3, rel=0.11)  # 5 standard errors
    assert abs(share.mean()) < 5 * 0.01 / np.sqrt(3000)
    again = np.array([Simulated(MODEL, 7, Faults(noise=0.01)).read(one).XYZ_cd_m2 for one in white[99::-1]])[::-1]
    np.testing.assert_array_equal(read[:100], again)
    other = Simulated(MODEL, 8, Faults(noise=0.01)).read(white[0]).XYZ_cd_m2
    assert other != tuple(read[0])


def test_each_fault_does_what_it_says() -> None:
    def light(codes: tuple[float, float, float], faults: Faults) -> np.ndarray:
        return simulated_XYZ(MODEL, np.array(codes), faults)

    black = MODEL.black_XYZ_cd_m2
    lossy = Faults(additivity_loss=0.05)
    np.testing.assert_allclose(light((1, 1, 1), lossy) - black, 0.95 * (MODEL.xyz([1, 1, 1]) - black))
    np.testing.assert_allclose(light((1, 0, 0), lossy), MODEL.xyz([1, 0, 0]))
    mixing = Faults(interaction=0.02)
    np.testing.assert_allclose(light((0.5, 1, 1), mixing), MODEL.xyz([0.52, 1, 1]))
    np.testing.assert_allclose(light((0.5, 0, 0), mixing), MODEL.xyz([0.5, 0, 0]))
    drifting = Simulated(MODEL, 0, Faults(noise=0.0, drift_per_hour=0.1))
    reading = drifting.read(PatchOnScreen("w", (1.0, 1.0, 1.0), 0, 1800.0))
    np.testing.assert_allclose(reading.XYZ_cd_m2, 1.05 * MODEL.xyz([1, 1, 1]))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"noise": "lots"}, "'noise' is 'lots'"),
        ({"nose": "1"}, "no option 'nose'"),
        ({"noise": "-1"}, "cannot be -1"),
        ({"noise": "nan"}, "cannot be nan"),
    ],
)
def test_wrong_faults_are_refused(options: dict[str, str], words: str) -> None:
    with pytest.raises(DeviceError, match=words):
        open_instrument("simulated", Wiring(options=options, model=MODEL))


@pytest.mark.parametrize(
    ("name", "wiring", "words"),
    [
        ("cs200", Wiring(), "did you mean 'cs2000'"),
        ("cs2000", Wiring(), "needs a port"),
        ("pr655", Wiring(), "needs a port"),
        ("cs2000", Wiring("x", {"measure_s": "-1"}), "'measure_s' is '-1'"),
        ("cs2000", Wiring("x", {"speed": "1"}), "no option 'speed'"),
        ("manual", Wiring(options={"a": "b"}), "it has none"),
        ("simulated", Wiring(), "no display model to simulate"),
    ],
)
def test_what_cannot_be_opened_says_why(name: str, wiring: Wiring, words: str) -> None:
    with pytest.raises(DeviceError, match=words):
        open_instrument(name, wiring)


def test_the_command_line_offers_the_instruments_that_there_are() -> None:
    from runner.measuring.options import INSTRUMENT_NAMES

    assert sorted(INSTRUMENTS.own()) == sorted(INSTRUMENT_NAMES)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Reading((1.0, float("nan"), 1.0)),
        lambda: Reading((1.0, 1.0, 1.0), (1.0,), ()),
        lambda: Reading((1.0, 1.0, 1.0), (float("inf"),), (380.0,)),
    ],
)
def test_a_reading_refuses_what_cannot_be(make: Callable[[], Reading]) -> None:
    with pytest.raises(GarbledError):
        make()
