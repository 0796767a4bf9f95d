"""Measuring two pictures, eye by eye and for both eyes: the table."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stimuli.errors import StimulusError
from stimuli.measures.measure import EyeMeasured, Measure
from stimuli.measures.reduced import reduced
from stimuli.measures.registry import measures_named
from stimuli.measures.viewing import ViewingConditions
from stimuli.pictures.rows import Floats32, Mask, Rows, bands
from stimuli.pictures.stereo_image import StereoImage

Eye = Literal["left", "right", "both"]


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


@dataclass(frozen=True, eq=False, slots=True)
class MeasureRow:
    """What one measure says: of each eye, ``both`` for a flat picture, and ``binocular``, None for a flat picture."""

    measure: Measure
    eyes: Mapping[Eye, EyeMeasured]
    binocular: float | None

    def to_json(self) -> dict[str, Any]:
        """Return the numbers by name; None for infinity, which only identical pictures have."""
        values: dict[str, float] = {eye: measured.value for eye, measured in self.eyes.items()}
        if self.binocular is not None:
            values["binocular"] = self.binocular
        remarks = list(dict.fromkeys(remark for measured in self.eyes.values() for remark in measured.remarks))
        return {
            "name": self.measure.name,
            "title": self.measure.title,
            "unit": self.measure.unit,
            "better": self.measure.better,
            "identical": _or_none(self.measure.identical),
            **{name: _or_none(value) for name, value in values.items()},
            "remarks": remarks,
        }


@dataclass(frozen=True, eq=False, slots=True)
class MeasureTable:
    """The measures of two pictures, one row each."""

    rows: tuple[MeasureRow, ...]
    viewing: ViewingConditions

    def __getitem__(self, name: str) -> MeasureRow:
        """Return the row of the measure of that name."""
        for row in self.rows:
            if row.measure.name == name:
                return row
        raise KeyError(name)

    def binocular(self, name: str) -> float:
        """Return the value of a measure for both eyes. Raises StimulusError for flat pictures, which have none."""
        value = self[name].binocular
        if value is None:
            raise StimulusError.of(
                f"the pictures are flat, and '{name}' has no value for two eyes",
                "give pairs for two eyes, or take the value of the one picture",
            )
        return value

    def to_json(self) -> list[dict[str, Any]]:
        """Return the rows as JSON values."""
        return [row.to_json() for row in self.rows]

    def lines(self) -> list[str]:
        """Return the table as lines of text, its columns one below the other."""
        if not self.rows:
            return []
        eyes = tuple(self.rows[0].eyes)
        columns = (*eyes, "both eyes") if len(eyes) > 1 else ("value",)
        cells = [["measure", *columns, ""]]
        for row in self.rows:
            values = [row.eyes[eye].value for eye in eyes] + ([] if row.binocular is None else [row.binocular])
            better = "less is closer" if row.measure.better == "lower" else "more is closer"
            cells.append([row.measure.title, *(printed(value, row.measure.unit) for value in values), better])
        widths = [max(len(line[column]) for line in cells) for column in range(len(cells[0]))]
        return [
            "  ".join(
                cell.ljust(width) if at in (0, len(line) - 1) else cell.rjust(width)
                for at, (cell, width) in enumerate(zip(line, widths, strict=True))
            ).rstrip()
            for line in cells
        ]


def _or_none(value: float) -> float | None:
    return value if np.isfinite(value) else None


def printed(value: float, unit: str) -> str:
    """Return a value with four significant digits and its unit, ``∞`` where it is infinite."""
    number = "∞" if np.isinf(value) else f"{value:.4g}"
    return f"{number} {unit}".rstrip()


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
    pairs: Mapping[Eye, PicturePair],
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
        Names of `measure_names`; ``all`` stands for those that are installed.
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
    measures = measures_named(names)
    if viewing is None:
        raise StimulusError.of(
            "it is not known from how far the pictures are seen, and on what display, which measures of pictures need",
            "give --rig RIG.yaml, or --display D.yaml and --distance-mm",
        )
    density = viewing.pixels_per_degree
    if not (np.isfinite(density) and density > 0):
        raise StimulusError(f"pixels_per_degree is {density}; it must be a finite number above 0")
    for eye, pair in pairs.items():
        _check(pair, "" if eye == "both" else f" of the {eye} eye")
    rows = []
    for done, measure in enumerate(measures):
        if progress is not None:
            progress(f"Measuring {measure.title}", done, len(measures))
        rows.append(_row(measure, pairs, viewing, map_longest_px))
    if progress is not None:
        progress("Measuring pictures", len(measures), len(measures))
    return MeasureTable(tuple(rows), viewing)


def _eyes(picture: StereoImage | ArrayLike) -> dict[Eye, NDArray[np.floating]]:
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
        bad = sum(int(np.count_nonzero(~np.isfinite(picture[band]).all(axis=-1))) for band in bands(picture.shape))
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
    measure: Measure, pairs: Mapping[Eye, PicturePair], viewing: ViewingConditions, map_longest_px: int | None
) -> MeasureRow:
    eyes = {eye: _measured(measure, pair, viewing, map_longest_px) for eye, pair in pairs.items()}
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
