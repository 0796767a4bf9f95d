"""A camera characterised from a chart that it photographed, or from a table of what camera and instrument saw."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from devices.camera import (
    CameraFit,
    Exposure,
    Form,
    Loss,
    ReferenceColours,
    fit_camera,
    read_correspondences,
    read_reference,
)
from devices.patches import colorchecker_XYZ
from documents import Finding
from documents.text import visible
from stimuli.chart.photographed import PhotographedChart, read_chart
from stimuli.develop.levels import Levels
from stimuli.develop.read import read_camera_image
from stimuli.errors import StimulusError

Triple = tuple[float, float, float]
_TABLES = (".csv", ".txt")


@dataclass(frozen=True, slots=True, eq=False)
class ChartFit:
    """A camera fitted to a chart: the ``fit``, and how the ``chart`` was read, None if its values came in a table.

    ``notes`` are remarks on reading the chart, a sentence each.
    """

    file: str
    fit: CameraFit
    chart: PhotographedChart | None
    notes: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        chart = None if self.chart is None else {**self.chart.to_json(), "said": list(self.notes)}
        return {"file": self.file, "chart": chart, **self.fit.to_json()}


def is_table(chart: str | Path) -> bool:
    """Return whether ``chart`` names a table of colours, not a photograph."""
    return str(chart).lower().endswith(_TABLES)


def fit_camera_to_chart(
    chart: str | Path,
    *,
    reference: str | Path | None = None,
    white_XYZ_cd_m2: Triple | None = None,
    corners_px: ArrayLike | None = None,
    exposure: Exposure | None = None,
    form: Form = "linear",
    loss: Loss = "xyz",
    black_rgb: Triple = (0.0, 0.0, 0.0),
    saturated: float | None = None,
    assume_linear: bool = False,
    name: str = "",
) -> ChartFit:
    """Fit a camera model to a photographed colour chart.

    Parameters
    ----------
    chart
        A table ``R,G,B,X,Y,Z[,name]`` (``.csv``, ``.txt``), or a photograph of a 24-patch ColorChecker: raw, or TIFF or
        OpenEXR of linear camera RGB.
    reference
        The measured patches of a photographed chart, a table ``X,Y,Z[,name]`` in cd/m².
    white_XYZ_cd_m2
        The measured white patch, in place of ``reference``; the other patches are those of the published chart.
    corners_px
        The outer corners of the patches in the photograph, shape (4, 2), in order around the chart; None finds them.
    exposure
        The exposure of the photograph; None takes the file's own.
    form
        ``linear``, or ``affine`` with an offset, for one exposure only.
    loss
        What is minimised: the squares in ``xyz``, or those of ΔE00 (``delta-e``).
    black_rgb
        The black level to subtract first, in shares of full scale.
    saturated
        The sensor level from which a photosite counts as saturated; None takes the file's white.
    assume_linear
        Whether a TIFF or OpenEXR file is read as linear, whatever it declares.
    name
        The name of the camera.

    Returns
    -------
    ChartFit
        The fitted model, and every patch's ΔE00, as fitted and as predicted by the fit to all others.

    Raises
    ------
    InputError
        If a file cannot be read, no chart is found, or the colours do not determine a camera model.
    """
    chart = Path(chart)
    photographed: PhotographedChart | None = None
    notes: tuple[str, ...] = ()
    if is_table(chart):
        colours = read_correspondences(chart)
    else:
        # Bilinear demosaicing leaves the mean of a patch of one colour what it is, and the picture its size.
        patches = _reference(reference, white_XYZ_cd_m2)
        levels = Levels(saturated=saturated)
        image = read_camera_image(
            chart, demosaic="bilinear", levels=levels, exposure=exposure, assume_linear=assume_linear
        )
        photographed = read_chart(image.rgb, image.saturated, patches, corners_px, file=str(chart))
        colours, exposure = photographed.colours, image.exposure
        notes = (*photographed.notes, *image.full_early())
    source = f"{form} form, least squares in {'ΔE00' if loss == 'delta-e' else 'XYZ'}, {visible(chart.name)}"
    fit = fit_camera(colours, form, loss, black_rgb=black_rgb, exposure=exposure, name=name, source=source)
    return ChartFit(str(chart), _with_figures(fit), photographed, notes)


def _reference(reference: str | Path | None, white_XYZ_cd_m2: Triple | None) -> ReferenceColours:
    if (reference is None) == (white_XYZ_cd_m2 is None):
        remedy = "give the chart's measured patches or its white patch, and one of them"
        raise StimulusError(Finding("a photograph of a chart says nothing of its colours", remedy=remedy))
    if reference is not None:
        return read_reference(reference)
    names, XYZ = colorchecker_XYZ(white_XYZ_cd_m2 or ())
    return ReferenceColours(XYZ, names)


def _with_figures(fit: CameraFit) -> CameraFit:
    """Return the fit whose model's source says what it was fitted to and how well it predicts."""
    source = f"{fit.model.source}: {fit.fitted.patches} of {len(fit.patches)} patches"
    if fit.held_out is not None:
        held = fit.held_out
        source += f"; left-out ΔE00 mean {held.mean:.2f}, 95th percentile {held.p95:.2f}, largest {held.max:.2f}"
    return replace(fit, model=replace(fit.model, source=source))
