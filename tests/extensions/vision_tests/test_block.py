"""The screening block: what it asks and records, when it stops, and that it can be played again."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.kinds import Trial
from analysis.observers import passed_screening
from analysis.records import SessionLog, new_header
from devices.display import EyeModels
from extensions.vision_tests import Screen, VisionOutcomeRecord, screened, threshold_estimate
from extensions.vision_tests.acuity import NearAcuitySpec, StereoAcuitySpec, finest_arcsec, finest_logmar, gap_px
from extensions.vision_tests.colour_vision import ColourVisionSpec
from runner.blocks import Block
from runner.errors import SessionError
from runner.observers import plain_key, walk
from runner.ports import Ask, Choose, GoOn
from runner.scene import Box, Text
from runner.session import Resumed, Session
from runner.views import Style
from tests.extensions.vision_tests.conftest import model
from tests.runner.blocks.conftest import Presser
from tests.runner.every_kind import Stage, entry

Play = Callable[..., Any]  # conftest.py
MODEL = model()
TESTS = ["stereo_acuity", "colour_vision", "near_acuity"]
SCREEN = Screen((960, 1080), 0.2768, 700.0, 65.0, (1, 1), EyeModels(MODEL, MODEL))


def stereo(pass_: float, levels: tuple[float, ...], **more: Any) -> StereoAcuitySpec:
    once = {"repeats": 1, "required": 1, "depth": "both"} | more
    return StereoAcuitySpec(test="stereo_acuity", pass_arcsec=pass_, levels_arcsec=levels, **once)


def near(pass_: float, levels: tuple[float, ...], **more: Any) -> NearAcuitySpec:
    return NearAcuitySpec(test="near_acuity", pass_logmar=pass_, levels_logmar=levels, **more)


def colour(pass_: float, levels: tuple[float, ...], axes: Any, **more: Any) -> ColourVisionSpec:
    return ColourVisionSpec(test="colour_vision", pass_delta_uv=pass_, levels_delta_uv=levels, axes=axes, **more)


def screening(screen: Screen, seed: str, *tests: Any, **more: Any) -> Block:
    kind = entry("screening", tests=[test.model_dump() for test in tests], **more)
    made: Block = kind.of_tests([test.make(screen, seed) for test in tests], Style(screen.view_px))
    return made


def block(seed: str = "s", **more: Any) -> Block:
    tests = (
        stereo(140, (400, 60), repeats=2, required=2),
        colour(0.02, (0.04, 0.02), ("protan", "tritan"), repeats=2, required=2, controls=2),
        near(0.2, (0.5, 0.2, -0.3), repeats=3, required=2),
    )
    return screening(SCREEN, seed, *tests, **more)


def wrong(ask: Ask) -> str:
    """Answer what is not right."""
    if isinstance(ask.task, Choose):
        return next(option for option in ask.task.options if option != ask.task.correct)
    return plain_key(ask)


def unable(task: str, below: float) -> Callable[[Ask], str]:
    """Answer wrongly to ``task`` where it is weaker than ``below``."""

    def press(ask: Ask) -> str:
        told = ask.task
        if isinstance(told, Choose) and told.name == task and (told.strength or 0.0) < below:
            return wrong(ask)
        return plain_key(ask)

    return press


def outcome(played: Any, test: str) -> dict[str, Any]:
    (found,) = (
        trial.details() for trial in played.trials if trial.details()["test"] == test and "outcome" in trial.details()
    )
    return dict(found)


def test_someone_who_sees_everything_meets_everything(play: Play) -> None:
    whole = play(block())
    assert sum(not trial.is_outcome for trial in whole.trials) == block().trials
    assert whole.shown_at_record[-1] == len(whole.shown)
    assert {trial.kind for trial in whole.trials} == {"screening"}
    for trial in whole.trials:
        assert json.loads(json.dumps(trial.details())) == trial.details()
    told = {test: outcome(whole, test)["outcome"] for test in ("stereo_acuity", "colour_vision", "near_acuity")}
    assert all(one["passed"] and one["controls_seen"] for one in told.values())
    assert [one["threshold"] for one in told.values()] == [60.0, 0.02, 0.2]
    # All right: the threshold lies below what was shown, no one knows how far.
    assert [one["estimate"] for one in told.values()] == [None, None, None]
    assert {type(ask.task) for ask in whole.asks} == {GoOn, Choose}
    for ask in whole.asks:
        assert set(ask.keys) <= {*block().keys, "space", "enter", "pad_a"}


def uv(xyz: list[float]) -> NDArray[np.float64]:
    """Return u'v' (2,)."""
    x, y, z = xyz
    return np.array([4 * x, 9 * y]) / (x + 15 * y + 3 * z)


def test_records_say_what_was_shown_and_answered(play: Play) -> None:
    whole = play(block())
    asked = [ask for ask in whole.asks if isinstance(ask.task, Choose)]
    answers = [trial for trial in whole.trials if "correct" in trial.details()]
    for ask, trial in zip(asked, answers, strict=True):
        data = trial.details()
        assert data["correct"] is True
        assert data["answer"] == data["correct_answer"] == ask.task.correct
        assert trial.response_time_s == pytest.approx(0.5)
        if data["test"] == "stereo_acuity":
            assert ask.task.strength == data["level"]
            sign = -1 if data["depth"] == "crossed" else 1
            assert SCREEN.disparity_arcsec(data["parallax_px"]) == pytest.approx(sign * data["level"], abs=1e-3)
        if data["test"] == "near_acuity":
            assert ask.task.strength == pytest.approx(10 ** data["level"])
            assert 60 * SCREEN.degrees(data["gap_px"]) == pytest.approx(10 ** data["level"], rel=1e-4)
        if data["series"] in ("protan", "tritan"):
            apart = uv(data["ring_XYZ_cd_m2"]) - uv(block().facts["colour_vision"]["ground_XYZ_cd_m2"])
            assert np.hypot(*apart) == pytest.approx(data["level"], abs=1e-4)
    depths = [trial.details()["depth"] for trial in answers if trial.details()["test"] == "stereo_acuity"]
    assert depths == ["crossed", "uncrossed"] * 3


@pytest.mark.parametrize("press", [wrong, unable("stereo_acuity", 100), unable("colour_vision_protan", 0.03)])
def test_it_is_the_same_again_and_resumes_from_anywhere(press: Callable[[Ask], str], play: Play) -> None:
    whole, again = play(block(), press), play(block(), press)
    assert (again.shown, again.trials) == (whole.shown, whole.trials)
    for answered in range(0, len(whole.trials) + 1, 5):
        rest = play(block(), press, logged=whole.trials[:answered])
        assert rest.trials == whole.trials[answered:]
        assert rest.shown == whole.shown[len(whole.shown) - len(rest.shown) :]


def test_a_series_ends_with_the_level_that_is_not_passed(play: Play) -> None:
    played = play(block(), unable("stereo_acuity", 140.0))
    levels = [
        t.details()["level"] for t in played.trials if t.details()["test"] == "stereo_acuity" and "level" in t.details()
    ]
    assert levels == [400.0, 400.0, 140.0, 140.0, 60.0]
    told = outcome(played, "stereo_acuity")["outcome"]
    assert (told["passed"], told["threshold"]) == (True, 140.0)
    assert 60.0 < told["estimate"] < 140.0
    blind = outcome(play(block(), wrong), "stereo_acuity")
    assert blind["outcome"]["passed"] is False
    assert blind["outcome"]["threshold"] is None
    assert blind["by_series"]["stereo_acuity"]["presentations"] == 1


def test_one_axis_is_lost_and_the_others_go_on(play: Play) -> None:
    played = play(block(), unable("colour_vision_protan", 0.03))
    told = outcome(played, "colour_vision")
    assert told["outcome"]["passed"] is False
    assert told["by_series"]["protan"]["threshold"] == 0.04
    assert told["by_series"]["tritan"]["threshold"] == 0.02
    assert told["outcome"]["threshold"] == 0.04
    assert told["outcome"]["controls_seen"] is True


def test_who_does_not_see_the_controls_did_not_take_the_test(play: Play) -> None:
    def press(ask: Ask) -> str:
        return wrong(ask) if isinstance(ask.task, Choose) and ask.task.name.endswith("control") else plain_key(ask)

    told = outcome(play(block(), press), "colour_vision")
    assert told["outcome"]["controls_seen"] is False
    assert told["outcome"]["passed"] is False
    assert told["by_series"]["tritan"]["passed"] is True


def test_failing_continues_or_stops_the_session(play: Play) -> None:
    assert [t.details()["test"] for t in play(block(), wrong).trials if "outcome" in t.details()] == TESTS
    played = play(block(on_fail="stop"), wrong)
    assert [t.details()["test"] for t in played.trials if "outcome" in t.details()] == ["stereo_acuity"]
    assert played.trials[-1].details() == {"test": "stereo_acuity", "screened_out": True}
    assert played.shown_at_record[-1] == len(played.shown)
    assert any(isinstance(item, Text) and "all for today" in item.words for item in played.shown[-1].items)
    own = play(block(on_fail="stop", stop_words="Halt."), wrong).shown[-1].items
    assert any(isinstance(item, Text) and item.words == "Halt." for item in own)


def test_an_estimate_is_in_the_unit_of_its_test(play: Play) -> None:
    """Between the level that was passed and the one that was not."""
    for name, below, low, high in (("near_acuity", 10**0.3, 0.2, 0.5), ("stereo_acuity", 100.0, 60.0, 140.0)):
        done = play(block(), unable(name, below)).trials
        (told,) = (
            one.details()["outcome"] for one in done if one.details()["test"] == name and "outcome" in one.details()
        )
        assert low < told["estimate"] < high


@pytest.mark.parametrize("answered", range(4))
def test_a_stopped_session_is_complete_and_says_so(play: Play, answered: int) -> None:
    whole = play(block(on_fail="stop"), wrong)
    log = whole.trials[:answered]
    result = Stage()
    blocks = block(on_fail="stop"), block(seed="t")
    Session(blocks, result, Presser(wrong, result), result, Resumed(log), utc=lambda: "2026-01-01T00:00:00Z").run()
    assert result.ends == [{"screened_out": True}]
    assert [*log, *result.trials] == whole.trials


def test_everything_can_be_clicked(play: Play) -> None:
    def click(ask: Ask) -> str:
        return f"click {ask.task.correct}" if isinstance(ask.task, Choose) else "click continue"

    clicked = play(block(), click)
    assert sum(not trial.is_outcome for trial in clicked.trials) == block().trials
    for ask in clicked.asks:
        targets = list(ask.targets.values())
        for one in targets:
            assert sum(other.holds(one.offset_px) for other in targets) == 1


@pytest.mark.parametrize("press", [plain_key, wrong, unable("stereo_acuity", 140), unable("near_acuity", 2.0)])
def test_every_picture_was_made_ready_before_it_was_shown(press: Callable[[Ask], str], play: Play) -> None:
    played = play(block(), press)
    ready: set[str] = set()
    for ask in played.asks:
        assert set(ask.scene.stimuli) <= ready
        ready = set(ask.upcoming.stimuli) if ask.upcoming else set()
        if not isinstance(ask.task, Choose):
            assert ready


def test_pictures_are_named_after_what_they_show() -> None:
    """Observers in one sitting share the presenter's pictures: no two pictures may share a name."""
    one, other = block(seed="a").pictures, block(seed="b").pictures
    assert set(one).isdisjoint(other)
    assert len(one) == block().trials
    again = block(seed="a").pictures
    name = next(iter(one))
    assert np.array_equal(one[name]().left, again[name]().left)


