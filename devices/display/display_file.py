"""Display files: `configs/displays/*.yaml` to display models, one per stereo mode and eye.

A mode may also hold what leaks between the eyes and how evenly the panel shines; `same_as` carries both along.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, Discriminator, Field, NonNegativeFloat, PositiveFloat, Tag, model_validator

from devices.colour_matching import DEFAULT_OBSERVER, mixed_observers
from devices.compensation.crosstalk import Crosstalk, check_leakage
from devices.compensation.gain_map import GainMap
from devices.display.gamma_table import GammaTable
from devices.display.gamma_table_spec import GammaTableSpec
from devices.display.model import DisplayModel
from devices.display.model_spec import AmbientSpec, CrosstalkSpec, GainMapSpec, ModelSpec
from devices.display.monitor_settings import MonitorSettings
from devices.display.nominal import NOMINAL_OBSERVER, NOT_MEASURED, Nominal, NominalKind, refuse_black
from devices.display.panel import PanelSpec
from devices.errors import DeviceError
from documents import Finding, load_document
from documents.text import did_you_mean
from documents.yaml import Strict, YamlSource

NO_TABLE = "the display was not measured"
Eye = Literal["left", "right"]
EYES: tuple[Eye, Eye] = ("left", "right")
Made = TypeVar("Made")


class SameAsSpec(Strict):
    """A mode whose light is that of another mode: same panel state and glasses, other signal."""

    same_as: str


class _ExtrasSpec(Strict):
    """What a mode holds of both eyes at once."""

    crosstalk: CrosstalkSpec | None = None
    gain_map: GainMapSpec | None = None
    monitor_settings: MonitorSettings | None = None


class BothEyesSpec(ModelSpec, _ExtrasSpec):
    """A mode with one characterisation for both eyes."""

    def eye_models(self) -> EyeModels:
        """Return the model, the same object for both eyes."""
        model = self.model()
        return EyeModels(model, model)

    def ambient_specs(self) -> dict[Eye, AmbientSpec | None]:
        """Return the mode's own word on the room's light, for each eye."""
        return dict.fromkeys(EYES, self.ambient_XYZ_cd_m2)

    def gamma_table_specs(self) -> dict[Eye, GammaTableSpec | None]:
        """Return what is said of the gamma table, for each eye."""
        return dict.fromkeys(EYES, self.gamma_table)


class PerEyeSpec(_ExtrasSpec):
    """A mode characterised through each lens, or through one so far: then no session can use it yet."""

    left: ModelSpec | None = None
    right: ModelSpec | None = None

    @property
    def source(self) -> str:
        """Where the numbers come from."""
        return next((spec.source for spec in (self.left, self.right) if spec), "")

    @property
    def observer(self) -> str:
        """The colorimetric observer of the XYZ."""
        return next((str(spec.observer) for spec in (self.left, self.right) if spec), DEFAULT_OBSERVER)

    def lacking(self) -> tuple[Eye, ...]:
        """Return the eyes without a model; each that has one is tried."""
        made = {"left": self.left and self.left.model(), "right": self.right and self.right.model()}
        return tuple(eye for eye in EYES if made[eye] is None)

    def eye_models(self) -> EyeModels:
        """Return each eye's model; DeviceError if one is lacking, or the two are for different observers."""
        if self.left is None or self.right is None:
            raise DeviceError(f"the {' and '.join(self.lacking())} eye has no characterisation")
        observers = [("the left eye", str(self.left.observer)), ("the right eye", str(self.right.observer))]
        if mixed := mixed_observers(observers):
            raise DeviceError(mixed)
        return EyeModels(self.left.model(), self.right.model())

    def ambient_specs(self) -> dict[Eye, AmbientSpec | None]:
        """Return the mode's own word on the room's light, for each eye."""
        left, right = (None if spec is None else spec.ambient_XYZ_cd_m2 for spec in (self.left, self.right))
        return {"left": left, "right": right}

    def gamma_table_specs(self) -> dict[Eye, GammaTableSpec | None]:
        """Return what is said of the gamma table that each eye was measured with."""
        left, right = (None if spec is None else spec.gamma_table for spec in (self.left, self.right))
        return {"left": left, "right": right}


