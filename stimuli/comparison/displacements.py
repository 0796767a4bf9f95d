"""How a rendering lies beside its photograph: roughly, by one shift or by features, and closely, by squares.

A first guess is one shift for the whole picture (phase correlation), or, where that fails, a similarity from features
that both have [Lowe2004]. Squares of the photograph are then each registered in the rendering to a fraction of a pixel,
and a similarity is fitted to their displacements.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from documents import Finding
from documents.arrays import Floats, Floats32
from documents.text import significant
from stimuli.align.homography import mapped
from stimuli.align.warping import warp
from stimuli.comparison.sharpness import blur_between, blurred
from stimuli.errors import StimulusError
from stimuli.pictures.rows import RowFile, block_means

# Features are trusted within this; more is another picture size, which resampling by points would alias.
MOST_SCALE = 1.1
_START_PIXELS = 1 << 20
_LEAST_INLIERS, _LEAST_INLIER_SHARE = 12, 0.15
LEAST_SQUARES = 3
_SQUARES_ACROSS = 6
_SQUARE_PX = (48, 192)
_KNOWN_PX = 0.1


def guess_alignment(photo: RowFile, rendering: RowFile) -> tuple[Floats, str]:
    """Return a first guess: one shift for all, or, where that fails, a similarity from features."""
    from stimuli.align.registration import register_planes

    (photo_plane, bin_px), (rendering_plane, rendering_bin_px) = _small_plane(photo), _small_plane(rendering)
    reason: StimulusError | None = None
    blur_bins = blur_between(photo_plane, rendering_plane)
    photo_plane, rendering_plane = blurred(photo_plane, blur_bins), blurred(rendering_plane, -blur_bins)
    if photo.shape == rendering.shape:
        try:
            registration = register_planes(photo_plane, rendering_plane, names=("photograph's", "rendering's"))
            return move(np.array(registration.shift_px) * bin_px), "shift"
        except StimulusError as error:
            reason = error
    similarity = _features(photo_plane, rendering_plane)
    if similarity is None:
        if reason is None:
            raise sizes_differ(photo, rendering, "crop them alike, or give --photo-corners and --rendering-corners")
        raise StimulusError(
            [
                Finding(
                    f"the rendering cannot be brought onto the photograph: {finding.message}",
                    remedy="give --photo-corners and --rendering-corners, or use --register none if they lie alike",
                )
                for finding in reason.findings
            ]
        )
    bring = _binning(rendering_bin_px) @ similarity @ np.linalg.inv(_binning(bin_px))
    size = float(np.sqrt(abs(np.linalg.det(bring[:2, :2]))))
    if not 1.0 / MOST_SCALE < size < MOST_SCALE:
        raise StimulusError(
            Finding(
                f"the rendering is {significant(size)} times as large as the photograph",
                remedy="render or resample it to the photograph's pixels first",
            )
        )
    return bring, "features"


def blur_px(photo: RowFile, rendering: RowFile) -> float:
    """Return by how many pixels' standard deviation the rendering is blurrier, negative if the photograph is.

    0 for pictures of other sizes, whose pixels are not the same.
    """
    if photo.shape != rendering.shape:
        return 0.0
    (photo_plane, bin_px), (rendering_plane, _) = _small_plane(photo), _small_plane(rendering)
    return bin_px * blur_between(photo_plane, rendering_plane)


def _small_plane(picture: RowFile) -> tuple[Floats32, int]:
    """Return Y as means over squares, so that it has at most about a million, and a square's side."""
    height, width = picture.shape[:2]
    bin_px = int(np.ceil(np.sqrt(height * width / _START_PIXELS)))
    return block_means(picture, bin_px, 1), bin_px


def _features(photo: Floats32, rendering: Floats32) -> Floats | None:
    """Return the similarity from one plane's places to the other's by features that both have, or None."""
    import cv2

    detector = cv2.SIFT.create(nfeatures=4000)
    seen = [detector.detectAndCompute(_bytes(plane), None) for plane in (photo, rendering)]
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
    """Return the matrix (3, 3) from places on a grid of squares of ``bin_px`` to places in pixels."""
    half = (bin_px - 1) / 2.0
    return np.array([[bin_px, 0.0, half], [0.0, bin_px, half], [0.0, 0.0, 1.0]])


