"""From a picture for two eyes to an OpenEXR file: half float, zipped without loss, its colour space declared."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from devices.colour_matching import DEFAULT_OBSERVER, colorimetric_observer
from documents import Finding
from documents.files import unwritable, what_stopped, whole_file
from documents.text import counted
from stimuli.errors import StimulusError
from stimuli.pictures.exr_header import EXACT_ATTRIBUTE, OBSERVER_ATTRIBUTE
from stimuli.pictures.picture_input import reason, text_of
from stimuli.pictures.rows import bands
from stimuli.pictures.stereo_image import StereoImage

if TYPE_CHECKING:
    import OpenImageIO


HALF_MAX = 65504.0
# Rows of whole blocks of every compression, about 2 megapixels of each eye at a time.
_BLOCK_ROWS = 256
_BAND_PX = 1 << 21
# Pictures of fewer pixels are as quick, and as well, read and made at once.
LEAST_PX = 1 << 22
_XYZ_CHROMATICITIES = (1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0 / 3.0, 1.0 / 3.0)


def write_exr(path: Path, image: StereoImage, observer: str = DEFAULT_OBSERVER, *, exact: bool = False) -> None:
    """Write ``image`` to ``path``, as a whole or not at all.

    The file has a single part with ``multiView``: the views left and right, or center alone for a flat picture. Its
    ``chromaticities`` declare XYZ and its ``whiteLuminance`` is 1. Half floats keep 11 bits: values are rounded by at
    most 1/2048 of themselves (by 3e-8 cd/m² below 6e-5 cd/m²).

    Parameters
    ----------
    path
        The file to write, named .exr; its folder must exist.
    image
        XYZ in cd/m², 0 to 65504.
    observer
        The colorimetric observer of the XYZ. Another than CIE 1931 2° is declared as ``colorimetricObserver``.
    exact
        Whether to write single precision, and to mark the file as one whose pixels a recipe keeps as they are.

    Raises
    ------
    StimulusError
        If a value is NaN, infinite, negative, or above 65504 (the largest half float), or the file cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> light = np.full((4, 6, 3), 5.0, np.float32)
    >>> with TemporaryDirectory() as folder:
    ...     write_exr(Path(folder, "plate.exr"), StereoImage.flat(light))
    ...     [file.name for file in Path(folder).iterdir()]
    ['plate.exr']
    """
    path = Path(path)
    views = {"center": image.left} if image.is_flat else {"left": image.left, "right": image.right}
    for view, xyz in views.items():
        bad = sum(int((~((xyz[band] >= 0) & (xyz[band] <= HALF_MAX))).any(axis=-1).sum()) for band in bands(xyz.shape))
        if bad:
            raise StimulusError.at(
                path,
                f"in the view '{view}' {counted(bad, 'pixel is', 'pixels are')} not within 0 to {HALF_MAX:.0f} cd/m²",
                "scale the picture down, or correct it",
            )
    spec = xyz_spec(image.width_px, image.height_px, tuple(views), observer, exact)
    together = (
        (band, np.concatenate([np.asarray(xyz[band], dtype=np.float32) for xyz in views.values()], axis=-1))
        for band in bands_of_blocks(image.height_px, image.width_px)
    )
    write_pixel_rows(path, spec, together)


def bands_of_blocks(height: int, width: int) -> Iterator[slice]:
    """Yield rows of about two megapixels at a time, in whole blocks of the file."""
    rows = max(1, _BAND_PX // (_BLOCK_ROWS * width)) * _BLOCK_ROWS
    return (slice(top, min(top + rows, height)) for top in range(0, height, rows))


def write_exr_rows(
    path: Path,
    size_px: tuple[int, int],
    rows: Iterable[tuple[slice, NDArray[np.float32]]],
    observer: str = DEFAULT_OBSERVER,
) -> None:
    """Write a flat picture of XYZ to ``path`` as `write_exr` does, a band of ``rows`` at a time, from the top down.

    ``size_px`` is width and height; ``rows`` yields where a band stands and its XYZ in cd/m², float32 (rows, width, 3).
    The file is that of `write_exr`, byte for byte.

    Raises
    ------
    StimulusError
        As `write_exr`; the file is then as it was.
    """

    def checked() -> Iterator[tuple[slice, NDArray[np.float32]]]:
        bad = 0
        for band, xyz in rows:
            bad += int((~((xyz >= 0) & (xyz <= HALF_MAX))).any(axis=-1).sum())
            yield band, xyz
        if bad:
            raise StimulusError.at(
                path,
                f"in the view 'center' {counted(bad, 'pixel is', 'pixels are')} not within 0 to {HALF_MAX:.0f} cd/m²",
                "scale the picture down, or correct it",
            )

    write_pixel_rows(Path(path), xyz_spec(*size_px, ("center",), observer, False), checked())


def xyz_spec(width: int, height: int, views: tuple[str, ...], observer: str, exact: bool) -> OpenImageIO.ImageSpec:
    """Return the header of a file that `write_exr` writes, of ``views`` in their order."""
    import OpenImageIO as oiio

    first, *others = views
    names = [*"RGB", *(f"{view}.{channel}" for view in others for channel in "RGB")]
    spec = oiio.ImageSpec(width, height, len(names), "float" if exact else "half")
    spec.channelnames = tuple(names)
    spec.attribute("multiView", f"string[{len(views)}]", (first, *others))
    spec.attribute("chromaticities", "float[8]", _XYZ_CHROMATICITIES)
    spec.attribute("whiteLuminance", 1.0)
    if exact:
        spec.attribute(EXACT_ATTRIBUTE, 1)
    if observer != DEFAULT_OBSERVER:
        spec.attribute(OBSERVER_ATTRIBUTE, colorimetric_observer(observer).name)
    return spec


# Level 1: of pictures with grain, half of the time of level 4, OpenEXR's own, and files 2 % larger. Reading takes as
# long.
_ZIP = "zip:1"
# OpenImageIO writes the time of day into a file that has none; equal pictures must make equal files.
_NO_TIME = "0000:00:00 00:00:00"


def write_pixel_rows(
    path: Path, spec: OpenImageIO.ImageSpec, rows: Iterable[tuple[slice, NDArray[np.float32]]]
) -> None:
    """Write bands of ``rows`` (rows, width, channels), from the top down, to ``path`` by ``spec``, zipped, no time.

    A file that is there already stays as it was until the new one is complete.

    Raises
    ------
    StimulusError
        If the file cannot be written.
    """
    import OpenImageIO as oiio

    spec.attribute("compression", _ZIP)
    spec.attribute("DateTime", _NO_TIME)
    try:
        with whole_file(path, keep_suffix=True, make_folder=False) as draft:
            output = oiio.ImageOutput.create(str(draft))
            if output is None:
                raise _wrong(path, text_of(oiio.geterror))
            written = output.open(str(draft), spec)
            try:
                for band, pixels in rows:
                    part = np.ascontiguousarray(pixels)
                    written = written and output.write_scanlines(band.start, band.stop, 0, part)
                    del pixels, part  # not beside the next
            finally:
                closed = output.close()
            if not (closed and written):
                # OpenEXR says no more than that its output failed.
                if stopped := what_stopped(draft):
                    raise stopped
                raise _wrong(path, text_of(output.geterror))
    except OSError as error:
        wanted = spec.image_bytes(native=True)
        raise StimulusError(unwritable(error, path, "picture", wanted_bytes=wanted)) from error


def _wrong(path: Path, message: str) -> StimulusError:
    return StimulusError(Finding(f"the picture cannot be written: {reason(message)}", str(path)))
