"""Warm-up at several places of the screen: each with its own time, and whether they differ, both ways by simulation."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np
import pytest

from devices.diagnostics.readings import tag
from devices.diagnostics.settling import place_departures
from devices.diagnostics.warm_up import warm_up
from devices.readings import Measurements
from documents.arrays import Floats

LEVELS = {(2, 1): 0.9, (2, 2): 1.0, (2, 3): 0.95}
ALIKE = dict.fromkeys(LEVELS, 480.0)


def readings(
    tau_s: Mapping[tuple[int, int], float],
    seed: int = 1,
    *,
    excess: float = -0.1,
    rounds: int = 9,
    noise: float = 0.002,
) -> Measurements:
    """Return a grey read at three places, a minute apart, every five minutes from switching on."""
    drawn = np.random.default_rng(seed)
    names, time, light = [], [], []
    for number in range(rounds):
        for place, (own, level) in enumerate(LEVELS.items()):
            at = 300.0 * number + 60.0 * place
            names.append(f"gray120@warm-up-r{own[0]}c{own[1]}" + (f"#{number + 1}" if number else ""))
            time.append(at)
            light.append(60 * level * (1 + excess * np.exp(-at / tau_s[own])) * (1 + noise * drawn.standard_normal()))
    luminance = np.array(light)
    codes = np.full((len(names), 3), 120 / 255)
    return Measurements(codes, luminance[:, None] * [0.95, 1.0, 1.08], tuple(names), np.array(time))


def test_the_tag_holds_the_place() -> None:
    own = tag("gray120@warm-up-r2c1#3")
    assert own is not None
    assert (own.kind, own.parts) == ("warm-up", ("2", "1"))
    whole = tag("gray120@warm-up")
    assert whole is not None
    assert whole.parts == ("", "")


def test_places_that_warm_up_alike_have_their_times_and_do_not_differ() -> None:
    found = warm_up(readings(ALIKE))
    assert found.passed is True
    assert found.value == pytest.approx(480 * np.log(10) / 60, rel=0.25)
    assert found.table is not None
    assert [row[0] for row in found.table.rows] == [f"gray120, row 2, column {column}" for column in (1, 2, 3)]
    assert [row[3] for row in found.table.rows] == pytest.approx([54, 60, 57], rel=0.01)
    assert "The places do not differ in it." in found.words
    assert len(found.series[0].lines) == 6


def test_a_place_that_warms_up_later_is_found_and_named() -> None:
    found = warm_up(readings({**ALIKE, (2, 3): 2000.0}, excess=-0.2))
    assert found.passed is False  # the slowest counts
    assert "The places differ: " in found.words
    departures = dict(re.findall(r"(row 2, column [13]) by up to ([-+]\d[\d.]*) %", found.words))
    assert float(departures["row 2, column 3"]) == pytest.approx(-10, abs=1.5)
    assert abs(float(departures["row 2, column 1"])) < 1.0


def test_without_a_change_nothing_differs_and_all_is_stable_from_the_first() -> None:
    found = warm_up(readings(ALIKE, excess=0.0))
    assert found.passed is True
    assert found.value == 0.0
    assert found.words.count("No change is seen in 9 readings") == 3


def test_a_place_read_too_seldom_is_named() -> None:
    table = readings(ALIKE)
    third = [row for row, name in enumerate(table.name) if "r2c3" in name][3:]
    found = warm_up(table.select(np.setdiff1d(np.arange(len(table)), third)))
    assert found.passed is None
    assert "too few readings at row 2, column 3" in found.words


def test_places_that_agree_exactly_do_not_differ() -> None:
    time: Floats = 300.0 * np.arange(12.0)
    light = 50 * (1 - 0.1 * np.exp(-time / 600))
    assert place_departures({"a": (time, light), "b": (time, 0.8 * light)}) == {}
    assert place_departures({"a": (time, np.full(12, 5.0)), "b": (time, np.full(12, 4.0))}) == {}
