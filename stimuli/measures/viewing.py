"""How pictures are seen: from how far, and on a display of which white."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from documents.arrays import Floats
from stimuli.errors import StimulusError

if TYPE_CHECKING:
    from devices.display import AskMonitor


@dataclass(frozen=True, eq=False, slots=True)
class ViewingConditions:
    """How the pictures are seen: their pixels per degree of visual angle, and the white of the display.

    One pixel of a picture is one of the display. ``display_white_XYZ``, (3,), in cd/m², is None where it is not known,
    such as on a display with several modes; nor is ``observer`` then, the colorimetric observer of the display's XYZ.
    ``lab_white_XYZ``, (3,), in cd/m², is the white of CIELAB where it is not the display's. Pixel pitch and distance
    are kept for the record.
    """

    pixels_per_degree: float
    display_white_XYZ: Floats | None = None
    pixel_pitch_mm: float | None = None
    distance_mm: float | None = None
    observer: str | None = None
    lab_white_XYZ: Floats | None = None

    @property
    def white_XYZ(self) -> Floats:
        """The white of the display, XYZ (3,) in cd/m². Raises StimulusError where it is not known."""
        if self.display_white_XYZ is None:
            raise StimulusError.of(
                "the white of the display is not known, and measures of pictures need it",
                "give a rig, such as --rig configs/rigs/asus_vg248qe_3dvision.yaml",
            )
        return self.display_white_XYZ

    @property
    def cielab_white_XYZ(self) -> Floats:
        """The white of CIELAB, XYZ (3,) in cd/m²: the display's where no other is given. Raises StimulusError."""
        return self.white_XYZ if self.lab_white_XYZ is None else self.lab_white_XYZ

    @classmethod
    def on_rig(
        cls, rig_file: Path, distance_mm: float | None = None, ask_monitor: AskMonitor | None = None
    ) -> ViewingConditions:
        """Return how pictures are seen on a rig, from its own distance if none is given. Raises InputError.

        ``ask_monitor`` is called for the monitor where the rig does not state the panel of a nominal display.
        """
        from devices.display import read_rig

        rig = read_rig(rig_file, ask_monitor=ask_monitor)
        distance_mm = rig.spec.distance_mm if distance_mm is None else distance_mm
        return cls._of([rig.models], {rig.observer}, rig.display.panel.pixel_pitch_mm, distance_mm)

    @classmethod
    def on_display(cls, display_file: Path, distance_mm: float) -> ViewingConditions:
        """Return how pictures are seen on a display from a distance. Raises InputError."""
        from devices.display import read_display

        display = read_display(display_file)
        modes, observers = list(display.modes.values()), set(display.observers.values())
        if display.nominal_models is not None:
            modes, observers = [*modes, display.nominal_models], {*observers, display.observer("")}
        return cls._of(modes, observers, display.panel.pixel_pitch_mm, distance_mm)

    @classmethod
    def _of(cls, modes: list[Any], observers: set[str], pixel_pitch_mm: float, distance_mm: float) -> ViewingConditions:
        from devices.display import pixels_per_degree

        whites = [model.shown_white_XYZ_cd_m2 for model in (modes[0].left, modes[0].right)] if len(modes) == 1 else []
        white = max(whites, key=lambda white: float(white[1]), default=None)
        observer = observers.pop() if len(observers) == 1 else None
        return cls(pixels_per_degree(pixel_pitch_mm, distance_mm), white, pixel_pitch_mm, distance_mm, observer)
