"""Pictures that are wanted later are made ready one by one between the events of a window, while there is room."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from devices.display import read_display
from runner import Picture, Scene
from runner.presenter import Presenter, Surface, find_mode, open_surface
from runner.presenter.presenter import PICTURE_BUDGET_BYTES
from stimuli.pictures import StereoImage

ASUS = Path(__file__).parents[3] / "configs/displays/asus_vg248qe.yaml"
SIDE = 8
NAMES = ("a", "b", "c", "d", "e", "f", "g")


def _scene(*names: str) -> Scene:
    return Scene(tuple(Picture(name) for name in names))


def _load(name: str) -> StereoImage:
    if name == "b":
        raise OSError("it cannot be read")
    return StereoImage.flat(np.full((SIDE, SIDE, 3), 5.0, np.float32))


def _wait_for_keys(surface: Surface, until: Callable[[], bool], most_s: float) -> bool:
    """Do what a window does while it waits for a key, until something has come true."""
    end_s = time.monotonic() + most_s
    while not until():
        if time.monotonic() > end_s:
            return False
        assert surface.on_wake is not None
        surface.on_wake()
        time.sleep(0.001)
    return True


@pytest.mark.parametrize("budget", [PICTURE_BUDGET_BYTES, 3 * SIDE * SIDE * 4])
def test_what_is_wanted_later_follows_what_comes_next(budget: int) -> None:
    display = read_display(ASUS)
    with (
        open_surface("egl", (64, 48)) as surface,
        Presenter(
            surface, find_mode("side-by-side"), display.models("side-by-side"), _load, picture_budget_bytes=budget
        ) as presenter,
    ):
        may = False
        presenter.show(_scene("a"))
        presenter.prefetch_later((_scene(name) for name in NAMES), lambda: may)
        presenter.prefetch(_scene("e"))
        assert _wait_for_keys(surface, lambda: presenter.counters.decodes == 2, 30.0)
        assert not _wait_for_keys(surface, lambda: presenter.counters.decodes > 2, 0.05)
        may = True
        # One cannot be read, and the others follow all the same; where there is no room they end with the first that
        # takes another's.
        last = 6 if budget == PICTURE_BUDGET_BYTES else 4
        assert _wait_for_keys(surface, lambda: presenter.counters.decodes == last, 30.0)
        assert not _wait_for_keys(surface, lambda: presenter.counters.decodes > last, 0.05)
        done = presenter.counters
        assert done.evictions == (0 if last == 6 else 1)
        presenter.show(_scene("e"))
        assert presenter.counters.uploads == done.uploads
