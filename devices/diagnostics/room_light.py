"""The room's light on the screen (thesis Expression 3.1), from readings with the display switched off.

A reading named ``black@screen-off`` holds what the screen, while it is off, sends to the eye of the room's light,
through the glasses. Readings that were taken in the same light hold it too, in black and in all else; it is taken off
them before a display model is fitted, so that the display's own black stays the display's. Black that is darker than
the room's light cannot hold it: such readings were taken in the dark, and stay as they are.

In which light readings were taken decides what a model in a lit room is compared with. A display file may have the
room's light while readings were taken in the dark, in that light, or in another. Black shows which: with the screen on
it is the display's own black and the room's light together. A reading named ``black@screen-off`` says what the room's
light was; without one it can only be that of the display file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from devices.diagnostics.diagnosis import Cell, Check, Diagnosis, Readout
from devices.diagnostics.readings import black, tag, tagged
from devices.display.model import DisplayModel
from devices.display.model_spec import ten_digits
from devices.readings import Measurements, PatchEye
from documents.arrays import Floats
from documents.text import JsonResult
from documents.yaml import yaml_lines

CONTRAST = Check(
    "room_light",
    "The room's light on the screen",
    None,
    "white over black, in the room",
    "No limit: what a picture needs depends on its darkest parts; nothing darker than room and black can be shown",
)
# Two readings of one light differ by so little: black with the screen on is no darker than the room's light by more.
SAME = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class RoomLight(JsonResult):
    """What one lens gets of the room's light from the screen, XYZ in cd/m², (3,), as ``readings`` have it.

    ``held``: whether the readings of the display hold it. ``white_cd_m2`` and ``black_cd_m2``: the display's own
    luminances, without it; None where they were not read.
    """

    ambient_XYZ_cd_m2: Floats
    readings: int
    held: bool
    white_cd_m2: float | None
    black_cd_m2: float | None
    json_keys: ClassVar = {"held": "taken_off"}
    json_names: ClassVar = "ambient_XYZ_cd_m2 held white_cd_m2 black_cd_m2"

    def lines(self) -> list[str]:
        """Return it as a display file has it: a line of YAML."""
        return yaml_lines({"ambient_XYZ_cd_m2": ten_digits(self.ambient_XYZ_cd_m2)})

    @property
    def contrasts(self) -> tuple[float, float] | None:
        """White's luminance over black's, without and with the room's light; None where either was not read."""
        if self.white_cd_m2 is None or self.black_cd_m2 is None:
            return None
        room = float(self.ambient_XYZ_cd_m2[1])
        alone = self.white_cd_m2 / self.black_cd_m2 if self.black_cd_m2 > 0.0 else np.inf
        dark = self.black_cd_m2 + room
        return alone, (self.white_cd_m2 + room) / dark if dark > 0.0 else np.inf

    @property
    def words(self) -> str:
        """What was found, in sentences."""
        room = float(self.ambient_XYZ_cd_m2[1])
        words = f"The screen sends {room:.3g} cd/m² of the room's light to the eye while it is off."
        if self.contrasts is not None:
            alone, lit = self.contrasts
            dark = "more than can be read" if np.isinf(alone) else f"{alone:.0f}"
            words += f" White over black is {dark} without it and {lit:.0f} with it."
        if not self.held:
            words += (
                " Black with the screen on is darker: the display was read in the dark, and nothing is taken off it."
            )
        return words


def room_lights(measurements: Measurements) -> Mapping[PatchEye, RoomLight]:
    """Return the room's light by lens, of the readings with the display switched off; empty where there are none."""
    rows = [row for row, _ in tagged(measurements, "screen-off")]
    found: dict[PatchEye, RoomLight] = {}
    for eye in dict.fromkeys(measurements.eye[row] for row in rows):
        own = [row for row in rows if measurements.eye[row] == eye]
        ambient = np.maximum(measurements.XYZ[own].mean(axis=0), 0.0)
        dark, bright = (_mean(measurements, eye, code) for code in (0.0, 1.0))
        held = dark is None or bool(dark[1] >= (1.0 - SAME) * ambient[1])
        off = ambient[1] if held else 0.0
        found[eye] = RoomLight(
            ambient,
            len(own),
            held,
            None if bright is None else float(bright[1] - off),
            None if dark is None else max(float(dark[1] - off), 0.0),
        )
    return found


