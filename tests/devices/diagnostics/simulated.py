"""A simulated display with a known model, and readings of it in which faults can be planted."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import ArrayLike

from devices.diagnostics import Diagnosis
from devices.display import DisplayModel, ToneCurve
from devices.readings import Measurements, PatchEye, find_patches, steps
from documents.arrays import Floats

Light = Callable[[Floats], Floats]

NOISE = 0.002
SECONDS_EACH = 15.0
# Expression 3.12 with a black of 0.08 % of white, and the gammas of Table 3.6.
MODEL = DisplayModel(
    np.array([0.02, 0.021, 0.03]),
    np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]]),
    (ToneCurve(gamma=1.8132), ToneCurve(gamma=1.7649), ToneCurve(gamma=1.7156)),
)
COLOURS: Mapping[str, tuple[float, float, float]] = {
    "black": (0, 0, 0),
    "red": (1, 0, 0),
    "green": (0, 1, 0),
    "blue": (0, 0, 1),
    "white": (1, 1, 1),
}


def characterisation(
    seed: int = 1, noise: float = NOISE, *, light: Light = MODEL.xyz, over_time: Light | None = None
) -> Measurements:
    """Table C.1 with black and white after every twelve patches; ``over_time`` scales light at times in s."""
    shown = steps(find_patches("table_c1"), seed)
    codes = np.array([step.patch.codes for step in shown])
    time_s: Floats = SECONDS_EACH * np.arange(len(shown), dtype=np.float64)
    xyz = light(codes) * (over_time(time_s)[:, None] if over_time is not None else 1.0)
    return Measurements(codes, noisy(xyz, seed, noise), tuple(step.label for step in shown), time_s)


def readings(
    named: Mapping[str, tuple[ArrayLike, ArrayLike]], seed: int = 1, noise: float = NOISE, eye: PatchEye = "both"
) -> Measurements:
    """Readings by name of a code and its XYZ before noise."""
    codes = np.array([code for code, _ in named.values()], dtype=np.float64)
    xyz = np.array([light for _, light in named.values()], dtype=np.float64)
    return Measurements(codes, noisy(xyz, seed, noise), tuple(named), None, (eye,) * len(named))


def one_patch(light: Light, minutes: float, count: int, seed: int = 1, noise: float = NOISE) -> Measurements:
    """``count`` readings of a grey over ``minutes``; ``light`` is its share of the usual at times in s."""
    time_s = np.asarray(np.linspace(0, 60 * minutes, count), dtype=np.float64)
    codes = np.full((count, 3), 120 / 255)
    xyz = np.asarray(MODEL.xyz(codes) * light(time_s)[:, None])
    return Measurements(codes, noisy(xyz, seed, noise), ("gray120",) * count, time_s)


def noisy(xyz: Floats, seed: int, noise: float) -> Floats:
    """X, Y and Z each with its own noise, in proportion."""
    return np.asarray(xyz * (1 + noise * np.random.default_rng(seed).standard_normal(xyz.shape)))


def spectra(codes: Floats, share: Light | None = None) -> tuple[Floats, Floats]:
    """Wavelengths (m,) in nm and spectra (n, m) of bell-shaped primaries, through a filter of ``share``."""
    waves = np.arange(380.0, 781.0, 4.0)
    bells = np.array([np.exp(-(((waves - peak) / 22) ** 2)) for peak in (620.0, 535.0, 455.0)])
    linear = np.stack([curve.linear(codes[:, i]) for i, curve in enumerate(MODEL.curves)], axis=1)
    return waves, (linear @ bells) * (share(waves) if share is not None else 1.0)


def crosstalk_readings(leaks: Mapping[PatchEye, float], seed: int = 1, noise: float = NOISE) -> Measurements:
    """Every colour through each lens, and black with it in the other eye's picture, of which ``leaks`` arrive."""
    names: list[str] = []
    codes: list[tuple[float, float, float]] = []
    light: list[Floats] = []
    eyes: list[PatchEye] = []
    dark = MODEL.xyz(np.zeros(3))
    for eye, leak in leaks.items():
        for name, code in COLOURS.items():
            names.append(name)
            codes.append(code)
            light.append(MODEL.xyz(code))
            eyes.append(eye)
            if name != "black":
                names.append(f"black@other={name}")
                codes.append((0, 0, 0))
                light.append(dark + leak * (MODEL.xyz(code) - dark))
                eyes.append(eye)
    return Measurements(np.array(codes), noisy(np.array(light), seed, noise), tuple(names), None, tuple(eyes))


def judged(found: Diagnosis, passed: bool | None, *words: str) -> Diagnosis:
    """Return a diagnosis, which must have ``passed``, or not, or be no verdict, and say ``words``."""
    assert found.passed is passed, found.words
    for said in words:
        assert said in found.words
    return found
