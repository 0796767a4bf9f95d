"""A photograph and its rendering brought onto each other: known shifts and rolls found again, a rendering straightened.

A known shift found again: run time against error, ours beside scikit-image; and interpolators beside one another.

The pictures are sparkles integrated over pixels, with 1 % noise and 10 % more light in one of them; and the shipped
plate as a display shows it, whose eyes see sparkles of their own, rendered at a quarter of the pixel and moved by one
of these. Rolls are found beside OpenCV's ECC, which fits all pixels at once; there half of the sparkles lie in depth.

A turned and shifted rendering brought back, and the scale of its depth: run time against error, beside OpenCV.

The pictures are sparkles integrated over pixels, with 2 % noise, turned about the middle and shifted by known amounts.
The error is how far the farthest corner of the picture would lie from its place.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import cv2
import numpy as np
from curves import Row, answer_and_seconds, program, row, seconds, sized
from numpy.typing import NDArray
from promises import Promise, worst
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.special import ndtr
from skimage.registration import phase_cross_correlation

from documents.arrays import Floats, Floats32
from extensions.sparkle import Studio
from stimuli.align.homography import mapped
from stimuli.align.interpolate import cut
from stimuli.align.phase import hann
from stimuli.align.registration import register
from stimuli.align.straightening import straighten
from stimuli.comparison.binocular import measure_binocular
from stimuli.comparison.eye_identity import ViewPair
from stimuli.comparison.registering import align
from stimuli.pictures.rows import RowFile
from stimuli.recipes.recipe import read_recipe

RECIPE = Path(__file__).parents[1] / "configs/stimuli/manitoba_gray.yaml"
SIDE_PX, PITCH_MM = sized(512, 256), 0.277
SHIFTS_PX = sized((-0.5, -0.25, 0.25, 0.75), (0.25,))
METHODS = ("register", "scikit-image, phase", "scikit-image, plain")


def known_shifts() -> dict[str, object]:
    """Time both on made-up sparkles and on the shipped plate, and interpolators on a half-pixel shift."""
    shifts = [row for kind in sized(("sparkles", "plate"), ("sparkles",)) for row in _found(kind)]
    rolls, compared = _rolled(), _compared()
    promises = [
        Promise("a known shift, worst error", worst(shifts, series="register"), 0.02, "error", unit="px"),
        Promise("a roll, in the corners", worst(rolls, series="straighten"), 0.02, "error", unit="px"),
        Promise("a shift and turn as compare finds it", worst(compared, series="compare"), 0.02, "error", unit="px"),
    ]
    rows = [*shifts, *_cut(), *rolls, *compared]
    return {"title": "A known shift found again (error in px)", "rows": rows, "promises": promises}


def _found(kind: str) -> list[Row]:
    reference, moved = _sparkles() if kind == "sparkles" else _plate()
    rows: list[Row] = []
    for method in METHODS:
        still = np.zeros(2) if kind == "sparkles" else _shift(method, reference, moved[0.0])
        errors = [_shift(method, reference, moved[dx]) - still - (dx, 0.0) for dx in SHIFTS_PX]
        taken = seconds(partial(_shift, method, reference, moved[0.25]), repeats=3)
        worst = float(np.abs(errors).max())
        name = f"{kind}, {reference.shape[1]} × {reference.shape[0]}"
        note = f"worst of {len(SHIFTS_PX)} shifts"
        rows.append(row(method, name, taken, worst, note=note))
    return rows


def _shift(method: str, reference: Floats32, moving: Floats32) -> NDArray[np.float64]:
    """Return the shift across and down by one of `METHODS`, scikit-image with Hann's window and hundredths."""
    if method == "register":
        return np.array(register(reference, moving).shift_px)
    window = np.outer(hann(reference.shape[0]), hann(reference.shape[1]))
    found = phase_cross_correlation(
        (reference - reference.mean()) * window,
        (moving - moving.mean()) * window,
        upsample_factor=100,
        normalization="phase" if method.endswith("phase") else None,
    )[0]
    return -np.asarray(found, dtype=np.float64)[::-1]


def _sparkles() -> tuple[Floats32, dict[float, Floats32]]:
    rng = np.random.default_rng(1)
    noise = 0.01 * _spots(0.0).max()
    views = {dx: _spots(dx) * (1.1 if dx else 1.0) for dx in (0.0, *SHIFTS_PX)}
    noisy = {dx: (one + rng.normal(0.0, noise, one.shape)).astype(np.float32) for dx, one in views.items()}
    return noisy[0.0], noisy