def test_the_seed_decides_the_sides() -> None:
    def sides(seed: str) -> list[str]:
        asked = [step.task for step in walk(block(seed)) if isinstance(step, Ask)]
        return [str(task.correct) for task in asked if isinstance(task, Choose)]

    assert sides("a") == sides("a")
    assert sides("a") != sides("b")
    many = [side for n in range(12) for side in sides(str(n))]
    for side in ("up", "down", "left", "right"):
        assert many.count(side) / len(many) == pytest.approx(0.25, abs=0.07)


@pytest.mark.parametrize("view_px", [(960, 1080), (1920, 1080), (1920, 2160), (640, 480), (320, 480)])
@pytest.mark.parametrize("pitch_mm", [0.12, 0.2768])
def test_all_of_it_is_in_the_view_and_nothing_covers_the_picture(view_px: tuple[int, int], pitch_mm: float) -> None:
    screen = replace(SCREEN, view_px=view_px, pixel_pitch_mm=pitch_mm)
    specs = stereo(200, (200,)), near(0.3, (0.3,), repeats=1, required=1)
    made = screening(screen, "s", *specs)
    asks = [step for step in walk(made) if isinstance(step, Ask) and isinstance(step.task, Choose)]
    assert len(asks) == made.trials
    for ask in asks:
        image = made.pictures[ask.scene.stimuli[0]]()
        assert image.width_px <= view_px[0]
        for item in ask.scene.items:
            if isinstance(item, Text):
                assert abs(item.offset_px[1]) - item.height_px / 2 > image.height_px / 2
                assert abs(item.offset_px[1]) + item.height_px <= view_px[1] / 2
            if isinstance(item, Box):
                assert max(item.size_px) < image.width_px / 8
        for target in ask.targets.values():
            assert all(
                abs(place) + size / 2 <= image.width_px / 2 + 1
                for place, size in zip(target.offset_px, target.size_px, strict=True)
            )


