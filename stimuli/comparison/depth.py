"""Disparities of a photograph for two eyes and of its rendering, of the views as the files have them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from stimuli.align.disparity import DisparityReport, measure_disparity
from stimuli.comparison.evidence import DisparityEvidence
from stimuli.comparison.pictures import Picture

# The middle of larger pictures is measured.
_SIDE_PX = 2048
# A median's standard error beside a mean's, of a normal distribution.
_OF_A_MEDIAN = 1.2533


@dataclass(frozen=True, eq=False, slots=True)
class DisparityPair:
    """The disparities of both pairs, and their difference."""

    photo: DisparityReport
    rendering: DisparityReport
    evidence: DisparityEvidence

    def to_json(self) -> dict[str, Any]:
        """Return the numbers, None for what is not known."""

        def known(values: tuple[float, float]) -> list[float | None]:
            return [value if np.isfinite(value) else None for value in values]

        return {
            "photograph": dict(self.photo.to_json()),
            "rendering": dict(self.rendering.to_json()),
            "difference_px": known(self.evidence.difference_px),
            "standard_error_px": known(self.evidence.standard_error_px),
        }


def disparity_pair(photo: Picture, rendering: Picture) -> DisparityPair:
    """Return the disparities of both; their eyes are not moved for it."""
    photo_report, rendering_report = _measured(photo), _measured(rendering)
    (a, a_error), (b, b_error) = _median(photo_report), _median(rendering_report)
    apart, error = b - a, np.hypot(a_error, b_error)
    evidence = DisparityEvidence((float(apart[0]), float(apart[1])), (float(error[0]), float(error[1])))
    return DisparityPair(photo_report, rendering_report, evidence)


def _measured(picture: Picture) -> DisparityReport:
    planes = []
    for eye in ("left", "right"):
        rows = picture.views[eye].xyz
        height, width = rows.shape[:2]
        tall, wide = min(height, _SIDE_PX), min(width, _SIDE_PX)
        top, left = (height - tall) // 2, (width - wide) // 2
        planes.append(np.ascontiguousarray(rows[top : top + tall][:, left : left + wide, 1]))
    side = min(64, *planes[0].shape)
    return measure_disparity(planes[0], planes[1], block_px=side)


def _median(report: DisparityReport) -> tuple[np.ndarray, np.ndarray]:
    """Return the median disparity across and down, (2,), and its standard error; NaN where no block has any."""
    count = report.used
    if count < 2:
        return np.full(2, np.nan), np.full(2, np.nan)
    middle = np.median(report.disparity_px, axis=0)
    # The scatter without the few blocks that strayed.
    spread = 1.4826 * np.median(np.abs(report.disparity_px - middle), axis=0)
    return middle, np.hypot(
        _OF_A_MEDIAN * spread / np.sqrt(count), np.median(report.standard_error_px, axis=0) / count**0.5
    )
