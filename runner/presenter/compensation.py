"""What a rig makes necessary beside undoing the display's response: crosstalk cancelled, the panel evened out.

Crosstalk is a matter of both eyes' light at once, and evenness of where on the panel a picture stands. A presenter that
is given the `Compensation.correction` does both in its pass. `Compensation.apply` does the same in float64 and linear
XYZ: for modes that mix both views into one picture, for the report of what crosstalk could not be cancelled, and as
what the pass is tested against. In both, a view that the signal squeezes is averaged first: an eye's pixel leaks as the
one pixel that the panel has of it. A flat picture stays flat only where both eyes are sent the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.compensation.clipping import blocks
from devices.compensation.crosstalk import Crosstalk
from devices.compensation.crosstalk_cancel import CancelCost, cancel_crosstalk, needed_lift
from devices.compensation.gain_map import GainMap
from devices.display.display_file import Eye, EyeModels
from devices.display.model import DisplayModel
from devices.display.rig_file import Rig
from runner.presenter.compensated_pass import Correction
from runner.presenter.modes.mode import Mode
from runner.presenter.placement import Placement
from runner.presenter.rectangle import Size
from runner.presenter.scene import Offset
from stimuli.pictures.stereo_image import StereoImage, XYZImage

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
        plain = cls.unlifted(rig, mode)
        if rig.crosstalk is None or not rig.lift_black:
            return plain
        return replace(plain, lift_share=max((plain.needed_lift(image) for image in images), default=0.0))

    @classmethod
    def unlifted(cls, rig: Rig, mode: Mode) -> Compensation:
        """Return the rig's compensation with the black level as it is."""
        return cls(rig.models, mode, rig.display.panel.resolution_px, rig.crosstalk, rig.gain_map)

    def needed_lift(self, image: StereoImage) -> float:
        """Return the share of white that ``image`` needs so that crosstalk leaves nothing to clip; 0 without."""
        if self.crosstalk is None:
            return 0.0
        left, right = (_squeezed(view, self.squeeze).reshape(-1, 3) for view in (image.left, image.right))
        return max(needed_lift(self.models, self.crosstalk, left[part], right[part]) for part in blocks(len(left)))

    @property
    def squeeze(self) -> tuple[int, int]:
        """How many pixels of a view, across and down, share one of the signal."""
        return self.mode.areas(self.resolution_px)[0].squeeze

    @property
    def correction(self) -> Correction | None:
        """What a presenter's pass can do of it: all or, in a mode that mixes both views into one picture, nothing.

        None if there is nothing to do.
        """
        if (self.crosstalk is None and self.gain_map is None) or self.mode.mixture(self.models) is not None:
            return None
        return Correction(self.crosstalk, self.gain_map, self.lift_share)

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
        (left, right), report = self._without_leaks(
            *(_squeezed(view, self.squeeze) for view in (image.left, image.right))
        )
        return self._image(image, left, right, offset_px), report

    def uncancelled(self, image: StereoImage) -> dict[str, Any]:
        """Return what crosstalk could not be cancelled of ``image``, per eye; nothing without crosstalk."""
        if self.crosstalk is None:
            return {}
        left, right = (_squeezed(view, self.squeeze).reshape(-1, 3) for view in (image.left, image.right))
        done = [
            cancel_crosstalk(self.models, self.crosstalk, left[part], right[part], self.lift_share)
            for part in blocks(len(left))
        ]
        return self._report(_cost_together([one.left for one in done]), _cost_together([one.right for one in done]))

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

    def _without_leaks(self, left_XYZ: Floats, right_XYZ: Floats) -> tuple[tuple[Floats, Floats], dict[str, Any]]:
        crosstalk, models = self.crosstalk, self.models
        if crosstalk is None:
            return (left_XYZ, right_XYZ), {}
        done = cancel_crosstalk(models, crosstalk, left_XYZ, right_XYZ, self.lift_share)
        report = self._report(done.left, done.right)
        return (_XYZ(models.left, done.left_linear), _XYZ(models.right, done.right_linear)), report

    def _report(self, left: CancelCost, right: CancelCost) -> dict[str, Any]:
        return {"lift_share": round(self.lift_share, 6), "left": left.to_json(), "right": right.to_json()}

    def _evened(self, eye: Eye, xyz_cd_m2: Floats, offset_px: Offset) -> Floats:
        gain_map = self.gain_map
        if gain_map is None:
            return xyz_cd_m2
        height, width, _ = xyz_cd_m2.shape
        placement = Placement(self.mode, self.resolution_px)
        gain = gain_map.over(*placement.of(eye, (width, height), offset_px))
        return gain_map.corrected(xyz_cd_m2, gain)


def _cost_together(parts: Sequence[CancelCost]) -> CancelCost:
    """Return what a picture costs from what its parts do."""
    pixels = sum(part.pixels for part in parts)
    return CancelCost(
        pixels=pixels,
        negative=sum(part.negative for part in parts),
        above_full=sum(part.above_full for part in parts),
        worst_residual_cd_m2=max(part.worst_residual_cd_m2 for part in parts),
        delta_e_00_mean=sum(part.delta_e_00_mean * part.pixels for part in parts) / pixels,
        delta_e_00_max=max(part.delta_e_00_max for part in parts),
    )


def _XYZ(model: DisplayModel, linear: Floats) -> Floats:
    return np.asarray(model.black_XYZ_cd_m2 + linear @ model.primaries_XYZ_cd_m2.T)


def _squeezed(view: XYZImage, squeeze: tuple[int, int]) -> Floats:
    """Return ``view`` in float64, each box of ``squeeze`` pixels, across and down, holding its mean."""
    xyz = view.astype(np.float64)
    for axis, length in ((1, squeeze[0]), (0, squeeze[1])):
        if length > 1:
            first = np.arange(0, xyz.shape[axis], length)
            counts = np.diff([*first, xyz.shape[axis]])
            sums = np.add.reduceat(xyz, first, axis=axis)
            mean = sums / np.expand_dims(counts, tuple(other for other in range(3) if other != axis))
            xyz = np.repeat(mean, counts, axis=axis)
    return xyz
