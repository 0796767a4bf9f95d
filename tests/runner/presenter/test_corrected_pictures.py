"""Pictures made ready in the presenter's pass, as a session has them, against the same made ready in float64."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.compensation import Compensation, Correction, needed_lift
from devices.display import Crosstalk, DisplayModel, EyeModels, GainMap, ToneCurve, read_rig
from runner import Picture, Scene
from runner.presenter import ModeOptions, Presenter, find_mode, open_surface
from runner.presenter.surfaces.egl import EglSurface
from runner.protocol import read_experiment
from runner.session import SessionOptions
from runner.session.station import Station
from stimuli.build import build_set
from stimuli.pictures import StereoImage
from tests.choice import nightly
from tests.runner.families import by_family

Study = Any  # tests/conftest.py
PRIMARIES = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])
LEAKS = Crosstalk(np.diag([0.05, 0.04, 0.06]), np.diag([0.03, 0.05, 0.02]))
GAIN = GainMap(np.array([[0.7, 0.8, 0.75], [0.9, 1.0, 0.95], [0.8, 1.1, 0.85]]), (640, 480), "cells", "centre")
MODES = ["side-by-side-half", "top-bottom", "top-bottom-half", "row-interleaved", "anaglyph-red-cyan"]
# The picture that the processor hands on is float32, which costs a dark channel a code here and there.
MOST_DIFFERENT = 0.002


def _model(gamma: float, scale: float = 1.0) -> DisplayModel:
    curve = ToneCurve(gamma=gamma)
    return DisplayModel(np.array([0.05, 0.06, 0.07]), scale * PRIMARIES, (curve, curve, curve))


@pytest.fixture
def picture() -> StereoImage:
    """Two views of odd size, dark against bright here and there."""
    rng = np.random.default_rng(8)
    return StereoImage(*((rng.random((91, 121, 3)) ** 3 @ PRIMARIES.T).astype(np.float32) for _ in range(2)))


def _codes(presenter: Presenter, place_px: tuple[int, int] = (12, -20)) -> NDArray[np.int64]:
    with presenter:
        presenter.show(Scene((Picture("a", place_px),)))
        return presenter.capture()["screen"].astype(np.int64)


def _before(compensation: Compensation) -> Callable[[StereoImage, tuple[int, int]], StereoImage]:
    """Return what corrects a picture in float64, before it is handed to the presenter."""
    return lambda image, place_px: StereoImage(*compensation.apply((image.left, image.right), place_px)[0])


@pytest.mark.parametrize("mode", ["side-by-side", *by_family(MODES)])
@pytest.mark.parametrize(
    ("leaks", "gain_map", "lift_share"),
    [(LEAKS, GAIN, 0.0), *nightly((LEAKS, None, 0.0), (LEAKS, None, 0.05), (None, GAIN, 0.0))],
)
def test_the_pass_shows_what_was_computed_in_float64_before(
    egl: EglSurface,
    picture: StereoImage,
    mode: str,
    leaks: Crosstalk | None,
    gain_map: GainMap | None,
    lift_share: float,
) -> None:
    one = _model(2.2)
    models = EyeModels(one, one if mode.startswith("anaglyph") else _model(1.9, 0.9))
    options = ModeOptions.parse({"anaglyph": "channels"} if mode.startswith("anaglyph") else {})
    stereo_mode = find_mode(mode, options)
    correction = Correction(leaks, gain_map, lift_share)
    compensation = stereo_mode.compensation(models, (640, 480), correction)
    in_pass = _codes(Presenter(egl, stereo_mode, models, lambda _: picture, correction=correction))
    before = _codes(Presenter(egl, stereo_mode, models, lambda _: picture, prepare=_before(compensation)))
    untouched = _codes(Presenter(egl, stereo_mode, models, lambda _: picture))
    assert np.abs(in_pass - before).max() <= 1
    shown_px = np.count_nonzero(untouched.any(axis=-1))
    # A squeezed code's place is known to the pixel of the signal, which moves the gain by less than a tenth of a code.
    most = 0.1 if gain_map is not None and mode.endswith("half") else MOST_DIFFERENT
    assert np.count_nonzero((in_pass != before).any(axis=-1)) <= most * shown_px
    assert np.abs(in_pass - untouched).max() > 3
    assert (compensation.mixture is not None) == mode.startswith("anaglyph")
    if mode.startswith("anaglyph"):  # the pass cannot: the presenter does the same in float64
        assert np.array_equal(in_pass, before)


def test_in_a_squeezed_mode_what_cannot_be_cancelled_is_counted_on_what_is_averaged(picture: StereoImage) -> None:
    models = EyeModels(_model(2.2), _model(2.2))
    stripes = np.zeros((4, 6, 3), np.float32)
    stripes[:, ::2] = 40.0  # a dark column between bright ones: on the signal, all columns are grey
    bright = np.full_like(stripes, 40.0)

    def negative(mode: str) -> float:
        compensation = find_mode(mode).compensation(models, (640, 480), Correction(LEAKS))
        return float(compensation.apply((stripes, bright))[1]["left"]["percent_negative"])

    assert negative("side-by-side") == 50.0
    assert negative("side-by-side-half") == 0.0


def test_the_lift_is_what_the_averaged_pictures_need(study: Study) -> None:
    study.edit(
        "display.yaml",
        "  quad-buffered: {same_as: side-by-side}\n",
        "    crosstalk:\n"
        "      left: [[0.05, 0, 0], [0, 0.04, 0], [0, 0, 0.06]]\n"
        "      right: [[0.03, 0, 0], [0, 0.05, 0], [0, 0, 0.02]]\n"
        "  side-by-side-half: {same_as: side-by-side}\n",
    )
    study.edit("rig.yaml", "distance_mm: 700\n", "distance_mm: 700\nlift_black: true\n")
    dark, bright = np.zeros((4, 6, 3), np.float32), np.full((4, 6, 3), 30.0, np.float32)
    dark[:, ::2] = 0.2
    for mode, averaged in (("side-by-side", dark), ("side-by-side-half", np.full_like(dark, 0.1))):
        rig = read_rig(study.folder / "rig.yaml", mode)
        assert rig.crosstalk is not None
        plain = find_mode(mode).compensation(rig.models, (640, 480), Correction(rig.crosstalk))
        found = plain.lifted_for([(dark, bright)]).correction
        wanted = needed_lift(rig.models, rig.crosstalk, averaged, bright)
        assert wanted > 0.01
        assert found.lift_share == pytest.approx(wanted, rel=1e-5)


GAIN_MAP = """    gain_map:
      luminance: [[0.7, 0.8, 0.75], [0.9, 1.0, 0.95], [0.8, 0.9, 0.85]]
      positions: cells
      normalise: centre
    crosstalk:
      left: [[0.05, 0, 0], [0, 0.04, 0], [0, 0, 0.06]]
      right: [[0.03, 0, 0], [0, 0.05, 0], [0, 0, 0.02]]
