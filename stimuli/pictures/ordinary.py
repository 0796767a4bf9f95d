"""From a PNG, JPEG, TIFF, WebP, MPO or JPS to a picture for two eyes in absolute XYZ.

Codes of 8 and 16 bits stay codes as long as a table for each channel and a matrix make light of them; what needs
arithmetic on light (floats, profiles of tables, alpha, half pictures) becomes XYZ at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from documents import Finding
from documents.text import counted
from stimuli.errors import StimulusError
from stimuli.pictures.coded import CodedPicture
from stimuli.pictures.colour_spaces import NAMED_SPACES, ColourEncoding, embedded_encoding, named_encoding, same_space
from stimuli.pictures.exr_read import Decoding
from stimuli.pictures.find import declared_space
from stimuli.pictures.own_files import OwnFiles, decoded_eyes, own_files, stamps
from stimuli.pictures.packing import PACKINGS, Packing, eye_size_px, stretched
from stimuli.pictures.picture_header import PictureHeader, read_header
from stimuli.pictures.picture_input import is_square, refuse_pixels_not_square, refuse_undecoded
from stimuli.pictures.picture_pixels import Pixels
from stimuli.pictures.region import Part
from stimuli.pictures.stereo_image import Eye, StereoImage, XYZImage

_LINEAR = ("xyz", "rec709")
_ROWS = 64


@dataclass(frozen=True, eq=False, slots=True)
class OrdinaryPicture:
    """A picture, ``held`` as codes where these suffice, else in XYZ; a flat one has one array for both eyes.

    ``views`` are those that the files hold, ``colour_space`` what was used, ``clipped_pixels`` those whose XYZ below 0
    was set to 0.
    """

    held: StereoImage | CodedPicture
    views: tuple[str, ...]
    colour_space: str
    bits: int
    white_luminance_cd_m2: float
    packing: Packing | None
    clipped_pixels: int

    @property
    def image(self) -> StereoImage:
        """The picture in XYZ."""
        return self.held.image() if isinstance(self.held, CodedPicture) else self.held


@dataclass(frozen=True, slots=True)
class _Plan:
    """What the headers of a picture's files show: how its codes become light, and where its eyes are."""

    headers: tuple[PictureHeader, ...]
    encoding: ColourEncoding
    packing: Packing | None

    @property
    def is_pair(self) -> bool:
        return len(self.headers) == 2 or self.headers[0].frames == 2 or self.packing is not None


def check_ordinary(
    files: Sequence[Path],
    decoding: Decoding,
    packing: Packing | None = None,
    *,
    flat: bool = False,
    flat_eye: Eye | None = None,
) -> _Plan:
    """Check all of a picture that its files' headers show, without decoding it; as `read_ordinary`.

    Raises
    ------
    StimulusError
        As `read_ordinary`, but for what only the pixels show: damage, and transparent pixels.
    """
    given: Packing | None = "none" if len(files) == 2 else packing
    if given not in (None, *PACKINGS):
        raise StimulusError.at(files[0], f"there is no packing '{given}'", f"one of {', '.join(PACKINGS)}")
    headers = [read_header(path, given) for path in files]
    header, last = headers[0], headers[-1]
    if header.size_px != last.size_px:
        sizes = [f"{item.size_px[0]} × {item.size_px[1]}" for item in headers]
        message = f"the views differ in size: 'left' is {sizes[0]}, 'right' is {sizes[1]}"
        raise StimulusError.at(last.path, message, "crop or save them alike")
    if (header.channels, header.has_alpha, header.bits) != (last.channels, last.has_alpha, last.bits):
        message = "the two eyes' pictures are of different form: grey or colour, bits, or alpha"
        raise StimulusError.at(last.path, message, "save them alike")
    used = None if header.frames == 2 or header.packing == "none" else header.packing
    if used is not None:
        eye_size_px(header.size_px, used, header.path)
    for item in headers:
        _refuse_aspect(item, used)
    spaces = [encoding_of(item, decoding) for item in headers]
    if not _alike(spaces[0], spaces[-1]):
        message = "the two eyes' pictures have different colour spaces"
        raise StimulusError.at(last.path, message, "convert them to one, such as sRGB")
    plan = _Plan(tuple(headers), spaces[0], used)
    if flat and plan.is_pair and flat_eye is None:
        message = "there is no centre view for the flat version"
        raise StimulusError.at(header.path, message, "name an eye: flat_eye: left, or --flat-eye left")
    return plan


def _refuse_aspect(header: PictureHeader, packing: Packing | None) -> None:
    """Refuse pixels that are stated not to be square, unless they are as wide, or high, again for a half picture."""
    half = {"side-by-side-half": 2.0, "top-bottom-half": 0.5}.get((packing or "").removesuffix("-crossed"), 1.0)
    if not is_square(header.pixel_aspect / half):
        refuse_pixels_not_square(header.pixel_aspect, header.path, "its resolution across and down")


