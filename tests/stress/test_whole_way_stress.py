"""Whatever `check` accepts runs and is reported: many experiments, whole ways, every kind, sessions that forgive."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis.stateful import run_state_machine_as_test
from hypothesis.strategies import SearchStrategy

from analysis.records import new_header
from documents.yaml import read_yaml
from runner import Scene
from runner.blocks.message import pause_menu
from runner.blocks.text_entry import Number, typed
from runner.check import CheckReport
from runner.check.screens import check_screens
from runner.errors import SessionError
from runner.presenter import MODES, text_area
from runner.protocol import read_experiment
from runner.scene import Text
from runner.session import Recorder
from runner.session.folders import observer_folder, to_resume
from runner.views import page
from runner.views.interface import LANGUAGES
from tests.answers import altered, new_answer
from tests.runner import every_kind as EVERY
from tests.runner.every_kind import VARIANTS
from tests.runner.generated_experiments import experiments, what_check_calls_right_opens, write
from tests.runner.mixed_experiments import mixed_experiments, mutants
from tests.runner.session_machine import SessionMachine
from tests.runner.test_report_every_kind import make_a_page
from tests.runner.whole_way import whole_way
from tests.stress.how_many import how_many

pytestmark = pytest.mark.stress


# Whatever `check` accepts runs, and whatever ran is reported, exported and replayed: many experiments, with pages.

EXAMPLES = how_many(50, 200)


@pytest.mark.parametrize(("drawn_from", "fewest"), [(mixed_experiments, EXAMPLES // 5), (mutants, EXAMPLES // 20)])
def test_many_experiments_the_whole_way(
    drawn_from: Callable[[], SearchStrategy[dict[str, Any]]],
    fewest: int,
    tmp_path_factory: pytest.TempPathFactory,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path_factory.mktemp("cache")))
    written = tmp_path_factory.mktemp("written")
    verdicts: Counter[bool] = Counter()

    @given(drawn=drawn_from())
    @settings(max_examples=EXAMPLES, suppress_health_check=list(HealthCheck))
    def try_one(drawn: dict[str, Any]) -> None:
        file: Path = write(drawn, written)
        way = tmp_path_factory.mktemp("way")
        page = sum(verdicts.values()) % 8 == 0
        verdicts[whole_way(file, written / "observers.yaml", way / "new", page=page)] += 1

    try_one()
    assert verdicts[True] >= fewest


# Whatever `check` calls right opens: many experiments, drawn at random; and enough of them are right.

CHECK_EXAMPLES = how_many(80, 200)


def test_what_check_calls_right_opens(tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp("drawn")
    verdicts: Counter[bool] = Counter()

    @given(drawn=experiments())
    @settings(max_examples=CHECK_EXAMPLES, deadline=None)
    def try_one(drawn: dict[str, object]) -> None:
        verdicts[what_check_calls_right_opens(drawn, folder)] += 1

    try_one()
    assert verdicts[True] >= CHECK_EXAMPLES // 20
    assert verdicts[False] >= CHECK_EXAMPLES // 20


# Whatever is done to a session, to its disk and to its clock: longer, and far more often.
def test_what_is_done_to_a_session_loses_no_answer() -> None:
    run_state_machine_as_test(
        SessionMachine,
        settings=settings(
            max_examples=how_many(250, 600), stateful_step_count=60, suppress_health_check=list(HealthCheck)
        ),
    )


# A report on sessions of every kind of block, by one observer and by four, with every figure drawn.
@pytest.mark.parametrize("observers", [1, 4])
@pytest.mark.parametrize(("kind", "variant"), VARIANTS)
def test_sessions_of_every_kind_make_a_page(kind: str, variant: int, observers: int, tmp_path: Path) -> None:
    make_a_page(kind, variant, observers, tmp_path)


# Sessions that forgive, at their edges: hundreds of observers to name, a day of intervals, desktops of any shape.

STIMULI = ({"name": "a"}, {"name": "b"})
CHOICE = {"first": "a", "second": "b", "answer": "first", "chosen": "a", "rejected": "b"}
HEADER = new_header("e", "01", "s", "2026-01-01T00:00:00.000+00:00", question="Which?", simulated=True, stimuli=STIMULI)


def test_resuming_nothing_beside_four_hundred_unfinished_sessions_names_some_of_them_soon(tmp_path: Path) -> None:
    for number in range(400):
        name = f"{number:03d}"
        folder = observer_folder(tmp_path, "e", name) / "ses-20260101T000000abcd"
        with Recorder.create(folder, altered(HEADER, observer=name)) as recorder:
            recorder.append(new_answer(0, 0, "all_pairs", (("up", 1.0),), 1.0, "2026-01-01T00:00:01.000+00:00", CHOICE))
    began_s = time.process_time()
    with pytest.raises(SessionError) as told:
        to_resume(tmp_path, "e", "nobody")
    assert time.process_time() - began_s < 5.0
    assert "000 (1 answer), 001 (1 answer)" in str(told.value)
    assert ", ..." in str(told.value)
    assert len(str(told.value)) < 1000


# Every word of every kind of block, in each language, lies within the view of every mode, on any panel.

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
