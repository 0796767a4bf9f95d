"""Dark frames and flat fields: what a sensor records without light, and of an even light.

value = (photograph − dark) / flat, photosite by photosite, before colours are interpolated. Several frames are pooled
by their mean, so that their own noise falls with the square root of their number.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.camera import Exposure
from stimuli.develop.levels import Levels
from stimuli.develop.raw_files import read_sensor_image
from stimuli.develop.sensor_image import SensorImage
from stimuli.errors import StimulusError

# A sensor at room temperature gathers less than a tenth of an electron in this time: any shorter dark frame serves.
_NO_DARK_CURRENT_S = 1.0
_SAME = 2e-3
_MOST_UNUSABLE = 1e-3
_DEAD = 0.01
_CLIPPED = 4.0
_COLOURS = ("red", "green", "blue")


@dataclass(frozen=True, eq=False, slots=True)
class Frames:
    """Frames of one kind, pooled: ``mean`` of their values in shares of full scale, as the sensor stores them.

    ``first`` is the first frame without its values: zeros of their shape.
    ``usable`` says which photosites are: not full in any frame, nor dead in a flat field. ``noise`` (3,) is the
    standard deviation of red, green and blue from frame to frame; of a single frame, from photosite to photosite.
    """

    first: SensorImage
    mean: NDArray[np.float32]
    usable: NDArray[np.bool_]
    files: tuple[str, ...]
    sha256: tuple[str, ...]
    noise: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.files)

    def as_step(self, step: str) -> dict[str, Any]:
        """Return the step that they are in."""
        exposure = self.first.exposure
        return {
            "step": step,
            "files": list(self.files),
            "sha256_of_files": list(self.sha256),
            "frames": len(self),
            "exposure": None if exposure is None else exposure.to_json(),
            "unusable_photosites": int(self.usable.size - np.count_nonzero(self.usable)),
        }


@dataclass(frozen=True, eq=False, slots=True)
class Calibration:
    """The pooled dark frames and flat fields that photographs are corrected by; None where there are none."""

    dark: Frames | None = None
    flat: Frames | None = None

    def applied(self, photo: SensorImage) -> SensorImage:
        """Return ``photo`` without what the sensor records in the dark, divided by the flat field.

        Photosites that are full in the dark are marked saturated. Where the flat field is full or dead, the value
        stays as it is.

        Raises
        ------
        StimulusError
            If the frames are of another camera or size, or were taken at another ISO, time or aperture, or the dark
            frames are brighter than the photograph.
        """
        if self.dark is not None:
            photo = _without_dark(photo, self.dark)
        return photo if self.flat is None else _flattened(photo, self.flat)


def read_calibration(
    dark: Sequence[Path] = (), flat: Sequence[Path] = (), *, levels: Levels | None = None, assume_linear: bool = False
) -> Calibration:
    """Return the frames in ``dark`` and ``flat``, each pooled; a folder stands for all the files in it.

    The flat field is freed from the dark frames where these serve its exposure, and its centre set to 1 in each colour:
    the middle of a photograph stays as it is.

    Raises
    ------
    StimulusError
        If a frame cannot be read, frames of a kind do not go together, or a flat field is saturated or dark.
    """
    pooled_dark = _pooled(_files(dark), "dark frame", levels, assume_linear) if dark else None
    if not flat:
        return Calibration(pooled_dark)
    even = _pooled(_files(flat), "flat field", levels, assume_linear)
    if pooled_dark is not None and _serves(pooled_dark.first.exposure, even.first.exposure) is None:
        _same_sensor(even.first, pooled_dark, "dark frame")
        even = replace(even, mean=even.mean - pooled_dark.mean)
    return Calibration(pooled_dark, _normalised(even))


def _files(paths: Sequence[Path]) -> list[Path]:
    files: list[Path] = []
    for path in map(Path, paths):
        if not path.is_dir():
            files.append(path)
            continue
        inside = sorted(file for file in path.iterdir() if file.is_file() and not file.name.startswith("."))
        if not inside:
            raise StimulusError.at(path, "the folder has no files", "give frames, or a folder of them")
        files += inside
    return files


def _pooled(files: Sequence[Path], what: str, levels: Levels | None, assume_linear: bool) -> Frames:
    first: SensorImage | None = None
    total = last = usable = None
    digests: list[str] = []
    variances: list[NDArray[np.float64]] = []
    for path in files:
        frame = read_sensor_image(path, levels=levels, rotate=False, assume_linear=assume_linear)
        if first is None or total is None or usable is None or last is None:
            first, total, usable = frame, frame.values.astype(np.float64), ~frame.saturated
        else:
            _like_the_first(frame, first, what)
            total += frame.values
            usable &= ~frame.saturated
            variances.append(_variances(frame.values - last, frame) / 2)
        last = frame.values
        digests.append(next(str(step["sha256"]) for step in reversed(frame.steps) if "sha256" in step))
    assert first is not None
    assert total is not None
    assert usable is not None
    if not variances:
        variances.append(_variances(first.values, first))
    noise = np.sqrt(np.mean(variances, axis=0))
    total /= len(files)
    mean = total.astype(np.float32)
    # Of the first frame no more is needed than its shape and what is known of it.
    shape = first.values.shape
    first = replace(first, values=np.broadcast_to(np.float32(0), shape), saturated=np.broadcast_to(np.False_, shape))
    return Frames(first, mean, usable, tuple(path.name for path in files), tuple(digests), noise)


def _like_the_first(frame: SensorImage, first: SensorImage, what: str) -> None:
    if frame.values.shape != first.values.shape or not _same_pattern(frame, first):
        raise StimulusError.at(
            frame.source, f"the {what} has {_size(frame)}, and {first.source.name} {_size(first)}", "give frames alike"
        )
    if frame.camera and first.camera and frame.camera != first.camera:
        message = f"the {what} is of a {frame.camera}, and {first.source.name} of a {first.camera}"
        raise StimulusError.at(frame.source, message, "give frames of one camera")
    if frame.exposure and first.exposure and not _alike(frame.exposure, first.exposure):
        message = f"the {what} was taken at {frame.exposure}, and {first.source.name} at {first.exposure}"
        raise StimulusError.at(frame.source, message, "give frames of one exposure")


def _alike(one: Exposure, other: Exposure) -> bool:
    pairs = ((one.time_s, other.time_s), (one.f_number, other.f_number), (one.iso, other.iso))
    return all(abs(a / b - 1) <= _SAME for a, b in pairs)


def _variances(values: NDArray[np.float32], frame: SensorImage) -> NDArray[np.float64]:
    """Return the variance of red, green and blue, without what lies beyond four standard deviations."""
    found = []
    for places in frame.planes():
        part = np.concatenate([values[place].ravel()[:: max(1, values.size // 4_000_000)] for place in places])
        found.append(clipped_variance(part))
    return np.array(found)


def clipped_variance(values: NDArray[np.floating[Any]]) -> float:
    """Return the variance of ``values`` (n,) without those beyond four standard deviations, as of normal noise."""
    from scipy.special import ndtr

    signed = np.asarray(values, dtype=np.float64) - np.median(values)
    off = np.abs(signed)
    # Codes are whole numbers: the median of the deviations alone would often be none.
    spread = max(1.4826 * float(np.median(off)), 1.2533 * float(off[off <= np.quantile(off, 0.98)].mean()))
    kept = signed[off <= _CLIPPED * spread]
    missing = 2 * _CLIPPED * np.exp(-0.5 * _CLIPPED**2) / np.sqrt(2 * np.pi) / (2 * ndtr(_CLIPPED) - 1)
    return float(kept.var() / (1 - missing)) if spread > 0 else 0.0


def _normalised(even: Frames) -> Frames:
    """Return the flat field with a centre of 1 in each colour; its dead and full photosites are 1 too."""
    gains, usable = even.mean.copy(), even.usable.copy()
    path = even.first.source
    for colour, places in zip(_COLOURS, even.first.planes(), strict=True):
        full = sum(int(np.count_nonzero(~even.usable[place])) for place in places)
        of = sum(even.usable[place].size for place in places)
        if full > _MOST_UNUSABLE * of:
            message = f"the flat field is saturated at {100 * full / of:.3g} % of the {colour} photosites"
            raise StimulusError.at(path, message, "photograph it again with half the exposure or less")
        centre = float(np.mean([_centre(even.mean[place]) for place in places]))
        dead = sum(int(np.count_nonzero(even.mean[place] <= _DEAD * centre)) for place in places)
        if not centre > 0 or dead > _MOST_UNUSABLE * of:
            message = (
                f"the flat field is dark at {100 * (dead / of if centre > 0 else 1):.3g} % of the {colour} photosites"
            )
            raise StimulusError.at(path, message, "photograph an even bright surface, a third to two thirds exposed")
        for place in places:
            gains[place] /= np.float32(centre)
            usable[place] &= even.mean[place] > _DEAD * centre
    gains[~usable] = 1
    return replace(even, mean=gains, usable=usable)


def _centre(plane: NDArray[np.float32]) -> float:
    height, width = plane.shape
    middle = plane[2 * height // 5 : max(3 * height // 5, 2 * height // 5 + 1)]
    return float(middle[:, 2 * width // 5 : max(3 * width // 5, 2 * width // 5 + 1)].mean(dtype=np.float64))


def _without_dark(photo: SensorImage, dark: Frames) -> SensorImage:
    _same_sensor(photo, dark, "dark frame")
    if reason := _serves(dark.first.exposure, photo.exposure):
        raise StimulusError.at(dark.first.source, reason.format(photo=photo.source.name), "take dark frames like it")
    means = []
    for colour, places in zip(_COLOURS, photo.planes(), strict=True):
        seen = np.mean([photo.values[place].mean(dtype=np.float64) for place in places])
        black = np.mean([dark.mean[place].mean(dtype=np.float64) for place in places])
        count = sum(photo.values[place].size for place in places)
        noise = np.sqrt(_variances(photo.values, photo).max() / count)
        if seen < black - 5 * noise - 1e-7:
            message = f"the dark frame is brighter than {photo.source.name}: {black:.4g} of full scale in {colour}, "
            raise StimulusError.at(
                dark.first.source,
                f"{message}beside {seen:.4g}",
                "take it with the cap on the lens, or give the right one",
            )
        means.append(float(black))
    step = {**dark.as_step("dark"), "mean_rgb": means}
    return replace(
        photo,
        values=photo.values - dark.mean,
        saturated=photo.saturated | ~dark.usable,
        steps=(*photo.steps, step),
    )


def _flattened(photo: SensorImage, flat: Frames) -> SensorImage:
    _same_sensor(photo, flat, "flat field")
    taken, even = photo.exposure, flat.first.exposure
    if taken and even and abs(even.f_number / taken.f_number - 1) > _SAME:
        message = f"the flat field was taken at f/{even.f_number:g}, and {photo.source.name} at f/{taken.f_number:g}"
        raise StimulusError.at(
            flat.first.source, message, "a lens darkens its corners by its aperture: take it like that"
        )
    gains = [flat.mean[place] for places in photo.planes() for place in places]
    step = {
        **flat.as_step("flat"),
        "lowest": min(float(gain.min()) for gain in gains),
        "highest": max(float(gain.max()) for gain in gains),
    }
    return replace(photo, values=photo.values / flat.mean, steps=(*photo.steps, step))


def _same_sensor(photo: SensorImage, frames: Frames, what: str) -> None:
    first = frames.first
    if first.values.shape != photo.values.shape or not _same_pattern(first, photo):
        message = f"the {what} has {_size(first)}, and {photo.source.name} {_size(photo)}"
        raise StimulusError.at(first.source, message, f"give the {what} of the same camera, in the same kind of file")
    if first.camera and photo.camera and first.camera != photo.camera:
        message = f"the {what} is of a {first.camera}, and {photo.source.name} of a {photo.camera}"
        raise StimulusError.at(first.source, message, f"give the {what} of the same camera")


def _serves(dark: Exposure | None, photo: Exposure | None) -> str | None:
    """Return why dark frames of one exposure do not serve a photograph of another; None if they do."""
    if dark is None or photo is None:
        return None
    if abs(dark.iso / photo.iso - 1) > _SAME:
        return f"the dark frame was taken at ISO {dark.iso:g}, and {{photo}} at ISO {photo.iso:g}"
    longest = max(dark.time_s, photo.time_s)
    if longest > _NO_DARK_CURRENT_S and abs(dark.time_s / photo.time_s - 1) > _SAME:
        return f"the dark frame was taken at {dark}, and {{photo}} at {photo}"
    return None


def _same_pattern(one: SensorImage, other: SensorImage) -> bool:
    if one.pattern is None or other.pattern is None:
        return one.pattern is other.pattern
    return bool(np.array_equal(one.pattern, other.pattern))


def _size(sensor: SensorImage) -> str:
    width, height = sensor.size_px
    return f"{width} × {height} {'pixels of R, G and B' if sensor.pattern is None else 'photosites'}"
