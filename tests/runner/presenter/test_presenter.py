"""What the presenter draws, where, and how much work it does for it."""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import combinations

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.display import DisplayModel, EyeModels
from runner import Picture, Scene
from runner.presenter import Codes, EyeArea, GraphicsError, PresentationError, Presenter
from runner.scene import Text
from stimuli.pictures import StereoImage

Make = Callable[..., Presenter]
Stereo = Callable[..., StereoImage]


def expected(model: DisplayModel, XYZ: NDArray[np.float32]) -> NDArray[np.float64]:
    return model.code(XYZ.astype(np.float64)) * 255.0


def assert_codes(codes: Codes, reference: NDArray[np.float64]) -> None:
    error = codes.astype(np.float64) - reference
    assert np.abs(error).max() <= 0.501
    assert abs(error.mean()) < 0.01


def test_later_items_cover_earlier_ones(make_presenter: Make, random_stereo: Stereo) -> None:
    presenter = make_presenter({"a": random_stereo(60, 60), "b": random_stereo(60, 60, 5)})
    presenter.show(Scene((Picture("b"),)))
    alone = presenter.eye_view("left")
    presenter.show(Scene((Picture("a"), Picture("b"))))
    np.testing.assert_array_equal(presenter.eye_view("left"), alone)


def test_what_a_scene_does_not_cover_is_black_again(make_presenter: Make, random_stereo: Stereo) -> None:
    pictures = {"whole": random_stereo(480, 320), "part": random_stereo(480, 319)}
    presenter = make_presenter(pictures)
    for first in (Picture("whole"), Picture("part"), Picture("whole", (0, 1)), Picture("whole", (0, 0), (320, 479))):
        presenter.show(Scene((Picture("whole"),)))
        assert presenter.capture()["screen"].all(axis=2).mean() > 0.9
        presenter.show(Scene((first,)))
        seen = presenter.capture()["screen"]
        presenter.show(Scene())
        assert not presenter.capture()["screen"].any()
        presenter.show(Scene((first,)))
        np.testing.assert_array_equal(presenter.capture()["screen"], seen)


def test_flat_shows_a_flat_picture_once_and_refuses_two_views(
    make_presenter: Make, random_stereo: Stereo, same_models: EyeModels
) -> None:
    stereo = random_stereo(60, 640)
    presenter = make_presenter({"flat": StereoImage.flat(stereo.left), "stereo": stereo}, mode="flat")
    presenter.show(Scene((Picture("flat"),)))
    assert_codes(presenter.eye_view("right")[210:270], expected(same_models.left, stereo.left))
    np.testing.assert_array_equal(presenter.eye_view("left"), presenter.eye_view("right"))
    with pytest.raises(PresentationError, match=r"'stereo' has a view for each eye.*flat version"):
        presenter.show(Scene((Picture("stereo"),)))


def test_flat_refuses_models_per_eye(make_presenter: Make, model: Callable[..., DisplayModel]) -> None:
    with pytest.raises(PresentationError, match="characterised per eye"):
        make_presenter({}, mode="flat", models=EyeModels(model(2.0), model(2.1)))


def test_a_still_trial_draws_one_frame_and_keeps_its_onset(make_presenter: Make, random_stereo: Stereo) -> None:
    presenter = make_presenter({"a": random_stereo(20, 20)})
    before_s = time.monotonic()
    onsets_s = {presenter.show(Scene((Picture("a"), Text("Which?")))) for _ in range(5)}
    assert len(onsets_s) == 1
    assert before_s <= onsets_s.pop() <= time.monotonic()
    assert presenter.counters.frames_drawn == 1
    assert presenter.counters.scenes_skipped == 4
    assert len(presenter.swaps.times_s) == 1


def test_nine_trials_decode_upload_and_transform_each_picture_once(
    make_presenter: Make, random_stereo: Stereo, random_XYZ: Callable[..., NDArray[np.float32]]
) -> None:
    flat = StereoImage.flat(random_XYZ(30, 40))
    pictures = {f"s{number}": random_stereo(30, 40, number) for number in range(9)} | {"flat": flat}
    presenter = make_presenter(pictures)
    for first, second in combinations(pictures, 2):
        presenter.prefetch(Scene((Picture(first, (0, -100)), Picture(second, (0, 100)))))
        presenter.show(Scene((Picture(first, (0, -100)), Picture(second, (0, 100)))))
    work = presenter.counters
    assert work.frames_drawn == 45
    assert work.decodes == 10
    assert work.uploads == 9 * 2 + 1
    assert work.bytes_uploaded == 19 * 30 * 40 * 3 * 4
    assert work.colour_passes == 19
    assert work.pixels_shaded == 19 * 30 * 40
    assert work.evictions == 0


