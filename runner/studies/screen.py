"""The screen of a new study: a display file or rig that is there, or a nominal display of the monitor's size."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import floor, log10
from pathlib import Path
from typing import Any

from devices.display import Display, PanelSpec, ReportedMonitor, panel_of_monitor, read_display, read_rig
from documents import InputError
from documents.files import beside
from documents.yaml import read_yaml

COMMON_PANEL = PanelSpec(resolution_px=(1920, 1080), pixel_pitch_mm=0.2768)
DISTANCE_MM = 600.0


@dataclass(frozen=True, slots=True)
class StudyScreen:
    """A study's screen: its ``panel``, and a ``source`` that says in a sentence where its numbers are from.

    ``nominal`` is whether the display was not measured. Of a file that a person named, ``mode`` and ``distance_mm`` are
    what it states, ``rig`` is what the study's own rig file says, ``copies`` are the files that this names, by their
    names in the study, and ``white_cd_m2`` is the luminance of white in each mode that was measured.
    """

    panel: PanelSpec
    source: str
    nominal: bool
    mode: str | None = None
    distance_mm: float | None = None
    rig: Mapping[str, Any] | None = None
    copies: Mapping[str, Path] = field(default_factory=dict)
    white_cd_m2: Mapping[str, float] = field(default_factory=dict)


def nominal_screen(panel: PanelSpec | None, monitor: ReportedMonitor | PanelSpec | None) -> StudyScreen:
    """Return a nominal display with ``panel``, else with what ``monitor`` reports, else of a common size, as it says.

    Parameters
    ----------
    panel
        The panel, where a person states it.
    monitor
        What the monitor reports of itself, where there is one to ask.
    """
    known = panel or (monitor if isinstance(monitor, PanelSpec) else None)
    if known is not None:
        return StudyScreen(known, "The panel is as it was given.", nominal=True)
    if not isinstance(monitor, ReportedMonitor) or min(monitor.size_px) < 1:
        size = f"{COMMON_PANEL.resolution_px[0]} x {COMMON_PANEL.resolution_px[1]} px"
        source = f"ASSUMED: no monitor could be asked, so a panel of {size} is taken. Correct it if yours is another."
        return StudyScreen(COMMON_PANEL, source, nominal=True)
    try:
        return StudyScreen(panel_of_monitor(monitor), f"The panel is as {monitor.words}, reports.", nominal=True)
    except InputError:
        refresh = {"refresh_hz": monitor.refresh_hz} if monitor.refresh_hz else {}
        panel = PanelSpec(resolution_px=monitor.size_px, pixel_pitch_mm=COMMON_PANEL.pixel_pitch_mm, **refresh)
        source = f"ASSUMED: the pixel pitch, because the monitor '{monitor.name}' does not report its size. "
        source += f"Write the picture's width in mm divided by {monitor.size_px[0]}."
        return StudyScreen(panel, source, nominal=True)


def screen_of_file(file: Path) -> StudyScreen:
    """Return the screen of a display file or of a rig file, with what to copy.

    Raises
    ------
    InputError
        If the file, or one that it names, is wrong.
    """
    data = read_yaml(file).data
    if not isinstance(data, dict) or "display" not in data:
        display = read_display(file)
        only = next(iter(display.modes)) if len(display.modes) == 1 else None
        rig: dict[str, Any] = {"schema_version": 1, "display": "display.yaml"}
        copies = {"display.yaml": file}
        return StudyScreen(
            display.panel, f"The display is {file.name}.", False, only, None, rig, copies, _whites(display)
        )
    read = read_rig(file)
    rig, copies = dict(data), {}
    for key, name in (("display", "display.yaml"), ("photodiode_verification", "photodiode_verification.yaml")):
        if isinstance(rig.get(key), str):
            copies[name] = beside(file, rig[key])
            rig[key] = name
    whites = {} if read.nominal else _whites(read.display)
    source = f"The rig is {file.name}."
    return StudyScreen(
        read.display.panel, source, bool(read.nominal), read.mode, read.spec.distance_mm, rig, copies, whites
    )


def _whites(display: Display) -> dict[str, float]:
    """Return the luminance that both eyes see of white in each mode, cd/m², rounded down to three digits."""
    whites = {}
    for mode, models in display.modes.items():
        white = min(float(model.shown_white_XYZ_cd_m2[1]) for model in (models.left, models.right))
        step = 10.0 ** (floor(log10(white)) - 2)
        whites[mode] = round(floor(white / step) * step, 6)
    return whites
