"""Where a rendering lies against its photograph: shifted, turned, larger, or between four corners; and what is left.

A first guess comes from four corners, from one shift for the whole (phase correlation), or, where that fails, from
features that both have, at any angle [Lowe2004]. Then squares spread over the picture are registered each on its own
to a fraction of a pixel, and a shift, or a similarity if the squares ask for one, is fitted to what they say. What
they say after it is undone is the residual.

Places are in pixels of the middle of a pixel, x to the right and y down; an angle is positive clockwise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from documents import Finding
from runner.comparing.row_file import RowFile
from stimuli.errors import StimulusError

Floats = NDArray[np.float64]
Floats32 = NDArray[np.float32]
Registering = Literal["auto", "none", "corners"]

# Displacements below this are not worth an interpolation.
STILL_PX = 0.02
# A rotation or a scale is undone if it moves the picture's corners by more, and by more than its errors explain.
LEAST_TURN_PX, LEAST_TURN_Z = 0.06, 4.0
# Features are trusted within this; more is another picture size, which resampling by points would alias.
MOST_SCALE = 1.1
_START_PIXELS = 1 << 20
_SQUARES_ACROSS = 6
_SQUARE_PX = (48, 192)
_LEAST_SQUARES = 3
_KNOWN_PX = 0.1
_ROUNDS = 5
_LEAST_INLIERS, _LEAST_INLIER_SHARE = 12, 0.15


@dataclass(frozen=True, eq=False, slots=True)
class Field:
    """What squares of the photograph say: ``middle_px``, ``moved_px`` and standard error, (n, 2) each.

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
            if len(known) < _LEAST_SQUARES:
                return None
            kept = np.sort(known**2)[: max(_LEAST_SQUARES, int(np.ceil(0.95 * len(known))))]
            parts.append(float(kept.mean()))
        return float(np.sqrt(sum(parts)))


@dataclass(frozen=True, eq=False, slots=True)
class Placing:
    """How the rendering was brought to the photograph's pixels.

    ``matrix`` (3, 3) takes a place of the photograph to the rendering. ``shift_px``, ``rotation_deg`` and ``scale`` are
    what it does to the photograph's middle, with their standard errors where squares told them. ``residual_px`` is left
    after it, None where nothing could be measured; ``apart_px`` was there before. ``start`` says how it was begun.
    """

    matrix: Floats
    start: str
    shift_px: tuple[float, float]
    shift_se_px: tuple[float, float] | None
    rotation_deg: float
    rotation_se_deg: float | None
    scale: float
    residual_px: float | None
    squares: int
    squares_of: int
    moved: bool

    def to_json(self) -> dict[str, Any]:
        """Return the numbers by name."""
        told = {name: getattr(self, name) for name in self.__dataclass_fields__ if name != "matrix"}
        for name in ("shift_px", "shift_se_px"):
            told[name] = None if told[name] is None else list(told[name])
        return {**told, "photo_to_rendering": self.matrix.tolist()}

    def sentences(self) -> list[str]:
        """Say how the rendering lies."""
        told = []
        ways = [_way(self.shift_px[0], "further right", "further left"), _way(self.shift_px[1], "lower", "higher")]
        if any(ways):
            told.append(f"the rendering lies {' and '.join(way for way in ways if way)} than the photograph")
        if self.rotation_deg and abs(self.rotation_deg) >= 5e-4:
            sign = "clockwise" if self.rotation_deg > 0 else "anticlockwise"
            error = "" if self.rotation_se_deg is None else f" ± {self.rotation_se_deg:.3f}"
            told.append(f"the rendering is turned {abs(self.rotation_deg):.3f}{error}° {sign}")
        if abs(self.scale - 1.0) >= 5e-5:
            told.append(f"the rendering is {self.scale:.4f} times as large")
        return told

    def remarks(self) -> list[str]:
        """Say what the verdict does not."""
        told = [f"the rendering is {self.scale:.4f} times as large"] if abs(self.scale - 1.0) >= 5e-5 else []
        if self.residual_px is None:
            told.append("how far the pictures lie apart could not be measured: their textures have nothing in common")
        return told


