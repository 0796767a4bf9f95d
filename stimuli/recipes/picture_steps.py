"""From views to the pictures that are shown: aligned, cropped, adapted, scaled, resampled, fitted to a display.

A stimulus is read, aligned and cropped once, however many pictures show it (`Prepared`). Then each picture is adapted
to another white, and gets its luminance, its series, its size and the display's range (`finished_picture`). What acts
on each pixel alone comes before the picture is resampled, at its own precision. What saturates is counted on the
display's pixels, so that tone mapping comes last: a sparkle that one camera pixel holds is less bright where it is
averaged with its neighbours.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from devices.colour_matching import DEFAULT_OBSERVER
from stimuli.align.disparity import Viewing
from stimuli.align.pair import PairAlignment, align_pair
from stimuli.align.planes import Region
from stimuli.align.straightening import straighten
from stimuli.align.toe_in import focal_px, rectify_toe_in
from stimuli.errors import StimulusError
from stimuli.luminance.saturation import tone_mapping
from stimuli.luminance.scale import (
    eyes_once,
    factor_to,
    grey_picture,
    max_luminance_cd_m2,
    mean_luminance_cd_m2,
    scaled_picture,
    white_luminance_cd_m2,
)
from stimuli.pictures.resampling import resample_picture
from stimuli.pictures.resolution import display_resolution
from stimuli.pictures.rows import bands
from stimuli.pictures.stereo_image import Eye, StereoImage, XYZImage
from stimuli.recipes.build_context import DisplaySetup
from stimuli.recipes.steps_spec import AdaptSpec, CropSpec, LuminanceSpec, ResampleSpec, StepsSpec
from stimuli.recipes.values import SeriesSpec, Step, View
from stimuli.recipes.view_sources import MultiViewFile, StoredPicture, ViewSource

if TYPE_CHECKING:
    from stimuli.recipes.banded_picture import BandedPicture


@dataclass(frozen=True, eq=False, slots=True)
class _Pair:
    """An aligned pair, what was done, and the left view as it was before where a centre view is to be laid on it.

    ``crop`` is the part of the views that the left one was cropped to when it was straightened.
    """

    alignment: PairAlignment
    left: XYZImage | None
    crop: Region
    steps: tuple[Step, ...]


class Prepared:
    """A stimulus's pictures up to its crop: each is made when it is first asked for.

    ``pixel_pitch_mm`` is the display's; disparities are reported as they are seen from ``setup``, where one is known.
    """

    def __init__(
        self,
        source: ViewSource,
        steps: StepsSpec,
        flat_eye: Eye | None,
        pixel_pitch_mm: float,
        setup: DisplaySetup | None = None,
    ) -> None:
        self._source, self._steps, self._flat_eye = source, steps, flat_eye
        self._pixel_pitch_mm, self._setup = pixel_pitch_mm, setup
        self._pair: _Pair | None = None
        self._parallel: StoredPicture | None = None
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

    def unchanged(self, view: View | None) -> StoredPicture | None:
        """Return the picture in ``view`` as it is stored, or None if a step is to change it."""
        return None if self._steps.steps_json() != StepsSpec().steps_json() else self._read(view)

    def banded(self, view: View | None, series: SeriesSpec | None) -> tuple[BandedPicture, tuple[Step, ...]] | None:
        """Return the picture in ``view`` to be made some rows at a time, and what leads to it; None if it is not.

        It can be where it comes from one OpenEXR file and is multiplied at most.
        """
        factors = _multiplied(self._steps, series)
        if factors is None or not isinstance(self._source, MultiViewFile) or not (found := self._source.banded(view)):
            return None
        picture, read = found
        done = [{"step": "scale", "luminance_scale": factor} for factor in factors]
        return replace(picture, factors=factors), (read, *done)

    def _read(self, view: View | None) -> StoredPicture:
        return {"stereo": self._source.stereo, "flat": self._source.flat, None: self._source.stored}[view]()

    def _aligned(self, view: View | None) -> tuple[StereoImage, tuple[Step, ...]]:
        if self._steps.align is None and self._steps.toe_in is None:
            read = self._read(view)
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
        centre = self._source.flat()  # raises where there is none
        assert pair.left is not None
        image, step = pair.alignment.flat_from_centre(_part(centre.image.left, pair.crop), pair.left)
        return image, (*pair.steps, *centre.steps, step)

    def _one_eye(self, image: StereoImage, steps: tuple[Step, ...]) -> tuple[StereoImage, tuple[Step, ...]]:
        if self._flat_eye is None:
            message = "no eye is named for the flat version of an aligned pair"
            raise StimulusError.of(message, "write flat_eye: left, or right")
        return StereoImage.flat(image.eye(self._flat_eye)), (*steps, {"step": "flat", "view": self._flat_eye})

    def _as_parallel(self) -> StoredPicture:
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
        return StoredPicture(turned.stereo, (*read.steps, *turned.steps), False)

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
            alignment = align_pair(
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
            self._pair = _Pair(alignment, image.left if read.centre else None, crop, (*steps, *alignment.steps))
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


def _multiplied(steps: StepsSpec, series: SeriesSpec | None) -> tuple[float, ...] | None:
    """Return the factors that a picture is multiplied by in turn; None if more is done to it."""
    luminance = steps.luminance
    others = steps.model_copy(update={"luminance": None})
    grey = [spec.greyscale_white_xy for spec in (luminance, series) if spec is not None]
    if others.steps_json() != StepsSpec().steps_json() or any(grey) or (luminance and luminance.scale is None):
        return None
    scale = () if luminance is None or luminance.scale is None else (float(luminance.scale),)
    return scale if series is None else (*scale, float(series.luminance_scale))


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
        raise StimulusError.of(
            f"the crop reaches to column {right} and row {bottom}; the picture has {image.width_px} × "
            f"{image.height_px} pixels",
            "make it smaller; aligned pictures are smaller than their views",
        )
    there = slice(crop.top_px, bottom), slice(crop.left_px, right)
    left = image.left[there]
    whole = StereoImage.flat(left) if image.is_flat else StereoImage(left, image.right[there])
    return whole, {"step": "crop_to_plate", **crop.model_dump(mode="json")}


def finished_picture(
    image: StereoImage,
    steps: StepsSpec,
    series: SeriesSpec | None,
    pixel_pitch_mm: float,
    setup: DisplaySetup | None,
    observer: str = DEFAULT_OBSERVER,
) -> tuple[StereoImage, tuple[Step, ...]]:
    """Return the picture as a display of ``pixel_pitch_mm`` shows it, and what was done.

    ``observer`` is whose XYZ the picture has.

    Raises
    ------
    StimulusError
        If adaptation leaves negative light that is refused, no factor brings the picture to its luminance, or it is to
        be fitted to a display and none is known.
    """
    done: list[Step] = []
    if steps.adapt:
        image, step = adapted(image, steps.adapt, observer)
        done.append(step)
    if steps.luminance:
        image, more = _at_luminance(image, steps.luminance)
        done += more
    if series:
        shown = [series.apply(eye, series.luminance_scale) for eye in eyes_once(image)]
        image = StereoImage(shown[0], shown[-1])
        done += series.steps()
    if steps.resample:
        image, step = _resampled(image, steps.resample, pixel_pitch_mm, setup)
        done.append(step)
    if steps.tone_map:
        if setup is None:
            raise StimulusError.of(
                "the recipe fits pictures to a display's range, and no rig is named", "build with --rig"
            )
        mapped = tone_mapping(image, steps.tone_map.reference_cd_m2, setup.models, steps.tone_map.limit_percent)
        image = mapped.apply(image)
        done.append(mapped.to_json())
    return image, tuple(done)


def adapted(image: StereoImage, spec: AdaptSpec, observer: str = DEFAULT_OBSERVER) -> tuple[StereoImage, Step]:
    """Return the picture as it looks under another white, and the step; the picture itself where nothing changes.

    Raises
    ------
    StimulusError
        If light falls below 0 and that is refused.
    """
    matrix = spec.matrix(observer)
    step: Step = {
        "step": "chromatic_adaptation",
        "method": spec.method,
        "degree": spec.degree,
        "from_white_XYZ": spec.white_XYZ("from_white", observer).tolist(),
        "to_white_XYZ": spec.white_XYZ("to_white", observer).tolist(),
    }
    # A matrix this near to none changes no XYZ by a rounding of single precision.
    if np.abs(matrix - np.eye(3)).max() < 1e-9:
        return image, {**step, "pixels_computed": 0}
    if observer != DEFAULT_OBSERVER:
        step = {**step, "said": [f"{spec.method} is defined for {DEFAULT_OBSERVER}; for {observer} it is approximate"]}
    eyes, clipped = [], 0
    for eye in eyes_once(image):
        light = np.empty_like(eye)
        for band in bands(eye.shape):
            light[band] = eye[band].astype(np.float64) @ matrix.T
            below = light[band] < 0
            clipped += int(below.any(axis=-1).sum())
            light[band][below] = 0.0
        eyes.append(light)
    if clipped and spec.negative == "refuse":
        raise StimulusError.of(
            f"{clipped} pixels get negative light by the adaptation: their colours are too saturated for {spec.method}",
            "write negative: clip below 'adapt', or a smaller degree",
        )
    computed = sum(eye.shape[0] * eye.shape[1] for eye in eyes)
    shown = StereoImage.flat(eyes[0]) if image.is_flat else StereoImage(eyes[0], eyes[1])
    return shown, {**step, "pixels_computed": computed, "clipped_pixels": clipped}


def _at_luminance(image: StereoImage, spec: LuminanceSpec) -> tuple[StereoImage, list[Step]]:
    done: list[Step] = []
    for factor, step in _factor(image, spec):
        image = scaled_picture(image, factor)
        done.append({**step, "luminance_scale": factor})
    if spec.greyscale_white_xy is not None:
        image = grey_picture(image, spec.greyscale_white_xy)
        done.append({"step": "greyscale", "white_xy": list(spec.greyscale_white_xy)})
    return image, done


def _factor(image: StereoImage, spec: LuminanceSpec) -> Iterator[tuple[float, Step]]:
    if spec.scale is not None:
        yield spec.scale, {"step": "scale"}
    elif spec.mean_cd_m2 is not None:
        luminance_cd_m2 = mean_luminance_cd_m2(image)
        step = {
            "step": "adapt",
            "target_mean_luminance_cd_m2": spec.mean_cd_m2,
            "mean_luminance_cd_m2": luminance_cd_m2,
        }
        yield factor_to(luminance_cd_m2, spec.mean_cd_m2), step
    elif spec.max_cd_m2 is not None:
        luminance_cd_m2 = max_luminance_cd_m2(image)
        step = {"step": "adapt", "target_max_luminance_cd_m2": spec.max_cd_m2, "max_luminance_cd_m2": luminance_cd_m2}
        yield factor_to(luminance_cd_m2, spec.max_cd_m2), step
    elif spec.white_cd_m2 is not None and spec.white_box is not None:
        left, top, width, height = spec.white_box
        if left + width > image.width_px or top + height > image.height_px:
            raise StimulusError.of(
                f"the white_box reaches to column {left + width} and row {top + height}; the picture has "
                f"{image.width_px} × {image.height_px} pixels",
                "it is [first column, first row, width, height], of the aligned and cropped picture",
            )
        luminance_cd_m2 = white_luminance_cd_m2(image, (top, left, height, width))
        step = {
            "step": "adapt",
            "target_white_luminance_cd_m2": spec.white_cd_m2,
            "white_luminance_cd_m2": luminance_cd_m2,
        }
        yield factor_to(luminance_cd_m2, spec.white_cd_m2), {**step, "white_box": list(spec.white_box)}


def _resampled(
    image: StereoImage, spec: ResampleSpec, pixel_pitch_mm: float, setup: DisplaySetup | None
) -> tuple[StereoImage, Step]:
    size_mm = spec.size_mm(image.width_px, image.height_px)
    step: dict[str, object] = {
        "step": "resample",
        "pixel_pitch_mm": pixel_pitch_mm,
        "size_mm": list(size_mm),
        "filter": spec.filter,
    }
    if setup is not None:
        kept = display_resolution((image.width_px, image.height_px), size_mm, pixel_pitch_mm, setup.distance_mm)
        step |= {"resolution": kept.to_json(), "said": list(kept.sentences())}
    return resample_picture(image, size_mm, pixel_pitch_mm, spec.filter), step
