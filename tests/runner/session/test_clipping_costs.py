"""A picture's costs are computed once, read from the cache, and computed again where what they depend on changed."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import astuple
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import runner.session.clipping_costs
from analysis.records import read_session, session_files
from devices.compensation import Compensation, Correction, eye_clip_costs
from devices.display import EyeModels
from runner.check import CheckOptions, check_file
from runner.protocol import Experiment, read_experiment
from runner.session.clipping_costs import COST_VERSION, COSTS, ClippingCosts, clipping_record
from stimuli.build import build_set
from stimuli.pictures import StereoImage, read_exr, write_exr
from tests.choice import nightly

Study = Any  # tests/conftest.py
CROSSTALK = """    crosstalk:
      left: [[0.05, 0, 0], [0, 0.04, 0], [0, 0, 0.06]]
      right: [[0.03, 0, 0], [0, 0.05, 0], [0, 0, 0.02]]
"""
GAIN = "    gain_map: {luminance: [[0.7, 0.8], [0.9, 1.0]], positions: cells, normalise: centre}\n"
SOURCE = "    source: made up for tests\n"


def _opened(study: Study) -> tuple[list[dict[str, Any]], tuple[int, int]]:
    """Return each picture's description, and how many costs were computed and how many were cache hits."""
    design = read_experiment(study.experiment)
    stimuli = build_set(design.recipe_file, design.rig.display.panel.pixel_pitch_mm)
    costs = ClippingCosts.of(design, stimuli, partial(stimuli.load, part=design.visible_part))
    return [costs.description(name) for name in stimuli.names], astuple(costs.work)


def _slow(study: Study) -> list[dict[str, Any]]:
    """Return the same by computing it all."""
    design = read_experiment(study.experiment)
    stimuli = build_set(design.recipe_file, design.rig.display.panel.pixel_pitch_mm)
    load = partial(stimuli.load, part=design.visible_part)
    compensation = rig_compensation(design, load, stimuli.names)
    return [
        {
            "name": name,
            "factors": dict(stimuli.factors(name)),
            "size_px": [load(name).width_px, load(name).height_px],
            "resampled": None,
            "flat": load(name).is_flat,
            "clipping": clipping_record(load(name), compensation, design.places_px),
        }
        for name in stimuli.names
    ]


def rig_compensation(design: Experiment, load: Callable[[str], StereoImage], names: tuple[str, ...]) -> Compensation:
    rig = design.rig
    panel_px = rig.display.panel.resolution_px
    plain = design.mode.compensation(rig.models, panel_px, Correction(rig.crosstalk, rig.gain_map))
    images = (load(name) for name in names)
    return plain.lifted_for((image.left, image.right) for image in images) if rig.spec.lift_black else plain


def _leaky(study: Study) -> None:
    study.edit("display.yaml", SOURCE, SOURCE + CROSSTALK)


def _lifted(study: Study) -> None:
    _leaky(study)
    study.edit("rig.yaml", "distance_mm: 700\n", "distance_mm: 700\nlift_black: true\n")


def _uneven(study: Study) -> None:
    study.edit("display.yaml", SOURCE, SOURCE + GAIN)


def _anaglyph(study: Study) -> None:
    study.edit("display.yaml", "  quad-buffered: {same_as", "  anaglyph-red-cyan: {same_as")
    study.edit("rig.yaml", "mode: side-by-side", "mode: anaglyph-red-cyan")


def _as_it_is(study: Study) -> None:
    pass


@pytest.mark.parametrize("rig", [_as_it_is, _leaky, _lifted, _uneven, _anaglyph])
def test_a_cache_hit_is_what_was_computed(study: Study, rig: Callable[[Study], None]) -> None:
    rig(study)
    lifts = 4 if rig is _lifted else 0
    first, work = _opened(study)
    assert work == (4 + lifts, 0)
    again, work = _opened(study)
    assert work == (0, 4 + lifts)
    slow = _slow(study)
    assert first == again == slow
    assert json.dumps(first) == json.dumps(again) == json.dumps(slow)  # in one order, and whole numbers alike
    assert any(described["clipping"]["left"]["percent_any"] > 0.0 for described in first)


def _other_picture(study: Study) -> None:
    rng = np.random.default_rng(9)
    for name in ("one", "two", "three", "four"):
        view = rng.uniform(1, 25, (40, 80, 3)).astype(np.float32)
        write_exr(study.folder / f"{name}.exr", StereoImage.flat(view))


CHANGES: dict[str, Callable[[Study], None]] = {
    "crosstalk": _leaky,
    "crosstalk and lift": _lifted,
    "gain map": _uneven,
    "mixed views": _anaglyph,
    "black": lambda study: study.edit("display.yaml", "[0.02, 0.02, 0.03]", "[0.02, 0.03, 0.03]"),
    "primary": lambda study: study.edit("display.yaml", "[10.83, 5.62, 0.54]", "[10.83, 5.63, 0.54]"),
    "tone curve": lambda study: study.edit("display.yaml", "red: {gamma: 2.1}", "red: {gamma: 2.1, gain: 0.9}"),
    "aperture": lambda study: study.edit("small.yaml", "size_mm: [20, 10]", "size_mm: [18, 10]"),
    "mode": lambda study: study.edit("rig.yaml", "mode: side-by-side", "mode: quad-buffered"),
    "picture": _other_picture,
}


SOME = ("crosstalk and lift", "black", "mode", "picture")


