"""From an OpenEXR file to a picture for two eyes."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from devices.colour import rgb_to_xyz_matrix
from devices.colour_matching import DEFAULT_OBSERVER, mixed_observers
from devices.errors import DeviceError
from documents import Finding
from documents.text import counted
from stimuli.errors import StimulusError
from stimuli.pictures.exr_header import REC709, SAME, XYZ
from stimuli.pictures.exr_views import View, read_views
from stimuli.pictures.region import Part, Region
from stimuli.pictures.rows import bands
from stimuli.pictures.stereo_image import Eye, StereoImage, XYZImage

# The last five are of codes, in ordinary pictures; OpenEXR holds light.
ColourSpace = Literal["declared", "xyz", "rec709", "srgb", "display-p3", "adobe-rgb", "rec2020", "icc"]
Negative = Literal["refuse", "clip"]


@dataclass(frozen=True, slots=True)
class Decoding:
    """How a file's values become light.

    ``colour_space`` is that of light in a file that declares none, ``xyz`` or ``rec709`` (linear, D65), or a name for
    codes, ``icc`` for the file's own profile; None and ``declared`` rely on the file. ``white_luminance_cd_m2`` is the
    luminance of the value 1, or of the codes' white; without it that of OpenEXR is the file's ``whiteLuminance``, or
    1 cd/m². Colours seen through alpha lie on a grey of ``alpha_background_cd_m2``, which light does not need.
    ``negative`` says what to do with XYZ below 0: ``refuse`` the file, or ``clip`` to 0.
    """

    colour_space: str | None = None
    white_luminance_cd_m2: float | None = None
    alpha_background_cd_m2: float | None = None
    negative: Negative = "refuse"


@dataclass(frozen=True, slots=True)
class ExrPicture:
    """A picture, the views it was made of (left then right, or one), and how many pixels were clipped at 0.

    ``centre`` is true if the file has a view of neither eye, used or not. ``observer`` is the colorimetric observer of
    the XYZ, ``exact`` whether floats are to be kept as they are.
    """

    image: StereoImage
    views: tuple[str, ...]
    clipped_pixels: int
    centre: bool
    observer: str
    exact: bool = False


def read_exr(
    path: Path,
    decoding: Decoding | ColourSpace | None = None,
    *,
    flat: bool = False,
    flat_eye: Eye | None = None,
    region: Region | Part | None = None,
    observer: str | None = DEFAULT_OBSERVER,
) -> StereoImage:
    """Return the picture in the OpenEXR file at ``path``, in absolute XYZ (cd/m²).

    With a left and a right view it is a stereo picture; with only a centre or unnamed view, a flat one.

    Parameters
    ----------
    path
        The file: one part with several views, several parts, or one view.
    decoding
        How its values become light, or their colour space alone; None relies on the file.
    flat
        Whether to return the flat version: the centre view, or the view of ``flat_eye`` where the file has no centre.
    flat_eye
        The eye whose view is the flat version.
    region
        The part of the picture to read, in pixels, or what chooses it by the picture's size; the rest is neither read
        nor checked.
    observer
        The colorimetric observer whose XYZ are wanted, such as ``CIE 2015 10``: a file of another is refused. None
        takes any.

    Returns
    -------
    StereoImage
        XYZ in cd/m², float32, (height, width, 3) for each eye.

    Raises
    ------
    StimulusError
        If the file cannot be read, is of another observer, lacks a view, declares no colour space and none is given, or
        holds NaN, infinity or XYZ below 0. The finding names file, view and the number of pixels.

    Examples
    --------
    >>> import numpy as np
    >>> from tempfile import TemporaryDirectory
    >>> from stimuli.pictures import write_exr
    >>> light = np.full((4, 6, 3), 5.0, np.float32)
    >>> with TemporaryDirectory() as folder:
    ...     write_exr(Path(folder, "plate.exr"), StereoImage(light, 2 * light))
    ...     picture = read_exr(Path(folder, "plate.exr"))
    >>> picture.right[0, 0].tolist()
    [10.0, 10.0, 10.0]
    """
    decoding = decoding if isinstance(decoding, Decoding) else Decoding(decoding)
    read = read_exr_counted(path, decoding, flat=flat, flat_eye=flat_eye, region=region)
    refuse_other_observer(Path(path), read.observer, observer)
    return read.image


def refuse_other_observer(path: Path, observer: str, wanted: str | None) -> None:
    """Raise StimulusError if a picture's XYZ are for another colorimetric observer than is ``wanted``."""
    if wanted is not None and observer != wanted:
        what = f"its XYZ are for the observer {observer}; {wanted} is wanted"
        raise StimulusError.at(path, what, "make the picture again from spectra, or write 'observer:' to match")


