"""Readings that no display gives: every check answers with a verdict or a reason, in finite numbers."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.diagnostics import MeasuredSet, examine
from devices.display import EyeModels
from devices.readings import Faults, Measurements, PatchEye
from tests.devices.diagnostics.simulated import MODEL, characterisation
from tests.devices.diagnostics.simulated_cable import CHECKS, read_cable

NAMES = ["white", "black", "red", "a@r1c1", "a@r1c2", "a@r2c1", "a@0deg", "a@20deg", "a@v-5deg", "a@on-white"]
NAMES += ["a@on-black", "black@other=white", "black@other=red", "x@r99c99", "b@90000deg"]
EYES: list[PatchEye] = ["left", "right", "both"]
light = st.one_of(st.sampled_from([0.0, -1.0, 1e-30, 1e30, 1.0, 5.0]), st.floats(-1e6, 1e6))


@st.composite
def tables(draw: st.DrawFn) -> Measurements:
    count = draw(st.integers(1, 24))
    code = st.sampled_from([0.0, 0.25, 0.5, 0.75, 1.0])
    codes = draw(st.lists(st.tuples(code, code, code), min_size=count, max_size=count))
    xyz = draw(st.lists(st.tuples(light, light, light), min_size=count, max_size=count))
    names = draw(st.lists(st.sampled_from(NAMES), min_size=count, max_size=count))
    eyes = draw(st.lists(st.sampled_from(EYES), min_size=count, max_size=count))
    times = draw(st.none() | st.lists(st.sampled_from([0.0, 1.0, 2.0, 60.0, 1e9]), min_size=count, max_size=count))
    spectra = np.abs(np.array(xyz)) if draw(st.booleans()) else None
    waves = None if spectra is None else np.array([450.0, 550.0, 650.0])
    time_s = None if times is None else np.array(times)
    return Measurements(np.array(codes), np.array(xyz), tuple(names), time_s, tuple(eyes), "", spectra, waves)


# More of them: tests/stress.
@settings(max_examples=3, deadline=None)
@given(tables(), st.booleans())
def test_any_readings_get_an_answer(table: Measurements, against_clean: bool) -> None:
    check_answers(table, against_clean)


def check_answers(table: Measurements, against_clean: bool) -> None:
    """Assert that every check of ``table`` answers, beside a clean display or itself without glasses."""
    other = MeasuredSet("other", characterisation() if against_clean else table)
    found = examine([MeasuredSet("a", table), other], models=EyeModels(MODEL, MODEL), without_glasses=other)
    json.dumps([one.to_json() for one in found], allow_nan=False)
    for one in found:
        assert one.words
        assert one.value is None or np.isfinite(one.value)
        assert one.passed is None or one.value is not None or one.passed is False


@cache
def cable_table(noise: float, seed: int) -> Measurements:
    """Return a simulated set ``cable``: a second each on a busy machine, and few are different."""
    return read_cable(MODEL, Faults(noise=noise), seed)


@st.composite
def cable_tables(draw: st.DrawFn) -> Measurements:
    """The set ``cable`` with readings left out, and with light that no display gives."""
    table = cable_table(draw(st.sampled_from([0.0, 0.002, 0.5])), 3)
    rng = np.random.default_rng(draw(st.integers(0, 1000)))
    changed = np.array(table.XYZ)
    how = draw(st.sampled_from(["some", "all alike", "none", "negative", "reversed", "huge"]))
    if how == "some":
        rows = rng.random(len(table)) < 0.1
        changed[rows] = rng.choice([0.0, -1.0, 1e-30, 1e30, 5.0], (int(rows.sum()), 3))
    elif how in ("all alike", "none"):
        changed[:] = 1.0 if how == "all alike" else 0.0
    else:
        changed = {"negative": -changed, "reversed": changed.max() - changed, "huge": 1e250 * changed}[how]
    kept = rng.random(len(table)) < draw(st.sampled_from([0.2, 0.7, 1.0]))
    return replace(table, XYZ=changed).select(np.flatnonzero(kept | (np.arange(len(table)) == 0)))


@pytest.mark.nightly
@settings(max_examples=15, deadline=None)
@given(cable_tables())
def test_any_readings_of_the_set_cable_get_an_answer(table: Measurements) -> None:
    check_cable_answers(table)


def test_a_wild_reading_of_a_primary_gets_an_answer() -> None:
    """Of this table one reading of full blue has a Z of 1e30."""
    table = cable_table(0.5, 3)
    rng = np.random.default_rng(7)
    wild, rows = np.array(table.XYZ), rng.random(len(table)) < 0.1
    wild[rows] = rng.choice([0.0, -1.0, 1e-30, 1e30, 5.0], (int(rows.sum()), 3))
    check_cable_answers(replace(table, XYZ=wild))


def check_cable_answers(table: Measurements) -> None:
    """Assert that every check of what codes pass on their way answers in finite numbers."""
    for one in (check(table) for check in CHECKS):
        json.dumps(one.to_json(), allow_nan=False)
        assert one.words
        assert one.value is None or np.isfinite(one.value)