def test_what_the_rig_cannot_show_is_left_out_or_refused() -> None:
    # A pixel of 0.2768 mm at 700 mm is 1.36 arcmin, or 81 arcsec of disparity.
    assert finest_logmar(SCREEN) == pytest.approx(math.log10(60 * math.degrees(0.2768 / 700)), abs=1e-6)
    assert SCREEN.disparity_arcsec(1.0) == pytest.approx(3600 * math.degrees(0.2768 / 700), rel=0.01)
    assert finest_arcsec(SCREEN) == pytest.approx(0.2 * SCREEN.disparity_arcsec(1.0), rel=0.01)
    halved = replace(SCREEN, grain_px=(2, 1))
    assert finest_arcsec(halved) == pytest.approx(2 * finest_arcsec(SCREEN), rel=0.01)
    assert finest_logmar(halved) == pytest.approx(finest_logmar(SCREEN) + math.log10(2), abs=1e-6)
    assert gap_px(SCREEN, finest_logmar(SCREEN)) == pytest.approx(1.0, abs=1e-6)
    facts = block().facts["near_acuity"]
    assert (facts["levels_logmar"], facts["not_shown_logmar"]) == ([0.5, 0.2], [-0.3])
    with pytest.raises(SessionError, match=r"0\.14 to .* logMAR, not .* of 0\.1"):
        near(0.1, (0.5,), repeats=1, required=1).make(SCREEN, "s")
    with pytest.raises(SessionError, match=r"16 to .* arcsec, not the pass mark of 5"):
        stereo(5, (100,), depth="crossed").make(SCREEN, "s")
    with pytest.raises(SessionError, match="deutan line the display shows at most"):
        colour(0.2, (0.02,), ("deutan",), repeats=1, required=1, controls=0).make(SCREEN, "s")


