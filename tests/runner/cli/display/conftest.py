"""Fits that several tests of the commands ask for are made once."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from devices.characterise import choose, thesis
from devices.measurements import Measurements


@pytest.fixture(scope="session", autouse=True)
def _each_fit_once() -> Iterator[None]:
    """Keep what `characterise` and `thesis_fits` return: the same readings and options give the same."""
    kept: dict[Any, Any] = {}
    choose_once, thesis_once = choose.characterise, thesis.thesis_fits

    def characterise(readings: Measurements, *options: Any, **named: Any) -> choose.Characterisation:
        words = (readings.name, readings.eye, readings.mode, readings.assumptions)
        key = (readings.codes.tobytes(), readings.XYZ.tobytes(), words, options, tuple(named.items()))
        if key not in kept:
            kept[key] = choose_once(readings, *options, **named)
        found: choose.Characterisation = kept[key]
        return found

    def thesis_fits(codes: np.ndarray, XYZ: np.ndarray) -> thesis.ThesisFits:
        key = (codes.tobytes(), XYZ.tobytes())
        if key not in kept:
            kept[key] = thesis_once(codes, XYZ)
        found: thesis.ThesisFits = kept[key]
        return found

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(choose, "characterise", characterise)
        patch.setattr(thesis, "thesis_fits", thesis_fits)
        yield
