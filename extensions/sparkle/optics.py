"""How much light a flake sends to an eye.

A flake is a small mirror whose surface normals scatter about its own by a von Mises-Fisher lobe, exp((n·h − 1)/σ²) /
(2πσ²), with h the half-way direction between lamp and eye inside the coat. The reflected luminance is then
ρ · E · lobe / (4 v·h): integrated over all directions v it gives back ρ · E, the light that the mirror received
(4 v·h is the ratio of the solid angles of v and of h). A lamp of finite size widens the lobe, and so does the
diffraction of a small flake. What shines in the base is the same kind of mirror, flat and everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from documents.arrays import Floats
from extensions.sparkle.flakes import Flakes
from extensions.sparkle.lamplight import angular_radius, illuminance_lx, lamp_directions, nearest_mm
from extensions.sparkle.scene import Lamp, Plate

# The Gaussian that fits the centre of a disc's diffraction pattern best has this standard deviation, in wavelengths
# per diameter; the rings around it are left out.
DIFFRACTION_SD = 0.42


@dataclass(frozen=True, slots=True)
class Sparkles:
    """The sparkles that one eye sees: place on the surface in mm, luminance in cd/m², area seen in mm²; each (n,).

    ``lobe_share`` is how much of the lobe's peak, 0 to 1, goes towards the eye.
    """

    x_mm: Floats
    y_mm: Floats
    luminance_cd_m2: Floats
    area_mm2: Floats
    lobe_share: Floats

    def chosen(self, which: NDArray[np.bool_]) -> Sparkles:
        """Return the sparkles for which ``which``, shape (n,), is true."""
        return Sparkles(*(getattr(self, field.name)[which] for field in fields(self)))


def refract(direction: Floats, refractive_index: float) -> Floats:
    """Return unit directions (..., 3) inside the coat for unit directions outside (Snell's law, z the normal)."""
    inside = np.array(direction, dtype=np.float64) / refractive_index
    inside[..., 2] = np.sqrt(1.0 - inside[..., 0] ** 2 - inside[..., 1] ** 2)
    return inside


def transmittance(cos_outside: Floats | float, cos_inside: Floats | float, refractive_index: float) -> Floats:
    """Return the share of unpolarised light that passes the surface (Fresnel); the same both ways."""
    outside, inside = np.asarray(cos_outside, dtype=np.float64), np.asarray(cos_inside, dtype=np.float64)
    # Fresnel's r_s and r_p; what is not reflected passes, half of the light in each polarisation.
    across = (outside - refractive_index * inside) / (outside + refractive_index * inside)
    along = (refractive_index * outside - inside) / (refractive_index * outside + inside)
    return np.asarray(1.0 - 0.5 * (across**2 + along**2))


def lobe_sd(plate: Plate, angular_radius_rad: Floats | float, diameter_mm: Floats | float) -> Floats | float:
    """Return the lobe's standard deviation about a flake's normal, in radians.

    A lamp's disc, of angular radius a, has the variance a²/4 along each axis; a flake of diameter D spreads light of
    wavelength λ by 0.42 λ/D. In the coat angles shrink by the refractive index, and a turn of the half-way direction
    turns the reflection twice as far. The disc is taken as round in the coat; for a lamp at 45° it is a fifth narrower
    in the plane of incidence. A disc of 3° under a lobe of 1° is then within 2 % of the lobe's peak.
    """
    turn = 2.0 * plate.coat_refractive_index
    variance = np.radians(plate.lobe_sd_deg) ** 2 + (angular_radius_rad / (2.0 * turn)) ** 2
    if plate.diffraction_nm is not None:
        variance = variance + (DIFFRACTION_SD * plate.diffraction_nm * 1e-6 / (turn * diameter_mm)) ** 2
    widest = np.sqrt(variance)
    return float(widest) if np.ndim(widest) == 0 else np.asarray(widest)


def widest_lobe_sd(plate: Plate, lamp: Lamp) -> float:
    """Return an upper bound of `lobe_sd` over the plate: its smallest flake, as near to the lamp as it may lie."""
    radius, zero = np.radians(lamp.angular_radius_deg), np.zeros(1)
    if lamp.distance_mm is not None:
        nearest = nearest_mm(lamp, zero, zero, np.full(1, 0.5 * np.hypot(plate.width_mm, plate.height_mm)))
        radius = np.arctan(lamp.distance_mm * np.tan(radius) / nearest[0])
    return float(lobe_sd(plate, float(radius), plate.flake_diameter_min_um / 1000.0)) * (1.0 + 1e-6)


def view_directions(x_mm: Floats, y_mm: Floats, eye_mm: Floats) -> Floats:
    """Return unit directions (n, 3) from places on the surface to the eye at ``eye_mm`` (3,)."""
    ray = np.stack([eye_mm[0] - x_mm, eye_mm[1] - y_mm, np.full_like(x_mm, eye_mm[2])], axis=-1)
    return np.asarray(ray / np.linalg.norm(ray, axis=-1, keepdims=True))


def half_way(view_inside: Floats, lamp_inside: Floats) -> Floats:
    """Return the unit directions (n, 3) half way between view (n, 3) and lamp (3,) or (n, 3)."""
    h = view_inside + lamp_inside
    return np.asarray(h / np.linalg.norm(h, axis=-1, keepdims=True))


@dataclass(frozen=True, slots=True)
class Mirrored:
    """Return the light of mirrors to an eye: luminance in cd/m² and share of the lobe's peak, (n,) each.

    ``view_inside`` (n, 3) is the direction of view in the coat, and ``lamp_inside``, (3,) or (n, 3), the lamp's.
    """

    luminance_cd_m2: Floats
    lobe_share: Floats
    view_inside: Floats
    lamp_inside: Floats


def mirror(
    places_mm: tuple[Floats, Floats],
    normal: Floats,
    reflectance: float,
    sd: Floats | float,
    plate: Plate,
    lamp: Lamp,
    eye_mm: Floats,
) -> Mirrored:
    """Return the light of mirrors of unit ``normal`` (n, 3) or (3,) and lobe ``sd`` at ``places_mm`` (x, y, (n,) each).

    The eye is at ``eye_mm`` (3,). Their depth in the coat does not count here.
    """
    x, y = places_mm
    index = plate.coat_refractive_index
    view = view_directions(x, y, eye_mm)
    view_inside = refract(view, index)
    light = lamp_directions(lamp, x, y)
    lamp_inside = refract(light, index)
    h = half_way(view_inside, lamp_inside)
    # The lobe exp((n·h − 1)/σ²) / (2πσ²).
    lobe_share = np.exp((np.einsum("...j,...j->...", normal, h) - 1.0) / sd**2)
    lobe = lobe_share / (2.0 * np.pi * sd**2)
    # Illuminance on a plane square to the beam inside the coat: the meter's reading, less what the surface returns.
    through = transmittance(light[..., 2], lamp_inside[..., 2], index)
    received = illuminance_lx(lamp, x, y) * through / lamp_inside[..., 2]
    # ρ · E · lobe / (4 v·h).
    inside = reflectance * received * lobe / (4.0 * np.einsum("ij,ij->i", view_inside, h))
    # Leaving the coat, light spreads over n² times the solid angle.
    luminance = inside * transmittance(view[:, 2], view_inside[:, 2], index) / index**2
    return Mirrored(np.asarray(luminance), np.asarray(lobe_share), view_inside, lamp_inside)


def shade(flakes: Flakes, plate: Plate, lamp: Lamp, eye_mm: Floats) -> Sparkles:
    """Return the sparkle of each flake for the eye at ``eye_mm`` (3,).

    A flake lies deeper than the surface, so that each eye sees it at its own place there. The direction of view is
    taken at the flake's own x and y: over a depth of some hundredths of a millimetre it does not change.
    """
    x, y = flakes.x_mm.astype(np.float64), flakes.y_mm.astype(np.float64)
    diameter = flakes.diameter_mm.astype(np.float64)
    normal = np.stack([flakes.slope_x, flakes.slope_y, np.ones(len(flakes), np.float32)], axis=-1).astype(np.float64)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    sd = lobe_sd(plate, angular_radius(lamp, x, y), diameter)
    seen = mirror((x, y), normal, plate.flake_reflectance, sd, plate, lamp, eye_mm)
    view_inside, luminance = seen.view_inside, seen.luminance_cd_m2
    # The disc's area as the eye sees it, laid out on the surface: n·v / v_z.
    across = np.abs(np.einsum("ij,ij->i", normal, view_inside)) / view_inside[:, 2]
    depth = flakes.depth_mm.astype(np.float64) / view_inside[:, 2]
    if plate.coat_extinction_per_mm > 0:  # Lambert's law over the way down and up
        path = depth + flakes.depth_mm / seen.lamp_inside[..., 2]
        luminance = luminance * np.exp(-plate.coat_extinction_per_mm * path)
    flat = np.maximum(diameter - 2e-3 * plate.flake_rim_um, 0.0)
    return Sparkles(
        x_mm=x + depth * view_inside[:, 0],
        y_mm=y + depth * view_inside[:, 1],
        luminance_cd_m2=luminance,
        area_mm2=np.asarray(across * np.pi / 4.0 * flat**2),
        lobe_share=seen.lobe_share,
    )
