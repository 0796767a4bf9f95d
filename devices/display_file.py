"""Display files: `configs/displays/*.yaml` to display models, one per stereo mode and eye."""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Discriminator, Field, PositiveFloat, PositiveInt, Tag

from devices.display import DisplayModel
from devices.errors import DeviceError
from devices.tone_curve import ToneCurve
from documents import Finding, load_document
from documents.yaml_source import YamlSource

Eye = Literal["left", "right"]
Triple = tuple[float, float, float]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class PanelSpec(_Strict):
    """The panel: how many pixels, how large, how fast, how deep."""

    resolution_px: tuple[PositiveInt, PositiveInt]
    pixel_pitch_mm: PositiveFloat
    refresh_hz: PositiveFloat = 60.0
    bits: Literal[6, 8, 10, 12] = 8


class PrimariesSpec(_Strict):
    """XYZ of each channel at full drive minus black, in cd/m²."""

    red: Triple
    green: Triple
    blue: Triple


class ChannelSpec(_Strict):
    """One channel's curve: linear = max(0, gain · code + offset) ^ gamma + lift, code in 0..1."""

    gain: PositiveFloat = 1.0
    offset: float = 0.0
    gamma: PositiveFloat
    lift: float = 0.0


# What each kind of curve leaves fixed.
_FIXED = {"gog": ("lift",), "ggo": ("offset",), "gogo": (), "gamma": ("gain", "offset", "lift")}


class CurveSpec(_Strict):
    """The tone curves of the three channels."""

    kind: Literal["gog", "gogo", "ggo", "gamma"]
    red: ChannelSpec
    green: ChannelSpec
    blue: ChannelSpec


class ModelSpec(_Strict):
    """One characterisation, measured through the glasses in its stereo mode."""

    black_XYZ_cd_m2: Triple
    primaries_XYZ_cd_m2: PrimariesSpec
    curve: CurveSpec
    source: str = ""

    def model(self) -> DisplayModel:
        """Return the display model."""
        fixed = _FIXED[self.curve.kind]
        channels = (self.curve.red, self.curve.green, self.curve.blue)
        for channel in channels:
            for name in fixed:
                if name in channel.model_fields_set:
                    raise DeviceError(f"a curve of kind '{self.curve.kind}' has no '{name}'")
        primaries = self.primaries_XYZ_cd_m2
        red, green, blue = (ToneCurve(c.gain, c.offset, c.gamma, c.lift) for c in channels)
        return DisplayModel(
            np.array(self.black_XYZ_cd_m2),
            np.array([primaries.red, primaries.green, primaries.blue]).T,
            (red, green, blue),
        )


class SameAsSpec(_Strict):
    """A mode whose light is that of another mode: same panel state and glasses, other signal."""

    same_as: str


class PerEyeSpec(_Strict):
    """A mode characterised through each lens."""

    left: ModelSpec
    right: ModelSpec


def _shape(value: Any) -> str:
    keys = value if isinstance(value, dict) else {}
    if isinstance(value, BaseModel):
        keys = dict.fromkeys(type(value).model_fields)
    return "same" if "same_as" in keys else "eyes" if "left" in keys or "right" in keys else "model"


ModeSpec = Annotated[
    Annotated[SameAsSpec, Tag("same")] | Annotated[PerEyeSpec, Tag("eyes")] | Annotated[ModelSpec, Tag("model")],
    Discriminator(_shape),
]


class DisplaySpec(_Strict):
    """A display file."""

    schema_version: Literal[1]
    panel: PanelSpec
    modes: dict[str, ModeSpec] = Field(min_length=1)


@dataclass(frozen=True, slots=True)
class EyeModels:
    """What each eye sees of the display in one stereo mode; the same object where one model serves both."""

    left: DisplayModel
    right: DisplayModel

    def eye(self, eye: Eye) -> DisplayModel:
        """Return the model for ``eye``."""
        return self.left if eye == "left" else self.right


@dataclass(frozen=True, slots=True)
class Display:
    """A display file, read: its panel and its characterised modes."""

    file: str
    panel: PanelSpec
    modes: dict[str, EyeModels]
    sources: dict[str, str]

    def models(self, mode: str) -> EyeModels:
        """Return the characterisation of stereo mode ``mode``; raise DeviceError if it was not characterised."""
        if mode in self.modes:
            return self.modes[mode]
        near = difflib.get_close_matches(mode, self.modes, n=1)
        known = ", ".join(sorted(self.modes))
        hint = f"did you mean '{near[0]}'? " if near else ""
        raise DeviceError(
            Finding(
                f"the display was not characterised in the mode '{mode}'",
                self.file,
                remedy=f"{hint}characterised here: {known}; measure the mode through the glasses and add it",
            )
        )


def read_display(path: Path) -> Display:
    """Read the display file at ``path``.

    Raises
    ------
    InputError
        With every fault's file, line, column and remedy.
    """
    spec, source = load_document(path, DisplaySpec)
    modes: dict[str, EyeModels] = {}
    sources: dict[str, str] = {}
    findings: list[Finding] = []
    for name in spec.modes:
        try:
            modes[name], sources[name] = _resolve(name, spec, source)
        except DeviceError as error:
            findings += error.findings
    if findings:
        raise DeviceError(findings)
    return Display(str(path), spec.panel, modes, sources)


def _resolve(name: str, spec: DisplaySpec, source: YamlSource) -> tuple[EyeModels, str]:
    seen = [name]
    mode = spec.modes[name]
    while isinstance(mode, SameAsSpec):
        place = source.place(("modes", seen[-1], "same_as"))
        where = (source.file, place.line if place else None, place.column if place else None)
        if mode.same_as in seen:
            raise DeviceError(Finding(f"the mode '{seen[-1]}' is the same as itself", *where, "name a measured mode"))
        if mode.same_as not in spec.modes:
            near = difflib.get_close_matches(mode.same_as, spec.modes, n=1)
            remedy = f"did you mean '{near[0]}'?" if near else "expected one of: " + ", ".join(sorted(spec.modes))
            raise DeviceError(Finding(f"there is no mode '{mode.same_as}'", *where, remedy))
        seen.append(mode.same_as)
        mode = spec.modes[mode.same_as]
    try:
        if isinstance(mode, PerEyeSpec):
            return EyeModels(mode.left.model(), mode.right.model()), mode.left.source
        model = mode.model()
        return EyeModels(model, model), mode.source
    except DeviceError as error:
        place = source.place(("modes", seen[-1]), key=True)
        line, column = (place.line, place.column) if place else (None, None)
        raise DeviceError([Finding(f.message, source.file, line, column, f.remedy) for f in error.findings]) from error
