"""In which light readings were taken, so that a display model in a lit room is compared with what they hold.

A display file may have the room's light (thesis Expression 3.1) while readings were taken in the dark, in that light,
or in another. Black shows which: with the screen on it is the display's own black and the room's light together. A
reading named ``black@screen-off`` says what the room's light was; without one it can only be that of the display file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from devices.diagnostics.readings import black
from devices.diagnostics.room_light import SAME, RoomLight
from devices.display.model import DisplayModel
from devices.readings import Measurements, PatchEye
from documents.arrays import Floats

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
