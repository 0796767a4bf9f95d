"""The pointer: within the view, the same in both eyes in every mode, and no new scene."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.display import EyeModels
from runner import Scene
from runner.presenter import PresentationError, Presenter, find_mode
from runner.presenter.pointer import Pointer
from runner.presenter.surfaces.egl import EglSurface
from runner.scene import Text
from tests.choice import nightly

MakePresenter = Callable[..., Presenter]
SCENE = Scene((Text("Which is closer?", (0, -60), width_px=300),))


def _move(presenter: Presenter, right: float, down: float) -> None:
    """Do what a window does when its mouse is moved."""
    presenter._pointer.move(right, down)
    assert presenter.surface.on_point is not None
    presenter.surface.on_point()


@given(st.lists(st.tuples(st.floats(-1e4, 1e4), st.floats(-1e4, 1e4)), min_size=1))
def test_it_never_leaves_the_view(motions: list[tuple[float, float]]) -> None:
    pointer = Pointer((320, 480))
    for motion in motions:
        pointer.move(*motion)
        assert abs(pointer.place_px[0]) < 160
        assert abs(pointer.place_px[1]) < 240


def test_small_motions_add_up_and_the_edge_is_no_spring() -> None:
    pointer = Pointer((320, 480))
    assert not pointer.shown
    for _ in range(10):
        pointer.move(0.4, -0.3)
    assert pointer.place_px == (4, -3)
    assert pointer.shown
    pointer.move(1e6, 0.0)
    pointer.move(-9.0, 0.0)
    assert pointer.place_px == (150, -3)


@pytest.mark.parametrize(
    "mode", ["row-interleaved", "flat", *nightly("side-by-side", "column-interleaved", "top-bottom")]
)
def test_both_eyes_see_it_at_the_same_place(make_presenter: MakePresenter, mode: str) -> None:
    presenter = make_presenter({}, mode)
    presenter.show(Scene())
    presenter.point(True)
    _move(presenter, 31.0, -21.0)
    assert presenter.pointer_px == (31, -21)
    seen = {}
    for eye in ("left", "right"):
        view = presenter.eye_view(eye).max(axis=2)
        area = next(area for area in presenter.areas if eye in area.eyes)
        across, down = area.squeeze
        rows, columns = np.nonzero(view > 200)
        seen[eye] = (columns.min() + columns.max() + 1) * across / 2, (rows.min() + rows.max() + 1) * down / 2
        width, height = area.view_px
        # Within what a woven or squeezed eye can show of the place.
        assert seen[eye] == pytest.approx((width / 2 + 31, height / 2 - 21), abs=1.5)
    assert seen["left"] == pytest.approx(seen["right"], abs=1.0)


def test_each_of_two_windows_has_it(same_models: EyeModels) -> None:
    try:
        surface = EglSurface((320, 480), windows=2)
    except PresentationError as error:
        pytest.skip(str(error))
    with (
        surface,
        Presenter(surface, find_mode("dual-window"), same_models, lambda name: pytest.fail(name)) as presenter,
    ):
        presenter.show(Scene())
        presenter.point(True)
        _move(presenter, 31.0, -21.0)
        captured = presenter.capture()
        np.testing.assert_array_equal(captured["left"], captured["right"])
        rows, columns = np.nonzero(captured["left"].max(axis=2) > 200)
        assert (columns.min() + columns.max() + 1) / 2 == pytest.approx(160 + 31, abs=1.0)
        assert (rows.min() + rows.max() + 1) / 2 == pytest.approx(240 - 21, abs=1.0)


def test_a_motion_is_a_frame_but_no_scene_and_no_onset(make_presenter: MakePresenter) -> None:
    presenter = make_presenter({})
    onset_s = presenter.show(SCENE)
    before = presenter.capture()["screen"]
    presenter.point(True)
    assert presenter.pointer_px is None
    _move(presenter, 5.0, 5.0)
    assert np.any(presenter.capture()["screen"] != before)
    assert presenter.show(SCENE) == onset_s
    work = presenter.counters
    assert (work.frames_drawn, work.pointers_drawn, work.frames_redrawn, work.scenes_skipped) == (1, 1, 0, 1)


def test_it_comes_back_at_once_where_it_was_if_asked(make_presenter: MakePresenter) -> None:
    presenter = make_presenter({})
    presenter.show(SCENE)
    presenter.point(True)
    _move(presenter, 5.0, 7.0)
    presenter.point(False)
    presenter.show(Scene())
    presenter.point(True, at_once=True)
    assert presenter.pointer_px == (5, 7)
    assert presenter.capture()["screen"].any()


def test_it_is_a_white_cross_with_a_black_edge(make_presenter: MakePresenter, egl: EglSurface) -> None:
    presenter = make_presenter({}, "flat")
    presenter.show(Scene((Text("█" * 6, height_px=60, luminance_share=1.0),)))  # white below it
    presenter.point(True)
    _move(presenter, 0.0, 0.0)
    row = presenter.capture()["screen"][240, :, 1].astype(int)
    dark = np.flatnonzero(row[300:340] == 0) + 300
    assert len(dark) == 2  # an edge at each end of the bar
    assert row[320] == 255


def test_in_turns_the_next_frame_has_it(egl: EglSurface, same_models: EyeModels) -> None:
    def load(name: str) -> Any:
        pytest.fail(name)

    with Presenter(egl, find_mode("frame-sequential"), same_models, load) as presenter:
        presenter.show(Scene())
        presenter.point(True)
        frames = presenter.counters.frames_alternated
        _move(presenter, 3.0, 3.0)
        assert presenter.counters.frames_alternated == frames
        captured = presenter.capture()
        np.testing.assert_array_equal(captured["left"][1:-1], captured["right"][1:-1])
        assert captured["left"].any()