def _way(value: float, more: str, less: str) -> str:
    return f"{abs(value):.2f} px {more if value >= 0 else less}" if abs(value) >= STILL_PX else ""


def place(
    photo: RowFile, rendering: RowFile, mode: Registering, corners: tuple[ArrayLike, ArrayLike] | None = None
) -> Placing:
    """Return where ``rendering`` lies; ``corners`` are four places (4, 2) of either, for the mode ``corners``.

    Raises
    ------
    StimulusError
        If the sizes differ and the mode is ``none``, or no place was found.
    """
    if mode == "none":
        if photo.shape != rendering.shape:
            raise _sizes(photo, rendering, "let them be registered (--register auto or corners), or crop them alike")
        return _told(np.eye(3), "as they are", squares(photo, rendering, np.eye(3)), None, photo.shape, moved=False)
    if mode == "corners":
        from stimuli.align.homography import homography_from_points

        if corners is None:
            raise StimulusError(Finding("no corners are given", remedy="say --photo-corners and --rendering-corners"))
        matrix, start = homography_from_points(*corners).matrix, "corners"
    else:
        matrix, start = _start(photo, rendering)
    return _refined(photo, rendering, matrix, start)


def _refined(photo: RowFile, rendering: RowFile, matrix: Floats, start: str) -> Placing:
    """Fit a shift, or a similarity, to the squares until they ask for no more."""
    errors: Floats | None = None
    turned = start != "shift"
    if photo.shape == rendering.shape and _reach(matrix, photo.shape) < STILL_PX:
        matrix = np.eye(3)
    field = squares(photo, rendering, matrix)
    for _ in range(_ROUNDS):
        if len(field.middle_px) < _LEAST_SQUARES:
            break
        fit = _similarity(field, photo.shape)
        turned = turned or fit.turns(photo.shape)
        move, errors = fit.matrix(turned, photo.shape), fit.errors(turned)
        reach = _reach(move, photo.shape)
        if reach < STILL_PX / 4:
            break
        candidate = np.asarray(matrix @ move)
        found = squares(photo, rendering, candidate)
        before, after = field.residual_px, found.residual_px
        if before is not None and (after is None or after > before):
            break
        matrix, field = candidate / candidate[2, 2], found
    still = photo.shape == rendering.shape and _reach(matrix, photo.shape) < STILL_PX
    if still:
        # As good as where it was: nothing is interpolated.
        if not np.array_equal(matrix, np.eye(3)):
            field = squares(photo, rendering, np.eye(3))
        return _told(np.eye(3), start, field, errors, photo.shape, moved=False)
    return _told(matrix, start, field, errors, photo.shape, moved=True)


def _told(
    matrix: Floats, start: str, field: Field, errors: Floats | None, shape: tuple[int, ...], *, moved: bool
) -> Placing:
    middle = _middle(shape)
    from stimuli.align.homography import mapped

    step = 0.5
    across = mapped(matrix, middle + [step, 0]) - mapped(matrix, middle - [step, 0])
    down = mapped(matrix, middle + [0, step]) - mapped(matrix, middle - [0, step])
    shift = mapped(matrix, middle) - middle
    if not moved and len(field.middle_px) >= _LEAST_SQUARES:
        fit = _similarity(field, shape)
        shift = np.where(np.abs(fit.values[:2]) > 0, fit.values[:2], shift)
        errors = fit.errors(True)
        rotation = float(np.degrees(fit.values[3])) if fit.turns(shape) else 0.0
        scale = 1.0 + (float(fit.values[2]) if fit.turns(shape) else 0.0)
    else:
        rotation = float(np.degrees(np.arctan2(across[1] - down[0], across[0] + down[1])))
        scale = float(np.sqrt(abs(across[0] * down[1] - across[1] * down[0])))
    # The angle of a matrix is that of where things lie; rounding is none.
    rotation = 0.0 if abs(rotation) < 1e-9 else rotation
    return Placing(
        matrix,
        start,
        (float(shift[0]), float(shift[1])),
        None if errors is None else (float(errors[0]), float(errors[1])),
        rotation,
        None if errors is None or not np.isfinite(errors[3]) else float(np.degrees(errors[3])),
        1.0 if abs(scale - 1.0) < 1e-9 else scale,
        field.residual_px,
        len(field.middle_px),
        field.of,
        moved,
    )


