"""Displays and pictures: what a screen shows, light in files, stimuli, and how different two pictures are."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cyclopean.result import Result
from devices.characterise import FitOptions
from documents.options import made, taking
from runner.reports import ComparisonOptions

if TYPE_CHECKING:
    from devices.characterise import DisplayFit
    from devices.display import Display
    from stimuli.build import StimulusSet
    from stimuli.comparison import Comparison
    from stimuli.pictures import ColourSpace, Packing, StereoImage


def display(path: str | Path) -> Result[Display]:
    """Read a display file.

    Parameters
    ----------
    path
        A display file, such as ``configs/displays/asus_vg248qe.yaml``.

    Returns
    -------
    Result
        A row for each stereo mode and eye: luminance of white and black in cd/m²; a nominal display, which was not
        measured, has one row for each eye for all modes. ``value.models(mode)`` gives each
        eye's display model, whose ``xyz(code)`` and ``code(xyz)`` go both ways.

    Raises
    ------
    InputError
        With every fault's file, line, column and remedy.

    Examples
    --------
    >>> asus = display("configs/displays/asus_vg248qe.yaml")
    >>> asus
    <Display asus_vg248qe.yaml: 1920 x 1080 px, modes quad-buffered, side-by-side>
    >>> asus.value.models("quad-buffered").left.xyz([1, 1, 1]).round(2).tolist()
    [26.74, 27.88, 31.2]
    """
    from devices.display import EYES, read_display

    read = read_display(Path(path))
    every = dict(read.modes)
    if read.nominal_models is not None:
        every["any other (nominal)" if every else "any (nominal)"] = read.nominal_models
    rows = [
        {
            "mode": mode,
            "eye": eye,
            "white_luminance_cd_m2": float(models.eye(eye).shown_white_XYZ_cd_m2[1]),
            "black_luminance_cd_m2": float(models.eye(eye).shown_black_XYZ_cd_m2[1]) + read.stated_black_cd_m2(mode),
            "ambient_luminance_cd_m2": float(models.eye(eye).ambient_XYZ_cd_m2[1]),
            "source": read.source(mode),
        }
        for mode, models in every.items()
        for eye in EYES
    ]
    across, down = read.panel.resolution_px
    return Result(read, rows, f"Display {Path(path).name}: {across} x {down} px, modes {', '.join(sorted(every))}")


@taking(FitOptions)
def fit_display(
    measurements: str | Path,
    mode: str | None = None,
    *,
    codes: str | None = None,
    white_cd_m2: float | None = None,
    **options: Any,
) -> Result[DisplayFit]:
    """Fit display models to measurements through the glasses, and choose the one that predicts held-out readings best.

    Parameters
    ----------
    measurements
        A table of codes and XYZ: CSV, an ArgyllCMS ``.ti3``, a Psychtoolbox ``.mat``, the log of a measurement, or an
        ICC profile.
    mode
        The stereo mode that was measured; None takes the readings' own.
    codes
        The range of the codes of a CSV table that does not name it, such as ``0..255``.
    white_cd_m2
        Luminance of the white of an ICC profile that does not say how bright it is, above 0.
    **options
        As `devices.characterise.fit_display`: ``model``, ``eye``, ``observer``, ``seed``, ``keep_all`` and
        ``correct_drift``.

    Returns
    -------
    Result
        A row for each eye and model with its held-out errors in ΔE00; ``chosen`` marks the one taken.
        ``value.write(file)`` puts the mode into a display file.

    Raises
    ------
    InputError
        If the file cannot be read, the readings cannot be those of a display, or no model predicts them.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from devices.readings import Measurements, write_csv
    >>> from devices.readings import find_patches
    >>> codes = np.array([patch.codes for patch in find_patches("table_c1").patches])
    >>> XYZ = display("configs/displays/asus_vg248qe.yaml").value.models("quad-buffered").left.xyz(codes)
    >>> with TemporaryDirectory() as folder:
    ...     write_csv(Measurements(codes, XYZ), Path(folder, "readings.csv"))
    ...     fitted = fit_display(Path(folder, "readings.csv"), "quad-buffered")
    >>> list(fitted.value.eyes)
    ['both']
    """
    from devices.characterise import fit_display as fit
    from devices.readings import read_measurements

    readings = read_measurements(Path(measurements), codes, white_cd_m2=white_cd_m2)
    fitted = fit(readings, mode=mode, file=measurements, **options)
    rows = [
        {"eye": eye, "chosen": candidate is own.characterisation.chosen, **candidate.to_json()}
        for eye, own in fitted.eyes.items()
        for candidate in own.characterisation.candidates
    ]
    chosen = ", ".join(f"{eye}: {own.characterisation.chosen.name}" for eye, own in fitted.eyes.items())
    return Result(fitted, rows, f"Display fitted to {Path(measurements).name}; {chosen}")


def read_picture(
    path: str | Path,
    colour_space: ColourSpace | None = None,
    white_luminance_cd_m2: float | None = None,
    *,
    right: str | Path | None = None,
    packing: Packing | None = None,
    observer: str = "CIE 1931 2",
) -> StereoImage:
    """Read a picture, in absolute XYZ: OpenEXR, or PNG, JPEG, TIFF, WebP, MPO or JPS.

    Parameters
    ----------
    path
        The file: of one view or both, or the left eye's where ``right`` is given.
    colour_space
        ``srgb``, ``display-p3``, ``adobe-rgb``, ``rec2020`` or ``icc`` (the file's profile) of an ordinary picture,
        ``xyz`` or ``rec709`` of linear light; None takes what the file states.
    white_luminance_cd_m2
        Luminance of an ordinary picture's white, or of the value 1.
    right
        The right eye's file.
    packing
        How both eyes lie in one ordinary picture, such as ``side-by-side``; None takes what the file states.
    observer
        The colorimetric observer whose XYZ are wanted, such as ``CIE 2015 10``: a file of another is refused.

    Returns
    -------
    StereoImage
        ``left`` and ``right``: XYZ in cd/m², float32, shape (height, width, 3) each.

    Raises
    ------
    InputError
        If the file cannot be read, is of another observer, lacks a view, or holds what must not reach an eye; if its
        colour space or white is not known.

    Examples
    --------
    >>> import numpy as np
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> grey = np.full((4, 6, 3), 20, np.float32)
    >>> with TemporaryDirectory() as folder:
    ...     write_picture(Path(folder, "grey.exr"), grey)
    ...     picture = read_picture(Path(folder, "grey.exr"))
    >>> picture.is_flat, picture.left.shape
    (True, (4, 6, 3))
    """
    from stimuli.pictures import read_picture as read

    return read(
        path,
        colour_space,
        right=right,
        packing=packing,
        white_luminance_cd_m2=white_luminance_cd_m2,
        observer=observer,
    )


def write_picture(
    path: str | Path, left: ArrayLike, right: ArrayLike | None = None, *, observer: str = "CIE 1931 2"
) -> None:
    """Write a picture in absolute XYZ as OpenEXR of half floats; the file appears whole or not at all.

    Parameters
    ----------
    path
        The file to write.
    left
        XYZ in cd/m², shape (height, width, 3).
    right
        The same for the right eye; both eyes see ``left`` if None.
    observer
        The colorimetric observer of the XYZ, such as ``CIE 2015 10``, which the file declares.

    Raises
    ------
    InputError
        If the shapes are wrong, values are not finite, or the file cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     write_picture(Path(folder, "grey.exr"), np.full((4, 6, 3), 20.0))
    ...     read_picture(Path(folder, "grey.exr")).left.shape
    (4, 6, 3)
    """
    from stimuli.pictures import StereoImage, write_exr

    first = np.asarray(left, dtype=np.float32)
    second = first if right is None else np.asarray(right, dtype=np.float32)
    write_exr(Path(path), StereoImage(first, second), observer)


def delta_e(first: ArrayLike, second: ArrayLike, white: ArrayLike) -> NDArray[np.float64]:
    """Return the colour difference ΔE00 (CIEDE2000) of each pair of colours.

    Parameters
    ----------
    first, second
        XYZ, shape (..., 3) each.
    white
        XYZ of the white that they are seen against, shape (3,), in the same unit.

    Returns
    -------
    numpy.ndarray
        Shape (...).

    Examples
    --------
    >>> float(delta_e([20, 21, 22], [20, 20.5, 22], white=[95, 100, 108]).round(2))
    3.48
    """
    from devices.colour import delta_e_2000, xyz_to_lab

    return delta_e_2000(xyz_to_lab(first, white), xyz_to_lab(second, white))


@taking(ComparisonOptions, "viewing")
def compare(photo: str | Path, rendering: str | Path, regions: str | Path, **options: Any) -> Result[Comparison]:
    """Compare a photograph with its rendering, as `cyclopean compare` does and with the same options.

    Parameters
    ----------
    photo, rendering
        OpenEXR or TIFF of XYZ or of camera RGB, raw photographs, spectral pictures, or, with ``colour_space`` and
        ``picture_white_cd_m2``, pictures such as PNG and JPEG.
    regions
        A regions file: what is compared, and the limits.
    **options
        Those of `runner.reports.ComparisonOptions` by their names, such as ``rig="rig.yaml"``, ``measures=["flip"]`` or
        ``page="page.html"``; without ``rig`` or ``display`` the pictures are not compared as the eye resolves them.

    Returns
    -------
    Result
        A row for each eye and region; ``value.verdict`` is the decision with its reasons, ``value.measures`` the table
        of measures.

    Raises
    ------
    InputError
        If a file cannot be read, the pictures cannot be brought to one grid closely enough, a region lies outside, or
        an option is unknown, out of range, or does not go with another.
    WorkError
        If there is no room for temporary files.
    """
    from runner.reports import comparison_page, report_comparison

    asked = made(ComparisonOptions, options)
    result = report_comparison(photo, rendering, regions, asked, asked=options).comparison
    rows: list[dict[str, Any]] = []
    for eye, one_eye in result.eyes.items():
        table = one_eye.table.to_json()
        rows += [{"eye": eye, **row} for row in table["rows"]]
    return Result(result, rows, repr(result).strip("<>"), find_sections=lambda: comparison_page(result).sections)


def build(recipe: str | Path, rig: str | Path) -> Result[StimulusSet]:
    """Build the stimuli of a recipe for a rig's display, or take them from the cache.

    Parameters
    ----------
    recipe
        A recipe file, such as ``configs/stimuli/manitoba_gray.yaml``.
    rig
        A rig file, such as ``configs/rigs/asus_vg248qe_3dvision.yaml``.

    Returns
    -------
    Result
        A row for each stimulus with its factors; ``value.load(name)`` reads its picture.

    Raises
    ------
    InputError
        If the recipe or a picture is wrong, or the cache cannot be written.
    """
    from devices.display import read_rig
    from runner.presenter import primary_monitor
    from stimuli.build import build_set
    from stimuli.recipes import DisplaySetup

    station = read_rig(Path(rig), ask_monitor=primary_monitor)
    made = build_set(Path(recipe), station.display.panel.pixel_pitch_mm, setup=DisplaySetup.of(station))
    rows = [{"name": name, **made.factors(name), "file": str(made.path(name))} for name in made.names]
    return Result(made, rows, f"{len(rows)} stimuli of {Path(recipe).name}")