def read_ordinary(
    files: Sequence[Path],
    decoding: Decoding,
    packing: Packing | None = None,
    *,
    flat: bool = False,
    flat_eye: Eye | None = None,
    part: Part | None = None,
) -> OrdinaryPicture:
    """Read a picture from one file, or from the left and the right eye's.

    ``packing`` is how both eyes lie in one file; None takes what the file, or a word in its name, states. With ``flat``
    a pair gives the picture of ``flat_eye``. ``part`` chooses by an eye's size what light is made of; its codes are not
    kept as the files that they came from.

    Raises
    ------
    StimulusError
        If a file cannot be read or shown, declares another colour space, or neither it nor ``decoding`` states one.
    """
    plan = check_ordinary(files, decoding, packing, flat=flat, flat_eye=flat_eye)
    header, eye = plan.headers[0], flat_eye if flat and plan.is_pair else None
    try:
        before = stamps(plan.headers, eye)
        eyes = decoded_eyes(plan.headers, plan.packing, eye)
        own = own_files(plan.headers, plan.packing, eye) if part is None else None
        if before != stamps(plan.headers, eye):
            raise StimulusError.at(header.path, "the picture changed while it was read", "try again once it is written")
    except OSError as error:
        refuse_undecoded(header.path, f"the picture cannot be read: {error.strerror}", "try again", error)
    views = ("left", "right") if len(eyes) == 2 else ((str(eye),) if plan.is_pair else ("center",))
    return _made(eyes, plan, decoding, views, own, part)


def _made(
    eyes: list[Pixels],
    plan: _Plan,
    decoding: Decoding,
    views: tuple[str, ...],
    own: OwnFiles | None,
    part: Part | None,
) -> OrdinaryPicture:
    header, encoding, packing = plan.headers[0], plan.encoding, plan.packing
    white = decoding.white_luminance_cd_m2 or 1.0
    matrix = encoding.matrix * white
    with_alpha = eyes[0].shape[2] in (2, 4)
    opaque = not with_alpha or all(bool((codes[..., -1] == _full(codes)).all()) for codes in eyes)
    if not opaque and decoding.alpha_background_cd_m2 is None:
        remedy = "flatten it, or write the luminance of the grey behind it: alpha_background_cd_m2: 20"
        raise StimulusError.at(header.path, "the picture is partly transparent (alpha)", remedy)
    if opaque and with_alpha:
        eyes = [codes[..., :-1] for codes in eyes]
    whole = all(np.issubdtype(codes.dtype, np.unsignedinteger) for codes in eyes)
    light = encoding.tables(int(_full(eyes[0])) + 1) if whole and encoding.table is None else None
    half = packing is not None and "half" in packing
    if part is not None and not half:
        eyes = [codes[region_of(codes, part)] for codes in eyes]
    facts = (views, encoding.name, header.bits, white, packing)
    if light is not None and opaque and not half and not (matrix < 0).any():
        return OrdinaryPicture(CodedPicture.of(eyes, light, matrix, own), *facts, 0)
    background = decoding.alpha_background_cd_m2 or 0.0
    images, below = [], 0
    for codes in eyes:
        xyz, count = light_of(codes, encoding, white, background, decoding.negative, header.path)
        images.append(xyz)
        below += count
    image = StereoImage(images[0], images[-1])
    if half and packing is not None:
        image = stretched(image, packing)
        if part is not None:
            shown = [
                eye[region_of(eye, part)] for eye in ([image.left] if image.is_flat else [image.left, image.right])
            ]
            image = StereoImage(shown[0], shown[-1])
    return OrdinaryPicture(image, *facts, below)


def region_of(pixels: NDArray[Any], part: Part) -> tuple[slice, slice]:
    """Return the rows and columns of the ``part`` of a picture's pixels (height, width, ...)."""
    height, width = pixels.shape[:2]
    region = part((width, height))
    return slice(region.top, region.bottom), slice(region.left, region.right)


