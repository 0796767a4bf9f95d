"""Any picture file to absolute XYZ: OpenEXR, or an ordinary picture such as PNG and JPEG."""

from __future__ import annotations

from pathlib import Path

from devices.colour_matching import DEFAULT_OBSERVER
from stimuli.errors import StimulusError
from stimuli.pictures.exr_read import ColourSpace, Decoding, Negative, read_exr, refuse_other_observer
from stimuli.pictures.ordinary import read_ordinary
from stimuli.pictures.packing import Packing
from stimuli.pictures.picture_header import is_ordinary
from stimuli.pictures.region import Part
from stimuli.pictures.stereo_image import Eye, StereoImage


def read_picture(
    path: str | Path,
    colour_space: ColourSpace | None = None,
    *,
    right: str | Path | None = None,
    packing: Packing | None = None,
    flat: bool = False,
    flat_eye: Eye | None = None,
    white_luminance_cd_m2: float | None = None,
    alpha_background_cd_m2: float | None = None,
    negative: Negative = "refuse",
    observer: str | None = DEFAULT_OBSERVER,
    part: Part | None = None,
) -> StereoImage:
    """Return the picture in a file, or in two, in absolute XYZ (cd/m²).

    Parameters
    ----------
    path
        OpenEXR, PNG, JPEG, TIFF (8 and 16 bits, float), WebP, MPO or JPS; the left eye's where ``right`` is given.
    colour_space
        Of an ordinary picture ``srgb``, ``display-p3``, ``adobe-rgb``, ``rec2020`` or ``icc`` (the file's own profile);
        of light in OpenEXR and float TIFF ``xyz`` or ``rec709``. None and ``declared`` rely on the file.
    right
        The right eye's file, of the same kind and size.
    packing
        How both eyes lie in one ordinary picture, such as ``side-by-side-half``; None takes what it, or a word in its
        name, states.
    flat
        Whether to return the flat version.
    flat_eye
        The eye whose picture is the flat version of a pair.
    white_luminance_cd_m2
        The luminance of the value 1, or of an ordinary picture's white, which needs it.
    alpha_background_cd_m2
        The luminance of the grey behind a partly transparent picture; without it such a picture is refused.
    negative
        What to do with XYZ below 0: ``refuse`` the file, or ``clip`` to 0.
    observer
        The colorimetric observer whose XYZ are wanted; those of ordinary pictures are for CIE 1931 2°. None takes any.
    part
        Chooses the part of the picture to read by its size, (width, height) in pixels; light is made of that alone, and
        the rest is not checked.

    Returns
    -------
    StereoImage
        XYZ in cd/m², float32, (height, width, 3) for each eye.

    Raises
    ------
    StimulusError
        If a file cannot be read or shown, or its colour space or white is not known; with what to write.

    Examples
    --------
    >>> import numpy as np
    >>> from PIL import Image
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     Image.fromarray(np.full((4, 6, 3), 255, np.uint8)).save(Path(folder, "white.png"))
    ...     white = read_picture(Path(folder, "white.png"), "srgb", white_luminance_cd_m2=100)
    >>> white.is_flat, white.left[0, 0].round().tolist()
    (True, [95.0, 100.0, 109.0])
    """
    files = [Path(path)] if right is None else [Path(path), Path(right)]
    ordinary = [is_ordinary(file) for file in files]
    if len(set(ordinary)) > 1:
        raise StimulusError.at(
            files[1], "the two eyes' files are of different kinds", "give both as OpenEXR, or neither"
        )
    decoding = Decoding(colour_space, white_luminance_cd_m2, alpha_background_cd_m2, negative)
    if ordinary[0]:
        image = read_ordinary(files, decoding, packing, flat=flat, flat_eye=flat_eye, part=part).image
        refuse_other_observer(files[0], DEFAULT_OBSERVER, observer)
        return image
    if packing is not None:
        message = "an OpenEXR file names its own views"
        raise StimulusError.at(files[0], message, f"leave out the packing, {packing}")
    pair = len(files) == 2
    if pair and flat and flat_eye is None:
        raise StimulusError.at(files[0], "there is no centre view for the flat version", "name an eye: left or right")
    images = [
        read_exr(file, decoding, flat=flat or pair, flat_eye=flat_eye, observer=observer, region=part) for file in files
    ]
    if flat and pair:
        return images[0 if flat_eye == "left" else 1]
    return StereoImage(images[0].left, images[-1].left if pair else images[0].right)
