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
from stimuli.comparison.first_guess import first_guess, sizes_differ
from stimuli.comparison.row_file import RowFile
from stimuli.comparison.similarity import fit_similarity, middle
from stimuli.comparison.squares import LEAST_SQUARES, Field, squares
from stimuli.errors import StimulusError

Floats = NDArray[np.float64]
Registering = Literal["auto", "none", "corners"]

# Displacements below this are not worth an interpolation.
STILL_PX = 0.02
_ROUNDS = 5


@dataclass(frozen=True, eq=False, slots=True)
class Placing:
    """How the rendering was brought to the photograph's pixels.

    ``matrix`` (3, 3) takes a place of the photograph to the rendering. ``shift_px``, ``rotation_deg`` and ``scale`` are
    what it does to the photograph's middle, with their standard errors where squares told them. ``residual_px`` is left
    after it, None where nothing could be measured. ``start`` says how it was begun.
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
            raise sizes_differ(
                photo, rendering, "let them be registered (--register auto or corners), or crop them alike"
            )
        return _told(np.eye(3), "as they are", squares(photo, rendering, np.eye(3)), None, photo.shape, moved=False)
    if mode == "corners":
        from stimuli.align.homography import homography_from_points

        if corners is None:
            raise StimulusError(Finding("no corners are given", remedy="say --photo-corners and --rendering-corners"))
        matrix, start = homography_from_points(*corners).matrix, "corners"
    else:
        matrix, start = first_guess(photo, rendering)
    return _refined(photo, rendering, matrix, start)


def _refined(photo: RowFile, rendering: RowFile, matrix: Floats, start: str) -> Placing:
    """Fit a shift, or a similarity, to the squares until they ask for no more."""
    errors: Floats | None = None
    turned = start != "shift"
    if photo.shape == rendering.shape and _reach(matrix, photo.shape) < STILL_PX:
        matrix = np.eye(3)
    field = squares(photo, rendering, matrix)
    for _ in range(_ROUNDS):
        if len(field.middle_px) < LEAST_SQUARES:
            break
        fit = fit_similarity(field, photo.shape)
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
    centre = middle(shape)
    from stimuli.align.homography import mapped

    step = 0.5
    across = mapped(matrix, centre + [step, 0]) - mapped(matrix, centre - [step, 0])
    down = mapped(matrix, centre + [0, step]) - mapped(matrix, centre - [0, step])
    shift = mapped(matrix, centre) - centre
    if not moved and len(field.middle_px) >= LEAST_SQUARES:
        fit = fit_similarity(field, shape)
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


def _reach(matrix: Floats, shape: tuple[int, ...]) -> float:
    """Return how far ``matrix`` moves the corner that it moves farthest."""
    from stimuli.align.homography import mapped

    height, width = shape[:2]
    corners = np.array([[0.0, 0.0], [width - 1, 0.0], [0.0, height - 1], [width - 1, height - 1]])
    return float(np.abs(mapped(matrix, corners) - corners).max())
