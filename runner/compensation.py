"""Pictures made ready for a rig: crosstalk cancelled and the panel evened out before the presenter sees them.

The presenter undoes the display's response at one place and for one eye. Crosstalk is a matter of both eyes' light at
once, and evenness of where on the panel a picture stands; both are solved here, in float64 and linear XYZ, once per
picture, and once more per place where there is a gain map. A flat picture stays flat only where both eyes are sent the
same.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.crosstalk import Crosstalk
from devices.crosstalk_cancel import cancel_crosstalk, needed_lift
from devices.display import DisplayModel
from devices.display_file import Eye, EyeModels
from devices.gain_map import GainMap
from devices.rig_file import Rig
from runner.placement import Placement
from runner.presenter.modes.mode import Mode
from runner.presenter.rectangle import Size
from runner.presenter.scene import Offset
from stimuli.stereo_image import StereoImage

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Compensation:
    """What is done to every picture in a stereo mode; ``lift_share`` of each eye's white is added to all alike."""

    models: EyeModels
    mode: Mode
    resolution_px: Size
    crosstalk: Crosstalk | None = None
    gain_map: GainMap | None = None
    lift_share: float = 0.0

    @classmethod
    def of(cls, rig: Rig, mode: Mode, images: Iterable[StereoImage]) -> Compensation:
        """Return the rig's compensation, with the lift that the most demanding of ``images`` needs, if it is wanted."""
        plain = cls(rig.models, mode, rig.display.panel.resolution_px, rig.crosstalk, rig.gain_map)
        if rig.crosstalk is None or not rig.lift_black:
            return plain
        lifts = (needed_lift(rig.models, rig.crosstalk, image.left, image.right) for image in images)
        return replace(plain, lift_share=max(lifts, default=0.0))

    @property
    def depends_on_place(self) -> bool:
        """Whether a picture must be made ready anew for each place at which it is shown."""
        return self.gain_map is not None

    def apply(self, image: StereoImage, offset_px: Offset = (0, 0)) -> tuple[StereoImage, dict[str, Any]]:
        """Return what to send for ``image`` at ``offset_px``, and what crosstalk could not be cancelled, per eye.

        The report is empty without crosstalk; without either, the image is returned as it is.
        """
        if self.crosstalk is None and self.gain_map is None:
            return image, {}
        (left, right), report = self._without_leaks(image)
        return self._image(image, left, right, offset_px), report

    def evened(self, image: StereoImage, offset_px: Offset) -> StereoImage:
        """Return what to ask of the display model at ``offset_px`` for ``image`` to be seen evenly; leaks stay."""
        if self.gain_map is None:
            return image
        return self._image(image, image.left.astype(np.float64), image.right.astype(np.float64), offset_px)

    def _image(self, image: StereoImage, left: Floats, right: Floats, offset_px: Offset) -> StereoImage:
        left, right = self._evened("left", left, offset_px), self._evened("right", right, offset_px)
        sent = StereoImage(left.astype(np.float32), right.astype(np.float32))
        alike = image.is_flat and self.models.left is self.models.right
        return StereoImage.flat(sent.left) if alike and np.array_equal(sent.left, sent.right) else sent

    def _without_leaks(self, image: StereoImage) -> tuple[tuple[Floats, Floats], dict[str, Any]]:
        crosstalk, models = self.crosstalk, self.models
        if crosstalk is None:
            return (image.left.astype(np.float64), image.right.astype(np.float64)), {}
        done = cancel_crosstalk(models, crosstalk, image.left, image.right, self.lift_share)
        report = {"lift_share": round(self.lift_share, 6), "left": done.left.to_json(), "right": done.right.to_json()}
        return (_XYZ(models.left, done.left_linear), _XYZ(models.right, done.right_linear)), report

    def _evened(self, eye: Eye, xyz_cd_m2: Floats, offset_px: Offset) -> Floats:
        gain_map = self.gain_map
        if gain_map is None:
            return xyz_cd_m2
        height, width, _ = xyz_cd_m2.shape
        placement = Placement(self.mode, self.resolution_px)
        gain = gain_map.over(*placement.of(eye, (width, height), offset_px))
        return gain_map.corrected(xyz_cd_m2, gain)


def _XYZ(model: DisplayModel, linear: Floats) -> Floats:
    return np.asarray(model.black_XYZ_cd_m2 + linear @ model.primaries_XYZ_cd_m2.T)
