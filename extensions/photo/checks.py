"""What is wrong with a bracket, in words: photographs that do not go together, other scenes, exposures, what moved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from documents import Finding, InputError
from documents.text import JsonResult
from extensions.photo.consistency import Compared, Samples, camera_shift, colour_ratios
from extensions.photo.shots import BLOCK_PX, Shot
from stimuli.develop import SensorImage
from stimuli.errors import StimulusError

Mask = NDArray[np.bool_]

_SAME = 2e-3
# Beyond this the exposures, or the light, are not those stated, and it is said.
_NOTED = 0.03
_EXACT = 0.012
_MOST_OFF = 1.5
_LEAST_CORRELATION = 0.7
_MOST_MOVED = 0.25
# From so many places on it may be the camera that moved.
_MANY_PLACES = 5
_LEAST_EXPLAINED = 0.4
_NAMED = 3


@dataclass(frozen=True, slots=True)
class Ratios:
    """Exposures as the photographs show them: ``relative`` to the first, with ``errors``, None where they are stated.

    ``steps`` are the ratios of each to the one before, measured over stated; None where that could not be measured.
    """

    relative: list[float]
    errors: list[float | None]
    steps: list[float | None]


@dataclass(frozen=True, slots=True)
class MovedPart(JsonResult):
    """A part of the upright picture in which something moved, in pixels, and between which photographs."""

    x_px: int
    y_px: int
    width_px: int
    height_px: int
    between: tuple[str, str]

    def __str__(self) -> str:
        return f"{self.width_px} × {self.height_px} pixels at x {self.x_px}, y {self.y_px}"


def check_alike(sensor: SensorImage, first: Shot) -> None:
    """Raise StimulusError unless the photographs are of one camera, size, ISO and f-number."""
    mine, other = sensor.exposure, first.exposure
    assert mine is not None
    name = first.name
    if sensor.values.shape != first.shape:
        sizes = [f"{shape[1]} × {shape[0]}" for shape in (sensor.values.shape, first.shape)]
        raise StimulusError.at(
            sensor.source, f"it has {sizes[0]} pixels, and {name} {sizes[1]}", "give photographs of one camera and size"
        )
    if sensor.camera and first.sensor.camera and sensor.camera != first.sensor.camera:
        message = f"it is of a {sensor.camera}, and {name} of a {first.sensor.camera}"
        raise StimulusError.at(sensor.source, message, "give photographs of one camera")
    if abs(mine.iso / other.iso - 1) > _SAME:
        message = f"it was taken at ISO {mine.iso:g}, and {name} at ISO {other.iso:g}: the sensor's noise differs"
        raise StimulusError.at(sensor.source, message, "bracket by the shutter's time alone")
    if abs(mine.f_number / other.f_number - 1) > _SAME:
        message = (
            f"it was taken at f/{mine.f_number:g}, and {name} at f/{other.f_number:g}: sharpness and corners differ"
        )
        raise StimulusError.at(sensor.source, message, "bracket by the shutter's time alone")


def check_scene(shots: Sequence[Shot], compared: Sequence[Compared]) -> None:
    """Raise InputError if neighbouring photographs show other scenes."""
    for number, pair in enumerate(compared):
        correlation = pair.correlation()
        if correlation is not None and correlation < _LEAST_CORRELATION:
            raise InputError(
                Finding(
                    f"it shows another scene than {shots[number].name}, or the camera was moved: their light "
                    f"correlates by {correlation:.2f}",
                    str(shots[number + 1].sensor.source),
                    remedy="give photographs of one scene, from a tripod",
                )
            )


def relative_exposures(shots: Sequence[Shot], stated: Sequence[float], compared: Sequence[Compared]) -> Ratios:
    """Return the exposures as the photographs show them; InputError where they are far from those stated."""
    relative, errors, steps = [1.0], [0.0 if compared else None], list[float | None]()
    for number, pair in enumerate(compared):
        found = pair.ratio()
        said = stated[number + 1] / stated[number]
        if found is None:
            relative.append(relative[-1] * said)
            errors.append(None)
            steps.append(None)
            continue
        ratio, error = found
        off = ratio / said
        if not 1 / _MOST_OFF < off < _MOST_OFF or not np.isfinite(error):
            raise InputError(
                Finding(
                    f"it has {ratio:.3g} × the light of {shots[number].name}, and by their exposures it should have "
                    f"{said:.3g} ×",
                    str(shots[number + 1].sensor.source),
                    remedy="see that they show one scene in one light, and give --exposure if the files are wrong",
                )
            )
        before = errors[-1]
        relative.append(relative[-1] * ratio)
        errors.append(None if before is None else relative[-1] * float(np.hypot(before / relative[-2], error / ratio)))
        steps.append(off)
    return Ratios(relative, errors, steps)


def exposure_notes(photographs: Sequence[dict[str, Any]], ratios: Ratios, samples: Samples, level: float) -> list[str]:
    """Return in sentences which exposures are not as stated, and why that may be."""
    notes = []
    off = [number for number, step in enumerate(ratios.steps) if step is not None and abs(step - 1) > _NOTED]
    times = [_exact_time(photograph["exposure"]["time_s"]) for photograph in photographs]
    for number in off:
        one, other = photographs[number], photographs[number + 1]
        step = ratios.steps[number]
        assert step is not None
        said = other["exposure"]["time_s"] / one["exposure"]["time_s"]
        if abs(step * said / (times[number + 1] / times[number]) - 1) < _EXACT:
            notes.append(
                f"{other['file']} has {step:.3f} × the light that its time says beside {one['file']}: as the shutter's "
                "exact times, of which the files state rounded ones"
            )
        else:
            notes.append(
                f"{other['file']} has {step:.3f} × the light that its exposure says beside {one['file']}: the light "
                "changed in between, or the shutter is off"
            )
    for number, step in enumerate(ratios.steps):
        if step is None:
            one, other = photographs[number]["file"], photographs[number + 1]["file"]
            notes.append(f"{one} and {other} have too little well exposed in both: their ratio is as stated, unchecked")
            continue
        ratio = ratios.relative[number + 1] / ratios.relative[number]
        by_colour = [found for found in colour_ratios(samples, number, ratio, level) if found is not None]
        if len(by_colour) > 1 and max(by_colour) / min(by_colour) - 1 > _NOTED:
            name = photographs[number + 1]["file"]
            notes.append(
                f"{name}: the light's colour changed: red, green and blue by "
                f"{', '.join(f'{found / ratio:.3f}' for found in by_colour)} ×"
            )
    return notes


def _exact_time(time_s: float) -> float:
    """Return the time to which a shutter's rounded one belongs: a power of two in thirds of a stop."""
    return float(2 ** (round(3 * np.log2(time_s)) / 3))