def squares(photo: RowFile, rendering: RowFile, matrix: Floats) -> Field:
    """Return how squares of the photograph lie in the rendering once ``matrix`` is undone."""
    from stimuli.align.homography import mapped, warp
    from stimuli.align.register import register_planes

    height, width = photo.shape[:2]
    side = int(np.clip(min(height, width) // 4, *_SQUARE_PX))
    side = min(side, height, width)
    if side < 32:
        return Field(np.empty((0, 2)), np.empty((0, 2)), np.empty((0, 2)), 0)
    across = max(2, min(_SQUARES_ACROSS, 2 * width // side))
    down = max(2, min(_SQUARES_ACROSS, 2 * height // side))
    found: list[tuple[float, ...]] = []
    plain = np.array_equal(matrix, np.eye(3))
    for top in np.linspace(0, height - side, down).round().astype(int).tolist():
        band = photo[top : top + side][:, :, 1]
        for left in np.linspace(0, width - side, across).round().astype(int).tolist():
            one = np.ascontiguousarray(band[:, left : left + side])
            box = np.array([[0, 0], [side, 0], [side, side], [0, side]]) + [left, top]
            seen = mapped(matrix, box.astype(np.float64))
            low = np.maximum(np.floor(seen.min(axis=0)).astype(int) - 16, 0)
            high = np.minimum(np.ceil(seen.max(axis=0)).astype(int) + 17, [rendering.shape[1], rendering.shape[0]])
            if not (np.all(seen > -0.5) and np.all(seen < [rendering.shape[1] + 0.5, rendering.shape[0] + 0.5])):
                continue
            part = rendering[int(low[1]) : int(high[1])][:, int(low[0]) : int(high[0]), 1]
            if plain:
                two = np.ascontiguousarray(part[top - low[1] :, left - low[0] :][:side, :side])
            else:
                two = warp(part[:, :, None], _move(-low) @ matrix @ _move((left, top)), (side, side)).picture[:, :, 0]
            try:
                lies = register_planes(one, two, most_px=(side // 4, side // 4))
            except StimulusError:
                continue
            middle = (left + (side - 1) / 2, top + (side - 1) / 2)
            found.append((*middle, *lies.shift_px, *lies.standard_error_px))
    table = np.array(found, dtype=np.float64).reshape(-1, 6)
    return Field(table[:, :2], table[:, 2:4], table[:, 4:6], across * down)


@dataclass(frozen=True, eq=False, slots=True)
class _Similarity:
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
        if not turned:
            return _move(self.shift)
        x, y, growth, angle = self.values
        middle = _middle(shape)
        linear = (1.0 + growth) * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        found = np.eye(3)
        found[:2, :2] = linear
        found[:2, 2] = middle + (x, y) - linear @ middle
        return found

    def errors(self, turned: bool) -> Floats:
        if turned:
            return np.asarray(np.sqrt(np.diag(self.covariance)))
        return np.concatenate([np.sqrt(np.diag(self.shift_covariance)), [np.inf, np.inf]])


def _similarity(field: Field, shape: tuple[int, ...]) -> _Similarity:
    """Fit both by least squares, weighted by the squares' errors, without squares that stray from the others."""
    at = field.middle_px - _middle(shape)
    zero, one = np.zeros(len(at)), np.ones(len(at))
    rows = np.concatenate(
        [np.stack([one, zero, at[:, 0], -at[:, 1]], axis=1), np.stack([zero, one, at[:, 1], at[:, 0]], axis=1)]
    )
    said = field.moved_px.T.ravel()
    # Standard errors below a hundredth are not to be believed; those along an edge are large, and weigh nothing.
    weight = 1.0 / (np.minimum(field.standard_error_px.T.ravel(), 1e3) ** 2 + 0.01**2)
    values, covariance = _weighted(rows, said, weight)
    shift, shift_covariance = _weighted(rows[:, :2], said, weight)
    return _Similarity(values, covariance, shift, shift_covariance)


def _weighted(rows: Floats, said: Floats, weight: Floats) -> tuple[Floats, Floats]:
    kept = np.ones(len(said), dtype=bool)
    values = np.zeros(rows.shape[1])
    covariance = np.full((rows.shape[1], rows.shape[1]), np.inf)
    for _ in range(4):
        normal = rows[kept].T @ (rows[kept] * weight[kept, None])
        if np.linalg.matrix_rank(normal) < len(normal):
            break
        inverse = np.linalg.inv(normal)
        values = inverse @ (rows[kept].T @ (said[kept] * weight[kept]))
        off = (said - rows @ values) * np.sqrt(weight)
        free = max(1, int(kept.sum()) - len(values))
        covariance = inverse * max(1.0, float(np.sum(off[kept] ** 2)) / free)
        usual = max(1.0, 1.4826 * float(np.median(np.abs(off))))
        now = np.abs(off) < 4.0 * usual
        if np.array_equal(now, kept) or now.sum() < len(values) + 2:
            break
        kept = now
    return np.asarray(values), np.asarray(covariance)


def _start(photo: RowFile, rendering: RowFile) -> tuple[Floats, str]:
    """Return a first guess: one shift for all, or, where that fails, a similarity from features."""
    from stimuli.align.register import register_planes

    (one, bin_px), (two, other_px) = small_plane(photo), small_plane(rendering)
    reason: StimulusError | None = None
    if photo.shape == rendering.shape:
        try:
            lies = register_planes(one, two, names=("photograph's", "rendering's"))
            return _move(np.array(lies.shift_px) * bin_px), "shift"
        except StimulusError as error:
            reason = error
    found = _features(one, two)
    if found is None:
        if reason is None:
            raise _sizes(photo, rendering, "crop them alike, or give --photo-corners and --rendering-corners")
        raise StimulusError(
            [
                Finding(
                    f"the rendering cannot be brought onto the photograph: {one_.message}",
                    remedy="give --photo-corners and --rendering-corners, or say --register none if they lie alike",
                )
                for one_ in reason.findings
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


def small_plane(picture: RowFile, most_pixels: int = _START_PIXELS) -> tuple[Floats32, int]:
    """Return Y as means over squares, so that it has at most about ``most_pixels``, and a square's side."""
    height, width = picture.shape[:2]
    bin_px = int(np.ceil(np.sqrt(height * width / most_pixels)))
    columns = width // bin_px
    found = np.empty((height // bin_px, columns), dtype=np.float32)
    rows = max(1, (1 << 20) // (width * bin_px))
    for first in range(0, len(found), rows):
        last = min(first + rows, len(found))
        part = picture[first * bin_px : last * bin_px][:, : columns * bin_px, 1]
        found[first:last] = part.reshape(last - first, bin_px, columns, bin_px).mean(axis=(1, 3))
    return found, bin_px


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


def _middle(shape: tuple[int, ...]) -> Floats:
    return np.array([(shape[1] - 1) / 2.0, (shape[0] - 1) / 2.0])


def _move(by: ArrayLike) -> Floats:
    x, y = np.asarray(by, dtype=np.float64)
    return np.array([[1.0, 0.0, x], [0.0, 1.0, y], [0.0, 0.0, 1.0]])


def _reach(matrix: Floats, shape: tuple[int, ...]) -> float:
    """Return how far ``matrix`` moves the corner that it moves farthest."""
    from stimuli.align.homography import mapped

    height, width = shape[:2]
    corners = np.array([[0.0, 0.0], [width - 1, 0.0], [0.0, height - 1], [width - 1, height - 1]])
    return float(np.abs(mapped(matrix, corners) - corners).max())


def _sizes(photo: RowFile, rendering: RowFile, remedy: str) -> StimulusError:
    (height, width), (other_height, other_width) = photo.shape[:2], rendering.shape[:2]
    return StimulusError(
        Finding(
            f"the photograph is {width} × {height} pixels and the rendering {other_width} × {other_height}",
            remedy=remedy,
        )
    )