def sizes_differ(photo: RowFile, rendering: RowFile, remedy: str) -> StimulusError:
    """Return the error on two pictures of different size."""
    (height, width), (other_height, other_width) = photo.shape[:2], rendering.shape[:2]
    return StimulusError(
        Finding(
            f"the photograph is {width} × {height} pixels and the rendering {other_width} × {other_height}",
            remedy=remedy,
        )
    )


@dataclass(frozen=True, eq=False, slots=True)
class SquareShifts:
    """Where squares of the photograph lie: ``middle_px``, ``moved_px`` and standard error, (n, 2) each.

    ``moved_px`` is where a square lies in the rendering as brought, minus where it lies in the photograph. ``of`` were
    looked at; the others are flat, alike, or have nothing in common.
    """

    middle_px: Floats
    moved_px: Floats
    standard_error_px: Floats
    of: int

    @property
    def residual_px(self) -> float | None:
        """Root mean square of how far squares lie apart, without the farthest twentieth; None of fewer than three."""
        parts = []
        for axis in (0, 1):
            known = self.moved_px[self.standard_error_px[:, axis] < _KNOWN_PX, axis]
            if len(known) < LEAST_SQUARES:
                return None
            kept = np.sort(known**2)[: max(LEAST_SQUARES, int(np.ceil(0.95 * len(known))))]
            parts.append(float(kept.mean()))
        return float(np.sqrt(sum(parts)))


