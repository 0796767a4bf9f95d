"""Where a rendering lies, roughly: one shift for all, or, where that fails, features that both have [Lowe2004]."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from documents import Finding
from stimuli.comparison.rows import Floats, Floats32, RowFile, block_means
from stimuli.comparison.squares import move
from stimuli.errors import StimulusError

# Features are trusted within this; more is another picture size, which resampling by points would alias.
MOST_SCALE = 1.1
_START_PIXELS = 1 << 20
_LEAST_INLIERS, _LEAST_INLIER_SHARE = 12, 0.15


def guess_alignment(photo: RowFile, rendering: RowFile) -> tuple[Floats, str]:
    """Return a first guess: one shift for all, or, where that fails, a similarity from features."""
    from stimuli.align.registration import register_planes

    (one, bin_px), (two, other_px) = _small_plane(photo), _small_plane(rendering)
    reason: StimulusError | None = None
    if photo.shape == rendering.shape:
        try:
            lies = register_planes(one, two, names=("photograph's", "rendering's"))
            return move(np.array(lies.shift_px) * bin_px), "shift"
        except StimulusError as error:
            reason = error
    found = _features(one, two)
    if found is None:
        if reason is None:
            raise sizes_differ(photo, rendering, "crop them alike, or give --photo-corners and --rendering-corners")
        raise StimulusError(
            [
                Finding(
                    f"the rendering cannot be brought onto the photograph: {finding.message}",
                    remedy="give --photo-corners and --rendering-corners, or say --register none if they lie alike",
                )
                for finding in reason.findings
            ]
        )
    bring = _binning(other_px) @ found @ np.linalg.inv(_binning(bin_px))
    size = float(np.sqrt(abs(np.linalg.det(bring[:2, :2]))))
    if not 1.0 / MOST_SCALE < size < MOST_SCALE:
        raise StimulusError(
            Finding(
                f"the rendering is {size:.3g} times as large as the photograph",
                remedy="render or resample it to the photograph's pixels first",
            )
        )
    return bring, "features"


def _small_plane(picture: RowFile) -> tuple[Floats32, int]:
    """Return Y as means over squares, so that it has at most about a million, and a square's side."""
    height, width = picture.shape[:2]
    bin_px = int(np.ceil(np.sqrt(height * width / _START_PIXELS)))
    return block_means(picture, bin_px, 1), bin_px


def _features(one: Floats32, two: Floats32) -> Floats | None:
    """Return the similarity from one plane's places to the other's by features that both have, or None."""
    import cv2

    detector = cv2.SIFT.create(nfeatures=4000)
    seen = [detector.detectAndCompute(_bytes(plane), None) for plane in (one, two)]
    if any(descriptors is None or len(descriptors) < _LEAST_INLIERS for _, descriptors in seen):
        return None
    pairs = cv2.BFMatcher().knnMatch(seen[0][1], seen[1][1], k=2)
    good = [pair[0] for pair in pairs if len(pair) == 2 and pair[0].distance < 0.8 * pair[1].distance]
    if len(good) < _LEAST_INLIERS:
        return None
    source = np.array([seen[0][0][match.queryIdx].pt for match in good])
    target = np.array([seen[1][0][match.trainIdx].pt for match in good])
    matrix, inliers = cv2.estimateAffinePartial2D(
        source, target, method=cv2.RANSAC, ransacReprojThreshold=2.0, maxIters=5000, confidence=0.9999
    )
    if matrix is None:
        return None
    kept = inliers.ravel().astype(bool)
    # Of two fields of unlike sparkles, many features go to a few.
    apart = min(len(np.unique(np.round(points[kept]), axis=0)) for points in (source, target))
    if apart < max(_LEAST_INLIERS, _LEAST_INLIER_SHARE * len(good)):
        return None
    return np.vstack([np.asarray(matrix, dtype=np.float64), [0.0, 0.0, 1.0]])


def _bytes(plane: Floats32) -> NDArray[np.uint8]:
    low, high = np.percentile(plane, [0.5, 99.5])
    share = np.clip((plane - low) / max(float(high - low), 1e-30), 0.0, 1.0)
    return np.asarray(np.round(255.0 * np.sqrt(share)), dtype=np.uint8)


def _binning(bin_px: int) -> Floats:
    """Return what takes a place among squares of ``bin_px`` to one among pixels."""
    half = (bin_px - 1) / 2.0
    return np.array([[bin_px, 0.0, half], [0.0, bin_px, half], [0.0, 0.0, 1.0]])


def sizes_differ(photo: RowFile, rendering: RowFile, remedy: str) -> StimulusError:
    """Return the error that says so."""
    (height, width), (other_height, other_width) = photo.shape[:2], rendering.shape[:2]
    return StimulusError(
        Finding(
            f"the photograph is {width} × {height} pixels and the rendering {other_width} × {other_height}",
            remedy=remedy,
        )
    )
