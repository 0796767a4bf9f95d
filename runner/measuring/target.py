"""What is to be measured: a panel in a stereo mode, from a rig file or a display file."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

from devices.compensation.crosstalk import Crosstalk
from devices.compensation.gain_map import GainMap
from devices.display.display_file import EyeModels, PanelSpec, read_display
from devices.display.rig_file import RigSpec
from devices.errors import MeasuringError
from devices.instruments.simulated import SimulatedDisplay
from documents import Finding, load_document
from documents.files.paths import beside
from documents.yaml.source import read_yaml
from runner.presenter.modes.mode import Mode
from runner.presenter.modes.options import ModeOptions
from runner.presenter.modes.registry import find_mode


class _PanelAlone(BaseModel):
    """A display file of which only the panel counts: its modes may not be measured yet."""

    model_config = ConfigDict(extra="allow", frozen=True, allow_inf_nan=False)

    schema_version: Literal[1]
    panel: PanelSpec


@dataclass(frozen=True, slots=True)
class Target:
    """The ``file`` as given, the display file, its panel, the stereo mode, and its measurements if there are any."""

    file: Path
    display_file: Path
    panel: PanelSpec
    mode: Mode
    models: EyeModels | None = None
    mode_options: dict[str, Any] = field(default_factory=dict)
    crosstalk: Crosstalk | None = None
    gain_map: GainMap | None = None

    @property
    def simulated(self) -> SimulatedDisplay | None:
        """The display as a simulated instrument sees it, None if it was not characterised in this mode."""
        return None if self.models is None else SimulatedDisplay(self.models, self.crosstalk, self.gain_map)


def read_target(path: Path, mode: str | None = None) -> Target:
    """Read the rig or display file at ``path``; ``mode`` goes before a rig's own, and a display file needs it.

    A display file need not hold the mode: it is there to be measured.

    Raises
    ------
    InputError
        If a file is wrong, or no mode is named.
    """
    options: dict[str, Any] = {}
    display_file = path
    data = read_yaml(path).data
    if isinstance(data, dict) and "display" in data and "panel" not in data:
        rig, source = load_document(path, RigSpec, "rig")
        display_file = beside(path, rig.display)
        if not display_file.is_file():
            remedy = f"check the path; it is relative to {path.parent}"
            what = f"there is no such display file: {rig.display}"
            raise MeasuringError(source.finding(("display",), what, remedy))
        if mode is None or mode == rig.mode:
            options = rig.mode_options
        mode = mode or rig.mode
    if mode is None:
        raise MeasuringError(
            Finding("a display file does not say in which stereo mode", str(path), remedy="add --mode")
        )
    spec, _ = load_document(display_file, _PanelAlone, "display")
    found = find_mode(mode, ModeOptions.parse(options))
    # A new display file has no modes yet; one that has must be right.
    display = read_display(display_file) if (spec.model_extra or {}).get("modes") else None
    if display is None or mode not in display.modes:
        return Target(path, display_file, spec.panel, found, None, options)
    crosstalk, gain_map = display.crosstalk(mode), display.gain_map(mode)
    return Target(path, display_file, spec.panel, found, display.modes[mode], options, crosstalk, gain_map)