def measure_squares(photo: RowFile, rendering: RowFile, matrix: Floats, blur_px: float = 0.0) -> SquareShifts:
    """Return how squares of the photograph lie in the rendering once ``matrix`` is undone.

    The sharper of both is blurred by ``blur_px``, which is negative if that is the rendering: see `blur_px`.
    """
    from stimuli.align.registration import register_planes

    height, width = photo.shape[:2]
    side = int(np.clip(min(height, width) // 4, *_SQUARE_PX))
    side = min(side, height, width)
    if side < 32:
        return SquareShifts(np.empty((0, 2)), np.empty((0, 2)), np.empty((0, 2)), 0)
    across = max(2, min(_SQUARES_ACROSS, 2 * width // side))
    down = max(2, min(_SQUARES_ACROSS, 2 * height // side))
    rows: list[tuple[float, ...]] = []
    plain = np.array_equal(matrix, np.eye(3))
    beyond = int(np.ceil(4 * abs(blur_px)))
    for top in np.linspace(0, height - side, down).round().astype(int).tolist():
        begin = max(0, top - beyond)
        band = blurred(np.ascontiguousarray(photo[begin : top + side + beyond][:, :, 1]), blur_px)[top - begin :][:side]
        for left in np.linspace(0, width - side, across).round().astype(int).tolist():
            photo_square = np.ascontiguousarray(band[:, left : left + side])
            box = np.array([[0, 0], [side, 0], [side, side], [0, side]]) + [left, top]
            seen = mapped(matrix, box.astype(np.float64))
            low = np.maximum(np.floor(seen.min(axis=0)).astype(int) - 16 - beyond, 0)
            high = np.minimum(
                np.ceil(seen.max(axis=0)).astype(int) + 17 + beyond, [rendering.shape[1], rendering.shape[0]]
            )
            if not (np.all(seen > -0.5) and np.all(seen < [rendering.shape[1] + 0.5, rendering.shape[0] + 0.5])):
                continue
            part = rendering[int(low[1]) : int(high[1])][:, int(low[0]) : int(high[0]), 1]
            part = blurred(np.ascontiguousarray(part), -blur_px)
            if plain:
                rendering_square = np.ascontiguousarray(part[top - low[1] :, left - low[0] :][:side, :side])
            else:
                rendering_square = warp(
                    part[:, :, None], move(-low) @ matrix @ move((left, top)), (side, side)
                ).picture[:, :, 0]
            try:
                registration = register_planes(photo_square, rendering_square, most_px=(side // 4, side // 4))
            except StimulusError:
                continue
            middle = (left + (side - 1) / 2, top + (side - 1) / 2)
            rows.append((*middle, *registration.shift_px, *registration.standard_error_px))
    table = np.array(rows, dtype=np.float64).reshape(-1, 6)
    return SquareShifts(table[:, :2], table[:, 2:4], table[:, 4:6], across * down)


def move(by: ArrayLike) -> Floats:
    """Return the matrix (3, 3) of a shift (2,)."""
    x, y = np.asarray(by, dtype=np.float64)
    return np.array([[1.0, 0.0, x], [0.0, 1.0, y], [0.0, 0.0, 1.0]])


# A rotation or a scale is undone if it moves the picture's corners by more, and by more than its errors explain.
LEAST_TURN_PX, LEAST_TURN_Z = 0.06, 4.0


@dataclass(frozen=True, eq=False, slots=True)
class Similarity:
    """``values``: shift across and down, relative growth, rotation in radians; their covariance, and of the shift."""

    values: Floats
    covariance: Floats
    shift: Floats
    shift_covariance: Floats

    def turns(self, shape: tuple[int, ...]) -> bool:
        """Whether rotation or growth is more than noise, and moves the corners by more than next to nothing."""
        half = 0.5 * float(np.hypot(shape[0], shape[1]))
        for value, variance in zip(self.values[2:], np.diag(self.covariance)[2:], strict=True):
            if abs(value) * half > LEAST_TURN_PX and abs(value) > LEAST_TURN_Z * float(np.sqrt(variance)):
                return True
        return False

    def matrix(self, turned: bool, shape: tuple[int, ...]) -> Floats:
        """Return it as a matrix (3, 3): all of it if ``turned``, else the shift alone."""
        if not turned:
            return move(self.shift)
        x, y, growth, angle = self.values
        centre = middle(shape)
        linear = (1.0 + growth) * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        matrix = np.eye(3)
        matrix[:2, :2] = linear
        matrix[:2, 2] = centre + (x, y) - linear @ centre
        return matrix

    def errors(self, turned: bool) -> Floats:
        """Return the standard errors (4,) of shift, growth and rotation in `matrix`; infinite where it has none."""
        if turned:
            return np.asarray(np.sqrt(np.diag(self.covariance)))
        return np.concatenate([np.sqrt(np.diag(self.shift_covariance)), [np.inf, np.inf]])


def fit_similarity(shifts: SquareShifts, shape: tuple[int, ...]) -> Similarity:
    """Fit both by least squares, weighted by the squares' errors, without squares that stray from the others."""
    at = shifts.middle_px - middle(shape)
    zeros, ones = np.zeros(len(at)), np.ones(len(at))
    rows = np.concatenate(
        [np.stack([ones, zeros, at[:, 0], -at[:, 1]], axis=1), np.stack([zeros, ones, at[:, 1], at[:, 0]], axis=1)]
    )
    moved = shifts.moved_px.T.ravel()
    # Standard errors below a hundredth are not reliable; those along an edge are large, and have no weight.
    weight = 1.0 / (np.minimum(shifts.standard_error_px.T.ravel(), 1e3) ** 2 + 0.01**2)
    values, covariance = _weighted(rows, moved, weight)
    shift, shift_covariance = _weighted(rows[:, :2], moved, weight)
    return Similarity(values, covariance, shift, shift_covariance)


def _weighted(rows: Floats, moved: Floats, weight: Floats) -> tuple[Floats, Floats]:
    kept = np.ones(len(moved), dtype=bool)
    values = np.zeros(rows.shape[1])
    covariance = np.full((rows.shape[1], rows.shape[1]), np.inf)
    for _ in range(4):
        normal = rows[kept].T @ (rows[kept] * weight[kept, None])
        if np.linalg.matrix_rank(normal) < len(normal):
            break
        inverse = np.linalg.inv(normal)
        values = inverse @ (rows[kept].T @ (moved[kept] * weight[kept]))
        off = (moved - rows @ values) * np.sqrt(weight)
        free = max(1, int(kept.sum()) - len(values))
        covariance = inverse * max(1.0, float(np.sum(off[kept] ** 2)) / free)
        usual = max(1.0, 1.4826 * float(np.median(np.abs(off))))
        now = np.abs(off) < 4.0 * usual
        if np.array_equal(now, kept) or now.sum() < len(values) + 2:
            break
        kept = now
    return np.asarray(values), np.asarray(covariance)


def middle(shape: tuple[int, ...]) -> Floats:
    """Return the place of a picture's middle, x and y."""
    return np.array([(shape[1] - 1) / 2.0, (shape[0] - 1) / 2.0])
