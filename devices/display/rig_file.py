"""Rig files: `configs/rigs/*.yaml`: which display, in which stereo mode, seen from where."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import Discriminator, Field, Tag

from devices.colour_matching import DEFAULT_OBSERVER, ObserverSpec
from devices.display.crosstalk import Crosstalk
from devices.display.display_file import EYES, Display, Eye, EyeModels, read_display
from devices.display.gain_map import GainMap
from devices.display.gamma_table import GammaTable
from devices.display.held_out import HeldOut
from devices.display.model import refuse_lift
from devices.display.model_spec import AmbientSpec
from devices.display.monitor_settings import MonitorSettings
from devices.display.nominal import Nominal, NominalSpec
from devices.display.panel import AskMonitor
from devices.display.verification_file import Verification, read_verification
from devices.errors import DeviceError
from devices.timing_marks import MarksKind, TimingMarksSpec, listed_marks, listed_twice
from documents import Finding, InputError, load_document
from documents.files import beside, looked_for
from documents.yaml import FileModel, Natural, Positive

Read = TypeVar("Read")
MonitorName = Annotated[Natural, Field(le=1000)] | Annotated[str, Field(min_length=1)]


class PerEyeAmbientSpec(FileModel):
    """The room's light from the screen while it is off, through each lens, XYZ in cd/m²."""

    left: AmbientSpec
    """The room's light for the left eye, XYZ in cd/m²."""
    right: AmbientSpec
    """The room's light for the right eye, XYZ in cd/m²."""


def _display_shape(value: Any) -> str:
    return "in place" if isinstance(value, dict | NominalSpec) else "file"


class RigSpec(FileModel):
    """A rig file. ``display`` is the path of a display file, or a nominal display in its place."""

    schema_version: Literal[1]
    """The version of the file format: 1."""
    display: Annotated[
        Annotated[str, Tag("file")] | Annotated[NominalSpec, Tag("in place")], Discriminator(_display_shape)
    ]
    """The display file, relative to this file, or the facts of a nominal display."""
    mode: str
    """The stereo mode, such as side-by-side."""
    distance_mm: Positive
    """The viewing distance, in mm."""
    interpupillary_distance_mm: Positive = 65.0
    """The distance between the eyes, in mm."""
    glasses: str = ""
    """The glasses, in words."""
    mode_options: dict[str, Any] = Field(default_factory=dict)
    """How the stereo mode is adjusted, such as swap_eyes."""
    lift_black: bool = False
    """Whether pictures are lifted so that crosstalk can be cancelled everywhere."""
    dither: Literal["none", "shared", "independent"] = "none"
    """Whether pictures are dithered, and whether both eyes share the mask."""
    photodiode_verification: str | None = Field(default=None, min_length=1)
    """The record of onsets verified with a photodiode, relative to this file."""
    observer: ObserverSpec = DEFAULT_OBSERVER
    """The colorimetric observer of the XYZ, such as CIE 1931 2 or CIE 1964 10."""
    gamma_table: Literal["identity"] | None = None
    """The graphics card's gamma table: identity loads it while a window is open."""
    monitor_settings: MonitorSettings | None = None
    """What the monitor's own menu said."""
    ambient_XYZ_cd_m2: AmbientSpec | PerEyeAmbientSpec | None = None
    """The room's light from the screen while it is off, XYZ in cd/m²."""
    monitor: MonitorName | Annotated[list[MonitorName], Field(min_length=2, max_length=2)] | None = None
    """Which monitor shows it, by name or number."""
    results_mirror: str | None = Field(default=None, min_length=1)
    """A folder that results are also copied to while a session runs, relative to this file."""
    timing_marks: TimingMarksSpec | None = None
    """Where a mark goes at each onset and answer: one port, or a list of them."""

    @property
    def monitors(self) -> tuple[str, ...]:
        """The monitors by name or number: none, one, or the left eye's and the right eye's."""
        named = self.monitor if isinstance(self.monitor, list) else [self.monitor]
        return tuple(str(name) for name in named if name is not None)


