"""A turned and shifted rendering brought back, and the scale of its depth: run time against error, beside OpenCV.

The pictures are sparkles integrated over pixels, with 2 % noise, turned about the middle and shifted by known amounts.
The error is how far the farthest corner of the picture would lie from its place.
"""

from __future__ import annotations

from functools import partial

import cv2
import numpy as np
from curves import Row, answer_and_seconds, program, row, sized
from numpy.typing import NDArray
from promises import Promise, worst
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.special import ndtr

from documents.arrays import Floats, Floats32
from stimuli.align.homography import mapped
from stimuli.comparison.binocular import measure_binocular
from stimuli.comparison.eye_identity import ViewPair
from stimuli.comparison.registering import align
from stimuli.pictures.rows import RowFile

SIZE = sized((900, 700), (300, 240))
MOVES = sized(((0.4, 0.0, 0.0), (7.3, -4.1, 0.1), (3.0, 2.0, 1.5), (-5.0, 9.0, -20.0)), ((3.0, 2.0, 1.5),))
METHODS = ("squares", "OpenCV, SIFT alone", "OpenCV, ECC", "OpenCV, SIFT then ECC")


def run() -> dict[str, object]:
    """Time each method on each move."""
    rows: list[Row] = []
    still = _plate(0.0, 0.0, 0.0, 1)
    for move in MOVES:
        moved = _plate(*move, 2)
        files = RowFile.of(still), RowFile.of(moved)
        for method in METHODS:
            work = partial(_found, method, still[..., 1], moved[..., 1], files)
            found, taken = answer_and_seconds(work, repeats=3)
            error = _error(found, move)
            name = f"({move[0]:g}, {move[1]:g}) px, {move[2]:g}°"
            note = "corner off, px" if np.isfinite(error) else "not found"
            rows.append(row(method, name, taken, min(error, 1e3), note=note))
    title = f"A rendering of {SIZE[0]} × {SIZE[1]} pixels brought onto its photograph, and its depth"
    rows += depth()
    promises = [
        Promise("farthest corner", worst(rows, series="squares", parameter="°"), 0.02, "error", unit="px"),
        Promise("scale of depth, relative", worst(rows, series="squares", parameter="noise"), 5e-3, "error"),
    ]
    return {"title": title, "rows": rows, "promises": promises}


def depth() -> list[Row]:
    """Time how depth is compared where the base is 1.2 times the photograph's, by squares and by OpenCV's SGBM."""
    rows: list[Row] = []
    shape = sized((480, 640), (160, 240))
    everywhere = np.ones(shape, dtype=np.bool_)
    for noise in sized((0.0, 0.01, 0.05), (0.01,)):
        photo, rendering = (_relief(shape, base, noise) for base in (1.0, 1.2))
        for method in ("squares", "OpenCV, SGBM"):
            if method == "squares":
                work = partial(_scale_by_squares, photo, rendering, everywhere)
            else:
                work = partial(_scale_by_sgbm, photo, rendering)
            found, taken = answer_and_seconds(work, repeats=3)
            error = abs(found / 1.2 - 1.0)
            note = "scale of depth, relative error"
            rows.append(row(method, f"noise {noise:g}", taken, error, note=note))
    return rows


def _scale_by_squares(photo: ViewPair, rendering: ViewPair, everywhere: NDArray[np.bool_]) -> float:
    return measure_binocular(photo, rendering, everywhere, ~everywhere).measures["depth scale"].rendering


def _scale_by_sgbm(photo: ViewPair, rendering: ViewPair) -> float:
    """Return the slope of dense disparities by least squares, where both are known."""
    matcher = cv2.StereoSGBM.create(-16, 32, 7, 8 * 49, 32 * 49, 1, 0, 10, 50, 2)
    # OpenCV counts disparities from right to left.
    found = [-matcher.compute(_byte(pair[0]), _byte(pair[1])) / 16.0 for pair in (photo, rendering)]
    known = (np.abs(found[0]) < 15) & (np.abs(found[1]) < 15)
    return float(np.polyfit(found[0][known], found[1][known], 1)[0])


