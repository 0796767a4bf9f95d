"""What an ordinary picture file says of itself, read from its header without decoding its pixels.

PNG, JPEG (MPO and JPS among them), WebP and TIFF. What cannot become light without a guess is refused here: CMYK,
palettes, one bit, animations, and sizes that no display has.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stimuli.errors import StimulusError
from stimuli.pictures.packing import Packing, named_packing
from stimuli.pictures.picture_input import (
    MAX_PIXELS,
    kind_of,
    opened,
    opened_by_pillow,
    refuse_no_picture,
    refuse_undecoded,
)
from stimuli.pictures.png_chunks import png_aspect, png_chunks, png_exif, png_profile, png_space, stated_space
from stimuli.pictures.resampling import MAX_PIXELS as MAX_SIDE_PX

if TYPE_CHECKING:
    import OpenImageIO
    from PIL.Image import Image

TIFF = (".tif", ".tiff")
SUFFIXES = (".png", ".jpg", ".jpeg", ".jpe", ".jps", ".mpo", ".webp", *TIFF)
# Kinds of files that look like pictures and are not read, and what to do.
OTHERS = (".gif", ".bmp", ".heic", ".heif", ".avif", ".jxl", ".jp2", ".psd", ".tga")

_ORIENTATION, _EXIF_SPACE, _EXIF_IFD, _INTEROP_IFD = 0x0112, 0xA001, 0x8769, 0xA005
_TIFF_WHITE, _TIFF_PRIMARIES = 318, 319
_MODES = {"L": 1, "LA": 1, "RGB": 3, "RGBA": 3, "I;16": 1, "I;16B": 1, "I": 1}
_DAMAGED = "copy or write it again"
# What Pillow raises for files that are damaged.
UNREADABLE = (
    *(OSError, ValueError, SyntaxError, TypeError, LookupError, EOFError, struct.error),
    *(AttributeError, OverflowError, RecursionError),
)


@dataclass(frozen=True, slots=True)
class PictureHeader:
    """The facts of an ordinary picture file.

    ``kind`` is ``png``, ``jpeg``, ``webp`` or ``tiff``; ``stored_px`` (width, height) as the file stores them, before
    its EXIF ``orientation`` (1 to 8). ``bits`` are 8, 16, or 32 of a float; ``channels`` 1 (grey) or 3, without alpha.
    ``profile`` is the embedded ICC profile. ``declared`` is the named colour space that the file states without one,
    or of a PNG beside one, else None. ``packing`` is the layout of two eyes that the file, or its name, states;
    ``frames`` is 2 of an MPO pair.
    ``stored_aspect`` is a pixel's width over its height, as its resolutions along both state it, before it is upright.
    """

    path: Path
    kind: str
    stored_px: tuple[int, int]
    orientation: int
    bits: int
    channels: int
    has_alpha: bool
    profile: bytes | None
    declared: str | None
    packing: Packing | None
    frames: int = 1
    stored_aspect: float = 1.0

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height once upright."""
        width, height = self.stored_px
        return (height, width) if self.orientation >= 5 else (width, height)

    @property
    def pixel_aspect(self) -> float:
        """A pixel's width over its height once upright."""
        return 1.0 / self.stored_aspect if self.orientation >= 5 else self.stored_aspect

    @property
    def is_pair(self) -> bool:
        """Whether the file holds both eyes' pictures."""
        return self.frames == 2 or self.packing not in (None, "none")


def is_ordinary(path: Path) -> bool:
    """Whether a file is an ordinary picture, or one of the kinds that are not read, by its suffix."""
    return path.suffix.lower() in (*SUFFIXES, *OTHERS)


def read_header(path: Path, packing: Packing | None = None) -> PictureHeader:
    """Return the facts of the picture file at ``path``; of one that is packed as ``packing`` says, where that is given.

    Raises
    ------
    StimulusError
        If it is missing, damaged, of another kind, or of a form that cannot be shown; with what to do.
    """
    suffix = path.suffix.lower()
    refuse_no_picture(path)
    if suffix not in SUFFIXES:
        remedy = "save it as PNG, JPEG, TIFF, WebP or OpenEXR"
        raise StimulusError.at(path, f"pictures of the kind {suffix or 'without a suffix'} are not read", remedy)
    header = _tiff(path) if suffix in TIFF else _by_pillow(path)
    if packing is not None:
        header = replace(header, packing=packing, frames=1)
    _refuse_size(header)
    return header