"""


def test_a_session_compensates_in_its_pass_and_for_each_place(study: Study) -> None:
    study.edit("display.yaml", "    source: made up for tests\n", f"    source: made up for tests\n{GAIN_MAP}")
    design = read_experiment(study.experiment)
    stimuli = build_set(design.recipe_file, design.rig.display.panel.pixel_pitch_mm)
    places = design.places_px
    assert len(places) == 2
    with Station.open(design, stimuli, SessionOptions(study.results, backend="egl")) as station:
        for name in stimuli.names:
            station.presenter.prefetch(Scene(tuple(Picture(name, place) for place in places)))
        work = station.presenter.counters
        # Two stereo pictures and two flat ones, at two places each; leaks differ by eye, so that each is two passes.
        assert work.colour_passes == 4 * 2 * 2
        assert work.uploads == (2 * 2 + 2 * 1) * 2
        scene = Scene(tuple(Picture("one", place) for place in places))
        station.presenter.show(scene)
        shown = station.presenter.capture()["screen"].astype(np.int64)
        assert station.presenter.counters.uploads == work.uploads
    rig = design.rig
    compensation = design.mode.compensation(rig.models, (640, 480), Correction(rig.crosstalk, rig.gain_map))
    load = partial(stimuli.load, part=design.visible_part)
    with (
        open_surface("egl", (640, 480)) as surface,
        Presenter(surface, design.mode, rig.models, load, prepare=_before(compensation)) as presenter,
    ):
        presenter.show(scene)
        twin = presenter.capture()["screen"].astype(np.int64)
    assert shown.any()
    assert np.abs(shown - twin).max() <= 1
    assert np.count_nonzero(shown != twin) <= MOST_DIFFERENT * np.count_nonzero(twin)


@pytest.mark.parametrize("mode", by_family(["side-by-side", "side-by-side-half", "top-bottom-half"]))
@pytest.mark.parametrize("lift_share", [*nightly(0.0), 0.05])
def test_what_is_left_of_crosstalk_is_alike_in_blocks_and_at_once(
    picture: StereoImage, mode: str, lift_share: float
) -> None:
    models = EyeModels(_model(2.2), _model(1.9, 0.9))
    compensation = find_mode(mode).compensation(models, (640, 480), Correction(LEAKS, None, lift_share))
    at_once = compensation.apply((picture.left, picture.right))[1]
    in_blocks = compensation.uncancelled((picture.left, picture.right))
    assert in_blocks["lift_share"] == at_once["lift_share"]
    for eye in ("left", "right"):
        assert in_blocks[eye] == pytest.approx(at_once[eye], abs=1.5e-5)  # a unit of the last place that is kept
        assert at_once[eye]["delta_e_00_mean"] > 0.0


def test_the_lift_of_a_picture_is_alike_in_blocks_and_at_once(picture: StereoImage) -> None:
    models = EyeModels(_model(2.2), _model(1.9, 0.9))
    mode, pair = find_mode("side-by-side"), (picture.left, picture.right)
    found = mode.compensation(models, (640, 480), Correction(LEAKS)).needed_lift(pair)
    assert found == pytest.approx(needed_lift(models, LEAKS, picture.left, picture.right), rel=1e-12)
    assert found > 0.0
    assert mode.compensation(models, (640, 480), Correction()).needed_lift(pair) == 0.0
