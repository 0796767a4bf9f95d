"""Experiments of every shape for property tests: kinds of block, layouts, modes, words, flat and stereo pictures."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import strategies as st

from runner import Picture, Scene
from runner.blocks import Draft
from runner.check import CheckOptions, check_file
from runner.observers import walk
from runner.presenter import coverage
from runner.protocol import Experiment, read_experiment
from runner.reports import preview
from runner.scene import Text
from stimuli.pictures import StereoImage, write_exr

# Modes that one window without a right back buffer shows.
MODES = (
    *("flat", "side-by-side", "side-by-side-half", "top-bottom", "top-bottom-half", "row-interleaved"),
    *("column-interleaved", "checkerboard", "anaglyph-red-cyan"),
)
PANELS = ((640, 480), (800, 600), (1280, 720))
_LETTERS = "etaoin shrdlu cmfwyp vbgkqjxz "
# Lengths are drawn evenly: texts that hypothesis draws itself are nearly all short.
_PHRASES = st.sampled_from(["which of the two plates is closer to it ", "w", "Ähnlichkeit ", "i\u2019ll "])
_WORDS = st.builds(lambda phrase, length: (phrase * 280)[:length], _PHRASES, st.integers(1, 280))
_PAGES = st.builds(lambda words, lines: "\n".join([words[:60]] * lines), _WORDS, st.integers(1, 30))
_SCALES = st.builds(
    lambda question, high, anchor: {
        "name": "quality",
        "question": question,
        "highest": high,
        "low_anchor": anchor,
        "high_anchor": anchor,
    },
    _WORDS,
    st.sampled_from([5, 10, 100]),
    st.text(_LETTERS, max_size=60),
)
_BLOCKS = st.one_of(
    st.builds(lambda text: {"kind": "instructions", "text": text}, _PAGES),
    st.builds(
        lambda ties, every: {"kind": "all_pairs", "ties": ties, "break_every": every},
        st.sampled_from(["none", "both"]),
        st.integers(1, 4),
    ),
    st.just({"kind": "all_pairs", "presentation": "sequence", "exposure_s": 0.5}),
    st.builds(lambda scale: {"kind": "rating", "ratings": [scale]}, _SCALES),
    st.builds(lambda scale: {"kind": "all_pairs", "ratings": [scale]}, _SCALES),
    st.just({"kind": "best_of_series", "series": {"one": ["a", "b"]}}),
    st.builds(
        lambda question, option: {
            "kind": "questionnaire",
            "questions": [
                {"kind": "choice", "name": "hand", "question": question, "options": [f"{option}1", f"{option}2"]},
                {"kind": "text", "name": "more", "question": question},
            ],
        },
        _WORDS,
        st.text(_LETTERS, min_size=1, max_size=55),
    ),
    st.just({"kind": "practice", "trials": 2, "block": {"kind": "all_pairs"}}),
)


@st.composite
def experiments(draw: st.DrawFn) -> dict[str, Any]:
    """Draw an experiment: what its file says, with its panel, mode, distance and pictures."""
    size = st.floats(2, 60).map(lambda value: round(value, 1))
    return {
        "panel": draw(st.sampled_from(PANELS)),
        "mode": draw(st.sampled_from(MODES)),
        "stereo": draw(st.booleans()),
        "question": draw(_WORDS),
        "layout": {
            "arrangement": draw(st.sampled_from(["vertical", "horizontal"])),
            "size_mm": [draw(size), draw(size)],
            "gap_mm": draw(st.sampled_from([0, 1, 10])),
            "reference": draw(st.sampled_from(["none", "physical", "c"])),
        },
        "blocks": draw(st.lists(_BLOCKS, min_size=1, max_size=2)),
    }


def write(drawn: Mapping[str, Any], folder: Path) -> Path:
    """Write an experiment with all that it names, and return its file; the pictures are written once."""
    for shade in range(1, 7):
        for kind in ("flat", "stereo"):
            file = folder / f"{shade}_{kind}.exr"
            if not file.exists():
                left, right = (np.full((60, 80, 3), 3 * light, np.float32) for light in (shade, shade + 1 / 3))
                write_exr(file, StereoImage.flat(left) if kind == "flat" else StereoImage(left, right))
    kind = "stereo" if drawn["stereo"] else "flat"
    recipe: dict[str, Any] = {"schema_version": 1, "kind": "pictures"}
    stimuli: Mapping[str, Any] = drawn.get("stimuli", dict.fromkeys("abc"))
    recipe["stimuli"] = [
        {"name": name, "file": f"{shade}_{kind}.exr", **({"factors": factors} if factors else {})}
        for shade, (name, factors) in enumerate(stimuli.items(), start=1)
    ]
    model: dict[str, Any] = {"black_XYZ_cd_m2": [0.02, 0.02, 0.03], "source": "made up"}
    model["primaries_XYZ_cd_m2"] = {"red": [40, 21, 2], "green": [36, 70, 6], "blue": [18, 7, 95]}
    model["curve"] = {"kind": "gog", **{channel: {"gamma": 2.2} for channel in ("red", "green", "blue")}}
    panel = {"resolution_px": list(drawn["panel"]), "pixel_pitch_mm": 0.25}
    display = {"schema_version": 1, "panel": panel, "modes": {drawn["mode"]: model}}
    rig = {"schema_version": 1, "display": "display.yaml", "mode": drawn["mode"], "distance_mm": 700}
    said = {key: drawn[key] for key in ("question", "layout", "blocks")} | drawn.get("more", {})
    experiment = {"schema_version": 1, "name": "drawn", "rig": "rig.yaml", "stimuli": "recipe.yaml", **said}
    scores = {name: {"score": shade} for shade, name in enumerate(stimuli, start=1)}
    observers = {"schema_version": 1, "kind": "bradley_terry", "stimuli": scores, **drawn.get("behaviour", {})}
    files = {"recipe": recipe, "display": display, "rig": rig, "drawn": experiment, "observers": observers}
    for name, content in files.items():
        (folder / f"{name}.yaml").write_text(json.dumps(content), encoding="utf-8")  # JSON is YAML
    return folder / "drawn.yaml"


def what_check_calls_right_opens(drawn: Mapping[str, Any], folder: Path, screens: int = 4) -> bool:
    """Assert that an experiment opens and fits if `check` calls it right, and return whether it does."""
    file = write(drawn, folder)
    report = check_file(file, CheckOptions(results=folder / "results", screen=False))
    if report.errors:
        return False
    shown = preview(file, folder / "screens", first=screens)
    assert shown
    design = read_experiment(file)
    for block in design.example_blocks:
        for step in walk(block):
            if not isinstance(step, Draft):
                _fits(step.scene, design)
    return True


def _fits(scene: Scene, design: Experiment) -> None:
    """Assert by the ink itself that words are in the view and beside the pictures, and that pictures are in it."""
    width, height = design.view_px
    covered = np.zeros((height, width), dtype=bool)
    for item in scene.items:
        if isinstance(item, Picture) and item.aperture_px:
            left, top = (
                view // 2 + place - size // 2
                for view, place, size in zip(design.view_px, item.offset_px, item.aperture_px, strict=True)
            )
            assert left >= 0
            assert top >= 0
            assert left + item.aperture_px[0] <= width
            assert top + item.aperture_px[1] <= height
            covered[top : top + item.aperture_px[1], left : left + item.aperture_px[0]] = True
    for item in scene.items:
        ink = coverage(item.words, item.height_px, item.width_px) if isinstance(item, Text) else None
        if ink is None or not isinstance(item, Text):
            continue
        rows, columns = np.nonzero(ink)
        x = columns + width // 2 + item.offset_px[0] - ink.shape[1] // 2
        y = rows + height // 2 + item.offset_px[1] - ink.shape[0] // 2
        assert x.min() >= 0
        assert y.min() >= 0
        assert x.max() < width
        assert y.max() < height
        assert not covered[y, x].any(), item.words
