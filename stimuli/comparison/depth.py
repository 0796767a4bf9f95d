"""Depth of a photograph for two eyes and of its rendering: both pairs on one grid, place by place.

Both eyes of the rendering are brought to the photograph's grid by one and the same movement, so that what moves one eye
alone, such as a roll, stays in. The views are those of the files; the middle of larger pictures is measured.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from devices.eyes import AnyEye
from documents import in_threads
from documents.arrays import Floats, Floats32
from documents.text import json_fields
from stimuli.align.homography import mapped
from stimuli.align.warping import warp
from stimuli.comparison.alignment import Alignment
from stimuli.comparison.areas import inside, window
from stimuli.comparison.binocular import Binocular, measure_binocular
from stimuli.comparison.binocular_reasons import BinocularEvidence, binocular_reasons
from stimuli.comparison.displacements import move
from stimuli.comparison.eye_identity import EyeIdentity, identify_eyes
from stimuli.comparison.pictures import EyeXYZ, PictureFile
from stimuli.comparison.regions import PairedArea
from stimuli.comparison.verdict import Limits
from stimuli.pictures.rows import Mask, RowFile, block_means

# The middle of larger pictures is measured.
_SIDE_PX = 2048
# Eyes are identified on means over squares, of at most so many.
_IDENTITY_PIXELS = 1 << 19
# A movement this near to a shift by whole pixels is taken for one: nothing is then interpolated.
_NEAR_A_SHIFT_PX = 0.25


@dataclass(frozen=True, eq=False, slots=True)
class DepthComparison:
    """Depth and what else two eyes see of both pairs; ``matrix`` (3, 3) took the photograph's places to the rendering.

    ``identity`` is None where sizes differ.
    """

    eyes: Binocular
    identity: EyeIdentity | None
    matrix: Floats

    @property
    def evidence(self) -> BinocularEvidence:
        """What the verdict is about."""
        used = self.eyes.photo.used, self.eyes.rendering.used
        return BinocularEvidence(self.eyes.measures, self.identity, used, self.eyes.same_views)

    def fails(self, limits: Limits) -> bool:
        """Whether two eyes see another thing than in the photograph."""
        return any(reason.outcome == "fails" for reason in binocular_reasons(self.evidence, limits))

    def to_json(self) -> dict[str, Any]:
        """Return the numbers, None for what is not known."""
        eyes, measures = self.eyes, self.eyes.measures
        axes = [measures.get(f"disparity {name}") for name in ("across", "down")]
        return {
            "photograph": dict(eyes.photo.to_json()),
            "rendering": dict(eyes.rendering.to_json()),
            "difference_px": [None if one is None else one.difference for one in axes],
            "standard_error_px": [None if one is None else one.standard_error for one in axes],
            "measures": {name: json_fields(pair) for name, pair in measures.items()},
            "identity": None if self.identity is None else self.identity.to_json(),
            "squares": [
                {"x": x, "y": y, "photograph_px": across[0], "rendering_px": across[1]}
                for (x, y), across in zip(eyes.middle_px.tolist(), eyes.across.tolist(), strict=True)
            ],
            "sparkles": None
            if eyes.sparkles is None
            else [{"left": one.left, "right": one.right, "both": one.both} for one in eyes.sparkles],
        }


def which_eyes(photo: PictureFile, rendering: PictureFile) -> EyeIdentity | None:
    """Return which of the photograph's views the rendering's eyes show; None for pictures of unlike size."""
    width, height = photo.size_px
    if photo.size_px != rendering.size_px:
        return None
    bin_px = int(np.ceil(np.sqrt(width * height / _IDENTITY_PIXELS)))
    if min(width, height) < 32 * bin_px:
        return None
    all_views = [one.views[eye].xyz for one in (photo, rendering) for eye in ("left", "right")]
    small = in_threads(lambda xyz: block_means(xyz, bin_px, 1), all_views)
    found = identify_eyes((small[0], small[1]), (small[2], small[3]))
    return replace(found, shift_px=(found.shift_px[0] * bin_px, found.shift_px[1] * bin_px))


def exchanged(picture: PictureFile) -> PictureFile:
    """Return a picture for two eyes with its views exchanged, and a note that they were."""
    views: Mapping[AnyEye, EyeXYZ] = {"left": picture.views["right"], "right": picture.views["left"]}
    note = "its eyes are exchanged, and were changed back for all that follows"
    return replace(picture, views=views, notes=(*picture.notes, note))


def common_movement(alignments: Sequence[Alignment], identity: EyeIdentity | None) -> Floats:
    """Return where both eyes of the rendering lie, (3, 3): halfway between those that were registered.

    Of none, it is the shift under which eyes were identified, or none at all.
    """
    if alignments:
        return np.asarray(np.mean([one.matrix / one.matrix[2, 2] for one in alignments], axis=0))
    return move(identity.shift_px) if identity is not None and identity.way is not None else np.eye(3)


def compare_depth(
    photo: PictureFile,
    rendering: PictureFile,
    matrix: Floats,
    identity: EyeIdentity | None,
    regions: Sequence[PairedArea],
    limits: Limits,
) -> DepthComparison:
    """Return depth of both pairs within the regions, the rendering brought to the photograph's grid by ``matrix``."""
    shape, other = (one.views["left"].xyz.shape for one in (photo, rendering))
    rows, columns = (_middle(length) for length in shape[:2])
    matrix = _whole_pixels(matrix, (columns.stop, rows.stop))
    shift = matrix[:2, 2]
    if np.array_equal(matrix, move(shift)):
        across, down = (int(component) for component in shift)
        columns = slice(max(columns.start, -across), min(columns.stop, other[1] - across))
        rows = slice(max(rows.start, -down), min(rows.stop, other[0] - down))
        brought = [
            _luminance(
                rendering.views[eye].xyz,
                slice(rows.start + down, rows.stop + down),
                slice(columns.start + across, columns.stop + across),
            )
            for eye in ("left", "right")
        ]
        within = np.ones((rows.stop - rows.start, columns.stop - columns.start), dtype=np.bool_)
    else:
        brought, within = _warped(rendering, matrix, rows, columns)
    counted, sparkling = (np.zeros(within.shape, dtype=np.bool_) for _ in range(2))
    for region in regions:
        own_rows, own_columns = window(region.photo_px, shape)
        own = slice(max(own_rows.start, rows.start), min(own_rows.stop, rows.stop))
        along = slice(max(own_columns.start, columns.start), min(own_columns.stop, columns.stop))
        if own.stop <= own.start or along.stop <= along.start:
            continue
        here = (
            slice(own.start - rows.start, own.stop - rows.start),
            slice(along.start - columns.start, along.stop - columns.start),
        )
        mask = inside(region.photo_px, own, along) & within[here]
        counted[here] |= mask
        if region.sparkle:
            sparkling[here] |= mask
    left, right = (_luminance(photo.views[eye].xyz, rows, columns) for eye in ("left", "right"))
    eyes = measure_binocular((left, right), (brought[0], brought[1]), counted, sparkling, limits.disparity_px)
    return DepthComparison(eyes, identity, matrix)