def _shape(value: Any) -> str:
    keys = value if isinstance(value, dict) else {}
    if isinstance(value, BaseModel):
        keys = dict.fromkeys(type(value).model_fields)
    return "same" if "same_as" in keys else "eyes" if "left" in keys or "right" in keys else "model"


ModeSpec = Annotated[
    Annotated[SameAsSpec, Tag("same")] | Annotated[PerEyeSpec, Tag("eyes")] | Annotated[BothEyesSpec, Tag("model")],
    Discriminator(_shape),
]


class DisplaySpec(Strict):
    """A display file: modes that were measured, or a nominal display for all that were not, or both."""

    schema_version: Literal[1]
    panel: PanelSpec
    ambient_XYZ_cd_m2: AmbientSpec | None = None
    modes: dict[str, ModeSpec] = Field(default_factory=dict)
    nominal: NominalKind | None = None
    white_cd_m2: PositiveFloat | None = None
    black_cd_m2: NonNegativeFloat | None = None

    @model_validator(mode="after")
    def _has_modes(self) -> Self:
        if self.nominal is None and not self.modes:
            raise ValueError(
                "a display file needs 'modes:' that were measured, or 'nominal: srgb' and 'white_cd_m2: 100'"
            )
        if self.nominal is None and (self.white_cd_m2, self.black_cd_m2) != (None, None):
            raise ValueError("white_cd_m2 and black_cd_m2 are those of a nominal display: add 'nominal: srgb'")
        if self.nominal is not None and self.white_cd_m2 is None:
            raise ValueError("a nominal display needs its white: add 'white_cd_m2: 100'")
        refuse_black(self.white_cd_m2, self.black_cd_m2)
        return self

    @property
    def nominal_display(self) -> Nominal | None:
        """The nominal display, None where the file has none."""
        if self.nominal is None or self.white_cd_m2 is None:
            return None
        return Nominal.of(self.nominal, self.white_cd_m2, self.black_cd_m2)


@dataclass(frozen=True, slots=True)
class EyeModels:
    """What each eye sees of the display in one stereo mode; the same object where one model serves both."""

    left: DisplayModel
    right: DisplayModel

    def eye(self, eye: Eye) -> DisplayModel:
        """Return the model for ``eye``."""
        return self.left if eye == "left" else self.right

    def in_room(self, left_XYZ_cd_m2: ArrayLike, right_XYZ_cd_m2: ArrayLike) -> EyeModels:
        """Return the same display in a room of which each eye gets so much light, (3,), from the screen while off.

        Raises
        ------
        DeviceError
            If it is not three finite numbers of at least 0.
        """
        left = self.left.in_room(left_XYZ_cd_m2)
        same = self.left is self.right and np.array_equal(left_XYZ_cd_m2, right_XYZ_cd_m2)
        return EyeModels(left, left if same else self.right.in_room(right_XYZ_cd_m2))

    @property
    def normalised(self) -> EyeModels:
        """The same in units of what codes 0 and 1 give, see `DisplayModel.normalised`."""
        return EyeModels(self.left.normalised, self.right.normalised)


def nominal_models(nominal: Nominal, ambient_XYZ_cd_m2: ArrayLike | None = None) -> EyeModels:
    """Return what both eyes see of a nominal display, in a room of which they get so much light, (3,)."""
    model = nominal.model()
    models = EyeModels(model, model)
    return models if ambient_XYZ_cd_m2 is None else models.in_room(ambient_XYZ_cd_m2, ambient_XYZ_cd_m2)


