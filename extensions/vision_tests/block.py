"""`kind: screening`: tests of vision one after the other, and what follows if one is failed."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from documents import Finding
from extensions.vision_tests.acuity import NearAcuitySpec, StereoAcuitySpec
from extensions.vision_tests.colour_vision import ColourVisionSpec
from extensions.vision_tests.record import KEYS, SIDES
from extensions.vision_tests.vision_test import Presented, Screen, TrialAnswers, VisionSeries, VisionTest
from runner.blocks import Block, BlockContext, BlockKind, Draft, Fault, SessionEnd, Steps
from runner.errors import SessionError
from runner.ports import Ask, Choose, Response, answer
from runner.presenter import EyeArea, ModeOptions, find_mode
from runner.scene import Item, Picture, Scene
from runner.views import Style, Words, page

KIND = "screening"
STOP_WORDS = "Thank you. That is all for today.\n\nPlease call the experimenter."
_SECONDS_PER_PRESENTATION = 3.5
_SECONDS_PER_PAGE = 10.0


AnyTestSpec = Annotated[StereoAcuitySpec | ColourVisionSpec | NearAcuitySpec, Field(discriminator="test")]


class Screening(BlockKind):
    """Vision tests, in order; with ``on_fail: stop`` the session ends after the first that is failed.

    There is one record for each presentation, then one with the test's outcome; none can be repeated, since each answer
    decides what follows. After a failed test that ends the session come ``stop_words`` and a record that says
    ``screened_out``; the session is complete. The response time of a presentation runs from its onset to the answer;
    that of an outcome is 0.
    """

    begins_with_words = True
    by_scores = False
    tests_observers = True

    kind: Literal["screening"]
    tests: Annotated[list[AnyTestSpec], Field(min_length=1)]
    """The vision tests, in their order."""
    on_fail: Literal["continue", "stop"] = "continue"
    """Whether the session continues or stops after a failed test."""
    stop_words: Words = STOP_WORDS
    """What is said where the session stops."""

    @model_validator(mode="after")
    def _each_once(self) -> Screening:
        names = [test.test for test in self.tests]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"the test '{name}' stands twice")
        return self

    def meet(self, setting: BlockContext) -> Block:
        """Return the block, with pictures of this observer's own."""
        screen = _screen(self.tests, setting)
        return self.of_tests([test.make(screen, setting.own_seed) for test in self.tests], setting.style)

    def doubts(self, setting: BlockContext) -> Iterator[Fault]:
        """Yield that a mode with colour filters gives the squares of a stereogram away."""
        names = [test.test for test in self.tests]
        rig = setting.rig
        mixed = find_mode(rig.mode, ModeOptions.parse(rig.spec.mode_options)).mixture(rig.models) is not None
        if "stereo_acuity" in names and mixed:
            what = f"stereo acuity in the mode '{rig.mode}': without fusing, colour gives the square away"
            remedy = "test stereo acuity in a mode without colour filters, or with a printed test"
            yield Fault(what, ("tests", names.index("stereo_acuity")), remedy)

    def unpractised(self) -> Iterator[Fault]:
        """Yield that a practice cannot end the session."""
        if self.on_fail == "stop":
            yield Fault("a practice cannot end the session", ("on_fail",), "on_fail: continue")

    @classmethod
    def in_words(cls, facts: Mapping[str, Any]) -> Sequence[str]:
        """Return a sentence for each test."""
        return [_in_words(test, own) for test, own in facts.items()]

    def of_tests(self, tests: Sequence[VisionTest], style: Style) -> Block:
        """Return the block of tests that are made.

        Its trials are every presentation, which is what someone meets who sees everything; an outcome is no trial.
        """
        shown = sum(test.presentations for test in tests)
        return Block(
            entry=self,
            steps=partial(self._steps, tests, style),
            trials=shown,
            expected_s=_SECONDS_PER_PAGE * len(tests) + _SECONDS_PER_PRESENTATION * shown,
            keys=KEYS,
            pictures={one.picture: one.make for test in tests for one in _presentations(test.series)},
            facts={test.name: {"pass_mark": test.pass_mark, "unit": test.unit, **test.facts} for test in tests},
        )

    def _steps(self, tests: Sequence[VisionTest], style: Style) -> Steps:
        """Ask until each series is lost or at its end, and record the answers and outcomes."""
        for test in tests:
            first = next(_presentations(test.series))
            yield replace(
                page(style.interface.pointing(test.page), style, "begin"), upcoming=_scene(style, test, first)
            )
            all_answers = []
            for number, series in enumerate(test.series):
                after = next(_presentations(test.series[number + 1 :]), None)
                all_answers.append((yield from _run(test, style, series, after)))
            outcome = _outcome(test, all_answers)
            yield Draft(KIND, outcome, repeatable=False)
            if self.on_fail == "stop" and not outcome["outcome"]["passed"]:
                response = answer((yield page(self._stop_words(style), style, "finish")))
                data = {"test": test.name, "screened_out": True}
                yield Draft(KIND, data, response_time_s=response.time_s, repeatable=False)
                raise SessionEnd({"screened_out": True})

    def _stop_words(self, style: Style) -> str:
        return self.stop_words if "stop_words" in self.model_fields_set else style.say("screened_out")


