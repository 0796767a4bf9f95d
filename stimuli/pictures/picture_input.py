"""Picture files opened through OpenImageIO, why one cannot be, and pixels that are not square."""

from __future__ import annotations

import re
import threading
from pathlib import Path
from typing import TYPE_CHECKING

from stimuli.errors import StimulusError

if TYPE_CHECKING:
    import OpenImageIO


def opened(
    path: Path, remedy: str = "write it again as OpenEXR", hint: OpenImageIO.ImageSpec | None = None
) -> OpenImageIO.ImageInput:
    """Return the open file at ``path``; the caller closes it.

    Raises
    ------
    StimulusError
        If OpenImageIO cannot open it.
    """
    import OpenImageIO as oiio

    picture = _open(path, hint)
    message = "" if picture is not None else oiio.geterror()
    if "ubsampled channels" in message:
        picture = _open_by_openexr(path, hint)
        if picture is None:
            channels = ", ".join(dict.fromkeys(re.findall(r'channel "([^"]*)"', message)))
            what = f"the channels {channels} have a lower resolution than the picture"
            remedy = "write R, G and B at full resolution; of luminance and chroma, one view in one part is read"
            raise StimulusError.at(path, what, remedy)
    elif picture is None:
        raise StimulusError.at(path, f"the picture cannot be read: {reason(message)}", remedy)
    return picture


def _open(path: Path, hint: OpenImageIO.ImageSpec | None) -> OpenImageIO.ImageInput | None:
    import OpenImageIO as oiio

    return oiio.ImageInput.open(str(path)) if hint is None else oiio.ImageInput.open(str(path), hint)


_CORE = "openexr:core"
_turn = threading.Lock()


def _open_by_openexr(path: Path, hint: OpenImageIO.ImageSpec | None) -> OpenImageIO.ImageInput | None:
    """Open a picture by OpenEXR's C++ library, which interpolates chroma, in place of its C library."""
    import OpenImageIO as oiio

    # For the whole process; a picture that another thread opens meanwhile is read by that library too, only slower.
    with _turn:
        before = oiio.get_int_attribute(_CORE, 1)
        oiio.attribute(_CORE, 0)
        try:
            picture = _open(path, hint)
        finally:
            oiio.attribute(_CORE, before)
    if picture is None:
        oiio.geterror()
    elif picture.spec().getattribute("oiio:subimages") not in (None, 1):
        picture.close()
        picture = None
    return picture


# What rounding to whole pixels per metre, or dots per inch, makes of square pixels.
_SQUARE = 0.005


def is_square(pixel_aspect: float) -> bool:
    """Whether pixels of that width over height are square, but for how their resolution was rounded."""
    return abs(pixel_aspect - 1.0) <= _SQUARE


def refuse_pixels_not_square(pixel_aspect: float, path: Path, named: str) -> None:
    """Raise StimulusError if pixels of that width over height are not square; ``named`` says what states it."""
    if not is_square(pixel_aspect):
        message = f"its pixels are {pixel_aspect:.4g} times as wide as high ({named}), and are not stretched here"
        remedy = (
            f"resample it to square pixels in linear light: oiiotool IN --resize {100 * pixel_aspect:.4g}%x100% -o OUT"
        )
        raise StimulusError.at(path, message, remedy)


def reason(message: str) -> str:
    """Return the last line of OpenImageIO's message that is no advice on its own settings."""
    lines = [line for line in message.splitlines() if line.strip()]
    reasons = [line for line in lines if "global attribute" not in line] or lines
    return reasons[-1].strip() if reasons else "no reason given"