def _spots(dx: float, sd_px: float = 0.8) -> NDArray[np.float64]:
    rng = np.random.default_rng(0)
    x, y = rng.uniform(-10, SIDE_PX + 10, (2, 4000))
    edges = np.arange(SIDE_PX + 1) - 0.5
    across, down = (np.diff(ndtr((edges - place[:, None]) / sd_px), axis=1) for place in (x + dx, y))
    return np.asarray(3.6 + (down * rng.lognormal(3.0, 0.7, 4000)[:, None]).T @ across)


def _plate() -> tuple[Floats32, dict[float, Floats32]]:
    recipe, _ = read_recipe(RECIPE)
    studio = Studio(recipe.plate, recipe.lamp, recipe.camera, recipe.seed, PITCH_MM / 4)
    left, right = (one.xyz_cd_m2[:, :, 1] for one in studio.photographs("stereo", 1.0))

    def averaged(view: Floats32, dx: float) -> Floats32:
        height, width = ((length - 32) // 4 for length in view.shape)
        first = 16 - round(4 * dx)
        return view[16 : 16 + 4 * height, first : first + 4 * width].reshape(height, 4, width, 4).mean(axis=(1, 3))

    return averaged(left, 0.0), {dx: averaged(right, dx) for dx in (0.0, *SHIFTS_PX)}


def _rolled() -> list[Row]:
    """Find rolls from the vertical disparities, and by OpenCV; the error is in pixels at the corners."""
    import cv2

    left = _turned(0.0)

    def ours(right: Floats32) -> float:
        return straighten(left, right).roll_scale.roll_deg

    def ecc(right: Floats32) -> float:
        step = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 100, 1e-8)
        start = np.eye(2, 3, dtype=np.float32)
        _, found = cv2.findTransformECC(left[..., 1], right[..., 1], start, cv2.MOTION_EUCLIDEAN, step)
        return float(np.degrees(np.arctan2(found[1, 0], found[0, 0])))

    rows: list[Row] = []
    rights = {roll_deg: _turned(roll_deg) for roll_deg in sized((0.05, 0.2, -0.5), (0.2,))}
    for series, find in (("straighten", ours), ("OpenCV, ECC", ecc)):
        first, taken = answer_and_seconds(partial(find, rights[0.2]), repeats=3)
        errors = [abs((first if roll_deg == 0.2 else find(right)) - roll_deg) for roll_deg, right in rights.items()]
        rows.append(
            row(
                series,
                f"roll, {SIDE_PX} × {SIDE_PX}",
                taken,
                float(np.radians(max(errors)) * SIDE_PX / np.sqrt(2)),
                note=f"worst of {len(rights)} rolls, {max(errors):.4f}°",
            )
        )
    return rows


def _compared() -> list[Row]:
    """Find a shift as `cyclopean compare` does, and by ECC, of a blurred picture too; errors are at the corners."""
    import cv2
    from scipy.ndimage import gaussian_filter

    photo = _spots(0.0)
    rendering = _spots(0.4)
    want = np.array([[1.0, 0.0, 0.4], [0.0, 1.0, 0.0]])
    corners = np.array([[x, y, 1.0] for x in (0, SIDE_PX - 1) for y in (0, SIDE_PX - 1)])
    noise = 0.01 * photo.mean() * np.random.default_rng(2).normal(size=photo.shape)

    def ours(other: Floats32) -> NDArray[np.float64]:
        pair = [RowFile.of(np.repeat(plane[..., None], 3, axis=2)) for plane in (first, other)]
        return align(pair[0], pair[1], "auto").matrix[:2]

    def ecc(other: Floats32) -> NDArray[np.float64]:
        step = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 100, 1e-8)
        start = np.eye(2, 3, dtype=np.float32)
        return np.asarray(cv2.findTransformECC(first, other, start, cv2.MOTION_EUCLIDEAN, step)[1], dtype=np.float64)

    first = photo.astype(np.float32)
    rows: list[Row] = []
    for sd_px in (0.0, 4.0):
        soft = gaussian_filter(rendering, sd_px) if sd_px else rendering
        other = np.asarray(soft + noise, dtype=np.float32)
        for series, find in (("compare", ours), ("OpenCV, ECC", ecc)):
            found, taken = answer_and_seconds(partial(find, other), repeats=3)
            rows.append(
                row(
                    series,
                    f"shift, blur {sd_px:g} px, {SIDE_PX} × {SIDE_PX}",
                    taken,
                    float(np.abs((found - want) @ corners.T).max()),
                    note="shift and turn",
                )
            )
    return rows


