"""What a rig needs beside the inverse of the display's response: crosstalk cancelled, the panel evened out.

Crosstalk is a matter of both eyes' light at once, and evenness of where on the panel a picture stands. The presenter's
pass does both on the graphics card. `Compensation.apply` does the same in float64 and linear XYZ: for modes that mix
both views into one picture, for the report of what crosstalk could not be cancelled, and as what the pass is tested
against. In both, a view that the signal squeezes is averaged first: an eye's pixel leaks as the one pixel that the
panel has of it. A picture is a pair of arrays (height, width, 3), XYZ in cd/m², the left eye's and the right eye's; a
flat picture is one array twice, and stays so only where both eyes are sent the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from devices.compensation.clipping import over_blocks
from devices.compensation.crosstalk_cancel import CancelCost, cancel_crosstalk, needed_lift
from devices.compensation.eye_view import EyeView
from devices.compensation.mixture import Mixture
from devices.display.crosstalk import Crosstalk
from devices.display.display_file import Eye, EyeModels
from devices.display.gain_map import GainMap
from devices.display.model import DisplayModel
from documents.arrays import Floats

XYZImage = NDArray[np.float32]
Pair: TypeAlias = tuple[XYZImage, XYZImage]


@dataclass(frozen=True, eq=False, slots=True)
class Correction:
    """What becomes of both eyes' light before it is codes: leaks cancelled, black lifted, the panel evened out.

    ``lift_share`` is the share of each eye's white that is added to every pixel where there is crosstalk to cancel; see
    `devices.compensation.crosstalk_cancel.needed_lift`.
    """

    crosstalk: Crosstalk | None = None
    gain_map: GainMap | None = None
    lift_share: float = 0.0

    @property
    def is_none(self) -> bool:
        """Whether there is nothing to correct."""
        return self.crosstalk is None and self.gain_map is None

    @property
    def depends_on_place(self) -> bool:
        """Whether a picture must be corrected again for each place at which it is shown."""
        return self.gain_map is not None


@dataclass(frozen=True, slots=True)
class Compensation:
    """What is done to every picture in a stereo mode.

    ``views`` says where each eye's view lies on the panel, ``mixture`` how both views make one picture, where they do.
    """

    models: EyeModels
    views: Mapping[Eye, EyeView]
    mixture: Mixture | None = None
    correction: Correction = Correction()

    @property
    def squeeze(self) -> tuple[int, int]:
        """How many pixels of a view, across and down, share one of the signal."""
        return self.views["left"].squeeze

    def needed_lift(self, picture: Pair) -> float:
        """Return the share of white that ``picture`` needs so that crosstalk leaves nothing to clip; 0 without."""
        crosstalk = self.correction.crosstalk
        if crosstalk is None:
            return 0.0
        left, right = (_squeezed(view, self.squeeze).reshape(-1, 3) for view in picture)
        models = self.models
        return max(over_blocks(lambda part: needed_lift(models, crosstalk, left[part], right[part]), len(left)))

    def lifted(self, lift_share: float) -> Compensation:
        """Return it with ``lift_share`` of each eye's white added to every pixel."""
        return replace(self, correction=replace(self.correction, lift_share=lift_share))

    def lifted_for(self, pictures: Iterable[Pair]) -> Compensation:
        """Return it with the lift that the most demanding of ``pictures`` needs."""
        if self.correction.crosstalk is None:
            return self
        return self.lifted(max((self.needed_lift(picture) for picture in pictures), default=0.0))

    def apply(self, picture: Pair, offset_px: tuple[int, int] = (0, 0)) -> tuple[Pair, dict[str, Any]]:
        """Return what to send for ``picture`` at ``offset_px``, and what crosstalk could not be cancelled, per eye.

        The report is empty without crosstalk; with nothing to correct, the picture is returned as it is.
        """
        if self.correction.is_none:
            return picture, {}
        left, right = (_squeezed(view, self.squeeze) for view in picture)
        (left, right), report = self._without_leaks(left, right)
        return self._sent(picture, left, right, offset_px), report

    def uncancelled(self, picture: Pair, *, half: bool = False) -> dict[str, Any]:
        """Return what crosstalk could not be cancelled of ``picture``, per eye; nothing without crosstalk.

        ``half`` says that half floats held it: their rounding does not count as light that could not be cancelled.
        """
        crosstalk = self.correction.crosstalk
        if crosstalk is None:
            return {}
        left, right = (_squeezed(view, self.squeeze).reshape(-1, 3) for view in picture)

        def work(part: slice) -> tuple[CancelCost, CancelCost]:
            done = cancel_crosstalk(
                self.models, crosstalk, left[part], right[part], self.correction.lift_share, half=half
            )
            return done.left, done.right

        costs = list(over_blocks(work, len(left)))
        return self._report(_cost_together([one for one, _ in costs]), _cost_together([other for _, other in costs]))

    def evened(self, picture: Pair, offset_px: tuple[int, int]) -> Pair:
        """Return what to ask of the display model at ``offset_px`` for ``picture`` to be seen evenly; leaks stay."""
        if self.correction.gain_map is None:
            return picture
        left, right = (view.astype(np.float64) for view in picture)
        return self._sent(picture, left, right, offset_px)

    def _sent(self, picture: Pair, left: Floats, right: Floats, offset_px: tuple[int, int]) -> Pair:
        sent_left = self._evened("left", left, offset_px).astype(np.float32)
        sent_right = self._evened("right", right, offset_px).astype(np.float32)
        alike = picture[0] is picture[1] and self.models.left is self.models.right
        return sent_left, sent_left if alike and np.array_equal(sent_left, sent_right) else sent_right

    def _without_leaks(self, left_XYZ: Floats, right_XYZ: Floats) -> tuple[tuple[Floats, Floats], dict[str, Any]]:
        crosstalk, models = self.correction.crosstalk, self.models
        if crosstalk is None:
            return (left_XYZ, right_XYZ), {}
        done = cancel_crosstalk(models, crosstalk, left_XYZ, right_XYZ, self.correction.lift_share)
        report = self._report(done.left, done.right)
        return (_XYZ(models.left, done.left_linear), _XYZ(models.right, done.right_linear)), report

    def _report(self, left: CancelCost, right: CancelCost) -> dict[str, Any]:
        return {"lift_share": round(self.correction.lift_share, 6), "left": left.to_json(), "right": right.to_json()}

    def _evened(self, eye: Eye, xyz_cd_m2: Floats, offset_px: tuple[int, int]) -> Floats:
        gain_map = self.correction.gain_map
        if gain_map is None:
            return xyz_cd_m2
        height, width, _ = xyz_cd_m2.shape
        grid = self.views[eye].pixel_grid((width, height), offset_px)
        ambient = self.models.eye(eye).ambient_XYZ_cd_m2
        return gain_map.corrected(xyz_cd_m2, gain_map.over(*grid.axes((width, height))), ambient)


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
    return np.asarray(model.dark_XYZ_cd_m2 + linear @ model.primaries_XYZ_cd_m2.T)


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