@dataclass(frozen=True, slots=True)
class Rig:
    """A rig file that was read: a display in a stereo mode at a viewing distance.

    ``spec`` is what the file says: the distances, the options of the mode as the presenter's modes know them, the
    observer of all XYZ, of the display's and of the stimuli's. Here is what it names, or what was given in its place:
    the ``display``, the ``mode`` and the ``monitors`` that windows open on, by name or number (none, one, or the left
    eye's and the right eye's); ``verification`` is the record of onsets checked with a photodiode, or None. ``models``
    are what each eye sees, the room's light included: the rig's own word on it before the display file's.
    ``characterised_as`` is the mode whose measurements serve: ``mode`` itself, unless an uncharacterised mode was
    allowed. ``mirror`` is the folder that results are copied to while a session runs, or None, and ``marks`` are the
    ports that get marks at onsets and answers.
    """

    file: str
    spec: RigSpec
    display: Display
    mode: str
    models: EyeModels
    characterised_as: str
    verification: Verification | None
    monitors: tuple[str, ...] = ()
    mirror: Path | None = None
    marks: tuple[MarksKind, ...] = ()

    @property
    def observer(self) -> str:
        """The colorimetric observer of all XYZ: of the display's and of the stimuli's."""
        return str(self.spec.observer)

    @property
    def measured_settings(self) -> MonitorSettings | None:
        """What the monitor's menu said when the display was measured, or None where its file does not state it."""
        return self.display.monitor_settings.get(self.characterised_as)

    @property
    def settings_doubts(self) -> tuple[str, ...]:
        """Sentences on settings of the monitor that differ from those measured with, or change its light by itself."""
        measured, used = self.measured_settings, self.spec.monitor_settings
        found = dict.fromkeys((used or measured or MonitorSettings()).doubts)
        if measured and used and (differences := measured.differences(used)):
            found["the display was measured with other settings of the monitor: " + "; ".join(differences)] = None
        return tuple(found)

    @property
    def output_bits(self) -> Literal[8, 10]:
        """How many bits a channel to ask the graphics driver for: 10 for a panel that has them."""
        return self.display.panel.code_bits

    @property
    def crosstalk(self) -> Crosstalk | None:
        """The crosstalk that was measured in this mode, or None."""
        return self.display.crosstalk(self.characterised_as)

    @property
    def gain_map(self) -> GainMap | None:
        """How evenly the panel was measured to shine in this mode, or None."""
        return self.display.gain_map(self.characterised_as)

    @property
    def held_out(self) -> dict[Eye, HeldOut]:
        """How far each eye's characterisation is from readings that it was not fitted to, where its source says so."""
        return self.display.held_out.get(self.characterised_as, {})

    @property
    def measured_gamma_tables(self) -> dict[Eye, GammaTable]:
        """The gamma table that each eye was measured with; unknown where the display file does not state it."""
        return {eye: self.display.gamma_table(self.characterised_as, eye) for eye in EYES}

    @property
    def is_characterised(self) -> bool:
        """Whether the display was measured in this very mode."""
        return self.characterised_as == self.mode and self.nominal is None

    @property
    def nominal(self) -> Nominal | None:
        """The nominal display that pictures are shown by, or None where the display was measured."""
        return self.display.nominal_in(self.characterised_as)

    @property
    def stamps(self) -> dict[str, Any]:
        """What every trial's record says of a display that was not measured in this mode; empty where it was."""
        if self.nominal:
            return {"nominal": self.nominal.kind}
        return {} if self.is_characterised else {"uncharacterised": True}


