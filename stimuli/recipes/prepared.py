"""One stimulus, read, aligned and cropped once, however many pictures show it."""

from __future__ import annotations

from dataclasses import dataclass

from documents import Finding
from stimuli.align.disparity import Viewing
from stimuli.align.pair import Alignment, align_pair
from stimuli.align.planes import Region
from stimuli.align.straighten import straighten
from stimuli.align.toe_in import focal_px, rectify_toe_in
from stimuli.errors import StimulusError
from stimuli.pictures.stereo_image import Eye, StereoImage, View, XYZImage
from stimuli.recipes.build_context import DisplaySetup, Step
from stimuli.recipes.steps import CropSpec, StepsSpec
from stimuli.recipes.view_sources import Read, Source


@dataclass(frozen=True, eq=False, slots=True)
class _Pair:
    """An aligned pair, what was done, and the left view as it was before where a centre view is to be laid on it.

    ``crop`` is the part of the views that the left one was cropped to when it was straightened.
    """

    alignment: Alignment
    left: XYZImage | None
    crop: Region
    steps: tuple[Step, ...]


class Prepared:
    """A stimulus's pictures up to its crop: each is made when it is first asked for.

    ``pixel_pitch_mm`` is the display's; disparities are reported as they are seen from ``setup``, where one is known.
    """

    def __init__(
        self,
        source: Source,
        steps: StepsSpec,
        flat_eye: Eye | None,
        pixel_pitch_mm: float,
        setup: DisplaySetup | None = None,
    ) -> None:
        self._source, self._steps, self._flat_eye = source, steps, flat_eye
        self._pixel_pitch_mm, self._setup = pixel_pitch_mm, setup
        self._pair: _Pair | None = None
        self._parallel: Read | None = None
        self._done: dict[View | None, tuple[StereoImage, tuple[Step, ...]]] = {}

    def picture(self, view: View | None) -> tuple[StereoImage, tuple[Step, ...]]:
        """Return the picture in ``view``, or as it is stored, and what led to it.

        Raises
        ------
        StimulusError
            If a file cannot be read, its views do not go together, or the crop does not lie in them.
        """
        if view not in self._done:
            image, steps = self._aligned(view)
            if self._steps.crop:
                image, step = cropped(image, self._steps.crop)
                steps = (*steps, step)
            self._done[view] = image, steps
        return self._done[view]

    def _aligned(self, view: View | None) -> tuple[StereoImage, tuple[Step, ...]]:
        if self._steps.align is None and self._steps.toe_in is None:
            read = {"stereo": self._source.stereo, "flat": self._source.flat, None: self._source.stored}[view]()
            return read.image, read.steps
        if self._steps.align is None:
            if self._parallel is None:
                self._parallel = self._as_parallel()
            image, steps = self._parallel.image, self._parallel.steps
            return self._one_eye(image, steps) if view == "flat" else (image, steps)
        pair = self._align()
        if view != "flat":
            return pair.alignment.stereo, pair.steps
        if pair.left is None and (self._flat_eye or self._steps.toe_in):
            return self._one_eye(pair.alignment.stereo, pair.steps)
        centre = self._source.flat()  # which says so where there is none
        assert pair.left is not None
        image, step = pair.alignment.flat_from_centre(_part(centre.image.left, pair.crop), pair.left)
        return image, (*pair.steps, *centre.steps, step)

    def _one_eye(self, image: StereoImage, steps: tuple[Step, ...]) -> tuple[StereoImage, tuple[Step, ...]]:
        if self._flat_eye is None:
            message = "no eye is named for the flat version of an aligned pair"
            raise StimulusError(Finding(message, remedy="write flat_eye: left, or right"))
        return StereoImage.flat(image.eye(self._flat_eye)), (*steps, {"step": "flat", "view": self._flat_eye})

    def _as_parallel(self) -> Read:
        """Return the pair as parallel cameras would have taken it."""
        read, toe_in = self._source.stereo(), self._steps.toe_in
        if toe_in is None:
            return read
        image = read.image
        focal = toe_in.focal_length_px or focal_px(image.width_px, toe_in.field_of_view_deg or 0.0)
        turned = rectify_toe_in(
            image.left, image.right, toe_in.toe_in_deg, focal, viewing=self._viewing(image.width_px)
        )
        # The centre view was not turned with them.
        return Read(turned.stereo, (*read.steps, *turned.steps), False)

    def _align(self) -> _Pair:
        spec = self._steps.align
        assert spec is not None
        if self._pair is None:
            read = self._as_parallel()
            image, region, steps = read.image, spec.region, read.steps
            crop = (0, 0, image.width_px, image.height_px)
            if spec.straighten:
                level = straighten(
                    image.left, image.right, offset_px=spec.offset_px, region=region, most_px=spec.most_px
                )
                image, crop, steps = level.stereo, level.crop, (*steps, *level.steps)
                region = None if region is None else _within(region, crop)
            points = spec.points
            found = align_pair(
                image.left,
                image.right,
                spec.method,
                offset_px=spec.offset_px,
                points=None if points is None else (points.left, points.right),
                region=region,
                most_px=spec.most_px,
                correct_vertical=spec.correct_vertical,
                whole_pixels=spec.whole_pixels,
                interpolation=spec.interpolation,
                viewing=self._viewing(image.width_px),
            )
            self._pair = _Pair(found, image.left if read.centre else None, crop, (*steps, *found.steps))
        return self._pair

    def _viewing(self, width_px: int) -> Viewing | None:
        """Return how a pixel of the picture will be seen: at its true size, or as a pixel of the display."""
        if self._setup is None:
            return None
        pitch_mm, resample = self._pixel_pitch_mm, self._steps.resample
        if resample is not None:
            shown_px = self._steps.crop.width_px if self._steps.crop else width_px
            pitch_mm = resample.size_mm(shown_px, 1)[0] / shown_px
        return Viewing(pitch_mm, self._setup.distance_mm, self._setup.interpupillary_distance_mm)


def _part(view: XYZImage, part: Region) -> XYZImage:
    left, top, right, bottom = part
    return view[top:bottom, left:right]


def _within(region: Region, crop: Region) -> Region:
    """Return the region as it lies in a picture that was cropped."""
    sides = [
        min(max(side, low), high) - low
        for side, low, high in zip(region, (*crop[:2], *crop[:2]), (*crop[2:], *crop[2:]), strict=True)
    ]
    return sides[0], sides[1], sides[2], sides[3]


def cropped(image: StereoImage, crop: CropSpec) -> tuple[StereoImage, Step]:
    """Return the part of both eyes' pictures, and the step; StimulusError if it does not lie within them."""
    right, bottom = crop.left_px + crop.width_px, crop.top_px + crop.height_px
    if right > image.width_px or bottom > image.height_px:
        raise StimulusError(
            Finding(
                f"the crop reaches to column {right} and row {bottom}; the picture has {image.width_px} × "
                f"{image.height_px} pixels",
                remedy="make it smaller; aligned pictures are smaller than their views",
            )
        )
    there = slice(crop.top_px, bottom), slice(crop.left_px, right)
    left = image.left[there]
    whole = StereoImage.flat(left) if image.is_flat else StereoImage(left, image.right[there])
    return whole, {"step": "crop_to_plate", **crop.model_dump(mode="json")}