@pytest.mark.parametrize("change", [*SOME, *nightly(*(name for name in CHANGES if name not in SOME))])
def test_all_is_computed_again_where_anything_that_it_depends_on_changed(study: Study, change: str) -> None:
    _opened(study)
    CHANGES[change](study)
    described, (computed, hits) = _opened(study)
    assert (computed % 4, hits) == (0, 0)
    assert computed
    assert described == _slow(study)


def test_on_an_uneven_panel_the_places_count_and_on_an_even_one_they_do_not(study: Study) -> None:
    _opened(study)
    study.edit("small.yaml", "gap_mm: 5", "gap_mm: 6")
    assert _opened(study)[1] == (0, 4)
    _uneven(study)
    assert _opened(study)[1] == (4, 0)
    study.edit("small.yaml", "gap_mm: 6", "gap_mm: 12")
    described, work = _opened(study)
    assert work == (4, 0)
    assert described == _slow(study)


def test_what_an_anaglyph_s_filters_pass_counts(study: Study) -> None:
    _anaglyph(study)
    _opened(study)
    study.edit("rig.yaml", "distance_mm: 700\n", "distance_mm: 700\nmode_options: {anaglyph: channels}\n")
    described, work = _opened(study)
    assert work == (4, 0)
    assert described == _slow(study)


def test_what_costs_do_not_rest_on_finds_them(study: Study) -> None:
    _opened(study)
    study.edit("small.yaml", "Which is closer?", "Which is nearer?")
    study.edit("rig.yaml", "distance_mm: 700\n", "distance_mm: 900\ndither: shared\n")
    assert _opened(study)[1] == (0, 4)


def test_another_version_s_costs_are_not_taken(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    _opened(study)
    monkeypatch.setattr(runner.session.clipping_costs, "COST_VERSION", COST_VERSION + 1)
    assert _opened(study)[1] == (4, 0)


def test_one_changed_picture_is_computed_alone(study: Study) -> None:
    _opened(study)
    write_exr(study.folder / "two.exr", StereoImage.flat(np.full((40, 80, 3), 7.0, dtype=np.float32)))
    described, work = _opened(study)
    assert work == (1, 3)
    assert described == _slow(study)


def test_one_picture_that_needs_more_lift_changes_the_costs_of_all(study: Study) -> None:
    _lifted(study)
    white = read_experiment(study.experiment).rig.models.left.white_XYZ_cd_m2

    def write(name: str, *shares: float) -> None:
        views = (np.full((40, 80, 3), share * white, dtype=np.float32) for share in shares)
        write_exr(study.folder / f"{name}.exr", StereoImage(*views))

    for index, name in enumerate(("one", "two", "three", "four")):
        write(name, 0.1, 0.5 + index / 10)
    _opened(study)
    write("two", 0.002, 0.9)
    described, work = _opened(study)
    assert work == (1 + 4, 3)  # its own lift, then all at the new one
    assert described == _slow(study)


def _session(study: Study, results: Path) -> tuple[Any, dict[str, int]]:
    study.run(results=results)
    (file,) = session_files(results)
    end = json.loads(file.read_text().splitlines()[-1])
    costs = [trial.details().get("clipping") for trial in read_session(file).trials]
    return (read_session(file).header.stimuli, costs), end["work"]


@pytest.mark.promise("clip-cost")
@pytest.mark.parametrize("damaged", [False, True])
def test_every_trial_s_record_has_its_costs_found_or_not(study: Study, damaged: bool) -> None:
    first, work = _session(study, study.folder / "first")
    assert (work["clipping_costs_computed"], work["clipping_costs_cached"]) == (4, 0)
    costs = study.folder / "cache" / COSTS
    if damaged:
        for file in costs.iterdir():
            file.unlink()
        costs.rmdir()
        costs.write_text("no folder any more, and none can be made")
    second, work = _session(study, study.folder / "second")
    assert (work["clipping_costs_computed"], work["clipping_costs_cached"]) == ((4, 0) if damaged else (0, 4))
    assert first == second
    assert all(set(described[name]) == {"left", "right"} for described in first[1] if described for name in described)
    assert sum(described is not None for described in first[1]) == 6


def test_check_and_session_find_each_other_s_costs(study: Study) -> None:
    options = CheckOptions(results=study.results, screen=False)
    facts = check_file(study.experiment, options).facts
    assert (facts["clipping_costs_computed"], facts["clipping_costs_cached"]) == (4, 0)
    again = check_file(study.experiment, options).facts
    assert (again["clipping_costs_computed"], again["clipping_costs_cached"]) == (0, 4)
    assert again["clipped_percent"] == facts["clipped_percent"]
    (header, _), work = _session(study, study.results)
    assert work["clipping_costs_cached"] == 4
    described = {one.name: [getattr(one.clipping, eye).percent_any for eye in ("left", "right")] for one in header}
    assert described == facts["clipped_percent"]


def test_half_floats_near_black_are_within_the_gamut(study: Study) -> None:
    """What a picture of half floats, as sets hold them, rounds beneath black is no light that the display lacks."""
    model = read_experiment(study.experiment).rig.models.left
    dark = model.limits[0] + np.random.default_rng(7).uniform(0, 0.05, (40, 80, 3)) * np.eye(3)[0]
    image = StereoImage.flat(model.xyz_of_linear(dark).astype(np.float32))
    for exact in (True, False):
        write_exr(study.folder / "dark.exr", image, exact=exact)
        read = read_exr(study.folder / "dark.exr")
        assert read.half is not exact
        percent = eye_clip_costs(EyeModels(model, model), None, read.left, read.right, half=read.half)["left"]
        assert percent["percent_any"] == 0
    stored = read_exr(study.folder / "dark.exr").left
    assert model.clipping(stored).any_channel > 1_000