def without_room(measurements: Measurements) -> tuple[Measurements, Mapping[PatchEye, RoomLight]]:
    """Return the readings with the room's light taken off those that hold it, and the room's light by lens.

    Readings without the glasses, and with the display switched off, stay as they are. What noise would leave below no
    light is none.
    """
    found = room_lights(measurements)
    light = measurements.XYZ.copy()
    for row, (name, eye) in enumerate(zip(measurements.name, measurements.eye, strict=True)):
        known = found.get(eye) or found.get("both")
        own = tag(name)
        if known is None or not known.held or (own is not None and own.kind in ("screen-off", "no-glasses")):
            continue
        light[row] = np.maximum(light[row] - known.ambient_XYZ_cd_m2, 0.0)
    return (replace(measurements, XYZ=light) if found else measurements), found


def room_light(measurements: Measurements) -> Diagnosis:
    """Return the contrast of white over black in the room, with the terms apart; nothing is judged by it."""
    found = room_lights(measurements)
    known = [(eye, light, *light.contrasts) for eye, light in found.items() if light.contrasts is not None]
    known = [each for each in known if np.isfinite(each[3])]
    if not known:
        return CONTRAST.unjudged(
            "Read black with the display switched off, in the light of the experiment and through the glasses, and "
            "name that reading black@screen-off (display measure --set ambient); read black and white with it on."
        )
    rows: list[tuple[Cell, ...]] = []
    for eye, light, alone, lit in known:
        cells: tuple[Cell, ...] = (light.white_cd_m2, light.black_cd_m2, float(light.ambient_XYZ_cd_m2[1]))
        rows.append((eye, *cells, "" if np.isinf(alone) else f"{alone:.0f}", f"{lit:.0f}"))
    heads = ("lens", "white, cd/m²", "black, cd/m²", "room, cd/m²", "white over black", "in the room")
    _, worst, _, least = min(known, key=lambda each: each[3])
    return CONTRAST.described(least, worst.words, table=Readout(heads, tuple(rows)))


def _mean(measurements: Measurements, eye: PatchEye, code: float) -> Floats | None:
    """Return the mean XYZ (3,) of the plain readings of a grey's ``code`` through ``eye``, None if there are none."""
    rows = [
        row
        for row, name in enumerate(measurements.name)
        if tag(name) is None
        and np.all(measurements.codes[row] == code)
        and (eye == "both" or measurements.eye[row] in (eye, "both"))
    ]
    return np.asarray(measurements.XYZ[rows].mean(axis=0)) if rows else None


Lights = Mapping[PatchEye, RoomLight]


def light_through(lights: Lights, eye: PatchEye) -> Floats | None:
    """Return the room's light through the lens of ``eye``, XYZ in cd/m² (3,); None where it was not read.

    Readings through no lens in particular are compared with the left eye's model, and get the left eye's light.
    """
    found = lights.get(eye) or lights.get("both") or (lights.get("left") if eye == "both" else None)
    return None if found is None else found.ambient_XYZ_cd_m2


def in_light_of(
    measurements: Measurements, model: DisplayModel, read: Floats | None, elsewhere: Sequence[Floats] = ()
) -> tuple[DisplayModel, str]:
    """Return ``model`` in the light that ``measurements`` hold, and sentences on it; none where no light is known.

    The light is none or the room's: ``read``, XYZ in cd/m² (3,), where the readings say it; else the display file's, or
    one that was read ``elsewhere``. Taken is the one with which the model's black is the nearest to black as read, in
    luminance. Black darker than the room's light does not hold it, whatever the display file says.
    """
    room = [read] if read is not None else [model.ambient_XYZ_cd_m2, *elsewhere]
    room = [light for light in room if light.any()]
    own = model.in_the_dark
    if not room:
        words = " The screen gave no light while it was off: compared without the display file's room light."
        return own, words if model.ambient_XYZ_cd_m2.any() else ""
    level = black(measurements)
    if level is None:
        chosen = room[0]
        words = " Black was not read, which shows whether readings hold the room's light: they are taken to hold it"
        return own.in_room(chosen), f"{words}, {chosen[1]:.3g} cd/m²."
    alone = float(own.shown_black_XYZ_cd_m2[1])
    possible = [np.zeros(3), *(light for light in room if level[1] >= (1.0 - SAME) * light[1])]
    chosen = min(possible, key=lambda light: abs(float(level[1]) - alone - float(light[1])))
    lit = " or ".join(f"{alone + light[1]:.3g}" for light in room)
    words = f" Black was read as {level[1]:.3g} cd/m²; by the display file it is {alone:.3g} alone, {lit} with"
    if not chosen.any():
        return own, f"{words} the room's light: the readings are taken for ones in the dark, and compared without it."
    words += f" the room's light: the readings hold {chosen[1]:.3g} cd/m² of it, and are compared with it."
    if not np.array_equal(chosen, model.ambient_XYZ_cd_m2):
        words += f" This was read with the display switched off; the display file has {model.ambient_XYZ_cd_m2[1]:.3g}."
    return own.in_room(chosen), words