def _refuse_size(header: PictureHeader) -> None:
    width, height = header.size_px
    if header.frames == 1 and header.packing not in (None, "none"):
        across = str(header.packing).startswith("side-by-side")
        width, height = (width // 2, height) if across else (width, height // 2)
    if max(width, height) > MAX_SIDE_PX or header.stored_px[0] * header.stored_px[1] > MAX_PIXELS:
        limit = f"{MAX_SIDE_PX} a side and {MAX_PIXELS // 10**6} megapixels are the most"
        message = f"a picture of {width} × {height} pixels is too large: {limit}"
        raise StimulusError.at(header.path, message, "crop it, or save it smaller")


def _by_pillow(path: Path) -> PictureHeader:
    from PIL import Image, UnidentifiedImageError

    png = dict(png_chunks(path)) if kind_of(path) == "png" else {}
    profile = png_profile(png, path)
    try:
        with opened_by_pillow(path) as picture:
            return _of_pillow(picture, path, png, profile or picture.info.get("icc_profile") or None)
    except UnidentifiedImageError as error:
        refuse_undecoded(path, "the file is no picture, or its beginning is damaged", _DAMAGED, error)
    except Image.DecompressionBombError as error:
        message = f"the picture is too large: {MAX_PIXELS // 10**6} megapixels are the most"
        raise StimulusError.at(path, message, "crop it, or save it smaller") from error
    except UNREADABLE as error:
        refuse_undecoded(path, f"the picture is damaged: {_one_line(error)}", _DAMAGED, error)


def _of_pillow(picture: Image, path: Path, png: dict[str, bytes], profile: bytes | None) -> PictureHeader:
    kind = {"PNG": "png", "JPEG": "jpeg", "MPO": "jpeg", "WEBP": "webp"}.get(picture.format or "")
    if kind is None:
        message = f"the file is {picture.format}, whatever its name says"
        raise StimulusError.at(path, message, "save it as PNG, JPEG, TIFF or WebP")
    bits, colour_type = (png["IHDR"][8], png["IHDR"][9]) if kind == "png" else (8, -1)
    if kind != "jpeg" and getattr(picture, "is_animated", False):
        raise StimulusError.at(path, "the picture is animated", "save the frame that is to be shown")
    if bits == 1 or picture.mode == "1":
        raise StimulusError.at(path, "the picture has 1 bit a pixel, black or white", "save it as 8-bit grey or RGB")
    if colour_type == 3 or picture.mode in ("P", "PA"):
        message = "the picture has a palette of at most 256 colours"
        raise StimulusError.at(path, message, "save it as RGB, from the original if there is one")
    if picture.mode not in _MODES:
        what = "CMYK, inks for a printer" if picture.mode in ("CMYK", "YCCK") else f"of the mode {picture.mode}"
        raise StimulusError.at(path, f"the picture is {what}", "convert it to RGB with its profile, then save it")
    exif = png_exif(png) if kind == "png" else picture.getexif()
    frames, packing = 1, named_packing(path.stem)
    if kind == "jpeg":
        frames = frames_of(picture)
        packing = None if frames == 2 else jps_packing(picture, path) or packing
    return PictureHeader(
        path,
        kind,
        picture.size,
        _orientation(exif.get(_ORIENTATION)),
        max(bits, 8),
        _MODES[picture.mode],
        colour_type in (4, 6) or "tRNS" in png or (kind == "webp" and picture.mode == "RGBA"),
        profile,
        png_space(png, path) if kind == "png" else _exif_space(exif),
        packing,
        frames,
        png_aspect(png) if kind == "png" else pixel_aspect(picture.info.get("jfif_density")),
    )


def _exif_space(exif: Any) -> str | None:
    """Return the colour space that EXIF states: 1 is sRGB; R03 marks Adobe RGB (DCF 2.0)."""
    tags = exif.get_ifd(_EXIF_IFD)
    if tags.get(_EXIF_SPACE) == 1:
        return "srgb"
    if str(exif.get_ifd(_INTEROP_IFD).get(1, "")).startswith("R03") or tags.get(_EXIF_SPACE) == 2:
        return "adobe-rgb"
    return None


def pixel_aspect(per_length: object) -> float:
    """Return a pixel's width over its height, of how many lie along a length, across and down; 1 if that is not known.

    JFIF states 1 and 1 for square pixels without a size; 0, or anything else that is no resolution, states nothing.
    """
    match per_length:
        case (int() | float() as across, int() | float() as down) if across > 0 and 0 < down < math.inf:
            return float(down) / float(across)
    return 1.0


def _orientation(value: object) -> int:
    return value if isinstance(value, int) and 1 <= value <= 8 else 1


def _tiff(path: Path) -> PictureHeader:
    with opened(path, _DAMAGED) as picture:
        if picture.format_name() != "tiff":
            raise StimulusError.at(path, f"the file is {picture.format_name()}, not TIFF", "give it its own suffix")
        spec = picture.spec()
        if picture.seek_subimage(1, 0):
            raise StimulusError.at(path, "the file holds more than one picture", "save the one that is to be shown")
        alpha = spec.alpha_channel
        channels = spec.nchannels - (alpha >= 0)
        for message, remedy in _tiff_faults(spec, channels, alpha):
            raise StimulusError.at(path, message, remedy)
        data = spec.getattribute("ICCProfile")
        profile = None if data is None else bytes(bytearray(data))
        if profile is None:
            _refuse_other_primaries(path)
        return PictureHeader(
            path,
            "tiff",
            (spec.width, spec.height),
            _orientation(spec.getattribute("Orientation")),
            {"uint8": 8, "uint16": 16}.get(str(spec.format), 32),
            channels,
            alpha >= 0,
            profile,
            "srgb" if spec.getattribute("Exif:ColorSpace") == 1 and profile is None else None,
            named_packing(path.stem),
            stored_aspect=pixel_aspect((spec.getattribute("XResolution"), spec.getattribute("YResolution"))),
        )


def _refuse_other_primaries(path: Path) -> None:
    """Refuse a TIFF without a profile whose tags state other primaries than sRGB's; OpenImageIO leaves these out."""
    from PIL import Image

    try:
        with opened_by_pillow(path) as picture:
            tags: Any = getattr(picture, "tag_v2", {})
            white, primaries = tags.get(_TIFF_WHITE), tags.get(_TIFF_PRIMARIES)
    except (*UNREADABLE, Image.DecompressionBombError):
        return  # of a form that Pillow does not know: floats of some kinds
    if white is not None and primaries is not None and len((*white, *primaries)) == 8:
        stated_space([float(value) for value in (*white, *primaries)], None, path, "its tag PrimaryChromaticities")


def _tiff_faults(spec: OpenImageIO.ImageSpec, channels: int, alpha: int) -> Iterator[tuple[str, str]]:
    """Yield what is wrong with a TIFF's form, and what to do."""
    photometric = spec.getattribute("tiff:PhotometricInterpretation")
    bits = int(spec.getattribute("oiio:BitsPerSample") or 8 * spec.format.basesize())
    if photometric == 5:
        yield "the picture is CMYK, inks for a printer", "convert it to RGB with its profile, then save it"
    if photometric == 3:
        yield "the picture has a palette of at most 256 colours", "save it as RGB, from the original if there is one"
    if bits == 1:
        yield "the picture has 1 bit a pixel, black or white", "save it as 8-bit grey or RGB"
    if photometric not in (1, 2) or channels not in (1, 3) or alpha not in (-1, channels):
        names = ", ".join(spec.channelnames)
        yield f"the picture is of another form than grey or RGB (channels {names})", "save it as grey or RGB"
    if bits not in (8, 16, 32, 64) or str(spec.format) not in ("uint8", "uint16", "half", "float", "double"):
        yield f"its values are {spec.format} of {bits} bits", "save it with 8 or 16 bits, or as float"
    if alpha >= 0 and spec.getattribute("tiff:UnassociatedAlpha") is None:
        yield "its colours are multiplied by its alpha (associated alpha)", "flatten it, or save it with straight alpha"


def _one_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]