def read_exr_counted(
    path: Path,
    decoding: Decoding,
    *,
    flat: bool = False,
    flat_eye: Eye | None = None,
    region: Region | Part | None = None,
) -> ExrPicture:
    """Return what `read_exr` returns, with the views used and the pixels clipped."""
    path = Path(path)
    names: tuple[str, ...] = ()
    stored: tuple[str, ...] = ()

    def choose(of: tuple[str, ...]) -> tuple[str, ...]:
        nonlocal names, stored
        stored, names = of, chosen_views(of, path, flat, flat_eye)
        return names

    views = read_views(path, region, choose)
    # Data windows may differ: a compositor stores no more than what is not black.
    if len({views[name].size_px for name in names}) > 1:
        sizes = ", ".join(f"'{name}' is {' × '.join(map(str, views[name].size_px))}" for name in names)
        raise StimulusError.at(path, f"the views differ in size: {sizes}", "crop them alike")
    if mixed := mixed_observers([(f"the view '{name}'", views[name].observer) for name in names]):
        raise StimulusError(replace(mixed, file=str(path)))
    observer, exact = views[names[0]].observer, all(views[name].exact for name in names)
    half = all(views[name].half for name in names)
    # One after the other, each in place of what was read of it.
    unconverted = dict(views)
    del views
    converted = [view_to_xyz(unconverted.pop(name), str(path), decoding) for name in names]
    images = [xyz for xyz, _ in converted]
    clipped = sum(pixels for _, pixels in converted)
    image = StereoImage(images[0], images[-1], half=half)
    return ExrPicture(image, names, clipped, middle_view(stored) is not None, observer, exact)


def middle_view(names: Collection[str]) -> str | None:
    """Return the view that is neither eye's."""
    return next((name for name in ("center", "") if name in names), None)


def chosen_views(names: tuple[str, ...], path: Path, flat: bool, flat_eye: Eye | None) -> tuple[str, ...]:
    """Return the view names to show: left and right, or one for a flat picture."""
    middle = middle_view(names)
    eyes = [eye for eye in ("left", "right") if eye in names]
    if not flat and len(eyes) == 2:
        return "left", "right"
    if not flat and len(eyes) == 1:
        missing = "right" if eyes == ["left"] else "left"
        raise StimulusError.at(path, f"the view '{eyes[0]}' has no '{missing}' beside it", "add it, or ask for flat")
    if middle is not None:
        return (middle,)
    if flat and flat_eye in eyes:
        return (str(flat_eye),)
    listed = ", ".join(f"'{name}'" for name in names)
    if flat and eyes:
        raise StimulusError.at(path, f"there is no centre view for the flat version, only {listed}", "name an eye")
    raise StimulusError.at(path, f"there are only the views {listed}", "expected left and right, or center")


