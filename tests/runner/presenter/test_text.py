"""Words: their lines, their letters, their light, and their place in both eyes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.display import DisplayModel, EyeModels
from runner import Picture, Scene
from runner.presenter import Presenter, coverage
from runner.presenter.lettering import break_lines
from runner.presenter.words import ink_codes
from runner.scene import Box, Text
from stimuli.pictures import StereoImage
from tests.choice import nightly

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
