"""A picture for two eyes, in absolute XYZ."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from devices.eyes import Eye as Eye
from stimuli.errors import StimulusError

XYZImage = NDArray[np.float32]


@dataclass(frozen=True, eq=False, slots=True)
class StereoImage:
    """A picture for two eyes in absolute XYZ, of the observer that its file or recipe names (CIE 1931 2° if none).

    A flat picture holds one array for both eyes: the same object, so that it is transformed and uploaded once.

    Parameters
    ----------
    left, right
        XYZ in cd/m², float32, (height, width, 3) each.
    half
        Whether the values were held in half floats, whose rounding is coarser near black.

    Raises
    ------
    StimulusError
        If the two differ in shape, or are not (height, width, 3).

    Examples
    --------
    >>> import numpy as np
    >>> light = np.full((4, 6, 3), 5.0, np.float32)      # 5 cd/m² of equal-energy white
    >>> picture = StereoImage.flat(light)
    >>> picture.width_px, picture.height_px, picture.is_flat
    (6, 4, True)
    """

    left: XYZImage
    right: XYZImage
    half: bool = field(default=False, kw_only=True)

    def __post_init__(self) -> None:
        if self.left.ndim != 3 or self.left.shape[2] != 3 or 0 in self.left.shape:
            raise StimulusError(f"a picture has shape {self.left.shape}; expected (height, width, 3)")
        if self.left.shape != self.right.shape:
            raise StimulusError(f"the left eye's picture is {self.left.shape} and the right one's {self.right.shape}")

    @classmethod
    def flat(cls, xyz_cd_m2: XYZImage) -> StereoImage:
        """Return a picture that shows the same array to both eyes."""
        return cls(xyz_cd_m2, xyz_cd_m2)

    @property
    def is_flat(self) -> bool:
        """Whether both eyes see the same array."""
        return self.left is self.right

    @property
    def height_px(self) -> int:
        """Rows."""
        return int(self.left.shape[0])

    @property
    def width_px(self) -> int:
        """Columns."""
        return int(self.left.shape[1])

    def luminance_cd_m2(self, eye: Eye) -> NDArray[np.float32]:
        """Return the luminance that ``eye`` sees, (height, width), in rows that lie one after the other."""
        return np.ascontiguousarray(self.eye(eye)[..., 1])

    def eye(self, eye: Eye) -> XYZImage:
        """Return the array that ``eye`` sees."""
        return self.left if eye == "left" else self.right