def _run(
    test: VisionTest, style: Style, series: VisionSeries, after: Presented | None
) -> Generator[Ask | Draft, Response | None, TrialAnswers]:
    """Go down ``series`` until a level is not passed; ``after`` is what is shown next in either case."""
    answers = TrialAnswers(series)
    all_shown = [*series.levels.values()]
    for number, level in enumerate(series.levels):
        finer = all_shown[number + 1][0] if number + 1 < len(all_shown) else after
        for place, presentation in enumerate(all_shown[number]):
            rest = all_shown[number][place + 1 :]
            if_right = rest[0] if rest else finer
            if_wrong = if_right if answers.can_pass(level, if_wrong=True) else after
            ask = Ask(
                _scene(style, test, presentation),
                KEYS,
                _upcoming(style, test, if_right, if_wrong),
                Choose(series.task, SIDES, presentation.correct, presentation.strength),
                test.targets,
            )
            response = answer((yield ask))
            right = response.meaning == presentation.correct
            answers.add(presentation, right=right)
            data = {
                "test": test.name,
                "series": series.name,
                "level": level,
                "unit": test.unit,
                "presentation": place,
                **presentation.details,
                "correct_answer": presentation.correct,
                "answer": response.meaning,
                "correct": right,
            }
            yield Draft(KIND, data, response_time_s=response.time_s, repeatable=False)
            if not answers.can_pass(level):
                break
        if not answers.end_level(level):
            break
    return answers


def _scene(style: Style, test: VisionTest, presentation: Presented) -> Scene:
    half = test.side_px / 2 / style.unit_px
    items: tuple[Item, ...] = (
        style.text(style.say(test.question), y=-half - 54, height=28),
        Picture(presentation.picture),
        *test.marks,
        style.text(style.say("point_to_it"), y=half + 46, height=20, share=0.2),
    )
    return Scene(items)


def _upcoming(style: Style, test: VisionTest, *candidates: Presented | None) -> Scene | None:
    """Return a scene that holds all that may come next: it is made ready, not shown."""
    items = tuple(item for candidate in candidates if candidate for item in _scene(style, test, candidate).items)
    return Scene(tuple(dict.fromkeys(items))) if items else None


def _presentations(series: tuple[VisionSeries, ...]) -> Iterator[Presented]:
    return (shown for each in series for level in each.levels.values() for shown in level)


def _outcome(test: VisionTest, all_answers: list[TrialAnswers]) -> dict[str, Any]:
    """Return a test's record; without an estimate where the answers leave it open."""
    by_series = {}
    for answers in all_answers:
        series = answers.series
        reached = answers.threshold is not None and (series.control or answers.threshold <= test.pass_mark)
        by_series[series.name] = {
            "passed": reached,
            "threshold": None if series.control else answers.threshold,
            "estimate": None if series.control else _in_unit(answers.estimate, test),
            "presentations": len(answers.right),
            "right": sum(answers.right),
        }
    names = {
        control: [each.series.name for each in all_answers if each.series.control == control]
        for control in (False, True)
    }
    measured, controls = ([by_series[name] for name in names[control]] for control in (False, True))
    return {
        "test": test.name,
        "outcome": {
            "passed": all(result["passed"] for result in by_series.values()),
            "threshold": _worst([result["threshold"] for result in measured]),
            "estimate": _worst([result["estimate"] for result in measured]),
            "pass_mark": test.pass_mark,
            "unit": test.unit,
            "controls_seen": all(result["passed"] for result in controls),
        },
        "by_series": by_series,
        "screen": dict(test.facts),
    }


def _worst(values: list[float | None]) -> float | None:
    """Return the largest, None if one is open."""
    known = [value for value in values if value is not None]
    return max(known) if known and len(known) == len(values) else None


def _in_unit(strength: float | None, test: VisionTest) -> float | None:
    if strength is None:
        return None
    if test.logarithmic:
        return round(math.log10(strength), 4)
    return round(strength, 6)


_UNITS = {"arcsec": " arcsec", "logmar": " logMAR", "delta_uv": " of u'v'"}


def _in_words(test: str, facts: Mapping[str, Any]) -> str:
    """Return a vision test in a sentence: what passes it, the levels from coarse to fine, and those left out."""
    unit = facts["unit"]
    levels, left_out = facts.get(f"levels_{unit}", []), facts.get(f"not_shown_{unit}", [])
    words = f"{test.replace('_', ' ')}: passed at {facts['pass_mark']:g}{_UNITS.get(unit, f' {unit}')} or finer"
    if levels:
        words += f", shown from {max(levels):g} to {min(levels):g}"
    if left_out:
        words += f"; this screen cannot show {', '.join(f'{level:g}' for level in left_out)}"
    return words


def _screen(tests: list[AnyTestSpec], setting: BlockContext) -> Screen:
    """Return the rig's screen, if its stereo mode can show the tests at all."""
    rig = setting.rig
    mode = find_mode(rig.mode, ModeOptions.parse(rig.spec.mode_options))
    area = mode.areas(rig.display.panel.resolution_px)[0]
    names = {test.test for test in tests}
    mixed = mode.mixture(rig.models) is not None
    if "stereo_acuity" in names and len(area.eyes) > 1 and not mixed:
        raise _impossible("stereo_acuity", mode.name, "it shows both eyes the same pixels", "choose a stereo mode")
    if "colour_vision" in names and mixed:
        raise _impossible("colour_vision", mode.name, "its filters change colours", "use printed plates")
    return Screen(
        setting.style.view_px,
        rig.display.panel.pixel_pitch_mm,
        rig.spec.distance_mm,
        rig.spec.interpupillary_distance_mm,
        _grain_px(area),
        rig.models,
        rig.observer,
    )


def _grain_px(area: EyeArea) -> tuple[int, int]:
    across, down = area.squeeze
    if area.weave is None:
        return across, down
    return across * (2 if area.weave.column_step else 1), down * (2 if area.weave.row_step else 1)


def _impossible(test: str, mode: str, why: str, remedy: str) -> SessionError:
    finding = Finding(f"screening: the mode '{mode}' cannot show {test}: {why}", remedy=f"leave it out, or {remedy}")
    return SessionError(finding)
