"""What a display's readings give: the models of each eye, crosstalk, gain map and glasses, and the mode of a file."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

from devices.characterise.choose import Characterisation
from devices.characterise.measured_parts import MeasuredParts
from devices.characterise.mode_file import ModeLines, write_mode
from devices.characterise.thesis import ThesisFits
from devices.characterise.told import black_words, candidates_table, curves_tables, notes, thesis_tables
from devices.colour_matching import DEFAULT_OBSERVER
from devices.diagnostics.drift import Drift
from devices.diagnostics.room_light import RoomLight
from devices.display.gamma_table import GammaTable
from devices.display.held_out import HeldOut
from devices.display.model_spec import ModelSpec, ten_digits
from devices.display.monitor_settings import MonitorSettings
from devices.display.panel import PanelSpec
from devices.errors import DeviceError
from devices.readings import PatchEye
from documents import Finding
from documents.pages import Block
from documents.text import JsonResult


@dataclass(frozen=True, slots=True, eq=False)
class EyeFit(JsonResult):
    """The models fitted to one eye's readings, and the fits by the thesis's two methods.

    ``thesis`` is None where those methods do not apply; ``notes`` then say why. ``drift`` is the drift during the run
    that the readings were corrected for, None where they were not.
    """

    characterisation: Characterisation
    thesis: ThesisFits | None
    notes: tuple[str, ...]
    drift: Drift | None = None
    json_keys: ClassVar = {"characterisation": "*", "notes": "said"}
    json_names: ClassVar = "characterisation characterisation.chosen.numbers notes drift thesis"

    def told(self, *, brief: bool) -> Iterator[str | Block]:
        """Yield the thesis's tables unless ``brief``, every candidate, the chosen one's numbers, and where it errs."""
        found = self.characterisation
        if self.thesis and not brief:
            yield from thesis_tables(self.thesis)
        yield candidates_table(found.candidates, found.chosen.name)
        yield f"Chosen: {found.chosen.name}, because {found.reason}."
        yield from curves_tables(found.chosen.numbers)
        yield black_words(found.chosen.numbers, found.patches.black_read)
        for candidate in found.candidates:
            if candidate.unusable:
                yield f"{candidate.name}: {candidate.unusable}."
            for name in candidate.at_bound:
                yield f"{candidate.name}: {name} ended at the edge of what is allowed."
        yield "Where it errs:"
        yield from (f"  {sentence}" for sentence in found.where_it_errs)
        yield from notes(self.notes)


@dataclass(frozen=True, slots=True, eq=False)
class DisplayFit(JsonResult):
    """A display characterised in one stereo mode.

    Attributes
    ----------
    mode
        The stereo mode; None where neither the readings nor the caller name it.
    eyes
        The fits by eye: ``both``, or ``left`` and ``right``; empty where no model was to be fitted.
    parts
        What tagged readings give: crosstalk, gain map, glasses.
    notes
        Sentences on the readings that a reader of the result must know.
    file
        The readings' file, which the source in a display file names.
    instrument
        The instrument that took them.
    panel
        The panel that was measured, as the readings name it; empty where they do not.
    lens
        The one lens that stands for both eyes; None if the readings are of both or each eye was fitted apart.
    assumptions
        What was taken for granted of the readings, in sentences that the source in a display file names too.
    observer
        The colorimetric observer whose XYZ the model gives.
    gamma_table
        The graphics card's table that the readings were taken with, which the display file names too; None where they
        do not state it.
    monitor_settings
        What the monitor's menu said when it was measured; the mode of a display file states it too.
    room
        By lens, the room's light from the screen while it is off, and whether it was taken off the readings; the
        display file has it as ``ambient_XYZ_cd_m2``.
    written
        What was written into a display file, in sentences; empty for nothing.
    brief
        Whether people read nothing of the thesis's methods.
    """

    mode: str | None
    eyes: Mapping[PatchEye, EyeFit]
    parts: MeasuredParts
    notes: tuple[str, ...]
    file: str
    instrument: str
    panel: str
    lens: PatchEye | None
    assumptions: tuple[str, ...] = ()
    observer: str = DEFAULT_OBSERVER
    gamma_table: GammaTable | None = None
    monitor_settings: MonitorSettings = field(default_factory=MonitorSettings)
    room: Mapping[PatchEye, RoomLight] = field(default_factory=dict)
    written: str = ""
    brief: bool = False
    json_keys: ClassVar = {"notes": "said", "eyes": "*"}
    json_names: ClassVar = "file mode observer parts room notes eyes written"
    json_optional: ClassVar = ("written",)

    def told(self) -> Iterator[str | Block]:
        """Yield what people read of each eye's fit, of what tagged readings give, and what was written."""
        if self.eyes:
            yield f"Colorimetric observer: {self.observer}°"
        for eye, fit in self.eyes.items():
            if eye != "both":
                yield f"{eye.capitalize()} eye"
            yield from fit.told(brief=self.brief)
        for one in self.parts.diagnoses:
            if one.value is not None:
                yield f"{one.title}: {one.words}"
        for eye, diagnoses in self.parts.glasses.items():
            for one in diagnoses:
                yield f"{one.title}{'' if eye == 'both' else f', {eye} eye'}: {one.words}"
        yield from notes(self.notes)
        if self.written:
            yield self.written

    def mode_lines(self) -> ModeLines:
        """Return the mode as lines of a display file."""
        models: dict[str, list[str]] = {}
        for eye, fit in self.eyes.items():
            chosen = fit.characterisation.chosen
            errors = chosen.held_out
            readings = f"{len(fit.characterisation.patches)} readings of {origin_of(self.file, self.instrument)}"
            source = f"{chosen.name} fitted to {readings}; {HeldOut(errors.mean, errors.p95, errors.max).words}"
            worst = chosen.worst_light
            dark = () if worst is None else (f"held-out luminance off by {worst.off} from {worst.between} at worst",)
            drift = () if fit.drift is None else (f"corrected for drift: {fit.drift.words}",)
            source = "; ".join((source, *dark, *drift, *self.assumptions))
            light = self.room.get(eye) or self.room.get("both") or (next(iter(self.room.values()), None))
            models[eye] = ModelSpec.of(
                chosen.model,
                observer=self.observer,
                source=source,
                gamma_table=self.gamma_table and self.gamma_table.to_json(),
                ambient_XYZ_cd_m2=light and ten_digits(light.ambient_XYZ_cd_m2),
            ).lines()
        settings = {"monitor_settings": lines} if (lines := self.monitor_settings.yaml_lines()) and models else {}
        return ModeLines(models, {**self.parts.lines, **settings, **self._room_alone()})

    def _room_alone(self) -> dict[str, list[str]]:
        """Return the room's light as a part of the mode, where no model has it and it was read for both eyes."""
        alone = None if self.eyes else self.room.get("both")
        return {} if alone is None else {"ambient_XYZ_cd_m2": alone.lines()}

    @property
    def has_parts(self) -> bool:
        """Whether there is something to write beside a model: crosstalk, a gain map, the room's light."""
        return bool(self.parts.lines or self._room_alone())

    def write(self, file: str | Path, panel: PanelSpec | None = None, *, replace: bool = False) -> DisplayFit:
        """Write the mode into a display file; all else in the file stays as it is.

        Parameters
        ----------
        file
            The display file, made if it does not exist.
        panel
            The panel of a new file; None takes the one that the readings name.
        replace
            Whether a characterisation, crosstalk or gain map that the mode has already is overwritten.

        Returns
        -------
        DisplayFit
            The fit, with what was ``written`` and the notes on it.

        Raises
        ------
        DeviceError
            If the fit has no mode, or nothing to write; or as `devices.characterise.mode_file.write_mode`.
        """
        file = Path(file)
        if self.mode is None:
            raise DeviceError(Finding("the readings do not name a mode", remedy="name one with --mode"))
        if not self.eyes and not self.has_parts:
            raise DeviceError(Finding("there is no model, crosstalk, gain map or room's light to write", str(file)))
        said = list(self.notes)
        if self.lens is not None:
            words = f"the {self.lens} lens stands for both eyes in the display file"
            said.append(f"{words}; --eye {self.lens} writes that eye alone")
        if panel is None and self.panel and not file.exists():
            panel = self._measured_panel()
            said.append(f"the panel is the one that was measured: {panel.text}")
        written = write_mode(file, self.mode, self.mode_lines(), panel, replace=replace)
        return dataclasses.replace(self, written=written, notes=tuple(said))

    def _measured_panel(self) -> PanelSpec:
        try:
            return PanelSpec.parse(self.panel)
        except ValueError:
            remedy = "write it as 1920x1080,0.2768,120,8, or give --panel"
            what = f"the panel that was measured is '{self.panel}'"
            raise DeviceError(Finding(what, self.file, remedy=remedy)) from None


def origin_of(file: str, instrument: str) -> str:
    """Return the file's name and the instrument's, as a source says them."""
    return Path(file).name + (f" by {instrument}" if instrument else "")
