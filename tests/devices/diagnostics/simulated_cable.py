"""The set ``cable`` read on displays drawn at random: without fault, or with one between codes and light."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np

from devices.colour import rgb_to_xyz_matrix
from devices.diagnostics import Diagnosis
from devices.diagnostics.channels import channel_constancy
from devices.diagnostics.content import black_with_picture, dynamic_contrast, picture_level
from devices.diagnostics.mixing import added_channels, standard_primaries, white_segment
from devices.diagnostics.signal_path import code_steps, frame_rate_control, last_codes, signal_range
from devices.display import MIXTURES, NODES, DisplayModel, EyeModels, Plvc, TableCurve, ToneCurve
from devices.readings import (
    Faults,
    Measurements,
    PatchOnScreen,
    PatchTurn,
    Simulated,
    SimulatedDisplay,
    find_sets,
    steps,
)

Examination = Callable[[Measurements], Diagnosis]
EACH_S = 10.0
CHECKS: tuple[Examination, ...] = (
    signal_range, code_steps, last_codes, frame_rate_control, dynamic_contrast, black_with_picture, picture_level,
    white_segment, added_channels, standard_primaries, channel_constancy,
)  # fmt: skip
D65 = (0.3127, 0.3290)
SRGB = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06))
WIDE = ((0.680, 0.320), (0.265, 0.690), (0.150, 0.060))


@lru_cache(maxsize=8)
def _order(seed: int, highest: int) -> tuple[PatchTurn, ...]:
    return steps([patches.rounded(highest) for patches in find_sets(("cable",))], seed)


def read_cable(model: DisplayModel, faults: Faults, seed: int, highest: int = 255) -> Measurements:
    """Read the set as `display measure` does, 10 s a patch, with codes of 8 bits, or of 10 if ``highest`` is 1023."""
    instrument = Simulated(SimulatedDisplay(EyeModels(model, model)), seed, faults)
    shown = _order(seed % 8, highest)
    light = [
        instrument.read(PatchOnScreen(s.label, s.patch.codes, s.position, EACH_S * s.position, s.patch.codes, s.patch))
        for s in shown
    ]
    return Measurements(
        np.array([step.patch.codes for step in shown]),
        np.array([reading.XYZ_cd_m2 for reading in light]),
        tuple(step.label for step in shown),
        EACH_S * np.arange(len(shown), dtype=np.float64),
        area=np.array([step.patch.filled for step in shown]),
        surround=np.array([step.patch.surround for step in shown]),
    )


def display(rng: np.random.Generator, primaries_xy: tuple[tuple[float, float], ...] | None = None) -> DisplayModel:
    """A panel made for sRGB or Display P3, or with ``primaries_xy``, of 60 to 400 cd/m² and 500:1 to 5000:1.

    Its tone response is GOG, an S, sRGB's, or any of PLVC with channels that act on each other mildly.
    """
    made_for = primaries_xy or (SRGB if rng.random() < 0.5 else WIDE)
    red, green, blue = np.array(made_for) + rng.normal(0, 0.012, (3, 2))
    matrix = rgb_to_xyz_matrix(red, green, np.maximum(blue, 0.02), np.array(D65) + rng.normal(0, 0.008, 2))
    matrix = matrix * np.exp(rng.uniform(np.log(60), np.log(400)))
    black = matrix.sum(axis=1) / np.exp(rng.uniform(np.log(500), np.log(5000)))
    kind = str(rng.choice(["gog", "s-curve", "srgb", "plvc"]))
    curves = _curve(rng, kind), _curve(rng, kind), _curve(rng, kind)
    if kind != "plvc":
        return DisplayModel(black, matrix, curves)
    # Chromaticities move by up to 0.007 in u′v′ with the level, and pairs take up to 3 % from each other.
    own = matrix.T[:, np.newaxis] * (1 + 0.012 * rng.uniform(-1, 1, (3, len(NODES), 3)))
    mixtures = 0.03 * rng.uniform(-1, 0, (MIXTURES, 1)) * matrix.mean(axis=1)
    return Plvc(black, matrix, curves, own, mixtures)


def _curve(rng: np.random.Generator, kind: str) -> ToneCurve | TableCurve:
    if kind == "gog":
        offset = float(rng.uniform(-0.06, 0.03))
        return ToneCurve(gain=1 - offset, offset=offset, gamma=float(rng.uniform(1.8, 2.5)))
    codes = np.linspace(0, 1, 65)
    if kind == "s-curve":
        rising = 1 / (1 + np.exp(-rng.uniform(5, 8) * (codes - rng.uniform(0.5, 0.65))))
        light = (rising - rising[0]) / (rising[-1] - rising[0])
    else:
        light = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
    return TableCurve(tuple(codes.tolist()), tuple(light.tolist()))


def usual(rng: np.random.Generator) -> Faults:
    """What every display and instrument has: noise, drift, stray light, channels that interact mildly."""
    return Faults(
        noise=float(rng.uniform(0.0005, 0.003)),
        floor_cd_m2=float(rng.uniform(0, 0.004)),
        drift_per_hour=float(rng.uniform(-0.02, 0.02)),
        interaction=float(rng.uniform(0, 0.02)),
        additivity_loss=float(rng.uniform(0, 0.04)),
        stray_light=float(rng.uniform(0, 0.005)),
    )


def clean(seed: int) -> Measurements:
    """A display of no particular fault."""
    rng = np.random.default_rng([seed, 1])
    model = display(rng)
    return read_cable(model, usual(rng), seed)


def faulty(seed: int, *, noise: float = 0.002, **planted: float) -> Measurements:
    """A display with the faults ``planted``, read with ``noise``."""
    rng = np.random.default_rng([seed, 2])
    model = display(rng)
    return read_cable(model, replace(usual(rng), noise=noise, **planted), seed)


def converted(seed: int, primaries_xy: tuple[tuple[float, float], ...], gamma: float | None) -> Measurements:
    """A panel of given primaries, within 0.006, behind a compositor that takes codes for sRGB and its curve for 2.2.

    ``gamma`` is the panel's own; None draws any curve.
    """
    rng = np.random.default_rng([seed, 3])
    red, green, blue = np.array(primaries_xy) + rng.normal(0, 0.006, (3, 2))
    matrix = 200.0 * rgb_to_xyz_matrix(red, green, blue, np.array(D65) + rng.normal(0, 0.006, 2))
    curves = display(rng).curves if gamma is None else (ToneCurve(gamma=gamma),) * 3
    panel = DisplayModel(matrix.sum(axis=1) / 1000, matrix, curves)
    return read_cable(panel, replace(usual(rng), noise=0.002, compositor=1.0), seed)


def narrow(share: float) -> tuple[tuple[float, float], ...]:
    """The primaries of a panel whose gamut is that of sRGB shrunk towards white to ``share`` of each side."""
    return tuple((D65[0] + share * (x - D65[0]), D65[1] + share * (y - D65[1])) for x, y in SRGB)
