"""Several photographs of colour charts, pooled for one fit: repeated shots by their mean, the rest side by side.

Photographs of one chart at one exposure are repeated shots: the mean of each patch counts, and how the shots differ
gives its standard error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from devices.camera import CameraFit, Correspondences, Exposure
from documents import Finding
from documents.arrays import Floats
from documents.text import JsonResult, counted
from stimuli.errors import StimulusError

_MOST_APART = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class ChartShot:
    """One photograph of a chart, read: its ``file``, its patches beside the ``reference`` file, and its exposure."""

    file: str
    reference: str | None
    colours: Correspondences
    exposure: Exposure | None


@dataclass(frozen=True, slots=True, eq=False)
class PooledChart(JsonResult):
    """A chart in a pooled fit: its shots, and how the model does on it.

    ``delta_e_mean`` and ``delta_e_max`` are ΔE00 of the patches fitted to, ``luminance_ratio`` is the median of the
    estimated luminance over that measured, ``noise`` the median relative standard error of the patches' camera values
    by how the shots differ; None of a single shot.
    """

    files: tuple[str, ...]
    exposure: Exposure | None
    patches: int
    delta_e_mean: float | None
    delta_e_max: float | None
    luminance_ratio: float | None
    noise: float | None
    json_keys: ClassVar = {
        "patches": "patches_fitted",
        "delta_e_mean": "delta_e_2000_mean",
        "delta_e_max": "delta_e_2000_max",
        "noise": "relative_standard_error",
    }

    def __str__(self) -> str:
        shots = self.files[0] if len(self.files) == 1 else f"{self.files[0]} and {len(self.files) - 1} more"
        at = f" ({self.exposure})" if self.exposure else ""
        if self.delta_e_mean is None:
            return f"{shots}{at}: no patch fitted to"
        words = (
            f"ΔE00 mean {self.delta_e_mean:.2f}, largest {self.delta_e_max:.2f}; luminance × {self.luminance_ratio:.3f}"
        )
        return f"{shots}{at}: {words}" + ("" if self.noise is None else f"; noise {100 * self.noise:.2g} %")


@dataclass(frozen=True, slots=True, eq=False)
class Pooled:
    """Colours of all charts, one chart after the other, the shots of each, and notes, a sentence each."""

    colours: Correspondences
    groups: tuple[tuple[ChartShot, ...], ...]
    notes: tuple[str, ...]

    def residuals(self, fit: CameraFit) -> tuple[PooledChart, ...]:
        """Return how ``fit`` does on each chart."""
        found, first = [], 0
        for shots in self.groups:
            count = len(shots[0].colours)
            patches = [patch for patch in fit.patches[first : first + count] if not patch.left_out_reason]
            ratios = [patch.estimated_XYZ[1] / patch.XYZ[1] for patch in patches if patch.XYZ[1] > 0]
            error = self.colours.noise_rgb
            noise = None
            if error is not None and len(shots) > 1:
                rgb = self.colours.rgb[first : first + count]
                noise = float(np.median(error[first : first + count] / np.maximum(rgb, 1e-6)))
            found.append(
                PooledChart(
                    tuple(shot.file for shot in shots),
                    shots[0].exposure,
                    len(patches),
                    float(np.mean([patch.delta_e for patch in patches])) if patches else None,
                    max((patch.delta_e for patch in patches), default=None),
                    float(np.median(ratios)) if ratios else None,
                    noise,
                )
            )
            first += count
        return tuple(found)


def pool_shots(shots: Sequence[ChartShot]) -> Pooled:
    """Return the colours of several photographs of charts for one fit.

    Raises
    ------
    StimulusError
        If some of the photographs have an exposure and others none.
    """
    bare = [shot.file for shot in shots if shot.exposure is None]
    if bare and len(bare) < len(shots):
        raise StimulusError(
            Finding("the photograph has no exposure, and others have", bare[0], remedy="give --exposure for all")
        )
    groups: list[list[ChartShot]] = []
    for shot in shots:
        for group in groups:
            if group[0].reference == shot.reference and _same(group[0].exposure, shot.exposure):
                group.append(shot)
                break
        else:
            groups.append([shot])
    means, errors, notes = [], [], []
    for group in groups:
        rgb = np.stack([shot.colours.rgb for shot in group])
        means.append(rgb.mean(axis=0))
        errors.append(rgb.std(axis=0, ddof=1) / np.sqrt(len(group)) if len(group) > 1 else np.zeros(rgb.shape[1:]))
        notes += _apart(group, rgb)
    exposures = [group[0].exposure for group in groups for _ in range(len(group[0].colours))]
    parts = [group[0].colours for group in groups]
    colours = Correspondences(
        np.concatenate(means),
        np.concatenate([part.XYZ for part in parts]),
        tuple(name for part in parts for name in part.names),
        np.concatenate([np.logical_or.reduce([shot.colours.saturated for shot in group]) for group in groups]),
        shots[0].file,
        None if bare else tuple(exposure for exposure in exposures if exposure is not None),
        parts[0].observer,
        np.concatenate(errors) if any(len(group) > 1 for group in groups) else None,
    )
    return Pooled(colours, tuple(tuple(group) for group in groups), tuple(notes))


def _same(one: Exposure | None, other: Exposure | None) -> bool:
    return one is other if one is None or other is None else one.same_signal(other)


def _apart(group: Sequence[ChartShot], rgb: Floats) -> list[str]:
    """Return which shots differ from the mean of the others by more than a twentieth in the middle of their patches."""
    if len(group) < 2:
        return []
    notes = []
    for number, shot in enumerate(group):
        others = np.delete(rgb, number, axis=0).mean(axis=0)
        ratio = float(np.median(rgb[number] / np.maximum(others, 1e-9)))
        if abs(ratio - 1) > _MOST_APART:
            beside = counted(len(group) - 1, "other shot", "other shots")
            notes.append(f"{shot.file} has {ratio:.3f} × the light of its {beside} at the same exposure")
    return notes
