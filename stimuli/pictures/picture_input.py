"""Picture files opened through OpenImageIO, why one cannot be, and pixels that are not square."""

from __future__ import annotations

import re
import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from documents.files import looked_for, open_regular, system_fault, unreadable, what_stops_reading
from documents.text import visible
from stimuli.errors import StimulusError
from stimuli.pictures.exr_structure import check_exr
from stimuli.pictures.png_chunks import MOST_PROFILE_BYTES

if TYPE_CHECKING:
    import OpenImageIO
    from PIL.Image import Image as PillowImage

MAX_BYTES = 8_000_000_000
# Of ENVI files, of which a few rows are in memory at a time.
MAX_SPECTRAL_BYTES = 32_000_000_000
# The first bytes of the files that are read: OpenImageIO would try its readers of all other formats on the rest.
_KINDS = {
    b"\x76\x2f\x31\x01": "openexr",
    b"II*\0": "tiff",
    b"MM\0*": "tiff",
    b"II+\0": "tiff",
    b"MM\0+": "tiff",
    b"\x89PNG": "png",
    b"\xff\xd8\xff": "jpeg",
    b"RIFF": "webp",
}
_MOST_TEXT = 300
# Black pixels in their bytes, by any compression.
_MOST_RATIO = 200_000


@contextmanager
def opened(
    path: Path,
    remedy: str = "write it again as OpenEXR",
    hint: OpenImageIO.ImageSpec | None = None,
    *,
    whole: bool = False,
) -> Iterator[OpenImageIO.ImageInput]:
    """Yield the open file at ``path`` and close it.

    Of OpenEXR, what it declares is checked before; with ``whole``, that none of its pixels lies beyond its end as well.

    Raises
    ------
    StimulusError
        If it is no regular file, larger than any picture, or OpenImageIO cannot open it; if a text that the body asks
        for is not UTF-8.
    """
    refuse_no_picture(path)
    if kind_of(path) is None:
        message = "the picture cannot be read: its first bytes are those of no OpenEXR, TIFF, PNG, JPEG or WebP"
        raise StimulusError.at(path, message, remedy)
    if kind_of(path) == "openexr":
        check_exr(path, whole=whole)
    picture = _opened(path, remedy, hint)
    try:
        spec = picture.spec()
        needed = spec.width * spec.height * spec.nchannels * spec.format.basesize()
        stored = path.stat().st_size
        if needed > _MOST_RATIO * stored:
            what = f"the picture is cut short: {stored} bytes are too few for {spec.width} × {spec.height} pixels"
            raise StimulusError.at(path, what, "copy or write it again")
        yield picture
    except UnicodeDecodeError as error:
        # OpenImageIO hands over names and texts as they stand in the file.
        message = "the picture is damaged: its header is not UTF-8 text"
        raise StimulusError.at(path, message, "copy or write it again") from error
    except MemoryError as error:
        raise StimulusError(unreadable(error, path, "picture")) from error
    finally:
        picture.close()


@contextmanager
def opened_by_pillow(path: Path) -> Iterator[PillowImage]:
    """Yield the file at ``path``, open through Pillow, whose limit on pixels is no warning: ours is an error."""
    from PIL import Image, PngImagePlugin

    # By itself it calls a PNG damaged whose profile unpacks to more than a megabyte; all texts keep their own limit.
    PngImagePlugin.MAX_TEXT_CHUNK = max(PngImagePlugin.MAX_TEXT_CHUNK, MOST_PROFILE_BYTES)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            with Image.open(path) as picture:
                yield picture
        except (OSError, MemoryError) as error:
            if system_fault(error):
                raise StimulusError(unreadable(error, path, "picture")) from error
            raise


def kind_of(path: Path) -> str | None:
    """Return the kind of a file by its first bytes: openexr, tiff, png, jpeg, webp; None if it is none of these."""
    with open_regular(path, "picture", error=StimulusError) as file:
        start = file.read(4)
    return next((kind for magic, kind in _KINDS.items() if start.startswith(magic)), None)


def refuse_no_picture(path: Path, what: str = "picture", most_bytes: int = MAX_BYTES) -> None:
    """Raise StimulusError if ``path`` is no regular file that libraries can open, or larger than ``most_bytes``."""
    try:
        open_regular(path, what, limit_bytes=most_bytes, error=StimulusError).close()
    except StimulusError as error:
        if isinstance(error.__cause__, FileNotFoundError | NotADirectoryError):
            raise StimulusError.at(path, f"there is no such {what}", looked_for(path)) from error
        raise
    try:
        str(path).encode()
    except UnicodeEncodeError as error:
        message = "its name is not UTF-8, and the libraries that decode pictures cannot open it"
        raise StimulusError.at(path, message, "rename it") from error


def refuse_undecoded(path: Path, message: str, remedy: str, caught: Exception | None = None) -> NoReturn:
    """Raise StimulusError for a file that a library could not decode: what the machine could not do, else ``message``.

    ``caught`` is what the library raised, None if it keeps the reason to itself.
    """
    cause = caught if system_fault(caught) else what_stops_reading(path)
    if cause is not None:
        raise StimulusError(unreadable(cause, path, "picture")) from cause
    raise StimulusError.at(path, message, remedy) from caught


def text_of(call: Callable[[], str]) -> str:
    """Return the text of a C library, which may hold bytes of a damaged file, as one line that can be shown."""
    try:
        text = call()
    except UnicodeDecodeError as error:
        text = error.object.decode("utf-8", "replace")
    return "\n".join(visible(line) for line in text.splitlines())


def _opened(path: Path, remedy: str, hint: OpenImageIO.ImageSpec | None) -> OpenImageIO.ImageInput:
    import OpenImageIO as oiio

    picture = _open(path, hint)
    message = "" if picture is not None else text_of(oiio.geterror)
    if "ubsampled channels" in message:
        picture = _open_by_openexr(path, hint)
        if picture is None:
            channels = ", ".join(dict.fromkeys(re.findall(r'channel "([^"]*)"', message)))
            what = f"the channels {channels} have a lower resolution than the picture"
            remedy = "write R, G and B at full resolution; of luminance and chroma, one view in one part is read"
            raise StimulusError.at(path, what, remedy)
    elif picture is None:
        refuse_undecoded(path, f"the picture cannot be read: {reason(message)}", remedy)
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
        text_of(oiio.geterror)
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
    return reasons[-1].strip()[:_MOST_TEXT] if reasons else "no reason given"


MAX_PIXELS = 100_000_000  # per view, so that a header of a few bytes cannot ask for all memory