def _middle(length: int) -> slice:
    first = (length - min(length, _SIDE_PX)) // 2
    return slice(first, first + min(length, _SIDE_PX))


def _whole_pixels(matrix: Floats, reach_px: tuple[int, int]) -> Floats:
    """Return a shift by whole pixels where ``matrix`` is nearly a shift over the reach, else it as it is."""
    corners = np.array([[0.0, 0.0], [reach_px[0], 0.0], [0.0, reach_px[1]], reach_px])
    apart = mapped(matrix, corners) - corners
    middle = apart.mean(axis=0)
    if np.abs(apart - middle).max() < _NEAR_A_SHIFT_PX:
        return move(np.round(middle))
    return matrix


def _luminance(picture: RowFile, rows: slice, columns: slice) -> Floats32:
    return np.ascontiguousarray(picture[rows][:, columns, 1])


def _warped(rendering: PictureFile, matrix: Floats, rows: slice, columns: slice) -> tuple[list[Floats32], Mask]:
    """Return the luminance of both eyes in a window of the photograph, and where it lies within the rendering."""
    width, height = columns.stop - columns.start, rows.stop - rows.start
    places = np.stack(np.meshgrid(np.arange(columns.start, columns.stop), np.arange(rows.start, rows.stop)), axis=-1)
    seen = mapped(matrix, places.astype(np.float64))
    other = rendering.views["left"].xyz.shape
    within = np.all((seen >= 1) & (seen <= [other[1] - 2, other[0] - 2]), axis=-1)
    top = int(np.clip(np.floor(seen[..., 1].min()) - 24, 0, other[0] - 1))
    bottom = int(np.clip(np.ceil(seen[..., 1].max()) + 25, top + 1, other[0]))
    here = move((0, -top)) @ matrix @ move((columns.start, rows.start))
    views = [
        warp(rendering.views[eye].xyz[top:bottom][:, :, 1:2], here, (width, height)).picture[:, :, 0]
        for eye in ("left", "right")
    ]
    return views, np.asarray(within)
