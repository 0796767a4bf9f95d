"""Measuring two pictures, eye by eye and for both eyes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.eyes import AnyEye
from documents import Finding
from documents.arrays import Floats32
from stimuli.errors import StimulusError
from stimuli.measures.measure import EyeMeasured, Measure
from stimuli.measures.registry import asked_names, measures_named, package_of
from stimuli.measures.table import MeasureRow, MeasureTable
from stimuli.measures.viewing import ViewingConditions
from stimuli.pictures.rows import BAND_PIXELS, Mask, Rows, bands
from stimuli.pictures.stereo_image import StereoImage

# A map is drawn with at most so many pixels along its longer side, each the mean of those it stands for.
LONGEST_PX = 900


@dataclass(frozen=True, eq=False, slots=True)
class PicturePair:
    """The reference and the test picture of one eye, XYZ in cd/m², (height, width, 3), and the pixels that count.

    Pixels that are not ``usable``, such as saturated ones, take the reference's values in both pictures. Of the others,
    those that are ``counted`` enter a value that is pooled over pixels. Both are bool (height, width); None is all.
    """

    reference: Rows
    test: Rows
    usable: Mask | None = None
    counted: Mask | None = None

    @property
    def pooled(self) -> Mask | None:
        """The pixels that enter a value, bool (height, width); None for all."""
        masks = [mask for mask in (self.usable, self.counted) if mask is not None]
        return np.asarray(np.logical_and.reduce(masks)) if masks else None


def measure_pictures(
    reference: StereoImage | ArrayLike,
    test: StereoImage | ArrayLike,
    names: Iterable[str],
    viewing: ViewingConditions | None,
) -> MeasureTable:
    """Return how far a test picture is from its reference, by one measure or several, eye by eye and for both.

    Parameters
    ----------
    reference, test
        Pictures for one eye or two: `StereoImage`, or arrays (height, width, 3) of XYZ in cd/m².
    names
        Names of `measure_names`; ``all`` stands for those that are installed.
    viewing
        The pixels per degree of visual angle, and the white of the display.

    Returns
    -------
    MeasureTable
        A row for each measure: ``table["flip"].eyes["left"].value``, ``table["flip"].binocular``.

    Raises
    ------
    StimulusError
        If there is no such measure, its package is not installed, the viewing conditions are not known, one picture is
        for two eyes and the other is flat, they differ in size, or have NaN or infinity.

    Examples
    --------
    >>> grey = np.full((32, 32, 3), [47.5, 50.0, 54.4])
    >>> viewing = ViewingConditions(pixels_per_degree=40.0, display_white_XYZ=np.array([95.0, 100.0, 108.9]))
    >>> table = measure_pictures(grey, 1.02 * grey, ["delta-e-2000", "s-cielab"], viewing)
    >>> round(table["delta-e-2000"].eyes["both"].value, 2)
    0.44
    """
    first, second = _eyes(reference), _eyes(test)
    if set(first) != set(second):
        flat, stereo = ("reference", "test picture") if "both" in first else ("test picture", "reference")
        raise StimulusError.of(
            f"the {flat} is one picture and the {stereo} a pair for two eyes, and measures for two eyes need two pairs",
            "give two of a kind",
        )
    return measure_pairs({eye: PicturePair(first[eye], second[eye]) for eye in first}, names, viewing)


def measure_pairs(
    pairs: Mapping[AnyEye, PicturePair],
    names: Iterable[str],
    viewing: ViewingConditions | None,
    *,
    map_longest_px: int | None = None,
    progress: Callable[[str, int, int], None] | None = None,
) -> MeasureTable:
    """Return how far test pictures are from their references, by one measure or several.

    The value for both eyes is the mean of those of each eye [Campisi2007]; of a ratio in dB, the ratio of the mean.

    Parameters
    ----------
    pairs
        The pictures of the ``left`` and ``right`` eye, or one pair for ``both``.
    names
        Names of `measure_names`; ``all`` stands for those that are installed, of which one that cannot take these
        pictures is left out with a remark.
    viewing
        The pixels per degree of visual angle, and the white of the display.
    map_longest_px
        Keep maps with at most so many pixels along their longer side, each the mean of those it stands for.
    progress
        Called with what is measured, how many of the measures are done, and of how many.

    Returns
    -------
    MeasureTable
        A row for each measure.

    Raises
    ------
    StimulusError
        As of `measure_pictures`, or if no pixel of a pair counts.
    """
    asked = asked_names(names)
    measures, viewing = measures_for(asked, viewing), _known(viewing)
    for eye, pair in pairs.items():
        _check(pair, "" if eye == "both" else f" of the {eye} eye")
    rows, left_out = [], []
    for done, measure in enumerate(measures):
        if progress is not None:
            progress(f"Measuring {measure.title}", done, len(measures))
        try:
            rows.append(_row(measure, pairs, viewing, map_longest_px))
        except StimulusError as error:
            if measure.name in asked:
                raise
            left_out.append(f"{measure.title} is left out: {error.findings[0].message}")
    if not rows:
        raise StimulusError([Finding("no measure can take these pictures"), *map(Finding, left_out)])
    if progress is not None:
        progress("Measuring pictures", len(measures), len(measures))
    return MeasureTable(tuple(rows), viewing, tuple(left_out))


def measures_for(names: Iterable[str], viewing: ViewingConditions | None) -> tuple[Measure, ...]:
    """Return measures by name, after what they need beside pictures was checked.

    Parameters
    ----------
    names
        As of `measures_named`.
    viewing
        How the pictures are seen, None where it is not known.

    Returns
    -------
    tuple of Measure
        The measures.

    Raises
    ------
    StimulusError
        If there is no such measure, its package is not installed, or the viewing conditions are not known.

    Examples
    --------
    >>> [measure.name for measure in measures_for(["pu-psnr"], ViewingConditions(pixels_per_degree=45.0))]
    ['pu-psnr']
    """
    asked = asked_names(names)
    measures, seen = measures_named(asked), _known(viewing)
    if any(measure.needs_display_white and measure.name in asked for measure in measures):
        _ = seen.white_XYZ
    return measures


def _known(viewing: ViewingConditions | None) -> ViewingConditions:
    if viewing is None:
        raise StimulusError.of(
            "it is not known from how far the pictures are seen, and on what display, which measures of pictures need",
            "give --rig RIG.yaml, or --display D.yaml and --distance-mm",
        )
    density = viewing.pixels_per_degree
    if not (np.isfinite(density) and density > 0):
        raise StimulusError(f"pixels_per_degree is {density}; it must be a finite number above 0")
    return viewing


def _eyes(picture: StereoImage | ArrayLike) -> dict[AnyEye, NDArray[np.floating]]:
    if not isinstance(picture, StereoImage):
        return {"both": np.asarray(picture, dtype=np.float32)}
    return {"both": picture.left} if picture.is_flat else {"left": picture.left, "right": picture.right}


def _check(pair: PicturePair, whose: str) -> None:
    shapes = tuple(pair.reference.shape), tuple(pair.test.shape)
    if shapes[0] != shapes[1] or len(shapes[0]) != 3 or shapes[0][2] != 3 or 0 in shapes[0]:
        raise StimulusError.of(
            f"the pictures{whose} have the shapes {shapes[0]} and {shapes[1]}; they must be one (height, width, 3)",
            "bring them to one grid first, as `cyclopean compare` does",
        )
    masks = [mask for mask in (pair.usable, pair.counted) if mask is not None]
    if any(mask.shape != shapes[0][:2] for mask in masks):
        raise StimulusError(f"a mask of the pictures{whose} differs from them in size: it must be {shapes[0][:2]}")
    if masks and not np.any(pair.pooled):
        raise StimulusError(f"no pixel of the pictures{whose} is left to measure: all are excluded")
    for name, picture in (("reference", pair.reference), ("test picture", pair.test)):
        bad = 0
        for band in bands(picture.shape):
            wrong = ~np.isfinite(picture[band]).all(axis=-1)
            bad += int(
                np.count_nonzero(wrong if name == "reference" or pair.usable is None else wrong & pair.usable[band])
            )
        if bad:
            raise StimulusError(f"{bad} pixels of the {name}{whose} cannot be measured: they have NaN or infinity")


class _Prepared:
    """The rows of one picture of a pair as they are measured: no light below 0, the reference where none is usable."""

    def __init__(self, picture: Rows, pair: PicturePair) -> None:
        self._picture, self._reference, self._usable = picture, pair.reference, pair.usable

    @property
    def shape(self) -> tuple[int, ...]:
        """Height, width and 3."""
        return self._picture.shape

    def __getitem__(self, rows: slice, /) -> Floats32:
        """Return those rows, float32 (rows, width, 3)."""
        part = _without_negative(self._picture[rows])
        if self._usable is None or self._picture is self._reference:
            return part
        return np.where(self._usable[rows][..., None], part, _without_negative(self._reference[rows]))


def _without_negative(light: NDArray[np.floating]) -> Floats32:
    return np.asarray(np.maximum(light, 0), dtype=np.float32)


def _row(
    measure: Measure, pairs: Mapping[AnyEye, PicturePair], viewing: ViewingConditions, map_longest_px: int | None
) -> MeasureRow:
    try:
        eyes = {eye: _measured(measure, pair, viewing, map_longest_px) for eye, pair in pairs.items()}
    except Exception as error:
        # Another package's measure is left out by what it raises; ours raise nothing else.
        if isinstance(error, StimulusError) or not (of := package_of(measure.name)):
            raise
        raise StimulusError(f"'{measure.name}' failed ({type(error).__name__}: {error}): {of[0]}") from error
    values = [measured.value for measured in eyes.values()]
    return MeasureRow(measure, eyes, measure.binocular(values) if len(eyes) > 1 else None)


def _measured(
    measure: Measure, pair: PicturePair, viewing: ViewingConditions, map_longest_px: int | None
) -> EyeMeasured:
    measured = measure.measure(_Prepared(pair.reference, pair), _Prepared(pair.test, pair), viewing)
    errors, pooled, usable = measured.error_map, pair.pooled, pair.usable
    if pooled is not None:
        value = None if errors is None else measure.pooled(errors[pooled])
        if value is not None:
            measured = replace(measured, value=value)
        elif not pooled.all():
            remark = f"{measure.title} is of the whole picture, not of the regions that count alone"
            measured = replace(measured, remarks=(*measured.remarks, remark))
    if errors is None:
        return measured
    if usable is not None:
        errors = np.where(usable, errors, np.float32(np.nan))
    if map_longest_px is not None:
        errors = reduced(errors, np.isfinite(errors), map_longest_px)
    return replace(measured, error_map=errors)


def reduced(values: Floats32, compared: Mask | None = None, longest_px: int = LONGEST_PX) -> Floats32:
    """Return a map, (height, width), as means over square blocks: NaN where a block has no compared pixel."""
    size = max(1, -(-max(values.shape) // longest_px))
    height, width = values.shape
    columns = np.arange(0, width, size)
    means = []
    # A few rows of blocks at a time, so that no other map of this size is in memory.
    step = size * max(1, BAND_PIXELS // (width * size))
    for first in range(0, height, step):
        part = values[first : first + step]
        rows = np.arange(0, len(part), size)
        if compared is None:
            counts = np.outer(np.diff([*rows, len(part)]), np.diff([*columns, width])).astype(np.float64)
        else:
            within = compared[first : first + step]
            counts = _sums(within.astype(np.float32), rows, columns)
            part = np.where(within, part, np.float32(0))
        total = _sums(part, rows, columns)
        means.append(np.divide(total, counts, out=np.full(counts.shape, np.nan), where=counts > 0))
    return np.asarray(np.concatenate(means), dtype=np.float32)


def _sums(values: Floats32, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> NDArray[np.float64]:
    """Return sums over blocks that begin at ``rows`` and ``columns``: down a block in float32, which is fast."""
    return np.asarray(np.add.reduceat(np.add.reduceat(values, rows, axis=0), columns, axis=1, dtype=np.float64))