def test_the_picture_used_longest_ago_goes_first_and_never_one_that_is_shown(
    make_presenter: Make, random_stereo: Stereo
) -> None:
    one_picture = 2 * 20 * 20 * 4
    pictures = {name: random_stereo(20, 20, seed) for seed, name in enumerate("abc")}
    presenter = make_presenter(pictures, picture_budget_bytes=2 * one_picture)
    presenter.show(Scene((Picture("a"),)))
    presenter.show(Scene((Picture("b"),)))
    presenter.show(Scene((Picture("a"),)))
    presenter.show(Scene((Picture("c"),)))  # b goes
    assert (presenter.counters.decodes, presenter.counters.evictions) == (3, 1)
    presenter.show(Scene((Picture("a"),)))
    assert presenter.counters.decodes == 3
    presenter.show(Scene((Picture("a", (-80, 0)), Picture("b"), Picture("c", (80, 0)))))  # more than the budget
    view = presenter.eye_view("left")
    assert view[:, :100].any()
    assert view[:, 150:170].any()
    assert view[:, 220:].any()


def test_half_float_pictures_are_uploaded_as_they_are(
    make_presenter: Make, random_XYZ: Callable[..., NDArray[np.float32]], same_models: EyeModels
) -> None:
    half = random_XYZ(480, 320).astype(np.float16)
    presenter = make_presenter({"a": StereoImage.flat(half)})  # type: ignore[arg-type]  # halves on purpose
    presenter.show(Scene((Picture("a"),)))
    assert presenter.counters.bytes_uploaded == 480 * 320 * 3 * 2
    assert_codes(presenter.eye_view("left"), expected(same_models.left, half.astype(np.float32)))


def test_capture_shows_the_current_scene_and_black_before_any(make_presenter: Make, random_stereo: Stereo) -> None:
    presenter = make_presenter({"a": random_stereo(20, 20)})
    assert set(presenter.capture()) == {"screen"}
    assert not presenter.capture()["screen"].any()
    presenter.show(Scene((Picture("a"),)))
    np.testing.assert_array_equal(presenter.capture()["screen"], presenter.capture()["screen"])
    assert presenter.capture()["screen"].any()
    assert presenter.counters.frames_drawn == 1


def test_damage_draws_the_scene_again_and_counts_it_apart(make_presenter: Make, random_stereo: Stereo) -> None:
    presenter = make_presenter({"a": random_stereo(20, 20)})
    onset_s = presenter.show(Scene((Picture("a"),)))
    assert presenter.surface.on_damage is not None
    presenter.surface.on_damage()
    assert presenter.counters.frames_drawn == 1
    assert presenter.counters.frames_redrawn == 1
    assert presenter.show(Scene((Picture("a"),))) == onset_s


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_refused_by_name_view_and_count(
    make_presenter: Make, random_stereo: Stereo, bad: float
) -> None:
    picture = random_stereo(20, 20)
    picture.right[3, 4:7, 1] = bad
    presenter = make_presenter({"plate": picture})
    with pytest.raises(PresentationError, match="'plate', right view: 3 pixels"):
        presenter.show(Scene((Picture("plate"),)))
    assert presenter.counters.frames_drawn == 0


def test_a_picture_beyond_the_largest_texture_is_refused(make_presenter: Make) -> None:
    presenter = make_presenter({"long": StereoImage.flat(np.zeros((1, 200_000, 3), np.float32))})
    with pytest.raises(PresentationError, match="'long' is 200000 × 1 px"):
        presenter.show(Scene((Picture("long"),)))


def test_an_error_of_the_driver_is_raised_once(make_presenter: Make) -> None:
    presenter = make_presenter({})
    presenter.surface.context.enable_direct(0xDEAD)
    with pytest.raises(GraphicsError, match="GL_INVALID_ENUM"):
        presenter.show(Scene())
    presenter.show(Scene((Text("again"),)))


def test_a_frame_drawn_again_is_not_worked_out_again(make_presenter: Make, random_stereo: Stereo) -> None:
    presenter = make_presenter({"a": random_stereo(50, 40), "b": random_stereo(50, 40, 3)})
    mode, asked = presenter.mode, []

    class Counted(type(mode)):  # type: ignore[misc]  # a base class that is only known when it runs
        def areas(self, size_px: tuple[int, int], position_px: tuple[int, int] = (0, 0)) -> tuple[EyeArea, ...]:
            asked.append(position_px)
            return mode.areas(size_px, position_px)

    presenter.mode = Counted()
    presenter.show(Scene((Picture("a"), Text("a"))))
    first = presenter.capture()["screen"]
    for _ in range(3):
        presenter.redraw()
    assert len(asked) == 1
    presenter.show(Scene((Picture("b"), Text("a"))))
    assert len(asked) == 2
    assert (presenter.capture()["screen"] != first).any()
    presenter.surface.position_px = (5, 0)
    presenter.redraw()
    assert asked[2:] == [(5, 0)]


def test_a_picture_that_was_let_go_for_a_scene_that_failed_is_made_again(
    make_presenter: Make, random_stereo: Stereo
) -> None:
    broken = random_stereo(50, 40, 5)
    broken.left[0, 0] = np.nan
    pictures = {"a": random_stereo(50, 40), "b": random_stereo(50, 40, 3), "broken": broken}
    presenter = make_presenter(pictures, picture_budget_bytes=1)
    presenter.show(Scene((Picture("a"),)))
    before = presenter.capture()["screen"]
    with pytest.raises(PresentationError, match="'broken'"):
        presenter.show(Scene((Picture("b"), Picture("broken"))))
    assert presenter.counters.evictions == 1
    presenter.redraw()
    assert presenter.counters.uploads == 6
    np.testing.assert_array_equal(presenter.capture()["screen"], before)
