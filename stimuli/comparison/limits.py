"""What a rendering must keep to be called validated; each limit may be set in the regions file."""

from __future__ import annotations

from dataclasses import asdict, dataclass

from documents import Finding
from stimuli.comparison.errors import PictureError


@dataclass(frozen=True, slots=True)
class Limits:
    """The limits of a verdict.

    Parameters
    ----------
    delta_e
        ΔE00 up to which two colours count as equal: 1.0 ± 0.4 of Berns and Hou for car paint, thesis Section 5.5.
    above_limit_percent
        So many percent of the pixels may differ by more, as the eye resolves them.
    registration_residual_px
        Pictures that lie further apart are not compared pixel by pixel.
    sparkle_relative, sparkle_z, sparkle_relative_se
        Sparkle differs if it does by more than this share and by more than so many standard errors; if a share's
        standard error is larger than the last, nothing can be said.
    disparity_px
        So far may the disparities of photograph and rendering lie apart.
    stands_out_delta_xy, stands_out_luminance, stands_out_z
        A region whose chromaticity, or share of luminance, departs from that of the others by more is named.
    """

    delta_e: float = 1.4
    above_limit_percent: float = 5.0
    registration_residual_px: float = 0.25
    sparkle_relative: float = 0.10
    sparkle_z: float = 2.58
    sparkle_relative_se: float = 0.25
    disparity_px: float = 0.5
    stands_out_delta_xy: float = 0.001
    stands_out_luminance: float = 0.01
    stands_out_z: float = 3.0

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if not 0 < value < float("inf"):
                raise PictureError(Finding(f"the limit '{name}' is {value}", remedy="a finite number above 0"))

    def to_json(self) -> dict[str, float]:
        """Return the limits by name."""
        return asdict(self)
