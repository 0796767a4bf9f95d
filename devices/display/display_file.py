"""Display files: `configs/displays/*.yaml` to display models, one per stereo mode and eye.

A mode may also hold what leaks between the eyes and how evenly the panel shines; `same_as` carries both along.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

from numpy.typing import ArrayLike

from devices.display.crosstalk import Crosstalk, check_leakage
from devices.display.display_spec import BothEyesSpec, DisplaySpec, PerEyeSpec, SameAsSpec
from devices.display.gain_map import GainMap
from devices.display.gamma_table import GammaTable
from devices.display.held_out import HeldOut
from devices.display.model import EYES as EYES
from devices.display.model import Eye as Eye
from devices.display.model import EyeModels as EyeModels
from devices.display.model_spec import CURVES
from devices.display.monitor_settings import MonitorSettings
from devices.display.nominal import NOMINAL_OBSERVER, NOT_MEASURED, Nominal
from devices.display.panel import PanelSpec
from devices.errors import DeviceError
from documents import Finding, InputError, load_document
from documents.text import did_you_mean
from documents.yaml import YamlSource

NO_TABLE = "the display was not measured"
Made = TypeVar("Made")


def nominal_models(nominal: Nominal, ambient_XYZ_cd_m2: ArrayLike | None = None) -> EyeModels:
    """Return what both eyes see of a nominal display, in a room of which they get so much light, (3,)."""
    model = nominal.model()
    models = EyeModels(model, model)
    return models if ambient_XYZ_cd_m2 is None else models.in_room(ambient_XYZ_cd_m2, ambient_XYZ_cd_m2)


@dataclass(frozen=True, slots=True)
class Display:
    """A display file, read: its panel and its characterised modes; ``lacking`` holds modes that want an eye still.

    ``observers`` is the colorimetric observer of each mode's XYZ, such as ``CIE 1931 2``.
    ``held_out`` is how far each eye's characterisation is from readings that it was not fitted to, where it is stated.
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
    held_out: dict[str, dict[Eye, HeldOut]] = field(default_factory=dict)
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
    eyes = (mode,) if isinstance(mode, BothEyesSpec) else (mode.left, mode.right)
    whose = {f"{one.curve.kind} of {of}" for one in eyes if one is not None and (of := CURVES.whose(one.curve.kind))}
    display.modes[name], display.sources[name] = models, "; ".join(filter(None, (mode.source, *sorted(whose))))
    display.observers[name] = str(mode.observer)
    display.held_out[name] = mode.held_out
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
    except InputError as error:
        raise DeviceError([source.finding(key, f.message, f.remedy, key=True) for f in error.findings]) from error
