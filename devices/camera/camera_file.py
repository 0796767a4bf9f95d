"""Camera files: `configs/cameras/*.yaml` to a camera model, and back."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import yaml
from pydantic import BeforeValidator, Field

from devices.camera.camera_model import CameraModel, ExposureSet, Form
from devices.camera.exposure import Exposure, parse_seconds
from devices.colour_matching import DEFAULT_OBSERVER, ObserverSpec
from devices.errors import DeviceError
from documents import Finding, load_document
from documents.files import write_whole
from documents.yaml import NotNegative, Number, Positive, Strict

Triple = tuple[Number, Number, Number]


def _seconds(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    try:
        return parse_seconds(value)
    except ValueError:
        raise ValueError("write seconds, such as 0.5 or 1/15") from None


Seconds = Annotated[Positive, BeforeValidator(_seconds)]


class ExposureSpec(Strict):
    """An exposure; ``time_s`` may be written as on a camera, 1/15."""

    time_s: Seconds
    """Seconds of exposure, such as 0.5 or 1/15."""
    f_number: Positive
    """The lens's f-number."""
    iso: Positive = 100.0
    """The sensor's sensitivity."""

    def exposure(self) -> Exposure:
        """Return the exposure."""
        return Exposure(self.time_s, self.f_number, self.iso)


class ExposureSetSpec(Strict):
    """Shutter speeds at which a chart was photographed in one light (thesis Table 4.2)."""

    white_luminance_cd_m2: Positive
    """The luminance of white, in cd/m²."""
    time_s: Annotated[tuple[Seconds, ...], Field(min_length=1)]
    """Shutter speeds, in seconds."""
    f_number: Positive
    """The lens's f-number."""
    iso: Positive = 100.0
    """The sensor's sensitivity."""

    def exposure_set(self) -> ExposureSet:
        """Return the set."""
        return ExposureSet(
            self.white_luminance_cd_m2, tuple(Exposure(time_s, self.f_number, self.iso) for time_s in self.time_s)
        )


class MatrixSpec(Strict):
    """XYZ in cd/m² for camera R, G and B of full scale each: the rows of A in thesis Expression 4.2."""

    X: Triple
    """The row of the matrix that makes X."""
    Y: Triple
    """The row of the matrix that makes Y."""
    Z: Triple
    """The row of the matrix that makes Z."""


class CameraSpec(Strict):
    """A camera file; ``observer`` is the colorimetric observer of its XYZ."""

    schema_version: Literal[1]
    """The version of the file format: 1."""
    name: str = ""
    """A name of your own, by which records and reports call it."""
    form: Form
    """Whether the camera model has an offset (affine) or none (linear)."""
    exposure: ExposureSpec | None = None
    """The exposure, where the file does not hold it."""
    matrix_XYZ_cd_m2: MatrixSpec
    """XYZ in cd/m² for full-scale camera R, G and B."""
    offset_XYZ_cd_m2: Triple = (0.0, 0.0, 0.0)
    """XYZ added after the matrix, in cd/m²."""
    black_rgb: Triple = (0.0, 0.0, 0.0)
    """Camera R, G and B of no light."""
    safe_luminance_cd_m2: tuple[NotNegative, Positive] | None = None
    """The luminances between which the camera is trusted, in cd/m²."""
    exposure_sets: tuple[ExposureSetSpec, ...] = ()
    """The shutter speeds at which the chart was photographed."""
    source: str = ""
    """Where the numbers come from, in words."""
    observer: ObserverSpec = DEFAULT_OBSERVER
    """The colorimetric observer of the XYZ, such as CIE 1931 2 or CIE 1964 10."""

    def model(self) -> CameraModel:
        """Return the camera model."""
        rows = self.matrix_XYZ_cd_m2
        return CameraModel(
            np.array([rows.X, rows.Y, rows.Z]),
            np.array(self.offset_XYZ_cd_m2),
            np.array(self.black_rgb),
            self.exposure.exposure() if self.exposure else None,
            self.safe_luminance_cd_m2,
            self.form,
            self.name,
            self.source,
            tuple(tried.exposure_set() for tried in self.exposure_sets),
            str(self.observer),
        )


