"""The pixels of an ordinary picture file: decoded, and turned upright as its EXIF orientation asks."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from documents import count_work
from documents.files import read_regular
from stimuli.errors import StimulusError
from stimuli.pictures.picture_header import UNREADABLE, PictureHeader
from stimuli.pictures.picture_input import MAX_BYTES, opened, opened_by_pillow, reason, refuse_undecoded, text_of
from stimuli.pictures.png_chunks import png_pixel_bytes

Pixels = NDArray[Any]
_MOST_RATIO_OF_DEFLATE = 1100
_MOST_SCANS = 100
# A scan's mark and its header: length, components, their tables, and the spectral selection.
_SCANS = re.compile(rb"\xff\xda\0[\x06-\x0e][\x01-\x04]")


def decode(header: PictureHeader, frame: int = 0) -> Pixels:
    """Return the pixels of a file, upright, (height, width, channels), uint8, uint16 or float32; alpha last."""
    import OpenImageIO as oiio

    count_work("pictures_read")
    if header.kind == "png":
        _refuse_too_few_bytes(header)
    if header.kind == "jpeg":
        _refuse_many_scans(header)
    # OpenImageIO reads one picture of an MPO, and libpng writes its complaints past it to the terminal.
    if header.frames == 2 or (header.kind == "png" and header.bits == 8):
        return _decode_by_pillow(header, frame)
    hint = oiio.ImageSpec()
    hint.attribute("oiio:UnassociatedAlpha", 1)
    with opened(header.path, "copy or write it again", hint) as picture:
        spec = picture.spec()
        stored = picture.read_image(0, 0, 0, spec.nchannels, {8: "uint8", 16: "uint16"}.get(header.bits, "float"))
        # A JPEG that is cut short gives its first part, and a complaint.
        problem = text_of(picture.geterror)
    if stored is None or problem:
        why = reason(problem).replace(f' ("{header.path}")', "")
        refuse_undecoded(header.path, f"the picture is cut short or damaged: {why}", "copy or save it again")
    return upright(stored.reshape(*stored.shape[:2], -1), header.orientation)


def _refuse_too_few_bytes(header: PictureHeader) -> None:
    """Refuse a PNG of fewer bytes than its pixels can be compressed to, before memory is taken for them."""
    width, height = header.stored_px
    needed = width * height * (header.channels + header.has_alpha) * header.bits // 8
    stored = png_pixel_bytes(header.path)
    if needed > stored * _MOST_RATIO_OF_DEFLATE:
        message = f"the picture is cut short or damaged: {stored} bytes are too few for {width} × {height} pixels"
        raise StimulusError.at(header.path, message, "copy or save it again")


def _refuse_many_scans(header: PictureHeader) -> None:
    """Refuse a JPEG of so many scans that decoding takes minutes: each of them goes through all of the picture."""
    content = read_regular(header.path, MAX_BYTES, "picture", error=StimulusError)
    # The mark of a scan may stand in metadata by chance. NumPy counts it in a tenth of the time of `bytes.count`.
    pairs = (np.frombuffer(content, "<u2", (len(content) - first) // 2, first) for first in (0, 1))
    marks = sum(np.count_nonzero(each == 0xDAFF) for each in pairs)
    if marks > _MOST_SCANS and len(_SCANS.findall(content)) > _MOST_SCANS:
        message = f"the picture is stored in more than {_MOST_SCANS} scans"
        raise StimulusError.at(header.path, message, "save it again, not progressive")


def _decode_by_pillow(header: PictureHeader, frame: int) -> Pixels:
    try:
        with opened_by_pillow(header.path) as picture:
            picture.seek(frame)
            form = ("L" if header.channels == 1 else "RGB") + ("A" if header.has_alpha else "")
            pixels = np.asarray(picture if picture.mode == form else picture.convert(form))
    except UNREADABLE as error:
        message = f"the picture is cut short or damaged: {(str(error).splitlines() or ['no reason given'])[0]}"
        refuse_undecoded(header.path, message, "copy or save it again", error)
    return upright(pixels.reshape(*pixels.shape[:2], -1), header.orientation)


def upright(pixels: Pixels, orientation: int) -> Pixels:
    """Return pixels (height, width, ...) turned as an EXIF orientation of 1 to 8 asks."""

    return turned(pixels, EXIF_FLIPS[orientation])


# LibRaw's flip for each orientation of Exif (and TIFF), 1 to 8.
EXIF_FLIPS = {1: 0, 2: 1, 3: 3, 4: 2, 5: 4, 6: 6, 7: 7, 8: 5}


def turned(array: NDArray[Any], flip: int) -> NDArray[Any]:
    """Return ``array`` (height, width, ...) turned by the bits of LibRaw's ``flip``.

    2 reverses the rows, 1 the columns, and 4, done last, swaps rows with columns.
    """
    if flip & 2:
        array = array[::-1]
    if flip & 1:
        array = array[:, ::-1]
    return array.swapaxes(0, 1) if flip & 4 else array


def unturned(array: NDArray[Any], flip: int) -> NDArray[Any]:
    """Return a view of a `turned` ``array`` that stands as it did before."""
    if flip & 4:
        array = array.swapaxes(0, 1)
    if flip & 1:
        array = array[:, ::-1]
    return array[::-1] if flip & 2 else array