def _relief(shape: tuple[int, int], base: float, noise: float) -> ViewPair:
    """Return a textured scene with waves of depth, of 3 px of disparity."""
    height, width = shape
    rng = np.random.default_rng(3)
    rough = sum(gaussian_filter(rng.standard_normal((height, width + 80)), sd) * sd for sd in (1.0, 2.0, 4.0))
    light = 20 * np.exp(0.35 * rough / np.std(rough))
    y, x = np.mgrid[:height, :width].astype(np.float64)
    moved = base * 3 * np.sqrt(2) * np.sin(3 * np.pi * x / width) * np.cos(2 * np.pi * y / height)
    views = [map_coordinates(light, [y, x + 40 + side * moved], order=3) for side in (0.5, -0.5)]
    draw = np.random.default_rng(round(10 * base))
    left, right = (np.asarray(v * (1 + noise * draw.standard_normal(shape)), dtype=np.float32) for v in views)
    return left, right


def _found(method: str, one: Floats32, two: Floats32, files: tuple[RowFile, RowFile]) -> Floats | None:
    if method == "squares":
        return align(*files, "auto").matrix
    start = np.eye(2, 3, dtype=np.float32)
    if "SIFT" in method:
        found = _sift(one, two)
        if found is None or "ECC" not in method:
            return found
        start = found[:2].astype(np.float32)
    criteria = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 100, 1e-6)
    try:
        _, matrix = cv2.findTransformECC(_byte(one), _byte(two), start, cv2.MOTION_EUCLIDEAN, criteria, None, 5)
    except cv2.error:
        return None
    return np.vstack([matrix, [0, 0, 1]]).astype(np.float64)


def _sift(one: Floats32, two: Floats32) -> Floats | None:
    detector = cv2.SIFT.create(nfeatures=4000)
    seen = [detector.detectAndCompute(_byte(plane), None) for plane in (one, two)]
    pairs = cv2.BFMatcher().knnMatch(seen[0][1], seen[1][1], k=2)
    good = [first for first, second in pairs if first.distance < 0.8 * second.distance]
    source = np.array([seen[0][0][match.queryIdx].pt for match in good])
    target = np.array([seen[1][0][match.trainIdx].pt for match in good])
    matrix, _ = cv2.estimateAffinePartial2D(source, target, method=cv2.RANSAC, ransacReprojThreshold=2.0)
    return None if matrix is None else np.vstack([matrix, [0, 0, 1]])


def _byte(plane: Floats32) -> NDArray[np.uint8]:
    low, high = np.percentile(plane, [0.5, 99.5])
    return np.asarray(np.round(255 * np.sqrt(np.clip((plane - low) / (high - low), 0, 1))), dtype=np.uint8)


def _error(matrix: Floats | None, move: tuple[float, float, float]) -> float:
    if matrix is None:
        return float("inf")
    width, height = SIZE
    corners = np.array([[0, 0], [width - 1, 0], [0, height - 1], [width - 1, height - 1]], dtype=np.float64)
    return float(np.hypot(*(mapped(matrix, corners) - _turned(corners, *move)).T).max())


def _turned(places: Floats, dx: float, dy: float, angle_deg: float) -> Floats:
    middle = np.array([(SIZE[0] - 1) / 2, (SIZE[1] - 1) / 2])
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    return np.asarray((places - middle) @ np.array([[c, s], [-s, c]]) + middle + (dx, dy))


def _plate(dx: float, dy: float, angle_deg: float, seed: int) -> Floats32:
    rng = np.random.default_rng(0)
    places = _turned(rng.uniform([-150, -150], [SIZE[0] + 150, SIZE[1] + 150], (6000, 2)), dx, dy, angle_deg)
    light = 60.0 * rng.lognormal(0.0, 0.6, 6000)
    across, down = (
        np.diff(ndtr((np.arange(length + 1) - 0.5 - places[:, axis, None]) / 0.9), axis=1)
        for axis, length in ((0, SIZE[0]), (1, SIZE[1]))
    )
    plane = 20.0 + (down * light[:, None]).T @ across
    plane *= 1 + 0.02 * np.random.default_rng(seed).standard_normal(plane.shape)
    return np.repeat(plane[..., None], 3, axis=2).astype(np.float32)


if __name__ == "__main__":
    program("compare", run)
