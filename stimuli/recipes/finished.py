"""From a prepared picture to the one that is shown: its luminance, its series, its size, the display's range.

Factors and grey act on each pixel alone, so that they come before the picture is resampled, at its own precision. What
saturates is counted on the display's pixels, so that tone mapping comes last: a sparkle that one camera pixel holds is
less bright where it is averaged with its neighbours.
"""

from __future__ import annotations

from collections.abc import Iterator

from documents import Finding
from stimuli.errors import StimulusError
from stimuli.luminance.scale import (
    eyes_once,
    factor_to,
    grey_picture,
    max_luminance_cd_m2,
    mean_luminance_cd_m2,
    scaled_picture,
    white_luminance_cd_m2,
)
from stimuli.luminance.tone_map import tone_mapping
from stimuli.pictures.resample import resample_picture
from stimuli.pictures.resolution import resolution
from stimuli.pictures.stereo_image import StereoImage
from stimuli.recipes.build_context import DisplaySetup, Step
from stimuli.recipes.steps import LuminanceSpec, ResampleSpec, StepsSpec
from stimuli.recipes.values import SeriesSpec


def finished_picture(
    image: StereoImage,
    steps: StepsSpec,
    series: SeriesSpec | None,
    pixel_pitch_mm: float,
    setup: DisplaySetup | None,
) -> tuple[StereoImage, tuple[Step, ...]]:
    """Return the picture as a display of ``pixel_pitch_mm`` shows it, and what was done.

    Raises
    ------
    StimulusError
        If no factor brings it to its luminance, or it is to be fitted to a display and none is known.
    """
    done: list[Step] = []
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
            raise StimulusError(
                Finding("the recipe fits pictures to a display's range, and no rig is named", remedy="build with --rig")
            )
        mapped = tone_mapping(image, steps.tone_map.reference_cd_m2, setup.models, steps.tone_map.limit_percent)
        image = mapped.apply(image)
        done.append(mapped.to_json())
    return image, tuple(done)


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
        found = mean_luminance_cd_m2(image)
        step = {"step": "adapt", "target_mean_luminance_cd_m2": spec.mean_cd_m2, "mean_luminance_cd_m2": found}
        yield factor_to(found, spec.mean_cd_m2), step
    elif spec.max_cd_m2 is not None:
        found = max_luminance_cd_m2(image)
        step = {"step": "adapt", "target_max_luminance_cd_m2": spec.max_cd_m2, "max_luminance_cd_m2": found}
        yield factor_to(found, spec.max_cd_m2), step
    elif spec.white_cd_m2 is not None and spec.white_box is not None:
        left, top, width, height = spec.white_box
        if left + width > image.width_px or top + height > image.height_px:
            raise StimulusError(
                Finding(
                    f"the white_box reaches to column {left + width} and row {top + height}; the picture has "
                    f"{image.width_px} × {image.height_px} pixels",
                    remedy="it is [first column, first row, width, height], of the aligned and cropped picture",
                )
            )
        found = white_luminance_cd_m2(image, (top, left, height, width))
        step = {"step": "adapt", "target_white_luminance_cd_m2": spec.white_cd_m2, "white_luminance_cd_m2": found}
        yield factor_to(found, spec.white_cd_m2), {**step, "white_box": list(spec.white_box)}


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
        kept = resolution((image.width_px, image.height_px), size_mm, pixel_pitch_mm, setup.distance_mm)
        step |= {"resolution": kept.to_json(), "said": list(kept.sentences())}
    return resample_picture(image, size_mm, pixel_pitch_mm, spec.filter), step
