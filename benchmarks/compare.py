"""A turned and shifted rendering brought back: run time against error, ours beside OpenCV; and a comparison's parts.

The pictures are sparkles integrated over pixels, with 2 % noise, turned about the middle and shifted by known amounts.
The error is how far the farthest corner of the picture would lie from its place.
"""

from __future__ import annotations

from functools import partial

import cv2
import numpy as np
from curves import Row, seconds, write
from numpy.typing import NDArray
from scipy.special import ndtr

from stimuli.align.homography import mapped
from stimuli.comparison.registering import align
from stimuli.pictures.rows import RowFile

Floats = NDArray[np.float64]
Floats32 = NDArray[np.float32]
SIZE = (900, 700)
MOVES = ((0.4, 0.0, 0.0), (7.3, -4.1, 0.1), (3.0, 2.0, 1.5), (-5.0, 9.0, -20.0))
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
            error = _error(work(), move)
            taken = seconds(work, repeats=3)
            name = f"({move[0]:g}, {move[1]:g}) px, {move[2]:g}°"
            note = "corner off, px" if np.isfinite(error) else "not found"
            rows.append({"series": method, "parameter": name, "seconds": taken, "error": min(error, 1e3), "note": note})
    return {"title": f"A rendering of {SIZE[0]} × {SIZE[1]} pixels brought onto its photograph", "rows": rows}


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
    result = run()
    write("compare", str(result["title"]), result["rows"])