def _turned(roll_deg: float) -> Floats32:
    """Return sparkles turned about the middle, half of them aside by their depth, with 1 % noise."""
    rng = np.random.default_rng(4)
    places = rng.uniform(-30, SIDE_PX + 30, (2, 4000)) - (SIDE_PX - 1) / 2
    angle = np.radians(roll_deg)
    x, y = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]) @ places + (SIDE_PX - 1) / 2
    light = rng.lognormal(3.0, 0.7, 4000)
    if roll_deg:
        x[::2] += rng.uniform(-1, 3, 2000)
    edges = np.arange(SIDE_PX + 1) - 0.5
    across, down = (np.diff(ndtr((edges - place[:, None]) / 0.8), axis=1) for place in (x, y))
    plane = 3.6 + (down * light[:, None]).T @ across
    plane += 0.01 * plane.max() * np.random.default_rng(round(1000 * abs(roll_deg))).normal(size=plane.shape)
    return np.repeat(plane[:, :, None], 3, axis=2).astype(np.float32)


def _cut() -> list[Row]:
    """Cut a picture a quarter of a pixel aside, as a pair half a pixel apart is; the error is a share of the peak."""
    rows: list[Row] = []
    for sd_px in sized((0.8, 1.2), (0.8,)):
        source = np.repeat(_spots(0.0, sd_px)[:, :, None], 3, axis=2).astype(np.float32)
        want = _spots(-0.25, sd_px)[8:-8, 8:-8]
        for interpolation in ("linear", "cubic", "sinc"):
            work = partial(cut, source, (8.25, 8.0), (SIDE_PX - 16, SIDE_PX - 16), interpolation)
            found, taken = answer_and_seconds(work, repeats=3)
            error = float(np.abs(found[0][:, :, 1] - want).max() / want.max())
            name = f"spread {sd_px} px, {SIDE_PX} × {SIDE_PX}"
            note = "share of the peak"
            rows.append(row(f"cut, {interpolation}", name, taken, error, note=note))
    return rows


SIZE = sized((900, 700), (300, 240))
MOVES = sized(((0.4, 0.0, 0.0), (7.3, -4.1, 0.1), (3.0, 2.0, 1.5), (-5.0, 9.0, -20.0)), ((3.0, 2.0, 1.5),))
RENDERING_METHODS = ("squares", "OpenCV, SIFT alone", "OpenCV, ECC", "OpenCV, SIFT then ECC")


def rendering() -> dict[str, object]:
    """Time each method on each move."""
    rows: list[Row] = []
    still = _rendering_plate(0.0, 0.0, 0.0, 1)
    for move in MOVES:
        moved = _rendering_plate(*move, 2)
        files = RowFile.of(still), RowFile.of(moved)
        for method in RENDERING_METHODS:
            work = partial(_rendering_found, method, still[..., 1], moved[..., 1], files)
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


def _rendering_found(method: str, one: Floats32, two: Floats32, files: tuple[RowFile, RowFile]) -> Floats | None:
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
    return float(np.hypot(*(mapped(matrix, corners) - _rendering_turned(corners, *move)).T).max())


def _rendering_turned(places: Floats, dx: float, dy: float, angle_deg: float) -> Floats:
    middle = np.array([(SIZE[0] - 1) / 2, (SIZE[1] - 1) / 2])
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    return np.asarray((places - middle) @ np.array([[c, s], [-s, c]]) + middle + (dx, dy))


def _rendering_plate(dx: float, dy: float, angle_deg: float, seed: int) -> Floats32:
    rng = np.random.default_rng(0)
    places = _rendering_turned(rng.uniform([-150, -150], [SIZE[0] + 150, SIZE[1] + 150], (6000, 2)), dx, dy, angle_deg)
    light = 60.0 * rng.lognormal(0.0, 0.6, 6000)
    across, down = (
        np.diff(ndtr((np.arange(length + 1) - 0.5 - places[:, axis, None]) / 0.9), axis=1)
        for axis, length in ((0, SIZE[0]), (1, SIZE[1]))
    )
    plane = 20.0 + (down * light[:, None]).T @ across
    plane *= 1 + 0.02 * np.random.default_rng(seed).standard_normal(plane.shape)
    return np.repeat(plane[..., None], 3, axis=2).astype(np.float32)


if __name__ == "__main__":
    program("comparison", known_shifts, rendering)
