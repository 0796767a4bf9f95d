"""Fits that several tests of the commands ask for are made once."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from devices.characterise import choose, display_fit, thesis
from devices.characterise.patches import Patches


@pytest.fixture(scope="session", autouse=True)
def _each_fit_once() -> Iterator[None]:
    """Keep what `fit_all` and `thesis_fits` return: the same readings give the same."""
    kept: dict[Any, Any] = {}
    fit_once, thesis_once = choose.fit_all, thesis.thesis_fits

    def fit_all(data: Patches, starts: dict[str, np.ndarray], *, judged: bool = True) -> Any:
        # Folds begin where the whole fit ended: which that was, their readings and the whole's numbers tell.
        begun = tuple(numbers.tobytes() for numbers in starts.values())
        key = (data.codes.tobytes(), data.XYZ.tobytes(), begun, judged)
        if key not in kept:
            kept[key] = fit_once(data, starts, judged=judged), dict(starts)
        found, after = kept[key]
        starts.update(after)
        return found

    def thesis_fits(codes: np.ndarray, XYZ: np.ndarray) -> thesis.ThesisFits:
        key = (codes.tobytes(), XYZ.tobytes())
        if key not in kept:
            kept[key] = thesis_once(codes, XYZ)
        found: thesis.ThesisFits = kept[key]
        return found

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(choose, "fit_all", fit_all)
        patch.setattr(display_fit, "thesis_fits", thesis_fits)
        yield
