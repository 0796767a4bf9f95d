"""Crosstalk, evenness and glasses from tagged readings in one table, alike in fit and report."""

from __future__ import annotations

import numpy as np
import pytest
import yaml

from devices.characterise import thesis_display
from devices.characterise.measured_parts import measured_parts
from devices.diagnostics import MeasuredSet, examine
from devices.readings import Measurements, PatchEye

DISPLAY = thesis_display()
COLOURS: dict[str, list[float]] = {
    "black": [0, 0, 0],
    "red": [1, 0, 0],
    "green": [0, 1, 0],
    "blue": [0, 0, 1],
    "white": [1, 1, 1],
}
DARK = DISPLAY.xyz([0, 0, 0])


class Readings:
    """A table that grows by a reading at a time."""

    def __init__(self) -> None:
        self.rows: list[tuple[str, list[float], np.ndarray, PatchEye]] = []

    def add(self, name: str, code: list[float], XYZ: np.ndarray, eye: PatchEye = "both") -> None:
        self.rows.append((name, code, XYZ, eye))

    def table(self) -> Measurements:
        names, codes, XYZ, eyes = zip(*self.rows, strict=True)
        return Measurements(np.array(codes), np.array(XYZ), names, eye=eyes, mode="quad-buffered")


def crosstalk(readings: Readings, leak: float = 0.04) -> None:
    eyes: tuple[PatchEye, ...] = ("left", "right")
    for eye in eyes:
        for name, code in COLOURS.items():
            readings.add(name, code, DISPLAY.xyz(code), eye)
            if name != "black":
                readings.add(f"black@other={name}", [0, 0, 0], DARK + leak * (DISPLAY.xyz(code) - DARK), eye)


def grid(readings: Readings, eye: PatchEye = "both", columns: int = 3) -> None:
    for row in (1, 2, 3):
        for column in range(1, columns + 1):
            light = DISPLAY.xyz([0.5] * 3) * (1 - 0.1 * abs(row - 2))
            readings.add(f"gray@r{row}c{column}", [0.5] * 3, light, eye)


def greys(readings: Readings, share: float, eye: PatchEye = "both") -> None:
    for level in (0.25, 0.5, 0.75, 1.0):
        readings.add("gray", [level] * 3, share * DISPLAY.xyz([level] * 3), eye)
        readings.add("gray@no-glasses", [level] * 3, DISPLAY.xyz([level] * 3), eye)


def test_plain_readings_give_no_parts() -> None:
    readings = Readings()
    readings.add("white", [1, 1, 1], DISPLAY.xyz([1, 1, 1]))
    parts = measured_parts(readings.table(), "d.csv")
    assert (parts.lines, parts.glasses, parts.diagnoses, parts.notes) == ({}, {}, (), ())


def test_crosstalk_and_gain_map_are_those_of_the_report_with_their_source() -> None:
    readings = Readings()
    crosstalk(readings)
    grid(readings)
    parts = measured_parts(readings.table(), "d.csv by CS-2000: new")
    assert list(parts.lines) == ["crosstalk", "gain_map"]
    reported = {one.name: one for one in examine([MeasuredSet("d", readings.table())]) if one.output}
    for part, name in (("crosstalk", "crosstalk"), ("gain_map", "uniformity")):
        ours = yaml.safe_load("\n".join(parts.lines[part]))[part]
        theirs = yaml.safe_load(reported[name].output)[part]
        assert ours.pop("source") == theirs.pop("source") + ", of d.csv by CS-2000: new"
        assert ours == theirs
    np.testing.assert_allclose(
        yaml.safe_load("\n".join(parts.lines["crosstalk"]))["crosstalk"]["left"], 0.04 * np.eye(3), atol=1e-6
    )
    assert set(parts.to_json()) == {"crosstalk", "uniformity"}


def test_crosstalk_through_one_lens_is_said_and_not_written() -> None:
    readings = Readings()
    crosstalk(readings)
    left = readings.table().for_eye("left")
    parts = measured_parts(left, "d.csv")
    assert not parts.lines
    assert "no crosstalk is written" in parts.notes[0]


def test_half_a_grid_is_said_and_not_written() -> None:
    readings = Readings()
    grid(readings)
    parts = measured_parts(readings.table().select(np.arange(8)), "d.csv")
    assert not parts.lines
    assert "r3c3 is missing" in parts.notes[0]
    grid(readings, "left", columns=2)
    parts = measured_parts(readings.table(), "d.csv")
    assert not parts.lines
    assert "through each lens alike" in parts.notes[0]


@pytest.mark.parametrize("apart", [False, True])
def test_glasses_are_told_for_each_eye(apart: bool) -> None:
    readings, bare = Readings(), Readings()
    greys(readings, 0.15, "left")
    greys(readings, 0.12, "right")
    table = readings.table()
    if apart:
        for level in (0.25, 0.5, 0.75, 1.0):
            bare.add("gray", [level] * 3, DISPLAY.xyz([level] * 3))
    parts = measured_parts(table, "d.csv", bare.table() if apart else None, ("left", "right"))
    assert [one.value for one in parts.glasses["left"]] == pytest.approx([15, 0])
    assert [one.value for one in parts.glasses["right"]] == pytest.approx([12, 0])
    assert "85 % is lost" in parts.glasses["left"][1].words
    assert set(parts.to_json()["glasses_transmittance"]) == {"left", "right"}