@dataclass(frozen=True, slots=True)
class Display:
    """A display file, read: its panel and its characterised modes; ``lacking`` holds modes that want an eye still.

    ``observers`` is the colorimetric observer of each mode's XYZ, such as ``CIE 1931 2``.
    ``gamma_tables`` are those that were loaded while a mode was measured, as far as the file states them.
    ``monitor_settings`` is what the monitor's menu said then, where the file states it.
    ``nominal`` is the standard that the display is taken for in every mode that was not measured, ``nominal_models``
    what each eye then sees; None where such modes are refused.
    """

    file: str
    panel: PanelSpec
    modes: dict[str, EyeModels]
    sources: dict[str, str]
    crosstalks: dict[str, Crosstalk] = field(default_factory=dict)
    gain_maps: dict[str, GainMap] = field(default_factory=dict)
    lacking: dict[str, tuple[Eye, ...]] = field(default_factory=dict)
    observers: dict[str, str] = field(default_factory=dict)
    gamma_tables: dict[str, dict[Eye, GammaTable]] = field(default_factory=dict)
    monitor_settings: dict[str, MonitorSettings] = field(default_factory=dict)
    nominal: Nominal | None = None
    nominal_models: EyeModels | None = None

    @classmethod
    def of_nominal(cls, file: str, panel: PanelSpec, nominal: Nominal) -> Display:
        """Return a display of which no mode was measured."""
        return cls(file, panel, {}, {}, nominal=nominal, nominal_models=nominal_models(nominal))

    def nominal_in(self, mode: str) -> Nominal | None:
        """Return the nominal display that serves ``mode``, None where it was measured or is none."""
        return None if mode in self.modes or mode in self.lacking else self.nominal

    def stated_black_cd_m2(self, mode: str) -> float:
        """Return the black that adds to the models' light in ``mode``: that of a nominal display, else 0."""
        nominal = self.nominal_in(mode)
        return nominal.black_cd_m2 if nominal else 0.0

    def source(self, mode: str) -> str:
        """Return where the numbers of ``mode`` come from; errors as `models`."""
        self.models(mode)
        nominal = self.nominal_in(mode)
        return self.sources[mode] if nominal is None else f"{NOT_MEASURED}: {nominal.words}"

    def observer(self, mode: str) -> str:
        """Return the colorimetric observer of the XYZ of ``mode``; errors as `models`."""
        self.models(mode)
        return self.observers.get(mode, NOMINAL_OBSERVER)

    def gamma_table(self, mode: str, eye: Eye) -> GammaTable:
        """Return the gamma table that ``eye`` was measured with in ``mode``; unknown if the file does not state it."""
        why = NO_TABLE if self.nominal_in(mode) else "the display file does not state it"
        unknown = GammaTable.unreadable(why)
        return self.gamma_tables.get(mode, {}).get(eye, unknown)

    def crosstalk(self, mode: str) -> Crosstalk | None:
        """Return what leaks between the eyes in ``mode``, None if it was not measured; errors as `models`."""
        self.models(mode)
        return self.crosstalks.get(mode)

    def gain_map(self, mode: str) -> GainMap | None:
        """Return how evenly the panel shines in ``mode``, None if it was not measured; errors as `models`."""
        self.models(mode)
        return self.gain_maps.get(mode)

    def models(self, mode: str) -> EyeModels:
        """Return the characterisation of stereo mode ``mode``; raise DeviceError if it was not characterised."""
        if mode in self.modes:
            return self.modes[mode]
        if mode in self.lacking:
            raise DeviceError(self.unfinished(mode))
        if self.nominal_models is not None:
            return self.nominal_models
        known = ", ".join(sorted(self.modes))
        hint = did_you_mean(mode, self.modes, "")
        raise DeviceError(
            Finding(
                f"the display was not characterised in the mode '{mode}'",
                self.file,
                remedy=f"{hint} characterised here: {known}; measure the mode through the glasses and add it".lstrip(),
            )
        )

    def light_models(self, mode: str) -> EyeModels:
        """Return what an instrument would read in ``mode``: as `models`, with the black of a nominal display."""
        models, nominal = self.models(mode), self.nominal_in(mode)
        if nominal is None:
            return models
        light = nominal.light_model().in_room(models.left.ambient_XYZ_cd_m2)
        return EyeModels(light, light)

    def only_mode(self) -> str:
        """Return the mode of a file that has one; DeviceError if there are several, of which one must be named."""
        every = sorted((*self.modes, *self.lacking))
        if not every and self.nominal:
            return "nominal"  # it serves whatever mode is named
        if len(every) > 1 or self.nominal:
            every += ["any other, nominal"] if self.nominal else []
            what = f"the file has several modes: {', '.join(every)}"
            raise DeviceError(Finding(what, self.file, remedy="name one with --mode"))
        return every[0]

    def unfinished(self, mode: str) -> Finding:
        """Return a finding on a mode in ``lacking``."""
        eyes = " and ".join(self.lacking[mode])
        return Finding(
            f"the mode '{mode}' has no characterisation of the {eyes} eye yet, and cannot be used",
            self.file,
            remedy=f"measure it and add it with display fit --mode {mode} --eye {self.lacking[mode][0]}",
        )