@pytest.mark.parametrize("arcsec", [-2000.0, -140.0, -1.0, 1.0, 40.0, 140.0, 2000.0])
def test_parallax_undoes_disparity(arcsec: float) -> None:
    parallax_px = SCREEN.parallax_px(arcsec)
    assert SCREEN.disparity_arcsec(parallax_px) == pytest.approx(arcsec, rel=1e-9)
    assert np.sign(parallax_px) == np.sign(arcsec)  # in front of the screen, the right eye's dot is further left


def _log(trials: list[Trial], observer: str = "01") -> SessionLog:
    header = new_header("e", observer, "s", "2026-01-01T00:00:00+00:00", simulated=True)
    return SessionLog(Path("x"), header, tuple(trials), True)


def test_outcomes_are_read_back_and_choose_sessions(play: Play) -> None:
    good, bad = _log(play(block()).trials), _log(play(block(on_fail="stop"), wrong).trials, "02")
    untested = _log([], "03")
    assert [one.test for one in good.of(VisionOutcomeRecord) if one.passed] == TESTS
    (failed,) = bad.of(VisionOutcomeRecord)
    assert (failed.test, failed.passed, failed.words) == (
        "stereo_acuity",
        False,
        "stereo acuity: no level passed, pass mark 140 arcsec",
    )
    assert tuple(passed_screening([log]) for log in (good, bad, untested)) == (True, False, None)
    assert passed_screening([bad], ["near_acuity"]) is None
    assert passed_screening([bad], ["near_acuity", "stereo_acuity"]) is False
    assert screened([good, bad, untested]) == (good,)
    assert screened([good, bad, untested], unscreened="keep") == (good, untested)


def test_the_estimate_finds_a_threshold_back() -> None:
    rng = np.random.default_rng(5)
    strengths = list(np.tile([400.0, 200.0, 100.0, 50.0, 25.0], 400))
    chance = 0.25 + 0.73 / (1 + (80.0 / np.array(strengths)) ** 4.0)
    found = threshold_estimate(strengths, list(rng.random(len(strengths)) < chance), 4)
    assert found == pytest.approx(80.0, rel=0.06)
    assert threshold_estimate([], [], 4) is None
    assert threshold_estimate([100.0, 50.0], [True, True], 4) is None
    assert threshold_estimate([100.0, 50.0], [False, False], 4) is None
