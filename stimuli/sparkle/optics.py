"""How much light a flake sends to an eye.

A flake is a small mirror whose surface normals scatter about its own by a von Mises-Fisher lobe, exp((n·h − 1)/σ²) /
(2πσ²), with h the half-way direction between lamp and eye inside the coat. The reflected luminance is then
ρ · E · lobe / (4 v·h): integrated over all directions v it gives back ρ · E, the light that the mirror received
(4 v·h is the ratio of the solid angles of v and of h). A lamp of finite size widens the lobe.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from stimuli.sparkle.flakes import Flakes
from stimuli.sparkle.scene import Lamp, Plate

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Sparkles:
    """What one eye sees of flakes: place on the surface in mm, luminance in cd/m², area seen in mm²; each (n,).

    ``lobe_share`` is how much of the lobe's peak, 0 to 1, goes towards the eye.
    """

    x_mm: Floats
    y_mm: Floats
    luminance_cd_m2: Floats
    area_mm2: Floats
    lobe_share: Floats

    def chosen(self, which: NDArray[np.bool_]) -> Sparkles:
        """Return the sparkles for which ``which``, shape (n,), is true."""
        return Sparkles(*(getattr(self, one.name)[which] for one in fields(self)))


def refract(direction: Floats, refractive_index: float) -> Floats:
    """Return unit directions (..., 3) inside the coat for unit directions outside (Snell's law, z the normal)."""
    inside = np.array(direction, dtype=np.float64) / refractive_index
    inside[..., 2] = np.sqrt(1.0 - inside[..., 0] ** 2 - inside[..., 1] ** 2)
    return inside


def transmittance(cos_outside: Floats | float, cos_inside: Floats | float, refractive_index: float) -> Floats:
    """Return the share of unpolarised light that passes the surface (Fresnel); the same both ways."""
    outside, inside = np.asarray(cos_outside, dtype=np.float64), np.asarray(cos_inside, dtype=np.float64)
    across = (outside - refractive_index * inside) / (outside + refractive_index * inside)
    along = (refractive_index * outside - inside) / (refractive_index * outside + inside)
    return np.asarray(1.0 - 0.5 * (across**2 + along**2))


def lobe_sd(plate: Plate, lamp: Lamp) -> float:
    """Return the lobe's standard deviation about a flake's normal, in radians.

    The lamp's disc, of angular radius a, has the variance a²/4 along each axis; in the coat its angles shrink by the
    refractive index, and a turn of the half-way direction turns the reflection twice as far.
    """
    from_lamp = np.radians(lamp.angular_radius_deg) / (2.0 * plate.coat_refractive_index * 2.0)
    return float(np.hypot(np.radians(plate.lobe_sd_deg), from_lamp))


def view_directions(x_mm: Floats, y_mm: Floats, eye_mm: Floats) -> Floats:
    """Return unit directions (n, 3) from places on the surface to the eye at ``eye_mm`` (3,)."""
    ray = np.stack([eye_mm[0] - x_mm, eye_mm[1] - y_mm, np.full_like(x_mm, eye_mm[2])], axis=-1)
    return np.asarray(ray / np.linalg.norm(ray, axis=-1, keepdims=True))


def half_way(view_inside: Floats, lamp_inside: Floats) -> Floats:
    """Return the unit directions (n, 3) half way between view (n, 3) and lamp (3,)."""
    h = view_inside + lamp_inside
    return np.asarray(h / np.linalg.norm(h, axis=-1, keepdims=True))


def shade(flakes: Flakes, plate: Plate, lamp: Lamp, eye_mm: Floats) -> Sparkles:
    """Return what the eye at ``eye_mm`` (3,) sees of each flake.

    A flake lies deeper than the surface, so that each eye sees it at its own place there. The direction of view is
    taken at the flake's own x and y: over a depth of some hundredths of a millimetre it does not change.
    """
    index = plate.coat_refractive_index
    x, y = flakes.x_mm.astype(np.float64), flakes.y_mm.astype(np.float64)
    view = view_directions(x, y, eye_mm)
    view_inside = refract(view, index)
    lamp_inside = refract(lamp.direction, index)
    normal = np.stack([flakes.slope_x, flakes.slope_y, np.ones(len(flakes), np.float32)], axis=-1).astype(np.float64)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    h = half_way(view_inside, lamp_inside)
    sd = lobe_sd(plate, lamp)
    lobe_share = np.exp((np.einsum("ij,ij->i", normal, h) - 1.0) / sd**2)
    lobe = lobe_share / (2.0 * np.pi * sd**2)
    # Illuminance on a plane square to the beam inside the coat: the meter's reading, less what the surface returns.
    lamp_cos = lamp.direction[2]
    received = lamp.illuminance_lx * transmittance(lamp_cos, lamp_inside[2], index) / lamp_inside[2]
    inside = plate.flake_reflectance * received * lobe / (4.0 * np.einsum("ij,ij->i", view_inside, h))
    # Leaving the coat, light spreads over n² times the solid angle.
    luminance = inside * transmittance(view[:, 2], view_inside[:, 2], index) / index**2
    seen = np.abs(np.einsum("ij,ij->i", normal, view_inside)) / view_inside[:, 2]
    depth = flakes.depth_mm.astype(np.float64) / view_inside[:, 2]
    return Sparkles(
        x_mm=x + depth * view_inside[:, 0],
        y_mm=y + depth * view_inside[:, 1],
        luminance_cd_m2=np.asarray(luminance),
        area_mm2=np.asarray(seen * np.pi / 4.0 * flakes.diameter_mm.astype(np.float64) ** 2),
        lobe_share=np.asarray(lobe_share),
    )
