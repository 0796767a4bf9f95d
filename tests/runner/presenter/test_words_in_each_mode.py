"""Each eye sees every letter whole, whichever pixels a mode leaves it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.display import EYES, Eye
from runner import Scene
from runner.presenter import Presenter
from runner.scene import Box, Text
from tests.runner.families import by_family

Make = Callable[..., Presenter]
LETTERS = "abcdefghijklmnopqrstuvwxyz0123456789éßüœ"
STEP_PX, TYPE_PX = 28, 17  # the smallest type on a full HD screen
SHARED = ("row-interleaved", "column-interleaved", "checkerboard", "side-by-side-half", "top-bottom-half")


def stretched(presenter: Presenter, mode: str, eye: Eye) -> NDArray[np.float64]:
    """Return the light that ``eye`` sees, each of its pixels as large as what it stands for."""
    view = (presenter.eye_view(eye)[:, :, 1] / 255.0) ** 2.2
    first = 0 if eye == "left" else 1
    if mode == "row-interleaved":
        return np.repeat(view[first::2], 2, 0)
    if mode == "column-interleaved":
        return np.repeat(view[:, first::2], 2, 1)
    if mode == "checkerboard":  # each missing square is the mean of its neighbours to the left and right
        return np.asarray(view + (np.roll(view, 1, 1) + np.roll(view, -1, 1)) / 2)
    if mode == "side-by-side-half":
        return np.repeat(view, 2, 1)
    if mode == "top-bottom-half":
        return np.repeat(view, 2, 0)
    return view


def letters(presenter: Presenter, mode: str, eye: Eye, place_px: int) -> dict[str, NDArray[np.float64]]:
    """Return how ``eye`` sees each letter, drawn ``place_px`` off its place."""
    places = {
        letter: (STEP_PX * (number % 10 - 5), STEP_PX * (number // 10 - 2) + place_px)
        for number, letter in enumerate(LETTERS)
    }
    presenter.show(Scene(tuple(Text(letter, place, TYPE_PX) for letter, place in places.items())))
    view = stretched(presenter, mode, eye)
    middle = view.shape[1] // 2, view.shape[0] // 2
    half = STEP_PX // 2
    return {
        letter: view[middle[1] + y - half : middle[1] + y + half, middle[0] + x - half : middle[0] + x + half]
        for letter, (x, y) in places.items()
    }


def blurred(views: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return views (..., height, width) as wide as two pixels let them be seen."""
    for axis in (-2, -1):
        views = np.asarray((np.roll(views, 1, axis) + 2 * views + np.roll(views, -1, axis)) / 4)
    return views


def normal(views: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return each view, blurred, as a row whose product with another is their correlation."""
    rows = blurred(views).reshape(len(views), -1)
    rows = rows - rows.mean(axis=1, keepdims=True)
    return np.asarray(rows / np.linalg.norm(rows, axis=1, keepdims=True))


@pytest.mark.parametrize("mode", by_family(SHARED))
def test_each_eye_can_tell_the_letters_apart(make_presenter: Make, mode: str) -> None:
    """By their correlation with letters drawn plainly, where the two fit best within two pixels."""
    plain = letters(make_presenter({}, mode="flat"), "flat", "left", 0)
    templates = normal(np.array(list(plain.values())))
    presenter = make_presenter({}, mode=mode)
    shifts = [(down, across) for down in range(-2, 3) for across in range(-2, 3)]
    for eye in EYES:
        for place_px in (0, 1):  # on a row of its own, and on one of the other eye's
            seen = np.array(list(letters(presenter, mode, eye, place_px).values()))
            # Blurred once: a shift that goes round changes nothing in that.
            rows = normal(seen).reshape(seen.shape)
            shifted = np.array([np.roll(rows, shift, (1, 2)) for shift in shifts]).reshape(len(shifts), len(seen), -1)
            like = (shifted @ templates.T).max(axis=0)  # of each letter seen, with each template
            for number, letter in enumerate(LETTERS):
                assert LETTERS[int(like[number].argmax())] == letter, (eye, place_px)
                assert like[number].max() > 0.8, (eye, place_px, letter)


@pytest.mark.parametrize("mode", by_family(["row-interleaved", "column-interleaved", "checkerboard"]))
def test_a_line_of_one_pixel_is_as_bright_in_both_eyes(make_presenter: Make, mode: str) -> None:
    presenter = make_presenter({}, mode=mode)
    for place_px in (0, 1):
        for size in ((101, 1), (1, 101)):
            presenter.show(Scene((Box((place_px, place_px), size, 1.0),)))
            left, right = (((presenter.eye_view(eye)[:, :, 1] / 255.0) ** 2.15).sum() for eye in EYES)
            assert left == pytest.approx(right, rel=0.03)
            assert left == pytest.approx(101 / 2, rel=0.06)