def read_camera(path: str | os.PathLike[str]) -> CameraModel:
    """Read the camera file at ``path``.

    Parameters
    ----------
    path
        A camera file, such as ``configs/cameras/nikon_d800.yaml``.

    Returns
    -------
    CameraModel
        The camera: linear RGB to XYZ in cd/m², at its exposure.

    Raises
    ------
    InputError
        With file, line, column and remedy of what is wrong with it.

    Examples
    --------
    >>> camera = read_camera("configs/cameras/nikon_d800.yaml")
    >>> camera.form
    'linear'
    """
    spec, source = load_document(Path(path), CameraSpec, "camera")
    try:
        return spec.model()
    except DeviceError as error:
        raise DeviceError(
            [Finding(f.message, source.file, f.line, f.column, f.remedy) for f in error.findings]
        ) from None


def format_camera(model: CameraModel) -> str:
    """Return ``model`` as a camera file's text; reading it gives the same numbers, bit by bit."""
    lines = ["schema_version: 1"]
    if model.name:
        lines.append(f"name: {_text(model.name)}")
    if model.observer != DEFAULT_OBSERVER:
        lines.append(f"observer: {model.observer}")
    lines.append(f"form: {model.form}")
    if model.exposure is not None:
        e = model.exposure
        lines.append(
            f"exposure: {{time_s: {_number(e.time_s)}, f_number: {_number(e.f_number)}, iso: {_number(e.iso)}}}"
        )
    lines.append("matrix_XYZ_cd_m2:")
    lines += [f"  {axis}: {_numbers(row)}" for axis, row in zip("XYZ", model.matrix.tolist(), strict=True)]
    if model.form == "affine":
        lines.append(f"offset_XYZ_cd_m2: {_numbers(model.offset_XYZ.tolist())}")
    if np.any(model.black_rgb):
        lines.append(f"black_rgb: {_numbers(model.black_rgb.tolist())}")
    if model.safe_luminance_cd_m2 is not None:
        lines.append(f"safe_luminance_cd_m2: {_numbers(model.safe_luminance_cd_m2)}")
    if model.exposure_sets:
        lines.append("exposure_sets:")
        lines += [line for tried in model.exposure_sets for line in _set_lines(tried)]
    if model.source:
        lines.append(f"source: {_text(model.source)}")
    return "\n".join(lines) + "\n"


def refuse_existing(path: str | os.PathLike[str]) -> None:
    """Raise DeviceError if there is a file at ``path`` already.

    Parameters
    ----------
    path
        Where a camera file is to be written.

    Examples
    --------
    >>> refuse_existing("configs/cameras/nikon_d800.yaml")
    Traceback (most recent call last):
        ...
    devices.errors.DeviceError: ...the camera file is there already...
    """
    if Path(path).exists():
        remedy = "name another, or write over it with --replace"
        raise DeviceError(Finding("the camera file is there already", str(path), remedy=remedy))


def write_camera(model: CameraModel, path: str | os.PathLike[str]) -> None:
    """Write ``model`` to ``path``, whole or not at all; its folder is made if need be.

    Parameters
    ----------
    model
        The camera.
    path
        The file to write; one that is there is written over.

    Raises
    ------
    OSError
        If it cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> camera = read_camera("configs/cameras/nikon_d800.yaml")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_camera(camera, Path(folder) / "copy.yaml")
    ...     np.array_equal(read_camera(Path(folder) / "copy.yaml").matrix, camera.matrix)
    True
    """
    write_whole(Path(path), format_camera(model))


def _set_lines(tried: ExposureSet) -> list[str]:
    """Return a set as lines; one for each pair of aperture and ISO, which a file's set has in common."""
    pairs = dict.fromkeys((exposure.f_number, exposure.iso) for exposure in tried.exposures)
    lines = []
    for f_number, iso in pairs:
        times = [
            exposure.time_s for exposure in tried.exposures if (exposure.f_number, exposure.iso) == (f_number, iso)
        ]
        lines.append(
            f"  - {{white_luminance_cd_m2: {_number(tried.white_luminance_cd_m2)}, time_s: {_numbers(times)}, "
            f"f_number: {_number(f_number)}, iso: {_number(iso)}}}"
        )
    return lines


def _numbers(values: Iterable[float]) -> str:
    return "[" + ", ".join(_number(value) for value in values) + "]"


def _number(value: float) -> str:
    # The shortest text that reads back the same; YAML 1.1 readers take 1e-05 for text, so a number has its point.
    text = repr(float(value) + 0.0).removesuffix(".0")
    return text.replace("e", ".0e") if "e" in text and "." not in text else text


def _text(text: str) -> str:
    dumped: str = yaml.safe_dump(text, default_style='"', width=10**6, allow_unicode=True)
    return dumped.strip()
