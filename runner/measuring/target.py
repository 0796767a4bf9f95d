"""What is to be measured: a panel in a stereo mode, from a rig file or a display file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

from devices.colour_matching import DEFAULT_OBSERVER
from devices.display import (
    EYES,
    Crosstalk,
    Eye,
    EyeModels,
    GainMap,
    GammaTable,
    MonitorSettings,
    NominalSpec,
    PanelSpec,
    RigSpec,
    read_display,
    read_rig,
)
from devices.errors import MeasuringError
from devices.readings import ALL, PatchEye, PatchSet, SimulatedDisplay, Wiring, find_sets
from documents import Finding, load_document
from documents.files import beside, looked_for
from documents.yaml import read_yaml
from runner.measuring.options import Dialogue, InstrumentOptions, PatchOptions, ShowPatches
from runner.presenter.modes.mode import Mode
from runner.presenter.modes.options import ModeOptions
from runner.presenter.modes.registry import find_mode
from runner.presenter.surfaces.screens import primary_monitor


class _PanelAlone(BaseModel):
    """A display file of which only the panel counts: its modes may not be measured yet."""

    model_config = ConfigDict(extra="allow", frozen=True, allow_inf_nan=False)

    schema_version: Literal[1]
    panel: PanelSpec


@dataclass(frozen=True, slots=True)
class Target:
    """The ``file`` as given, the display file, its panel, the stereo mode, and its measurements if there are any.

    ``gamma_tables`` are those that each eye was measured with, ``identity`` is whether the rig asks for the identity.
    ``monitor_settings`` are those that a rig file states, None where it does not or a display file was given.
    """

    file: Path
    display_file: Path
    panel: PanelSpec
    mode: Mode
    models: EyeModels | None = None
    mode_options: dict[str, Any] = field(default_factory=dict)
    crosstalk: Crosstalk | None = None
    gain_map: GainMap | None = None
    observer: str = DEFAULT_OBSERVER
    gamma_tables: Mapping[Eye, GammaTable] = field(default_factory=dict)
    identity: bool = False
    monitor_settings: MonitorSettings | None = None
    monitors: tuple[str, ...] = ()

    @property
    def simulated(self) -> SimulatedDisplay | None:
        """The display as a simulated instrument sees it, None if it was not characterised in this mode."""
        return None if self.models is None else SimulatedDisplay(self.models, self.crosstalk, self.gain_map)

    def characterised(self) -> SimulatedDisplay:
        """Return all that was measured of the display.

        Raises
        ------
        MeasuringError
            If it was not characterised in this mode.
        """
        if self.simulated is None:
            what = f"the display was not characterised in the mode '{self.mode.name}'"
            raise MeasuringError(Finding(what, str(self.display_file), remedy="measure it, and fit a model"))
        return self.simulated

    def check_eye(self, eye: PatchEye) -> str:
        """Return a remark on measuring ``eye`` alone, empty if there is none.

        Raises
        ------
        MeasuringError
            If the mode has but one picture for both eyes and no filters.
        """
        if eye == "both" or not self._shares_pixels:
            return ""
        if self.mode.name == "flat":
            raise MeasuringError(Finding("the mode 'flat' has no picture of its own for an eye", remedy="--eye both"))
        return f"'{self.mode.name}' shows both eyes the same pixels: hold the {eye} filter before the instrument"

    def sets(self, asked: PatchOptions, eye: PatchEye) -> tuple[tuple[PatchSet, ...], str]:
        """Return the sets asked for, and a remark on those of ``all`` that the mode cannot show, which are left out."""
        sets = find_sets(asked.set_names, asked.code_range, asked.every_s)
        if asked.area is not None or asked.surround is not None:
            grey = asked.surround or 0.0
            sets = tuple(patches.in_part(asked.area, (grey, grey, grey)) for patches in sets)
        return self.check_sets(sets, eye, chosen=ALL not in asked.set_names)

    def check_sets(self, sets: Sequence[PatchSet], eye: PatchEye, *, chosen: bool) -> tuple[tuple[PatchSet, ...], str]:
        """Return those of ``sets`` that can be shown, and a remark on the others, empty if there are none.

        Raises
        ------
        MeasuringError
            If one that was ``chosen`` by its name cannot be shown to ``eye`` in this mode, or none is left.
        """
        size_px = self.panel.resolution_px
        areas = self.mode.areas(size_px)
        parts = any(area.squeeze == (1, 1) and area.rectangle.size_px != size_px for area in areas)
        kept: list[PatchSet] = []
        refused: list[Finding] = []
        for patches in sets:
            if self.mode.name == "flat" and not all(patch.glasses for patch in patches.patches):
                why, remedy = "needs no glasses", "leave it out"
            elif self._shares_pixels and any(patch.other is not None for patch in patches.patches):
                why, remedy = "shows both eyes the same pixels", "leave it out"
            elif parts and eye != "both" and any(patch.place is not None for patch in patches.patches):
                why, remedy = f"shows the {eye} eye a part of the panel alone", "--eye both"
            else:
                kept.append(patches)
                continue
            what = f"'{patches.name}' cannot be measured: '{self.mode.name}' {why}"
            refused.append(Finding(what, remedy=remedy))
        if refused and (chosen or not kept):
            raise MeasuringError(refused)
        return tuple(kept), "; ".join(finding.message for finding in refused)

    @property
    def _shares_pixels(self) -> bool:
        return any(len(area.eyes) > 1 for area in self.mode.areas(self.panel.resolution_px))


def read_target(path: Path, mode: str | None = None) -> Target:
    """Read the rig or display file at ``path``; ``mode`` goes before a rig's own, and a display file needs it.

    A display file need not hold the mode: it is there to be measured.

    Raises
    ------
    InputError
        If a file is wrong, or no mode is named.
    """
    options: dict[str, Any] = {}
    identity = False
    settings: MonitorSettings | None = None
    monitors: tuple[str, ...] = ()
    display_file = path
    data = read_yaml(path).data
    if isinstance(data, dict) and "display" in data and "panel" not in data:
        rig, source = load_document(path, RigSpec, "rig")
        if mode is None or mode == rig.mode:
            options = rig.mode_options
        if isinstance(rig.display, NominalSpec):
            return _nominal_target(path, rig, mode or rig.mode, options)
        display_file = beside(path, rig.display)
        if not display_file.is_file():
            what = f"there is no such display file: {rig.display}"
            raise MeasuringError(source.finding(("display",), what, looked_for(display_file)))
        identity = rig.gamma_table == "identity"
        mode = mode or rig.mode
        settings, monitors = rig.monitor_settings, rig.monitors
    if mode is None:
        raise MeasuringError(
            Finding("a display file does not say in which stereo mode", str(path), remedy="add --mode")
        )
    spec, _ = load_document(display_file, _PanelAlone, "display")
    stereo_mode = find_mode(mode, ModeOptions.parse(options))
    # A new display file has no modes yet; one that has must be right.
    known = {"modes", "nominal"} & set(spec.model_extra or {})
    display = read_display(display_file) if any((spec.model_extra or {})[key] for key in known) else None
    if display is None or (mode not in display.modes and not display.nominal_in(mode)):
        return Target(
            path,
            display_file,
            spec.panel,
            stereo_mode,
            None,
            options,
            identity=identity,
            monitor_settings=settings,
            monitors=monitors,
        )
    return Target(
        path,
        display_file,
        spec.panel,
        stereo_mode,
        display.light_models(mode),
        options,
        display.crosstalk(mode),
        display.gain_map(mode),
        display.observer(mode),
        {eye: display.gamma_table(mode, eye) for eye in EYES},
        identity,
        settings,
        monitors,
    )


def _nominal_target(path: Path, rig: RigSpec, mode: str, options: dict[str, Any]) -> Target:
    """Return the panel of a rig whose display is nominal: there to be measured."""
    read = read_rig(path, mode, ask_monitor=primary_monitor)
    models = read.display.light_models(mode)
    return Target(
        path,
        path,
        read.display.panel,
        find_mode(mode, ModeOptions.parse(options)),
        models,
        options,
        observer=read.observer,
        gamma_tables=read.measured_gamma_tables,
        identity=rig.gamma_table == "identity",
        monitor_settings=rig.monitor_settings,
        monitors=rig.monitors,
    )


def wiring_of(target: Target, show: ShowPatches, instrument: InstrumentOptions, dialogue: Dialogue) -> Wiring:
    """Return what the instrument may need: the port, its options, the person, a display to simulate.

    A simulated instrument looks at the target, or at the display file that its option ``display`` names.
    """
    options = dict(instrument.instrument_options)
    looked_at = target
    if instrument.instrument == "simulated" and "display" in options:
        looked_at = read_target(Path(options.pop("display")), target.mode.name)
    if instrument.instrument == "simulated" and looked_at.observer != DEFAULT_OBSERVER:
        what = f"the mode '{target.mode.name}' is for the observer {looked_at.observer}; XYZ are read for "
        what += DEFAULT_OBSERVER
        remedy = f"simulate a display that was characterised for {DEFAULT_OBSERVER}"
        raise MeasuringError(Finding(what, str(looked_at.display_file), remedy=remedy))
    simulated = looked_at.simulated
    return Wiring(instrument.port, options, dialogue.ask, dialogue.tell, simulated, show.seed, show.eye)
