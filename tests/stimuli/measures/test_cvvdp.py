"""ColorVideoVDP without its package; with it, tests/vdp."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from stimuli.errors import StimulusError
from stimuli.measures import ViewingConditions, measure_names, measure_pictures, measures_named
from stimuli.measures.cvvdp import ColorVideoVDP

GREY = np.full((32, 32, 3), 40.0, dtype=np.float32)


def test_without_the_package_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stimuli.measures.measure.find_spec", lambda name: None)
    with pytest.raises(StimulusError, match="'cvvdp' needs the package pycvvdp") as raised:
        measure_pictures(GREY, GREY, ["cvvdp"], ViewingConditions(45.0))
    assert "pip install '.[vdp]'" in str(raised.value)
    assert "cvvdp" in measure_names()
    assert "cvvdp" not in [measure.name for measure in measures_named(["all"])]


def test_a_package_that_cannot_be_loaded_is_one_message(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(StimulusError, match="ColorVideoVDP cannot be loaded") as raised:
        ColorVideoVDP().measure(GREY, GREY, ViewingConditions(45.0))
    assert "torchvision" in str(raised.value)


def test_too_far_away() -> None:
    with pytest.raises(StimulusError, match="check the viewing distance"):
        ColorVideoVDP().measure(GREY, GREY, ViewingConditions(1e5))