def view_to_xyz(view: View, file: str, decoding: Decoding) -> tuple[XYZImage, int]:
    """Return the view's XYZ in cd/m², float32 (height, width, 3), and how many pixels were clipped at 0.

    Raises
    ------
    StimulusError
        If the colour space is neither declared nor given, or given otherwise than declared; if a value is NaN,
        infinite, or beyond single precision; if XYZ is negative and not to be clipped.
    """
    matrix = matrix_of(view, file, decoding.colour_space)
    given = (decoding.white_luminance_cd_m2, view.white_luminance_cd_m2)
    luminance = next((value for value in given if value is not None), 1.0)
    if not (np.isfinite(luminance) and luminance > 0):
        raise _wrong(view, file, f"its whiteLuminance is {luminance}", "declare a luminance above 0")
    _refuse_not_finite(view.pixels, view, file)
    if np.array_equal(matrix, np.eye(3)) and luminance == 1.0:
        xyz = view.pixels
    else:
        xyz = np.empty_like(view.pixels)
        with np.errstate(over="ignore"):
            for rows in bands(xyz.shape):
                xyz[rows] = view.pixels[rows].astype(np.float64) @ (luminance * matrix.T)
        _refuse_not_finite(xyz, view, file, "beyond single precision after conversion to XYZ")
    below = xyz < 0
    if not below.any():
        return xyz, 0
    pixels = int(below.any(axis=-1).sum())
    if decoding.negative == "refuse":
        raise _wrong(
            view,
            file,
            f"{counted(pixels, 'pixel has', 'pixels have')} negative XYZ ({_per_channel(below, 'XYZ')}), down "
            f"to {xyz.min():.3g} cd/m²",
            "correct the picture, or ask for 'negative: clip'",
        )
    return np.maximum(xyz, np.float32(0)), pixels


def matrix_of(view: View, file: str, colour_space: str | None) -> NDArray[np.float64]:
    """Return what makes XYZ of the view's values, of luminance 1 for the value 1; StimulusError as `view_to_xyz`."""
    given = {"xyz": XYZ, "rec709": REC709}.get(colour_space or "")
    if given is None and colour_space not in (None, "declared"):
        what = f"OpenEXR holds linear light, and '{colour_space}' is of codes"
        raise _wrong(view, file, what, "write 'colour_space: declared' (or rec709, xyz) for this picture")
    declared = XYZ if view.is_xyz else view.chromaticities
    chromaticities = given if declared is None else declared
    if chromaticities is None:
        raise _wrong(
            view,
            file,
            "it does not declare its chromaticities",
            "write 'colour_space: rec709' or 'colour_space: xyz', in a recipe of kind: pictures",
        )
    if declared is not None and given is not None and not np.allclose(declared, given, rtol=0, atol=SAME):
        raise _wrong(
            view,
            file,
            f"it declares the chromaticities {np.round(declared, 4).tolist()}, not those of '{colour_space}'",
            "leave colour_space out, or correct the picture's header",
        )
    if np.allclose(chromaticities, XYZ, rtol=0, atol=1e-6):
        return np.eye(3)
    try:
        matrix = rgb_to_xyz_matrix(*chromaticities)
    except DeviceError as error:
        raise _wrong(view, file, str(error), "correct the picture's header") from error
    if not (matrix.sum(axis=0) > 0).all():
        what = f"its white lies outside its primaries: {np.round(chromaticities, 4).tolist()}"
        raise _wrong(view, file, what, "correct its chromaticities")
    return matrix


def _refuse_not_finite(values: XYZImage, view: View, file: str, what: str = "not finite") -> None:
    if np.isfinite(values).all():
        return
    nan, infinite = np.isnan(values), np.isinf(values)
    names = "XYZ" if view.is_xyz or what != "not finite" else "RGB"
    kinds = [
        f"{kind} in {int(bad.any(axis=-1).sum())} pixels ({_per_channel(bad, names)})"
        for kind, bad in (("NaN", nan), ("infinity", infinite))
        if bad.any()
    ]
    pixels = int((nan | infinite).any(axis=-1).sum())
    raise _wrong(
        view, file, f"{counted(pixels, 'pixel is', 'pixels are')} {what}: {', '.join(kinds)}", "correct the picture"
    )


def _per_channel(bad: NDArray[np.bool_], names: str) -> str:
    counts = bad.reshape(-1, 3).sum(axis=0)
    return ", ".join(f"{name} {int(count)}" for name, count in zip(names, counts, strict=True) if count)


def _wrong(view: View, file: str, message: str, remedy: str) -> StimulusError:
    place = f"in the view '{view.name}' " if view.name else ""
    return StimulusError(Finding(f"{place}{message}", file, remedy=remedy))