# A pair's second picture; others of an MPO are previews, panoramas and gain maps.
_PAIR_TYPES = ("Multi-Frame Image (Disparity)", "Undefined")


def frames_of(picture: Any) -> int:
    """Return 2 of an MPO whose two pictures are a pair: of one size, and not a preview or a gain map."""
    if picture.format != "MPO" or picture.n_frames != 2:
        return 1
    types = [entry["Attribute"]["MPType"] for entry in picture.mpinfo[0xB002]]
    if types[1] not in _PAIR_TYPES:
        return 1
    size = picture.size
    picture.seek(1)
    pair = picture.size == size
    picture.seek(0)
    return 2 if pair else 1


def jps_packing(picture: Any, path: Path) -> Packing | None:
    """Return the packing that a JPS states in its stereoscopic descriptor; without one a .jps is crossed [JPS]."""
    for name, content in getattr(picture, "applist", ()):
        if name == "APP3" and content[:8] == b"_JPSJPS_" and len(content) >= 14:
            _, flags, layout, media = content[10:14]
            if media != 1:
                return "none"
            if layout not in (2, 3):
                message = f"its stereoscopic descriptor states layout {layout}, rows in turn or an anaglyph"
                raise StimulusError.at(path, message, "save it side by side")
            half = "-half" if flags & (2 if layout == 2 else 1) else ""
            crossed = "" if flags & 4 else "-crossed"
            name_of: Any = ("side-by-side" if layout == 2 else "top-bottom") + half + crossed
            packing: Packing = name_of
            return packing
    return "side-by-side-crossed" if path.suffix.lower() == ".jps" else None