def read_rig(
    path: Path,
    mode: str | None = None,
    *,
    allow_uncharacterised: bool = False,
    ask_monitor: AskMonitor | None = None,
    monitors: tuple[str, ...] = (),
) -> Rig:
    """Read the rig file at ``path``, with ``mode`` in place of the file's own if given.

    With ``allow_uncharacterised``, a mode that was not characterised borrows the measurements of the display file's
    first mode; the rig says so. A nominal display serves every mode.

    Parameters
    ----------
    path
        A rig file, such as ``configs/rigs/asus_vg248qe_3dvision.yaml``.
    mode
        The stereo mode; None takes the file's own.
    allow_uncharacterised
        Whether a mode that was not characterised may use the first mode's measurements.
    ask_monitor
        Called with ``monitors`` for the one where a nominal display's panel is not stated. None: such a rig is refused.
    monitors
        Monitors in place of the file's own, by name or number.

    Returns
    -------
    Rig
        The display, the stereo mode, and where the observer sits.

    Raises
    ------
    InputError
        If the rig, its display file or its verification record is wrong or missing, or the display was not
        characterised in the mode, or for another colorimetric observer than the rig's; or if the panel of a nominal
        display is not stated and cannot be asked for.

    Examples
    --------
    >>> rig = read_rig(Path("configs/rigs/asus_vg248qe_3dvision.yaml"))
    >>> rig.mode, rig.spec.distance_mm
    ('side-by-side', 700.0)
    """
    spec, source = load_document(path, RigSpec, "rig")

    def located(error: InputError, key: str) -> InputError:
        wrong = ((f"{f.message}: {f.file}" if f.file else f.message, f.remedy) for f in error.findings)
        return InputError([source.finding((key,), message, remedy) for message, remedy in wrong])

    def named(key: str, name: str, what: str, read: Callable[[Path], Read]) -> Read | None:
        """Read the file that the rig names, and keep what is wrong with it."""
        try:
            if not os.path.isfile(path.parent / name):
                wrong = Finding(f"there is no such {what}", name, remedy=looked_for(path.parent / name, name))
                raise located(InputError(wrong), key)
            return read(beside(path, name))
        except InputError as error:
            findings.extend(error.findings)
            return None

    marks = listed_marks(spec.timing_marks)
    findings = [
        source.finding(
            ("timing_marks", index, marks[index].place), f"marks go to {marks[index].name} twice", "remove one"
        )
        for index in listed_twice(marks)
    ]
    display: Display | None
    if isinstance(spec.display, NominalSpec):
        try:
            display = _nominal_display(str(path), spec.display, ask_monitor, monitors or spec.monitors)
        except DeviceError as error:
            raise located(error, "display") from None
    else:
        display = named("display", spec.display, "display file", read_display)
    verification: Verification | None = None
    if spec.photodiode_verification is not None:
        what = "record of a photodiode's verification"
        verification = named("photodiode_verification", spec.photodiode_verification, what, read_verification)
    if display is None or findings:
        raise DeviceError(findings)
    wanted = mode or spec.mode
    characterised_as = wanted
    if allow_uncharacterised and wanted not in display.modes and not display.nominal_in(wanted):
        characterised_as = next(iter(display.modes))
    try:
        models = display.models(characterised_as)
    except InputError as error:
        raise error if mode else located(error, "mode") from None
    if (observer := display.observer(characterised_as)) != spec.observer:
        what = f"the rig is for the observer {spec.observer}, its display in this mode for {observer}"
        fit = "measure the display and fit it" if display.nominal_in(characterised_as) else "fit the display again"
        remedy = f"write observer: {observer}, or {fit} with "
        remedy += f"display fit --observer '{spec.observer}' from readings with spectra"
        raise located(DeviceError(Finding(what, remedy=remedy)), "observer")
    if isinstance(spec.ambient_XYZ_cd_m2, PerEyeAmbientSpec):
        models = models.in_room(spec.ambient_XYZ_cd_m2.left, spec.ambient_XYZ_cd_m2.right)
    elif spec.ambient_XYZ_cd_m2 is not None:
        models = models.in_room(spec.ambient_XYZ_cd_m2, spec.ambient_XYZ_cd_m2)
    if spec.lift_black and display.crosstalk(characterised_as):
        try:
            refuse_lift(models)
        except DeviceError as error:
            raise located(error, "lift_black") from None
    mirror = None if spec.results_mirror is None else Path(os.path.abspath(path.parent / spec.results_mirror))
    named_monitors = monitors or spec.monitors
    return Rig(str(path), spec, display, wanted, models, characterised_as, verification, named_monitors, mirror, marks)


def _nominal_display(
    file: str, spec: NominalSpec, ask_monitor: AskMonitor | None, monitors: tuple[str, ...]
) -> Display:
    panel, panel_from = spec.with_panel(ask_monitor, monitors)
    return Display.of_nominal(file, panel, Nominal.of(spec.nominal, spec.white_cd_m2, spec.black_cd_m2, panel_from))
