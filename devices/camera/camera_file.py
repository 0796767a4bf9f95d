"""Camera files: `configs/cameras/*.yaml` to a camera model, and back."""

from __future__ import annotations

import os
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field

from devices.camera.camera_model import CameraModel, ExposureSet, Form
from devices.camera.exposure import Exposure, parse_seconds
from devices.colour_matching import DEFAULT_OBSERVER, ObserverSpec
from devices.errors import DeviceError
from documents import Finding, load_document
from documents.files import write_whole
from documents.yaml import FileModel, NotNegative, Number, Positive, yaml_lines

Triple = tuple[Number, Number, Number]


def _seconds(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    try:
        return parse_seconds(value)
    except ValueError:
        raise ValueError("write seconds, such as 0.5 or 1/15") from None


Seconds = Annotated[Positive, BeforeValidator(_seconds)]


class ExposureSpec(FileModel):
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


class ExposureSetSpec(FileModel):
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


class MatrixSpec(FileModel):
    """XYZ in cd/m² for camera R, G and B of full scale each: the rows of A in thesis Expression 4.2."""

    X: Triple
    """The row of the matrix that makes X."""
    Y: Triple
    """The row of the matrix that makes Y."""
    Z: Triple
    """The row of the matrix that makes Z."""


class CameraSpec(FileModel):
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
    given: dict[str, Any] = {"schema_version": 1}
    if model.name:
        given["name"] = model.name
    if model.observer != DEFAULT_OBSERVER:
        given["observer"] = model.observer
    given["form"] = model.form
    if model.exposure is not None:
        given["exposure"] = asdict(model.exposure)
    given["matrix_XYZ_cd_m2"] = dict(zip("XYZ", (model.matrix + 0.0).tolist(), strict=True))
    if model.form == "affine":
        given["offset_XYZ_cd_m2"] = (model.offset_XYZ + 0.0).tolist()
    if np.any(model.black_rgb):
        given["black_rgb"] = (model.black_rgb + 0.0).tolist()
    if model.safe_luminance_cd_m2 is not None:
        given["safe_luminance_cd_m2"] = list(model.safe_luminance_cd_m2)
    if model.exposure_sets:
        given["exposure_sets"] = [one for tried in model.exposure_sets for one in _written_sets(tried)]
    if model.source:
        given["source"] = model.source
    return "\n".join(yaml_lines(given)) + "\n"


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


def _written_sets(tried: ExposureSet) -> list[dict[str, Any]]:
    """Return a set as a file has it; one for each pair of aperture and ISO, which a file's set has in common."""
    pairs = dict.fromkeys((exposure.f_number, exposure.iso) for exposure in tried.exposures)
    return [
        {
            "white_luminance_cd_m2": tried.white_luminance_cd_m2,
            "time_s": [one.time_s for one in tried.exposures if (one.f_number, one.iso) == (f_number, iso)],
            "f_number": f_number,
            "iso": iso,
        }
        for f_number, iso in pairs
    ]
