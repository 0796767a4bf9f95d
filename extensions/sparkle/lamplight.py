"""A lamp's light on the plate: its direction, its illuminance, the lamp's angular size."""

from __future__ import annotations

import numpy as np

from documents.arrays import Floats
from extensions.sparkle.scene import Lamp


def lamp_directions(lamp: Lamp, x_mm: Floats, y_mm: Floats) -> Floats:
    """Return unit directions from places on the plate to the lamp: (3,) if it is far, else (n, 3)."""
    position = lamp.position_mm
    if position is None:
        return lamp.direction
    ray = np.stack([position[0] - x_mm, position[1] - y_mm, np.full_like(x_mm, position[2])], axis=-1)
    return np.asarray(ray / np.linalg.norm(ray, axis=-1, keepdims=True))


def illuminance_lx(lamp: Lamp, x_mm: Floats, y_mm: Floats) -> Floats | float:
    """Return the illuminance at places on the plate, in lx: one number if the lamp is far, else (n,).

    The illuminance of a point: intensity towards the place times cosine over distance squared, the intensity falling
    off the beam's axis as a power of the cosine. Discs smaller than 5° differ from a point by less than 1 %.
    """
    position = lamp.position_mm
    if position is None:
        return lamp.illuminance_lx
    distance = float(np.linalg.norm(position))
    square = (position[0] - x_mm) ** 2 + (position[1] - y_mm) ** 2 + position[2] ** 2
    light = lamp.illuminance_lx * (distance**2 / square) ** 1.5
    if lamp.beam_angle_deg is not None:
        light = light * np.maximum(_along_the_beam(position, x_mm, y_mm), 0.0) ** _beam_power(lamp.beam_angle_deg)
    return np.asarray(light)


def most_illuminance_lx(lamp: Lamp, x_mm: Floats, y_mm: Floats, reach_mm: Floats) -> Floats:
    """Return an upper bound of the illuminance, in lx, at places within ``reach_mm`` of some; (n,) each.

    No such place is nearer to the lamp than s, its distance from the middle less the reach (and at least its height),
    and the direction to it turns by at most reach/s from that to the middle: so far into the beam may it lie.
    """
    position = lamp.position_mm
    if position is None:
        return np.full_like(x_mm, lamp.illuminance_lx)
    nearest = nearest_mm(lamp, x_mm, y_mm, reach_mm)
    light = lamp.illuminance_lx * (float(np.linalg.norm(position)) / nearest) ** 3
    if lamp.beam_angle_deg is not None:
        off_axis = np.arccos(np.clip(_along_the_beam(position, x_mm, y_mm), -1.0, 1.0))
        along = np.cos(np.clip(off_axis - reach_mm / nearest, 0.0, np.pi / 2))
        light = light * along ** _beam_power(lamp.beam_angle_deg)
    return np.asarray(light)


def _along_the_beam(position_mm: Floats, x_mm: Floats, y_mm: Floats) -> Floats:
    """Return the cosine of the angle between a beam aimed at the plate's middle and the way to each place."""
    distance = float(np.linalg.norm(position_mm))
    square = (position_mm[0] - x_mm) ** 2 + (position_mm[1] - y_mm) ** 2 + position_mm[2] ** 2
    return np.asarray((distance**2 - position_mm[0] * x_mm - position_mm[1] * y_mm) / (distance * np.sqrt(square)))


def _beam_power(beam_angle_deg: float) -> float:
    return float(np.log(0.5) / np.log(np.cos(np.radians(beam_angle_deg / 2))))


def angular_radius(lamp: Lamp, x_mm: Floats, y_mm: Floats) -> Floats | float:
    """Return the lamp's angular radius in radians as seen from places on the plate; one number if it is far."""
    radius, position = np.radians(lamp.angular_radius_deg), lamp.position_mm
    if position is None:
        return float(radius)
    square = (position[0] - x_mm) ** 2 + (position[1] - y_mm) ** 2 + position[2] ** 2
    return np.asarray(np.arctan(np.linalg.norm(position) * np.tan(radius) / np.sqrt(square)))


def nearest_mm(lamp: Lamp, x_mm: Floats, y_mm: Floats, reach_mm: Floats) -> Floats:
    """Return a lower bound of the lamp's distance from places within ``reach_mm`` of some, (n,); infinite if far."""
    position = lamp.position_mm
    if position is None:
        return np.full_like(x_mm, np.inf)
    away = np.sqrt((position[0] - x_mm) ** 2 + (position[1] - y_mm) ** 2 + position[2] ** 2)
    return np.asarray(np.maximum(away - reach_mm, position[2]))
