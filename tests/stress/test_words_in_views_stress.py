"""Every word of every kind of block, in each language, lies within the view of every mode, on any panel."""

from __future__ import annotations

from pathlib import Path

import pytest

from documents.yaml import read_yaml
from runner import Scene
from runner.blocks.interface import LANGUAGES
from runner.blocks.message import page, pause_menu
from runner.blocks.text_entry import Number, typed
from runner.check import CheckReport
from runner.check.screens import check_screens
from runner.presenter import MODES, text_area
from runner.protocol import read_experiment
from runner.scene import Text
from tests.runner import every_kind as EVERY

pytestmark = pytest.mark.stress
# Resolution, pixel pitch and the pictures' size: an old monitor, a full HD one, and 4K.
PANELS = {
    "small": ((1024, 768), 0.264, (18, 12)),
    "full-hd": ((1920, 1080), 0.2768, (40, 30)),
    "4k": ((3840, 2160), 0.18, (60, 40)),
}
RIG = """\
schema_version: 1
display: {{nominal: srgb, white_cd_m2: 100, panel: {{resolution_px: [{0}, {1}], pixel_pitch_mm: {2}, refresh_hz: 60}}}}
mode: {mode}
distance_mm: 1200
"""


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("panel", PANELS)
@pytest.mark.parametrize("mode", MODES)
def test_all_words_lie_within_the_view(tmp_path: Path, mode: str, panel: str, language: str) -> None:
    size_px, pitch_mm, picture_mm = PANELS[panel]
    rig = tmp_path / "rig.yaml"
    rig.write_text(RIG.format(*size_px, pitch_mm, mode=mode))
    blocks = [EVERY.written(kind, variant) for kind, variant in EVERY.VARIANTS if (mode, kind) != ("flat", "screening")]
    small = f"size_mm: [{picture_mm[0]}, {picture_mm[1]}]"
    more = f"words: {{language: {language}}}\nstyle: {{progress: count}}\n"
    file = EVERY.write(tmp_path, *blocks, more=more, rig=rig, layout=small)
    design = read_experiment(file)
    report = CheckReport(file)
    check_screens(report, design, read_yaml(file))
    assert [str(error) for error in report.errors] == []
    style = design.style
    writing = typed(style.say("note"), style, field=Number(unit=" mm", lowest=1, highest=99), required=False)
    scenes: list[Scene] = [pause_menu(style, can_repeat=True).scene, next(writing).scene]
    scenes.append(page(design.end_page or "", style, "finish").scene)
    for scene in scenes:
        for item in scene.items:
            if isinstance(item, Text) and (area := text_area(item)):
                assert area.within(style.view_px), item.words
