"""Bracketed photographs merged to one picture: run time against error, beside OpenCV's merging.

A simulated sensor (30000 electrons at full scale, 6 of read noise) photographs patches of 11 stops at six exposures,
1/8 to 1/250 s. The error is the root mean square of the relative error over values that some exposure saw below full.
OpenCV merges 8 bits only: its rows get the same linear values in 8 bits, and so does one of ours. The rows "14 bits"
are of the sensor's own codes.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from curves import program, seconds, sized
from numpy.typing import NDArray
from promises import Promise

from documents.arrays import Floats
from extensions.photo import NoiseModel, merge_exposures

sys.path.insert(0, str(Path(__file__).parents[1]))
from tests.extensions.photo.sensor import FULL_E, READ_E, SPAN, TIMES, codes, record, scene

SIDE = sized((384, 512), (48, 64))
SECONDS = [time[0] / time[1] for time in TIMES]
T = [time / SECONDS[0] for time in SECONDS]
NOISE = NoiseModel.of_electrons(FULL_E, READ_E)


def photographs() -> tuple[Floats, list[Floats]]:
    """Return the light (height, width, 3) at the shortest exposure, and values of each exposure in 14 bits."""
    light = np.stack([scene(*SIDE, seed=seed) for seed in range(3)], axis=-1)
    taken = [codes(record(light, time, seed)) for seed, time in enumerate(SECONDS)]
    return light * SECONDS[0], [(photograph.astype(np.float64) - 600) / SPAN for photograph in taken]


def hat(values: list[Floats]) -> Floats:
    """Return the mean weighed by a hat over the middle of the range [Debevec1997]."""
    weights = [np.maximum(0.5 - np.abs(value - 0.5), 1e-6) for value in values]
    above = sum(weight * value / time for weight, value, time in zip(weights, values, T, strict=False))
    return np.asarray(above / sum(weights))


def ours(values: list[Floats], noise: NoiseModel | None) -> Floats:
    """Return the merged light."""
    return merge_exposures(values, [value >= 1 for value in values], T[: len(values)], noise).value


def by_opencv(merge: Callable[..., NDArray[np.float32]], bytes_: list[NDArray[np.uint8]]) -> Floats:
    """Return OpenCV's light, in a unit of its own."""
    times = np.array(SECONDS[: len(bytes_)], np.float32)
    return np.asarray(merge(bytes_, times), dtype=np.float64)  # its response is linear


def bound(light: Floats, seen: NDArray[np.bool_], count: int) -> float:
    """Return the Cramér-Rao bound on the root mean square relative error, of exposures that are not full."""
    information = np.zeros_like(light)
    for time in T[:count]:
        information += np.where(light * time < 1, time**2 / (NOISE.gain * light * time + NOISE.read**2), 0)
    return float(np.sqrt(np.mean(1 / (information * light**2)[seen & (light < 1)])))


def run() -> dict[str, object]:
    """Return the rows."""
    light, all_values = photographs()
    seen = all_values[0] < 1
    coarse = NoiseModel(NOISE.gain, float(np.hypot(NOISE.read, 1 / 255 / np.sqrt(12))))
    rows: list[dict[str, object]] = []
    of_bound: list[float] = []
    for count in (1, 2, 4, 6):
        values = all_values[:count]
        bytes_ = [np.clip(np.rint(value * 255), 0, 255).astype(np.uint8) for value in values]
        work: dict[str, Callable[[], Floats]] = {
            "ours, 14 bits": partial(ours, values, NOISE),
            "ours, photon noise alone, 14 bits": partial(ours, values, None),
            "hat weights, 14 bits": partial(hat, values),
            "ours, 8 bits": partial(ours, [part / 255.0 for part in bytes_], coarse),
            "OpenCV Debevec, 8 bits": partial(by_opencv, cv2.createMergeDebevec().process, bytes_),
            "OpenCV Robertson, 8 bits": partial(by_opencv, cv2.createMergeRobertson().process, bytes_),
        }
        for name, make in work.items():
            relative = (make() / light)[seen]
            if "OpenCV" in name:
                relative = relative / np.median(relative)
            error = float(np.sqrt(np.mean((relative - 1) ** 2)))
            note = f"median error {100 * np.median(np.abs(relative - 1)):.2g} %"
            note += f", mean off by {100 * (relative.mean() - 1):+.2g} %"
            if name == "ours, 14 bits":
                least = bound(light, seen, count)
                of_bound.append(error / least)
                note += f"; the Cramér-Rao bound is {least:.4g}"
            exposures = f"{count} exposure{'s' if count > 1 else ''}"
            row = {"series": name, "parameter": exposures, "error": error, "note": note}
            rows.append({**row, "seconds": seconds(make, repeats=3)})
    promise = Promise("error beside the Cramér-Rao bound, 1 to 6 exposures", max(of_bound), 1.05, "error", unit="×")
    return {"title": "Bracketed photographs", "rows": rows, "promises": [promise]}


if __name__ == "__main__":
    program("bracket", run)