def where_moved(
    shots: Sequence[Shot],
    t: Sequence[float],
    blocks: Sequence[Mask],
    compared: Sequence[Compared],
    refuse: bool,
    reference: str,
) -> list[MovedPart]:
    """Return the places in which something moved, the largest first; InputError if that is refused or too much."""
    for number, (moved, pair) in enumerate(zip(blocks, compared, strict=True)):
        of = np.count_nonzero(pair.count > 0)
        share = int(np.count_nonzero(moved)) / max(int(of), 1)
        if share <= _MOST_MOVED and len(_places(shots, number, moved)) < _MANY_PLACES:
            continue
        across, down, explained = camera_shift(shots, t, number)
        if share <= _MOST_MOVED and explained < _LEAST_EXPLAINED:
            continue
        name, other = shots[number].name, f"{100 * share:.2g} % of what is well exposed in both differs"
        if explained >= _LEAST_EXPLAINED:
            why = (
                f"the camera moved between {name} and it, by {across:+.1f} pixels across and {down:+.1f} down: {other}"
            )
        else:
            why = f"the camera moved between {name} and it, or the scene is another: {other}"
        remedy = "photograph the bracket again from a tripod, the mirror up"
        raise InputError(Finding(why, str(shots[number + 1].sensor.source), remedy=remedy))
    places = [place for number, moved in enumerate(blocks) for place in _places(shots, number, moved)]
    places.sort(key=lambda place: -place.width_px * place.height_px)
    if places and refuse:
        first = places[0]
        more = len(places) - _NAMED
        others = "; ".join(str(place) for place in places[1:_NAMED])
        message = f"something moved between {first.between[0]} and {first.between[1]}: {first}"
        message += (f"; also {others}" if others else "") + (f" and {more} more" if more > 0 else "")
        source = next(str(shot.sensor.source) for shot in shots if shot.name == first.between[1])
        remedy = f"photograph it again; or --ghosts keep-reference takes such places from {reference} alone"
        raise InputError(Finding(message, source, remedy=remedy))
    return places


def _places(shots: Sequence[Shot], number: int, moved: Mask) -> list[MovedPart]:
    from scipy.ndimage import find_objects, label

    sensor = shots[0].sensor
    labels, _ = label(sensor.upright(moved), structure=np.ones((3, 3)))
    height, width = shots[0].shape[:2]
    if sensor.flip & 4:
        height, width = width, height
    between = shots[number].name, shots[number + 1].name
    places = []
    for rows, columns in find_objects(labels):
        x, y = columns.start * BLOCK_PX, rows.start * BLOCK_PX
        places.append(
            MovedPart(x, y, min(columns.stop * BLOCK_PX, width) - x, min(rows.stop * BLOCK_PX, height) - y, between)
        )
    return places
