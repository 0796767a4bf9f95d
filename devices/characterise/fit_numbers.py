"""What is reported of a fit: its numbers with standard errors, differences, R², errors of table and inverse."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from devices.characterise.patches import Patches
from devices.display.code_table import code_tables, knotted_codes, table_codes
from devices.display.model import DisplayModel
from documents.arrays import Floats
from documents.text import JsonResult

_COLOURS = ("red", "green", "blue")


@dataclass(frozen=True, slots=True)
class Errors(JsonResult):
    """ΔE00 of ``patches`` readings: mean, 95th percentile, largest, and the mean of the third with the least Y."""

    patches: int
    mean: float
    p95: float
    max: float
    dark_mean: float


@dataclass(frozen=True, slots=True)
class FitNumber:
    """A fitted number and its standard error, None where the fit gives none."""

    value: float
    standard_error: float | None


@dataclass(frozen=True, slots=True, eq=False)
class ModelNumbers:
    """The numbers of a display model.

    ``black_XYZ_cd_m2``: X, Y and Z of the model's own term. ``shown_black_XYZ_cd_m2``: of the light at code 0, (3,):
    the term and what the curves' offsets add to it, without the room's light. ``primaries_XYZ_cd_m2``: a row for each
    channel, shape (3, 3). ``curves``: gain, offset and gamma by channel, empty unless the curves are of the GOGO
    family. Light is a share of full drive, so that gain and offset add up to 1 and share one standard error.
    """

    black_XYZ_cd_m2: Mapping[str, FitNumber]
    primaries_XYZ_cd_m2: Floats
    curves: Mapping[str, Mapping[str, FitNumber]]
    shown_black_XYZ_cd_m2: Floats

    @classmethod
    def of(cls, model: DisplayModel, standard_errors: Mapping[str, float]) -> ModelNumbers:
        """Return the numbers of ``model``; ``standard_errors`` are those of the fit, by names such as ``red.gamma``."""
        black = {
            axis: FitNumber(float(value), standard_errors.get(f"black.{axis}"))
            for axis, value in zip("XYZ", model.black_XYZ_cd_m2, strict=True)
        }
        curves: dict[str, dict[str, FitNumber]] = {}
        for colour, curve in zip(_COLOURS, model.curves, strict=True):
            if curve.numbers:
                named = {"gain": "offset"}  # they share an error
                curves[colour] = {
                    name: FitNumber(value, standard_errors.get(f"{colour}.{named.get(name, name)}"))
                    for name, value in curve.numbers.items()
                }
        return cls(black, model.primaries_XYZ_cd_m2.T, curves, model.in_the_dark.shown_black_XYZ_cd_m2)

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "black_XYZ_cd_m2": {axis: asdict(number) for axis, number in self.black_XYZ_cd_m2.items()},
            "shown_black_XYZ_cd_m2": dict(zip("XYZ", self.shown_black_XYZ_cd_m2.tolist(), strict=True)),
            "primaries_XYZ_cd_m2": dict(zip(_COLOURS, self.primaries_XYZ_cd_m2.tolist(), strict=True)),
            "curves": {
                colour: {name: asdict(number) for name, number in curve.items()}
                for colour, curve in self.curves.items()
            }
            or None,
        }


def differences(model: DisplayModel, patches: Patches) -> Floats:
    """Return ΔE00 (n,) between what ``model`` predicts and what was measured."""
    return patches.delta_e_2000(model.xyz(patches.codes))


def errors_of(delta_e: Floats, luminance: Floats) -> Errors:
    """Return the figures of ``delta_e`` (n,), whose readings have ``luminance`` (n,); n is 1 or more."""
    dark = delta_e[np.argsort(luminance, kind="stable")[: max(1, len(delta_e) // 3)]]
    return Errors(
        len(delta_e), float(delta_e.mean()), float(np.quantile(delta_e, 0.95)), float(delta_e.max()), float(dark.mean())
    )


def r_squared(measured: Floats, predicted: Floats) -> tuple[float, ...]:
    """Return the coefficient of determination of each column of (n, k)."""
    left = ((measured - predicted) ** 2).sum(axis=0)
    spread = ((measured - measured.mean(axis=0)) ** 2).sum(axis=0)
    return tuple(float(v) for v in np.where(spread > 0, 1.0 - left / np.where(spread > 0, spread, 1.0), np.nan))


def table_error_codes(model: DisplayModel) -> float:
    """Return by how many 8-bit codes the presenter's table differs at most from ``model``'s own inverse.

    Over 4081 greys; a channel counts where a code more gives it a millionth of its light more, because where light
    stands still it matters to no one which code gives it.
    """
    asked = np.repeat(np.linspace(0.0, 1.0, 4081)[:, None], 3, axis=1)
    XYZ = model.xyz(asked)
    tabled = all(curve.tabled for curve in model.curves)
    shown = knotted_codes(model, XYZ) if tabled else table_codes(model, XYZ, code_tables(model))
    off = np.abs(shown - model.code(XYZ))
    rise = np.gradient(model.linear(XYZ), 1.0 / 16.0, axis=0)  # 16 steps of the greys to a code
    return float(off[rise > 1e-6].max(initial=0.0) * 255.0)


def inversion_error_codes(model: DisplayModel) -> float:
    """Return by how many 8-bit codes ``model``'s inverse misses codes whose light it is asked for, at most.

    Over 256 greys and a cube of 9 codes a side. A channel counts where a code less gives it a millionth of its light
    less: where light stands still, no inverse can recover the code.
    """
    side = np.linspace(0.0, 1.0, 9)
    cube = np.stack(np.meshgrid(side, side, side, indexing="ij"), axis=-1).reshape(-1, 3)
    asked = np.concatenate([np.repeat(np.linspace(0.0, 1.0, 256)[:, None], 3, axis=1), cube])
    off = np.abs(model.code(model.xyz(asked)) - asked)
    less = np.maximum(asked - 1.0 / 255.0, 0.0)
    rise = np.stack(
        [curve.linear(asked[:, i]) - curve.linear(less[:, i]) for i, curve in enumerate(model.curves)], axis=-1
    )
    return float(off[rise > 1e-6].max(initial=0.0) * 255.0)
