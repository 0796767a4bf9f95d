"""A crop to the aperture changes no pixel on the screen and saves the work for the rest."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Protocol

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.compensation import Rectangle
from devices.display import DisplayModel, EyeModels, ToneCurve
from runner import Picture, Scene
from runner.presenter import EyeArea, PresentationError, Presenter, find_mode, open_surface
from runner.presenter.modes.mode import visible_part
from stimuli.build import StimulusSet
from stimuli.pictures import Part, StereoImage, write_exr

SIZES = st.tuples(st.integers(1, 40), st.integers(1, 40))


class Held(Protocol):
    """Where a picture comes from."""

    def __call__(self, name: str, part: Part | None) -> StereoImage: ...


def held(image: StereoImage) -> Held:
    """Return where ``image`` comes from under any name, cropped after it is whole: what reading a part must equal."""

    def load(name: str, part: Part | None) -> StereoImage:
        if part is None:
            return image
        region = part((image.width_px, image.height_px))
        assert region.is_within(image.width_px, image.height_px)
        left, right = (
            image.eye(eye)[region.top : region.bottom, region.left : region.right] for eye in ("left", "right")
        )
        return StereoImage.flat(left) if image.is_flat else StereoImage(left, right)

    return load


@given(view=SIZES, size=SIZES, aperture=SIZES)
def test_what_is_seen_through_the_aperture_stays_in_its_place(
    view: tuple[int, int], size: tuple[int, int], aperture: tuple[int, int]
) -> None:
    width, height = size
    values = np.arange(width * height * 3, dtype=np.float32).reshape(height, width, 3)
    area = EyeArea(Rectangle(0, 0, *view), eyes=("left",))
    cropped = held(StereoImage.flat(values))("a", visible_part(aperture, area))
    assert cropped.is_flat
    assert (cropped.width_px, cropped.height_px) == (min(width, aperture[0]), min(height, aperture[1]))

    def drawn(image: np.ndarray) -> np.ndarray:
        screen = np.full((view[1], view[0], 3), -1.0, dtype=np.float32)
        place = area.rectangle.centred((image.shape[1], image.shape[0]))
        shown = area.rectangle.intersection(place).intersection(area.rectangle.centred(aperture))
        if not shown.is_empty:
            top, left = shown.top - place.top, shown.left - place.left
            screen[shown.top : shown.top + shown.height, shown.left : shown.left + shown.width] = image[
                top : top + shown.height, left : left + shown.width
            ]
        return screen

    assert np.array_equal(drawn(cropped.left), drawn(values))


def test_the_framebuffer_is_the_same_and_fewer_pixels_are_shaded() -> None:
    curve = ToneCurve(gamma=2.2)
    model = DisplayModel(np.zeros(3), np.array([[40.0, 35, 18], [20, 70, 7], [2, 11, 95]]), (curve, curve, curve))
    rng = np.random.default_rng(0)
    left, right = (model.xyz(rng.random((101, 147, 3))).astype(np.float32) for _ in range(2))
    image = StereoImage(left, right)
    scene = Scene((Picture("a", (3, -5), (60, 40)),))
    mode = find_mode("side-by-side")
    area = mode.areas((401, 200))[0]
    captured, shaded = [], []
    try:
        for part in (None, visible_part((60, 40), area)):
            with (
                open_surface("egl", (401, 200)) as surface,
                Presenter(surface, mode, EyeModels(model, model), partial(held(image), part=part)) as presenter,
            ):
                presenter.show(scene)
                captured.append(presenter.capture()["screen"])
                shaded.append(presenter.counters.pixels_shaded)
    except PresentationError as error:
        pytest.skip(str(error))
    assert np.array_equal(captured[0], captured[1])
    assert captured[0].any()
    assert shaded == [2 * 101 * 147, 2 * 60 * 40]


@pytest.mark.parametrize("flat", [False, True])
@pytest.mark.parametrize("size", [(147, 101), (60, 101), (31, 20)])
@pytest.mark.parametrize("mode", ["side-by-side", "side-by-side-half", "anaglyph-red-cyan"])
def test_a_set_reads_what_is_seen_and_nothing_else(
    tmp_path: Path, size: tuple[int, int], flat: bool, mode: str
) -> None:
    width, height = size
    left, right = np.random.default_rng(0).uniform(0.0, 50.0, (2, height, width, 3)).astype(np.float32)
    write_exr(tmp_path / "a.exr", StereoImage.flat(left) if flat else StereoImage(left, right))
    entry = {"name": "a", "file": "a.exr", "size_px": [width, height]}
    stimuli = StimulusSet(tmp_path / "recipe.yaml", tmp_path, ("a",), "", {"stimuli": [entry]})
    area = find_mode(mode).areas((401, 200))[0]
    read = stimuli.load("a", visible_part((60, 40), area))
    cropped = held(stimuli.load("a"))("a", visible_part((60, 40), area))
    assert read.is_flat is cropped.is_flat is flat
    assert np.array_equal(read.left, cropped.left)
    assert np.array_equal(read.right, cropped.right)
    whole = mode == "side-by-side-half"
    assert (read.width_px, read.height_px) == (size if whole else (min(width, 60), min(height, 40)))
