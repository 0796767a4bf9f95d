"""Words: their lines, their letters, their light, and their place in both eyes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.display import EYES, DisplayModel, Eye, EyeModels
from runner import Picture, Scene
from runner.presenter import Presenter, coverage
from runner.presenter.lettering import break_lines
from runner.presenter.words import ink_codes
from runner.scene import Box, Text
from stimuli.pictures import StereoImage
from tests.choice import nightly
from tests.runner.families import by_family

Make = Callable[..., Presenter]


@given(st.text(alphabet="abc de\nfgh", max_size=80), st.integers(3, 30))
def test_lines_fit_and_lose_no_letter(words: str, width: int) -> None:
    lines = break_lines(words, width, len)
    assert all(len(line) <= width for line in lines)
    assert "".join("".join(lines).split()) == "".join(words.split())


def test_lines_break_between_words_and_where_they_are_told() -> None:
    assert break_lines("one two three\n\nfour", 9, len) == ["one two", "three", "", "four"]
    assert break_lines("incomprehensible", 6, len) == ["incomp", "rehens", "ible"]
    assert break_lines("40\u00a0µm wide", 6, len) == ["40\u00a0µm", "wide"]


@pytest.mark.parametrize("letter", list("µé—äßñ“…°×²αΩЯ→↑≤"))
def test_letters_that_people_write_are_in_the_font(letter: str) -> None:
    drawn, absent = coverage(letter, 24, 100), coverage("\uffff", 24, 100)
    assert drawn is not None
    assert absent is not None
    assert drawn.max() > 200
    assert drawn.shape != absent.shape or (drawn != absent).any()


def test_edges_are_smooth_and_no_letter_touches_the_border() -> None:
    drawn = coverage("Which image is closer to the reference jgfÅ?", 24, 200)
    assert drawn is not None
    assert len(np.unique(drawn)) > 50
    for border in (drawn[0], drawn[-1], drawn[:, 0], drawn[:, -1]):
        assert not border.any()


@pytest.mark.parametrize("words", ["", " ", "\n\n", "\t"])
def test_nothing_to_say_draws_nothing(make_presenter: Make, words: str) -> None:
    presenter = make_presenter({})
    presenter.show(Scene((Text(words),)))
    assert not presenter.capture()["screen"].any()


def test_full_ink_is_the_asked_share_of_white_through_each_eyes_model(
    make_presenter: Make, model: Callable[..., DisplayModel]
) -> None:
    models = EyeModels(model(1.8, black=0.05), model(2.6, black=0.1))
    presenter = make_presenter({}, models=models)
    presenter.show(Scene((Text("████", height_px=60, luminance_share=0.3),)))
    for eye in ("left", "right"):
        brightest = presenter.eye_view(eye).reshape(-1, 3).max(axis=0)
        display = models.eye(eye)
        expected = display.code(0.3 * display.white_XYZ_cd_m2) * 255.0
        assert np.abs(brightest - expected).max() <= 0.501


def test_an_edge_on_black_has_its_share_of_the_light(model: Callable[..., DisplayModel]) -> None:
    display = model(2.2)
    codes = ink_codes(display, 0.5)
    light = display.xyz(codes[128] / 255.0)[1] / display.white_XYZ_cd_m2[1]
    assert light == pytest.approx(0.5 * 128 / 255, rel=0.02)
    assert (np.diff(codes.astype(int), axis=0) >= 0).all()


def test_words_over_a_picture_cover_it_fully_only_where_they_are_full(
    make_presenter: Make, same_models: EyeModels
) -> None:
    white = np.broadcast_to(same_models.left.white_XYZ_cd_m2, (480, 320, 3)).astype(np.float32)
    presenter = make_presenter({"white": StereoImage.flat(white)})
    presenter.show(Scene((Picture("white"), Text("██", height_px=60, luminance_share=0.2))))
    view = presenter.eye_view("left")
    ink = np.floor(same_models.left.code(0.2 * same_models.left.white_XYZ_cd_m2) * 255.0 + 0.5)
    assert (view[240, 160] == ink).all()
    assert (view[0, 0] == 255).all()
    assert (view >= ink).all()


def test_words_are_rasterised_once_however_bright_and_wherever(make_presenter: Make) -> None:
    presenter = make_presenter({})
    for share in (0.1, 0.2, 0.3):
        presenter.show(Scene((Text("Once", (0, int(100 * share)), luminance_share=share),)))
    assert presenter.counters.texts_rasterised == 1


def _different(view: NDArray[np.integer[Any]]) -> NDArray[np.int64]:
    """The codes of a view that differ, each once, (n, 3)."""
    codes = np.unique(view.reshape(-1, 3) @ np.array([1 << 32, 1 << 16, 1]))
    return np.stack([codes >> 32, codes >> 16 & 0xFFFF, codes & 0xFFFF], axis=1)


@pytest.mark.parametrize(
    "mode", ["row-interleaved", "side-by-side-half", *nightly("side-by-side", "anaglyph-red-cyan")]
)
def test_a_box_is_filled_evenly_with_its_share_of_white(make_presenter: Make, mode: str) -> None:
    presenter = make_presenter({}, mode=mode)
    presenter.show(Scene((Box((0, 0), (2000, 2000), 0.1), Box((2, -4), (8, 6), 0.5))))
    greys = [_different(presenter.eye_view(eye)) for eye in ("left", "right")]
    # Of woven views, the other eye's pixels are 0: beside them, one grey within the small box, one around it, and two
    # in the rows at its edges, whose ink is shared with the other eye.
    lit = [grey[grey.any(axis=1)] for grey in greys]
    assert [len(grey) for grey in lit] == ([4, 4] if mode == "row-interleaved" else [2, 2])
    np.testing.assert_array_equal(lit[0], lit[1])


def test_a_box_covers_just_its_own_pixels_with_the_light_asked(make_presenter: Make, same_models: EyeModels) -> None:
    presenter = make_presenter({}, mode="flat")
    presenter.show(Scene((Box((2, -4), (8, 6), 0.5),)))
    screen = presenter.capture()["screen"]
    rows, columns = np.nonzero(screen.any(axis=2))
    assert (rows.min(), rows.max() + 1, columns.min(), columns.max() + 1) == (233, 239, 318, 326)
    display = same_models.left
    expected = display.code(0.5 * display.white_XYZ_cd_m2) * 255.0
    assert np.abs(screen[rows, columns] - expected).max() <= 0.501


# Each eye sees every letter whole, whichever pixels a mode leaves it.


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
