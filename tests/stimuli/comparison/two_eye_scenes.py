"""Pairs of views with known depth: a textured scene with relief, and a plate of sparkles that one eye may see alone."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import TypeVar

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.special import ndtr

from documents.arrays import Floats, Floats32

Pair = tuple[Floats32, Floats32]
_BEYOND = 40


@dataclass(frozen=True)
class Relief:
    """A textured scene whose left view is fixed: disparities in px of standard deviation ``relief_px``, times ``base``.

    ``texture`` and ``noise`` are random seeds, ``noise_share`` the noise of a pixel. The right view is turned by
    ``roll_deg``, clockwise.
    """

    relief_px: float = 3.0
    base: float = 1.0
    roll_deg: float = 0.0
    texture: int = 0
    noise: int = 0
    noise_share: float = 0.005
    shape: tuple[int, int] = (240, 320)

    @cache  # noqa: B019  # as many as tests draw
    def views(self) -> Pair:
        """Return both views, in cd/m²."""
        height, width = self.shape
        rng = np.random.default_rng(self.texture)
        size = (height + 2 * _BEYOND, width + 2 * _BEYOND)
        rough = sum(gaussian_filter(rng.standard_normal(size), sd, mode="wrap") * sd for sd in (1.0, 2.0, 4.0, 8.0))
        light = 20 * np.exp(0.35 * rough / np.std(rough))
        y, x = np.mgrid[:height, :width].astype(np.float64)
        middle_y, middle_x = (height - 1) / 2, (width - 1) / 2
        c, s = np.cos(np.radians(self.roll_deg)), np.sin(np.radians(self.roll_deg))
        right_y = middle_y + c * (y - middle_y) - s * (x - middle_x)
        right_x = middle_x + s * (y - middle_y) + c * (x - middle_x)
        moved = 0.5 * self.depth(x, y)
        left = map_coordinates(light, [y + _BEYOND, x + _BEYOND + moved], order=3)
        moved = (self.base - 0.5) * self.depth(right_x, right_y)
        right = map_coordinates(light, [right_y + _BEYOND, right_x + _BEYOND - moved], order=3)
        return noisy((left, right), self.noise, self.noise_share)

    def depth(self, x: Floats, y: Floats) -> Floats:
        """Return disparities at places: waves, and a disc before them."""
        height, width = self.shape
        waves = np.sin(3 * np.pi * x / width) * np.cos(2 * np.pi * y / height)
        disc = np.hypot(x - 0.3 * width, y - 0.6 * height) < 0.15 * height
        return np.asarray(self.relief_px * (waves + 0.5 * disc) / 0.527)


@dataclass(frozen=True)
class Sparkles:
    """A flat plate of ``count`` sparkles, of which both eyes see ``shared`` and one eye alone the others.

    ``flakes`` and ``noise`` are random seeds. Of the right view, ``shuffled`` of the sparkles lie elsewhere.
    """

    shared: float = 0.5
    shuffled: float = 0.0
    flakes: int = 0
    noise: int = 0
    noise_share: float = 0.005
    count: int = 700
    shape: tuple[int, int] = (200, 300)

    @cache  # noqa: B019  # as many as tests draw
    def views(self) -> Pair:
        """Return both views, in cd/m²."""
        height, width = self.shape
        place, bright, seen, other = (
            np.random.default_rng(seed) for seed in np.random.SeedSequence(self.flakes).spawn(4)
        )
        at = place.uniform([-10, -10], [width + 10, height + 10], (self.count, 2))
        light = 100 * bright.lognormal(0, 0.6, self.count)
        chance = seen.uniform(size=self.count)
        both, left = chance < self.shared, chance < self.shared + (1 - self.shared) / 2
        elsewhere = other.uniform([-10, -10], [width + 10, height + 10], (self.count, 2))
        moved = np.where((other.uniform(size=self.count) < self.shuffled)[:, None], elsewhere, at)
        views = (self._drawn(at[left], light[left]), self._drawn(moved[both | ~left], light[both | ~left]))
        return noisy(views, self.noise, self.noise_share)

    def _drawn(self, at: Floats, light: Floats) -> Floats:
        across, down = (
            np.diff(ndtr((np.arange(length + 1) - 0.5 - at[:, axis, None]) / 0.9), axis=1)
            for axis, length in ((0, self.shape[1]), (1, self.shape[0]))
        )
        return np.asarray(10.0 + (down * light[:, None]).T @ across)


Scene = Relief | Sparkles
S = TypeVar("S", bound=Relief | Sparkles)


def noisy(views: tuple[Floats, Floats], seed: int, share: float) -> Pair:
    """Return both views with noise of its own on each pixel."""
    rng = np.random.default_rng([seed, 17])
    left, right = (np.asarray(view * (1 + share * rng.standard_normal(view.shape)), np.float32) for view in views)
    return left, right


def rendered(scene: S) -> S:
    """Return the same scene with other noise."""
    return replace(scene, noise=scene.noise + 1)


def contrasted(views: Pair, times: float) -> Pair:
    """Return both views, the right one with so many times the contrast about its mean."""
    left, right = views
    mean = right.mean()
    return left, np.maximum(mean + np.float32(times) * (right - mean), 0).astype(np.float32)