def read_display(path: Path) -> Display:
    """Read the display file at ``path``.

    Parameters
    ----------
    path
        A display file, such as ``configs/displays/asus_vg248qe.yaml``.

    Returns
    -------
    Display
        The panel, and a display model for each stereo mode and eye.

    Raises
    ------
    InputError
        With every fault's file, line, column and remedy.

    Examples
    --------
    >>> display = read_display(Path("configs/displays/asus_vg248qe.yaml"))
    >>> sorted(display.modes), display.panel.resolution_px
    (['quad-buffered', 'side-by-side'], (1920, 1080))
    """
    spec, source = load_document(path, DisplaySpec, "display")
    findings: list[Finding] = []
    display = Display(str(path), spec.panel, {}, {})
    if nominal := spec.nominal_display:
        models = _located(lambda: nominal_models(nominal, spec.ambient_XYZ_cd_m2), source, ("nominal",))
        display = replace(display, nominal=nominal, nominal_models=models)
    for name in spec.modes:
        try:
            _add_mode(name, spec, source, display)
        except DeviceError as error:
            findings += [finding for finding in error.findings if finding not in findings]
    if findings:
        raise DeviceError(findings)
    return display


def _add_mode(name: str, spec: DisplaySpec, source: YamlSource, display: Display) -> None:
    measured, mode = _measured(name, spec, source)
    if mode.monitor_settings is not None:
        display.monitor_settings[name] = mode.monitor_settings
    if isinstance(mode, PerEyeSpec) and (lacking := _located(mode.lacking, source, ("modes", measured))):
        display.lacking[name] = lacking
        return
    models = _located(mode.eye_models, source, ("modes", measured))
    both = isinstance(mode, BothEyesSpec)
    if spec.ambient_XYZ_cd_m2 is not None:
        own = mode.ambient_specs()
        models = models.in_room(*(own[eye] or spec.ambient_XYZ_cd_m2 for eye in EYES))
    display.modes[name], display.sources[name] = models, mode.source
    display.observers[name] = str(mode.observer)
    display.gamma_tables[name] = {
        eye: _located(spec_of.table, source, ("modes", measured, *(["gamma_table"] if both else [eye, "gamma_table"])))
        for eye, spec_of in mode.gamma_table_specs().items()
        if spec_of is not None
    }
    if crosstalk_spec := mode.crosstalk:

        def crosstalk() -> Crosstalk:
            leakage = crosstalk_spec.crosstalk()
            check_leakage(leakage, models.left.primaries_XYZ_cd_m2, models.right.primaries_XYZ_cd_m2)
            return leakage

        display.crosstalks[name] = _located(crosstalk, source, ("modes", measured, "crosstalk"))
    if gain_map_spec := mode.gain_map:
        resolution_px = spec.panel.resolution_px
        display.gain_maps[name] = _located(
            lambda: gain_map_spec.gain_map(resolution_px), source, ("modes", measured, "gain_map")
        )


def _measured(name: str, spec: DisplaySpec, source: YamlSource) -> tuple[str, BothEyesSpec | PerEyeSpec]:
    """Follow ``same_as`` from the mode ``name`` to the mode that was measured."""
    seen = [name]
    mode = spec.modes[name]
    while isinstance(mode, SameAsSpec):
        where = ("modes", seen[-1], "same_as")
        if mode.same_as in seen:
            raise DeviceError(
                source.finding(where, f"the mode '{seen[-1]}' is the same as itself", "name a measured mode")
            )
        if mode.same_as not in spec.modes:
            remedy = did_you_mean(mode.same_as, sorted(spec.modes))
            raise DeviceError(source.finding(where, f"there is no mode '{mode.same_as}'", remedy))
        seen.append(mode.same_as)
        mode = spec.modes[mode.same_as]
    return seen[-1], mode


def _located(make: Callable[[], Made], source: YamlSource, key: tuple[str, ...]) -> Made:
    """Return ``make()``; its findings get the place of the key at ``key``."""
    try:
        return make()
    except DeviceError as error:
        raise DeviceError([source.finding(key, f.message, f.remedy, key=True) for f in error.findings]) from error