def light_of(
    codes: Pixels, encoding: ColourEncoding, white: float, background_cd_m2: float, negative: str, path: Path
) -> tuple[XYZImage, int]:
    """Return XYZ in cd/m² of codes of any kind, alpha composed in linear light, and how many pixels were clipped."""
    height, width, channels = codes.shape
    full = _full(codes)
    grey_XYZ = encoding.white / encoding.white[1] * background_cd_m2
    out = np.empty((height, width, 3), np.float32)
    below = 0
    for first in range(0, height, _ROWS):
        with np.errstate(invalid="ignore"):  # of NaN, which is refused below
            values = codes[first : first + _ROWS].reshape(-1, channels).astype(np.float64) / full
        if not np.isfinite(values).all():
            bad = int((~np.isfinite(codes)).any(axis=-1).sum())
            message = f"{counted(bad, 'pixel is', 'pixels are')} NaN or infinite"
            raise StimulusError.at(path, message, "correct the picture")
        colours = values[:, :3] if channels >= 3 else np.repeat(values[:, :1], 3, axis=1)
        xyz = encoding.xyz(colours) * white
        if channels in (2, 4):
            alpha = values[:, -1:]
            xyz = alpha * xyz + (1.0 - alpha) * grey_XYZ
        below += int((xyz < 0).any(axis=-1).sum())
        with np.errstate(over="ignore"):
            out[first : first + _ROWS] = xyz.reshape(-1, width, 3)
        if beyond := int((~np.isfinite(out[first : first + _ROWS])).any(axis=-1).sum()):
            message = f"{counted(beyond, 'pixel is', 'pixels are')} beyond single precision after conversion to XYZ"
            raise StimulusError.at(path, message, "correct the picture")
    if below and negative == "refuse":
        message = f"{counted(below, 'pixel has', 'pixels have')} negative XYZ, down to {out.min():.3g} cd/m²"
        raise StimulusError.at(path, message, "correct the picture, or ask for 'negative: clip'")
    return (np.maximum(out, np.float32(0)), below) if below else (out, 0)


def encoding_of(header: PictureHeader, decoding: Decoding) -> ColourEncoding:
    """Return how the codes of a file become light; StimulusError if it is not known, or stated in two ways."""
    asked = None if decoding.colour_space == "declared" else decoding.colour_space
    faults: list[tuple[str, str]] = []
    encoding = None
    own = None if header.profile is None else embedded_encoding(header.profile, header.path)
    declared, disagreeing = declared_space(header, own)
    if disagreeing and asked is None:
        faults += disagreeing
    elif disagreeing and asked == header.declared:
        declared = asked
    if asked in _LINEAR:
        if header.bits != 32:
            faults.append(
                (
                    f"its values of {header.bits} bits are codes and no linear light ({asked})",
                    "write colour_space: srgb",
                )
            )
        linear = _linear_encoding(asked)
        return _checked(linear, header, faults)
    if asked in NAMED_SPACES:
        if declared not in (None, asked):
            what = "an ICC profile of another colour space" if declared == "icc" else f"the colour space {declared}"
            remedy = "write colour_space: declared, to use it"
            faults.append((f"it declares {what}, and {asked} is asked for", remedy))
        encoding = named_encoding(next(name for name in NAMED_SPACES if name == asked))
    elif asked == "icc" and own is None:
        faults.append(("it has no ICC profile", "write its colour space by name, such as colour_space: srgb"))
    elif asked not in (None, "icc"):
        names = ", ".join((*NAMED_SPACES, "icc", "declared"))
        faults.append((f"there is no colour space '{asked}'", f"one of {names}"))
    elif own is not None:
        name = same_space(own)
        encoding = own if name is None or asked == "icc" else named_encoding(name)
    elif header.declared in NAMED_SPACES:
        encoding = named_encoding(next(name for name in NAMED_SPACES if name == header.declared))
    else:
        also = ", or rec709 or xyz of linear light" if header.bits == 32 else ""
        remedy = f"write colour_space: srgb{also}; on the command line --colour-space srgb"
        faults.append(("it declares no colour space", remedy))
    if decoding.white_luminance_cd_m2 is None:
        faults.append(
            (
                "the luminance of its white is not given",
                "write white_luminance_cd_m2: 100, or that of your display's white; on the command line "
                "--white-luminance 100",
            )
        )
    return _checked(encoding, header, faults)


def _checked(encoding: ColourEncoding | None, header: PictureHeader, faults: list[tuple[str, str]]) -> ColourEncoding:
    if encoding is None or faults:
        raise StimulusError([Finding(message, str(header.path), remedy=remedy) for message, remedy in faults])
    return encoding


def _linear_encoding(name: str | None) -> ColourEncoding:
    def same(code: Any) -> NDArray[np.float64]:
        return np.asarray(code, dtype=np.float64)

    matrix = np.eye(3) if name == "xyz" else named_encoding("srgb").matrix
    return ColourEncoding(str(name), matrix, (same, same, same))


def _alike(one: ColourEncoding, other: ColourEncoding) -> bool:
    codes = np.linspace(0.0, 1.0, 5)[:, None] * np.eye(3)[np.arange(5) % 3]
    return bool(np.allclose(one.xyz(codes), other.xyz(codes), rtol=0, atol=1e-6))


def _full(codes: Pixels) -> float:
    return float(np.iinfo(codes.dtype).max) if np.issubdtype(codes.dtype, np.integer) else 1.0
