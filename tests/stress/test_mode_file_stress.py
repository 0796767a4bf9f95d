"""Display files changed again and again, in every order, and in many layouts: never a line that was not meant."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest

from devices.characterise.mode_file import ModeLines, write_mode
from devices.display import DisplayModel, PanelSpec, TableCurve, ToneCurve, read_display
from devices.display.model_spec import ModelSpec
from devices.errors import DeviceError
from documents.yaml import parse_yaml

pytestmark = pytest.mark.stress

MODES = ("flat", "quad-buffered", "side-by-side", "on", "1", "a: b # c", "Ünïcode")
EYES = (("both",), ("left",), ("right",), ("left", "right"))
PARTS = {
    "crosstalk": ["crosstalk:", *(f"  {eye}: [[0.03, 0, 0], [0, 0.03, 0], [0, 0, 0.05]]" for eye in ("left", "right"))],
    "gain_map": ["gain_map:", "  luminance: [[1, 2], [3, 4]]", "  positions: cells", "  normalise: centre"],
}


def _model(white: int, tables: bool) -> DisplayModel:
    primaries = np.array([[4.0, 3, 2], [2, 7, 1], [0, 1, 9]]) * white
    curve = TableCurve((0, 0.3, 1), (0, 0.1, 1)) if tables else ToneCurve(0.9, 0.1, 2.2)
    return DisplayModel(np.zeros(3), primaries, (curve,) * 3)


@pytest.mark.parametrize("seed", range(8))
def test_any_run_of_changes_leaves_what_the_changes_say(tmp_path: Path, seed: int) -> None:
    rng = random.Random(seed)
    path = tmp_path / "d.yaml"
    panel = PanelSpec(resolution_px=(640, 480), pixel_pitch_mm=0.25)
    expected: dict[str, dict[str, int]] = {}
    parts: dict[str, set[str]] = {}
    comments: list[str] = []
    for step in range(20):
        mode, eyes = rng.choice(MODES), rng.choice(EYES)
        white, replace = rng.randint(1, 99), rng.random() < 0.5
        added = {part: [*lines, f"  source: step {step}"] for part, lines in PARTS.items() if rng.random() < 0.2}
        lines = {
            eye: ModelSpec.of(_model(white, rng.random() < 0.5), source=f"step {step}: 'it' # \"said\"").lines()
            for eye in eyes
        }
        before = path.read_text() if path.exists() else ""
        held = expected.get(mode, {})
        clash = parts.get(mode, set()) & set(added)
        clash |= held.keys() if {"both"} & (held.keys() | set(eyes)) else held.keys() & set(eyes)
        new = ModeLines(lines, added)
        if clash and not replace:
            with pytest.raises(DeviceError, match="--replace"):
                write_mode(path, mode, new, panel)
            assert path.read_text() == before
            continue
        write_mode(path, mode, new, panel, replace=replace)
        kept = {} if "both" in held.keys() | set(eyes) else held
        expected[mode] = {**kept, **dict.fromkeys(eyes, white)}
        parts[mode] = parts.get(mode, set()) | set(added)
        text = path.read_text()
        assert all(comment in text for comment in comments)
        if rng.random() < 0.3:
            at = text.index("\nmodes:")
            comments.append(f"# note {step} on what follows")
            path.write_text(f"{text[:at]}\n{comments[-1]}{text[at:]}")
    display = read_display(path)
    data = parse_yaml(path.read_text(), "d").data["modes"]
    assert set(data) == set(expected)
    for mode, whites in expected.items():
        assert {part for part in PARTS if part in data[mode]} == parts[mode]
        if len(whites) == 1 and "both" not in whites:
            assert mode in display.lacking
            continue
        models = display.models(mode)
        for eye, model in (("left", models.left), ("right", models.right)):
            assert model.white_XYZ_cd_m2[1] == pytest.approx(10 * whites.get(eye, whites.get("both", 0)), rel=1e-9)
