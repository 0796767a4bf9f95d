"""A camera characterised from a chart that it photographed, or from a table of what camera and instrument saw."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike

from devices.camera import (
    CameraFit,
    Correspondences,
    FittedPatch,
    ReferenceColours,
    fit_camera,
    read_correspondences,
    read_reference,
)
from devices.chart import COLORCHECKER, ChartLayout
from devices.colour_matching import DEFAULT_OBSERVER, colorimetric_observer
from devices.errors import DeviceError
from devices.readings import colorchecker_XYZ
from documents import Finding
from documents.arrays import Floats
from documents.pages import Table
from documents.tables import ENDINGS
from documents.text import JsonResult, visible
from extensions.photo.chart_options import ChartOptions, Triple
from extensions.photo.find import Bools, PatchValues, Picture, find_corners, sample_patches, turn_upright
from extensions.photo.pooled import ChartShot, Pooled, PooledChart, pool_shots
from stimuli.develop import Levels, read_calibration, read_camera_image
from stimuli.errors import StimulusError

_MOST_SPREAD = 0.05
_MUCH_SATURATED = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class PhotographedChart(JsonResult):
    """The patches' values beside their reference, which ``way_round`` the chart lay, and ``notes``, a sentence each.

    ``corners`` says whether they were found or given.
    """

    colours: Correspondences
    values: PatchValues
    way_round: str
    corners: Literal["found", "given"]
    notes: tuple[str, ...]
    json_keys: ClassVar = {"values.spread": "spread_rgb", "notes": "said"}
    json_names: ClassVar = "values.corners_px corners way_round values.spread values.pixels notes"


def read_chart(
    rgb: Picture,
    saturated: Bools,
    reference: ReferenceColours,
    corners_px: ArrayLike | None = None,
    layout: ChartLayout = COLORCHECKER,
    *,
    file: str | None = None,
) -> PhotographedChart:
    """Return the values of a chart in a linear picture (height, width, 3) beside its ``reference``.

    ``corners_px`` (4, 2) are the outer corners of its patches around the chart, found where they are None. A chart that
    lies another way round than the corners say is turned, with a note.

    Raises
    ------
    StimulusError
        If there is no such chart, its patches are too small, or most are saturated.
    DeviceError
        If the values cannot be those of a linear camera.
    """
    if len(reference.names) != len(layout):
        raise DeviceError(
            Finding(
                f"the reference has {len(reference.names)} colours and the chart {len(layout)} patches", reference.file
            )
        )
    how: Literal["found", "given"] = "found" if corners_px is None else "given"
    given = None if corners_px is None else check_corners(corners_px, rgb.shape, file)
    corners = _find(rgb, saturated, layout, file) if given is None else given
    if not np.all((corners >= 0) & (corners <= [rgb.shape[1], rgb.shape[0]])):
        raise StimulusError(Finding("the chart reaches out of the picture", file))
    corners, way = turn_upright(rgb, saturated, corners, reference.XYZ, layout, file=file)
    values = sample_patches(rgb, saturated, corners, layout, file=file)
    colours = Correspondences(
        values.rgb, reference.XYZ, reference.names, values.saturated, file, observer=reference.observer
    )
    notes = []
    if way:
        verb = "lies" if how == "given" else "was found"
        notes.append(f"the chart {verb} {way}; its patches were named accordingly")
    uneven = values.spread > _MOST_SPREAD * np.maximum(values.rgb, 0.02)
    if uneven.any():
        notes.append(
            f"pixels differ by more than {100 * _MOST_SPREAD:.0f} % within {colours.named(uneven.any(axis=1))}: noise, "
            "shine, or corners that do not sit well"
        )
    return PhotographedChart(colours, values, way or "upright", how, tuple(notes))


def _find(rgb: Picture, saturated: Bools, layout: ChartLayout, file: str | None) -> Floats:
    try:
        return find_corners(rgb, layout, file=file)
    except StimulusError as error:
        share = float(saturated.any(axis=2).mean())
        if share < _MUCH_SATURATED:
            raise
        raise StimulusError(
            Finding(
                f"no chart was found, and {100 * share:.0f} % of the picture's pixels are saturated",
                file,
                remedy="photograph the chart again with a shorter exposure",
            )
        ) from error


def check_corners(corners_px: ArrayLike, shape: tuple[int, ...], file: str | None = None) -> Floats:
    """Return the corners (4, 2), x and y in pixels; StimulusError unless they are a convex quadrangle in the picture.

    Pixel centres lie at whole numbers and a half: the picture is from 0 to its width and height.
    """
    corners = np.asarray(corners_px, dtype=np.float64)
    height, width = shape[:2]
    if corners.shape != (4, 2) or not np.all(np.isfinite(corners)):
        raise StimulusError(Finding(f"a chart has four corners x,y, not {corners.tolist()}", file))
    if np.any(corners < 0) or np.any(corners > [width, height]):
        raise StimulusError(
            Finding(
                f"a corner of the chart lies outside the picture of {width} × {height} pixels: {corners.tolist()}",
                file,
                remedy="give x,y in pixels from the top left",
            )
        )
    sides = np.roll(corners, -1, axis=0) - corners
    following = np.roll(sides, -1, axis=0)
    turns = sides[:, 0] * following[:, 1] - sides[:, 1] * following[:, 0]
    if not (np.all(turns > 0) or np.all(turns < 0)):
        raise StimulusError(
            Finding(
                "the chart's corners are no convex quadrangle",
                file,
                remedy="give them around the chart: top left, top right, bottom right, bottom left",
            )
        )
    return corners


@dataclass(frozen=True, slots=True, eq=False)
class ChartFit:
    """A camera fitted to a chart: the ``fit``, and how the ``chart`` was read, None if its values came in a table.

    ``notes`` are remarks on reading the chart, a sentence each. Of several photographs ``chart`` is the first, and
    ``charts`` says of each chart and exposure how the fit does on it. ``written`` and ``page`` are the camera file and
    the page on it, if they were written.
    """

    file: str
    fit: CameraFit
    chart: PhotographedChart | None
    notes: tuple[str, ...]
    charts: tuple[PooledChart, ...] = ()
    written: Path | None = None
    page: Path | None = None

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        chart = None if self.chart is None else {**self.chart.to_json(), "said": list(self.notes)}
        charts = {"charts": [pooled.to_json() for pooled in self.charts]} if self.charts else {}
        written = {"written": self.written, "report": self.page}
        files = {key: file and str(file) for key, file in written.items()}
        return {"file": self.file, "chart": chart, **charts, **self.fit.to_json(), **files}

    def told(self) -> Iterator[str | Table]:
        """Yield a table of the patches, the model, its figures, what was left out, and what was written."""
        fit = self.fit
        headings = ("patch", "X", "Y", "Z", "X est.", "Y est.", "Z est.", "ΔE00", "left out")
        yield Table.of_texts("", headings, [_cells(patch) for patch in fit.patches])
        model, zone = fit.model, fit.model.safe_luminance_cd_m2
        for axis, row, offset in zip("XYZ", model.matrix.tolist(), model.offset_XYZ.tolist(), strict=True):
            shift = f" {offset:+.5g}" if model.form == "affine" else ""
            yield f"{axis} = {row[0]:.5g} R {row[1]:+.5g} G {row[2]:+.5g} B{shift}"
        if model.exposure:
            yield f"Exposure: {model.exposure} (EV {model.exposure.ev:.2f})"
        yield f"Condition number: {fit.condition:.1f}"
        if zone:
            yield f"Safe luminance zone: {zone[0]:.4g} to {zone[1]:.4g} cd/m²"
        yield from (f"Left out: {patch.name}: {patch.left_out_reason}" for patch in fit.left_out)
        yield from (f"Note: {note}." for note in (*self.notes, *fit.notes))
        yield fit.sentence
        yield from (f"Chart: {pooled}." for pooled in self.charts)
        yield from (f"{what}: {file}" for what, file in (("Camera file", self.written), ("Report", self.page)) if file)


def _cells(patch: FittedPatch) -> list[str]:
    held = patch.held_out_delta_e
    numbers = (f"{value:.4g}" for value in (*patch.XYZ, *patch.estimated_XYZ))
    left_out = "not fitted" if patch.left_out_reason else "–" if held is None else f"{held:.2f}"
    return [patch.name, *numbers, f"{patch.delta_e:.2f}", left_out]


def is_table(chart: str | Path) -> bool:
    """Return whether ``chart`` names a table of colours, not a photograph.

    Parameters
    ----------
    chart
        A path; the file is not read.

    Returns
    -------
    bool
        True if it ends in ``.csv`` or ``.txt``, in small letters or capitals.

    Examples
    --------
    >>> is_table("chart.csv"), is_table(Path("chart.NEF"))
    (True, False)
    """
    return str(chart).lower().endswith(ENDINGS)


def fit_camera_to_chart(
    chart: str | Path | Sequence[str | Path],
    options: ChartOptions | None = None,
) -> ChartFit:
    """Fit a camera model to a photographed colour chart, or to several photographs of charts together.

    Photographs of one chart at one exposure are repeated shots: the mean of each patch counts, weighed by how the shots
    differ. Those at other exposures, or of charts with references of their own, are fitted to side by side.

    Parameters
    ----------
    chart
        A table ``R,G,B,X,Y,Z[,name]`` (``.csv``, ``.txt``), or a photograph of a 24-patch ColorChecker: raw, or TIFF or
        OpenEXR of linear camera RGB; or several photographs.
    options
        What is known of the chart and the photographs, and how the model is fitted.

    Returns
    -------
    ChartFit
        The fitted model, and every patch's ΔE00, as fitted and as predicted by the fit to all others.

    Raises
    ------
    InputError
        If a file cannot be read, no chart is found, the colours do not determine a camera model, there is no such
        observer, or the published chart is asked for another observer than CIE 1931 2°.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> rgb = np.random.default_rng(1).uniform(0.1, 0.9, (24, 3))
    >>> XYZ = rgb @ np.array([[40.0, 20.0, 5.0], [30.0, 60.0, 10.0], [20.0, 10.0, 90.0]])
    >>> with TemporaryDirectory() as folder:
    ...     table = Path(folder, "chart.csv")
    ...     np.savetxt(table, np.hstack([rgb, XYZ]), delimiter=",", header="R,G,B,X,Y,Z", comments="")
    ...     fitted = fit_camera_to_chart(table)
    >>> fitted.chart is None, fitted.notes
    (True, ())
    """
    options = options or ChartOptions()
    charts = [Path(chart)] if isinstance(chart, str | Path) else [Path(one) for one in chart]
    _check_charts(charts, options)
    observer = None if options.observer is None else colorimetric_observer(options.observer).name
    exposure = options.exposure
    first: PhotographedChart | None = None
    pooled: Pooled | None = None
    notes: tuple[str, ...] = ()
    if is_table(charts[0]):
        colours = read_correspondences(charts[0])
    else:
        references = _references(options, observer, len(charts))
        levels = Levels(saturated=options.saturated)
        calibration = read_calibration(options.dark, options.flat, levels=levels, assume_linear=options.linear)
        shots: list[ChartShot] = []
        for photo, patches in zip(charts, references, strict=True):
            # Bilinear demosaicing leaves the mean of a patch of one colour what it is, and the picture its size.
            image = read_camera_image(
                photo,
                demosaic="bilinear",
                levels=levels,
                exposure=exposure,
                assume_linear=options.linear,
                calibration=calibration,
            )
            read = read_chart(image.rgb, image.saturated, patches, options.corners_px, file=str(photo))
            first = first or read
            said = (*read.notes, *image.full_early())
            notes += said if len(charts) == 1 else tuple(f"{photo.name}: {note}" for note in said)
            shots.append(ChartShot(photo.name, patches.file, read.colours, image.exposure))
        colours, exposure = shots[0].colours, shots[0].exposure
        if len(shots) > 1:
            pooled = pool_shots(shots)
            colours, notes = pooled.colours, (*notes, *pooled.notes)
            exposure = None
    what = visible(charts[0].name) + (f" and {len(charts) - 1} more" if len(charts) > 1 else "")
    by = "ΔE00" if options.loss == "delta-e" else "XYZ"
    fit = fit_camera(
        colours,
        options.form,
        options.loss,
        black_rgb=options.black_rgb,
        exposure=exposure,
        name=options.camera_name,
        source=f"{options.form} form, least squares in {by}, {what}",
        observer=observer,
    )
    by_chart = () if pooled is None else pooled.residuals(fit)
    return ChartFit(str(charts[0]), _with_figures(fit), first, notes, by_chart)


def _check_charts(charts: Sequence[Path], asked: ChartOptions) -> None:
    if not charts:
        raise StimulusError.of("there is no chart to fit to", "give a table, or photographs of a chart")
    tables = [chart for chart in charts if is_table(chart)]
    if tables and len(charts) > 1:
        message = "a table is given beside other charts"
        raise StimulusError.at(tables[0], message, "put all rows into one table, or give photographs alone")
    if len({chart.resolve() for chart in charts}) < len(charts):
        raise StimulusError.of("a photograph is named twice", "name it once: it would count as a repeated shot")
    of_photographs = ("reference", "white_XYZ_cd_m2", "corners_px", "saturated", "dark", "flat", "linear")
    given = [getattr(asked, name) for name in of_photographs]
    if tables and any(np.size(value) and value is not None and value is not False for value in given):
        remedy = "leave out reference, white, corners, saturated, dark, flat and linear"
        raise StimulusError.at(tables[0], "options of a photograph are given with a table", remedy)


def _references(asked: ChartOptions, observer: str | None, count: int) -> list[ReferenceColours]:
    """Return the reference of each photograph."""
    if bool(asked.reference) == (asked.white_XYZ_cd_m2 is not None):
        remedy = "give the chart's measured patches or its white patch, and one of them"
        raise StimulusError(Finding("a photograph of a chart says nothing of its colours", remedy=remedy))
    if asked.white_XYZ_cd_m2 is not None:
        return [_published(asked.white_XYZ_cd_m2, observer)] * count
    if len(asked.reference) not in (1, count):
        what = f"{len(asked.reference)} references are given for {count} photographs"
        raise StimulusError.of(what, "give one for all, or one for each in their order")
    read = [_measured(one, observer) for one in asked.reference]
    if len({one.observer for one in read}) > 1:
        raise StimulusError.of("the references are for different observers", "give XYZ of one observer")
    return read * count if len(read) == 1 else read


def _measured(reference: Path, observer: str | None) -> ReferenceColours:
    measured = read_reference(reference)
    if None not in (observer, measured.observer) and observer != measured.observer:
        what = f"its XYZ are for the observer {measured.observer}; {observer} is wanted"
        raise StimulusError(Finding(what, measured.file, remedy="leave the observer out, or give XYZ for it"))
    return measured


def _published(white_XYZ_cd_m2: Triple, observer: str | None) -> ReferenceColours:
    if observer not in (None, DEFAULT_OBSERVER):
        what = f"the chart's published colours are for {DEFAULT_OBSERVER}, and the camera file is to be for {observer}"
        raise StimulusError(Finding(what, remedy="measure the patches' spectra, and give their XYZ with --reference"))
    names, XYZ = colorchecker_XYZ(white_XYZ_cd_m2)
    return ReferenceColours(XYZ, names)


def _with_figures(fit: CameraFit) -> CameraFit:
    """Return the fit whose model's source says what it was fitted to and how well it predicts."""
    source = f"{fit.model.source}: {fit.fitted.patches} of {len(fit.patches)} patches"
    if fit.held_out is not None:
        held = fit.held_out
        source += f"; left-out ΔE00 mean {held.mean:.2f}, 95th percentile {held.p95:.2f}, largest {held.max:.2f}"
    return replace(fit, model=replace(fit.model, source=source))
