"""`kind: screening`: tests of the observer's vision."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field, PositiveFloat, model_validator

from documents import Finding, InputError
from runner.blocks.screening.block import STOP_WORDS, Screening
from runner.blocks.screening.colour_vision import colour_vision
from runner.blocks.screening.near_acuity import near_acuity
from runner.blocks.screening.screen import Screen
from runner.blocks.screening.series import VisionTest
from runner.blocks.screening.stereo_acuity import Depth, stereo_acuity
from runner.errors import SessionError
from runner.presenter.modes.mode import EyeArea, Mode
from runner.presenter.modes.options import ModeOptions
from runner.presenter.modes.registry import find_mode
from runner.protocol.kinds.block_spec import BlockSpec, Fault
from runner.protocol.parts import Strict, Words
from runner.protocol.setting import Setting
from stimuli.vision_tests.confusion_lines import AXES, Axis

Repeats = Annotated[int, Field(ge=1, le=20)]
LogMAR = Annotated[float, Field(ge=-1, le=2)]
Levels = Annotated[tuple[PositiveFloat, ...], Field(min_length=1, max_length=20)]
Sizes = Annotated[tuple[LogMAR, ...], Field(min_length=1, max_length=20)]


class _TestSpec(Strict):
    """A test; a level is passed by ``required`` right answers of ``repeats``, and the first failed ends a series."""

    repeats: Repeats = 4
    required: Repeats = 3

    @model_validator(mode="after")
    def _possible(self) -> _TestSpec:
        if self.required > self.repeats:
            raise ValueError(f"'required' is {self.required} of only {self.repeats} 'repeats'")
        return self

    @abstractmethod
    def make(self, screen: Screen, seed: str) -> VisionTest:
        """Return the test on ``screen``; raise SessionError if the screen cannot show its pass mark."""


class StereoAcuitySpec(_TestSpec):
    """Random-dot stereograms; ``levels_arcsec`` from coarse to fine, the pass mark among them in any case."""

    test: Literal["stereo_acuity"]
    pass_arcsec: PositiveFloat = 140.0
    levels_arcsec: Levels = (600.0, 400.0, 280.0, 200.0, 140.0, 100.0, 70.0, 50.0)
    depth: Depth = "both"

    def make(self, screen: Screen, seed: str) -> VisionTest:
        """Return the test."""
        return stereo_acuity(
            screen,
            seed,
            pass_arcsec=self.pass_arcsec,
            levels_arcsec=self.levels_arcsec,
            repeats=self.repeats,
            required=self.required,
            depth=self.depth,
        )


class ColourVisionSpec(_TestSpec):
    """Rings of dots on the confusion lines of ``axes``; levels are distances in CIE 1976 u'v'."""

    test: Literal["colour_vision"]
    pass_delta_uv: PositiveFloat = 0.02
    levels_delta_uv: Levels = (0.05, 0.03, 0.02)
    axes: Annotated[tuple[Axis, ...], Field(min_length=1)] = AXES
    controls: Annotated[int, Field(ge=0, le=20)] = 3

    def make(self, screen: Screen, seed: str) -> VisionTest:
        """Return the test."""
        return colour_vision(
            screen,
            seed,
            pass_delta_uv=self.pass_delta_uv,
            levels_delta_uv=self.levels_delta_uv,
            axes=tuple(dict.fromkeys(self.axes)),
            repeats=self.repeats,
            required=self.required,
            controls=self.controls,
        )


class NearAcuitySpec(_TestSpec):
    """Landolt rings; ``levels_logmar`` are logarithms of the gap in minutes of arc."""

    test: Literal["near_acuity"]
    repeats: Repeats = 5
    required: Repeats = 4
    pass_logmar: LogMAR = 0.2
    levels_logmar: Sizes = (0.6, 0.5, 0.4, 0.3, 0.2, 0.1, 0.0, -0.1)

    def make(self, screen: Screen, seed: str) -> VisionTest:
        """Return the test."""
        return near_acuity(
            screen,
            seed,
            pass_logmar=self.pass_logmar,
            levels_logmar=self.levels_logmar,
            repeats=self.repeats,
            required=self.required,
        )


AnyTestSpec = Annotated[StereoAcuitySpec | ColourVisionSpec | NearAcuitySpec, Field(discriminator="test")]


class ScreeningSpec(BlockSpec):
    """Vision tests, in order; with ``on_fail: stop`` the session ends after the first that is failed."""

    kind: Literal["screening"]
    tests: Annotated[list[AnyTestSpec], Field(min_length=1)]
    on_fail: Literal["continue", "stop"] = "continue"
    stop_words: Words = STOP_WORDS

    @model_validator(mode="after")
    def _each_once(self) -> ScreeningSpec:
        names = [test.test for test in self.tests]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"the test '{name}' stands twice")
        return self

    def make(self, setting: Setting) -> Screening:
        """Return the block, with pictures of this observer's own."""
        screen = _screen(self.tests, setting)
        tests = tuple(test.make(screen, setting.own_seed) for test in self.tests)
        return Screening(tests, self.on_fail, self.stop_words, setting.style)

    def rig_faults(self, setting: Setting) -> Iterator[Fault]:
        """Yield which tests the rig cannot show, or not as far as their pass marks."""
        try:
            self.make(setting)
        except InputError as error:
            yield from (Fault(finding.message, remedy=finding.remedy or "") for finding in error.findings)


def _screen(tests: list[AnyTestSpec], setting: Setting) -> Screen:
    """Return the rig's screen, if its stereo mode can show the tests at all."""
    rig = setting.rig
    mode = find_mode(rig.mode, ModeOptions.parse(rig.mode_options))
    area = mode.areas(rig.display.panel.resolution_px)[0]
    names = {test.test for test in tests}
    mixed = mode.mixture(rig.models) is not None
    if "stereo_acuity" in names and len(area.eyes) > 1 and not mixed:
        raise _impossible("stereo_acuity", mode, "it shows both eyes the same pixels", "choose a stereo mode")
    if "colour_vision" in names and mixed:
        raise _impossible("colour_vision", mode, "its filters change colours", "use printed plates")
    return Screen(
        setting.view_px,
        rig.display.panel.pixel_pitch_mm,
        rig.distance_mm,
        rig.interpupillary_distance_mm,
        _grain_px(area),
        rig.models,
    )


def _grain_px(area: EyeArea) -> tuple[int, int]:
    across, down = area.squeeze
    if area.weave is None:
        return across, down
    return across * (2 if area.weave.column_step else 1), down * (2 if area.weave.row_step else 1)


def _impossible(test: str, mode: Mode, why: str, remedy: str) -> SessionError:
    finding = Finding(
        f"screening: the mode '{mode.name}' cannot show {test}: {why}", remedy=f"leave it out, or {remedy}"
    )
    return SessionError(finding)
