"""Pictures of every kind that is read, for `tests.stress.mutants`: bases, readers, and files made to do harm."""

from __future__ import annotations

import io
import os
import struct
import tempfile
import zlib
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import OpenImageIO as oiio
import tifffile
from PIL import Image, ImageCms

from documents import Finding, InputError
from stimuli.build import build_set
from stimuli.comparison import ReadOptions
from stimuli.comparison.pictures import read_picture as read_compared
from stimuli.comparison.pictures import what_it_holds
from stimuli.develop import read_camera_image
from stimuli.pictures import (
    CodedPicture,
    Decoding,
    StereoImage,
    find_pictures,
    read_coded,
    read_ordinary,
    read_picture,
    write_exr,
)
from stimuli.spectral import read_spectral
from tests.stimuli.develop.dng import exposure_tags, save_dng, save_linear_dng
from tests.stimuli.pictures.exr_bytes import Part, decimated, floats, write_bytes
from tests.stress.mutants import Format

_RNG = np.random.default_rng(1)
LIGHT = (_RNG.random((24, 32, 3)) * 50).astype(np.float32)
CODES = _RNG.integers(0, 256, (24, 32, 3), dtype=np.uint8)
CODES_16 = _RNG.integers(0, 65536, (24, 32, 3), dtype=np.uint16)
PRIMARIES = (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329)
WAVES = np.arange(400, 701, 20.0)


def _written(suffix: str, write: Callable[[Path], object]) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"base{suffix}")
        write(path)
        return path.read_bytes()


def _oiio(path: Path, pixels: Any, kind: str, names: Sequence[str] = (), tile_px: int = 0, **attributes: Any) -> None:
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, kind)
    if names:
        spec.channelnames = tuple(names)
    for name, value in attributes.items():
        spec.attribute(name, value)
    if names:
        spec.attribute("chromaticities", "float[8]", PRIMARIES)
    spec.tile_width = spec.tile_height = tile_px
    output = oiio.ImageOutput.create(str(path))
    assert output is not None
    assert output.open(str(path), spec), output.geterror()
    assert output.write_image(np.ascontiguousarray(pixels))
    assert output.close()


# --- bases ------------------------------------------------------------------------------------------------------------


@cache
def exr_bases() -> Sequence[bytes]:
    half = {name: LIGHT[..., place].astype("<f2") for place, name in enumerate("RGB")}
    stated = [("chromaticities", "chromaticities", floats(*PRIMARIES))]
    left, right = [*stated, ("view", "string", b"left")], [*stated, ("view", "string", b"right")]
    chroma = {"Y": half["R"], "RY": decimated(half["G"]), "BY": decimated(half["B"])}
    spectral = _RNG.random((24, 32, len(WAVES))).astype(np.float32)
    names = [f"S0.{wave:g},0nm" for wave in WAVES]
    writers: list[Callable[[Path], object]] = [
        lambda path: write_bytes(path, Part(half, left), Part(half, right)),
        lambda path: write_bytes(path, Part(chroma, stated, steps={"RY": 2, "BY": 2})),
        lambda path: write_exr(path, StereoImage.flat(LIGHT)),
        lambda path: write_exr(path, StereoImage(LIGHT, LIGHT[::-1].copy())),
        lambda path: write_exr(path, StereoImage(LIGHT, LIGHT[::-1].copy()), exact=True),
        lambda path: _oiio(path, spectral, "float", names, compression="zip"),
    ]
    for compression in ("none", "rle", "zips", "piz", "pxr24", "b44", "b44a", "dwaa", "dwab"):
        writers.append(partial(_oiio, pixels=LIGHT, kind="half", names="RGB", compression=compression))
    for compression in ("zip", "piz"):
        writers.append(partial(_oiio, pixels=LIGHT, kind="float", names="RGB", tile_px=16, compression=compression))
    writers.append(_mip_mapped)
    return tuple(_written(".exr", write) for write in writers)


def _mip_mapped(path: Path) -> None:
    assert oiio.ImageBufAlgo.make_texture(oiio.MakeTxTexture, oiio.ImageBuf(LIGHT), str(path), oiio.ImageSpec())


def _pillow(pixels: Any, **options: Any) -> bytes:
    with io.BytesIO() as stream:
        Image.fromarray(pixels).save(stream, **options)
        return stream.getvalue()


@cache
def _profile() -> bytes:
    profile: bytes = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    return profile


def _exif() -> bytes:
    exif = Image.Exif()
    exif[0x112] = 6
    return exif.tobytes()


@cache
def png_bases() -> Sequence[bytes]:
    return (
        _pillow(CODES, format="PNG"),
        _pillow(CODES, format="PNG", icc_profile=_profile(), exif=_exif()),
        _pillow(np.dstack([CODES, CODES[..., 0]]), format="PNG"),
        _pillow(CODES[..., 0], format="PNG"),
        _written(".png", lambda path: _oiio(path, CODES_16, "uint16")),
    )


@cache
def jpeg_bases() -> Sequence[bytes]:
    return (
        _pillow(CODES, format="JPEG"),
        _pillow(CODES, format="JPEG", progressive=True),
        _pillow(CODES, format="JPEG", icc_profile=_profile(), exif=_exif()),
        _pillow(CODES, format="MPO", save_all=True, append_images=[Image.fromarray(CODES[::-1])]),
    )


@cache
def webp_bases() -> Sequence[bytes]:
    return (
        _pillow(CODES, format="WEBP", icc_profile=_profile(), exif=_exif()),
        _pillow(CODES, format="WEBP", lossless=True),
        _pillow(np.dstack([CODES, CODES[..., 0]]), format="WEBP"),
    )


@cache
def tiff_bases() -> Sequence[bytes]:
    kinds = ((CODES, "uint8"), (CODES_16, "uint16"), (LIGHT / 60, "float"))
    tiled = partial(tifffile.imwrite, data=CODES_16, tile=(16, 16), photometric="rgb", compression="zlib")
    planes = np.moveaxis(CODES_16, -1, 0)
    return (
        *(
            _written(".tif", partial(_oiio, pixels=pixels, kind=kind, compression=compression))
            for pixels, kind in kinds
            for compression in ("none", "lzw", "zip", "packbits")
        ),
        _written(".tif", tiled),
        _written(".tif", partial(tifffile.imwrite, data=planes, planarconfig="separate", photometric="rgb")),
    )


@cache
def dng_bases() -> Sequence[bytes]:
    tags = exposure_tags((1, 15), (8, 1), 800)
    codes = CODES_16[..., 0]
    return (
        _written(".dng", lambda path: save_dng(path, codes, tags=tags)),
        _written(".dng", lambda path: save_dng(path, codes, black=(600, 601, 602, 603), white=65000)),
        _written(".dng", lambda path: save_linear_dng(path, CODES_16)),
    )


_CUBE = _RNG.random((6, 8, len(WAVES))).astype("<f4").tobytes()


@cache
def envi_bases() -> Sequence[bytes]:
    listed = ", ".join(f"{wave:g}" for wave in WAVES)
    head = f"ENVI\nsamples = 8\nlines = 6\nbands = {len(WAVES)}\nheader offset = 0\nfile type = ENVI Standard\n"
    more = f"data type = 4\nbyte order = 0\nwavelength units = Nanometers\nwavelength = {{ {listed} }}\n"
    scaled = "reflectance scale factor = 2\nbbl = { " + ", ".join("1" * len(WAVES)) + " }\ndata ignore value = -1\n"
    kinds = ("bsq", "bil", "bip")
    return tuple(f"{head}interleave = {kind}\n{more}{own}".encode() for kind in kinds for own in ("", scaled))


@cache
def coded_bases() -> Sequence[bytes]:
    light = np.linspace(0, 1, 256)[:, None].repeat(3, axis=1)
    pictures = (CodedPicture(CODES, CODES, light, np.eye(3)), CodedPicture(CODES, CODES[::-1], light, np.eye(3)))
    return tuple(_written(".codes", picture.save) for picture in pictures)


@cache
def own_bases() -> Sequence[bytes]:
    def save(data: bytes, path: Path) -> None:
        path.with_suffix(".jpg").write_bytes(data)
        held = read_ordinary([path.with_suffix(".jpg")], Decoding("srgb", 100.0)).held
        assert isinstance(held, CodedPicture)
        held.save(path)

    large = [_pillow(CODES.repeat(8, 0).repeat(8, 1), format="JPEG", progressive=bool(n)) for n in range(2)]
    return tuple(_written(".own", partial(save, data)) for data in large)


# --- readers ----------------------------------------------------------------------------------------------------------


def _each(*reads: Callable[[], object]) -> None:
    """Call all; raise their findings if none of them takes the file."""
    findings: list[Finding] = []
    taken = False
    for read in reads:
        try:
            read()
            taken = True
        except InputError as error:
            findings += error.findings
    if not taken:
        raise InputError(findings)


def _compared(path: Path, reading: ReadOptions | None = None) -> object:
    holds = what_it_holds(path) if reading is None else None
    return read_compared(path, reading or ReadOptions(), holds, "photo", lambda done, total: None)


def _build(path: Path, keys: str) -> None:
    """Build a set of the picture, by a recipe beside it, as `stimuli build` does."""
    recipe = path.with_name("recipe.yaml")
    recipe.write_text(f"schema_version: 1\nkind: pictures\n{keys}stimuli: [{{name: a, file: {path.name}}}]\n")
    with tempfile.TemporaryDirectory() as folder, patch.dict(os.environ, CYCLOPEAN_CACHE=folder):
        built = build_set(recipe, 0.25)
        built.load("a")


def _read_exr(path: Path) -> None:
    _each(
        lambda: read_picture(path),
        lambda: read_picture(path, "xyz", flat=True, flat_eye="right", negative="clip"),
        lambda: read_camera_image(path, assume_linear=True),
        lambda: sum(1 for _ in read_spectral(path).blocks()),
        lambda: _compared(path),
        lambda: _build(path, ""),
    )


def _read_ordinary(path: Path) -> None:
    reading = ReadOptions(colour_space="srgb", picture_white_cd_m2=100.0)
    _each(
        lambda: read_picture(path, "declared", white_luminance_cd_m2=100, alpha_background_cd_m2=5),
        lambda: find_pictures([path]),
        lambda: _compared(path, reading),
        lambda: _build(path, "colour_space: srgb\nwhite_luminance_cd_m2: 100\nalpha_background_cd_m2: 5\n"),
    )


def _read_tiff(path: Path) -> None:
    _each(
        lambda: _read_ordinary(path),
        lambda: read_camera_image(path, assume_linear=True),
        lambda: read_picture(path, "rec709", negative="clip"),
        lambda: _compared(path),
    )


def _read_dng(path: Path) -> None:
    _each(lambda: read_camera_image(path), lambda: read_camera_image(path, demosaic="ahd"), lambda: _compared(path))


def _read_envi(path: Path) -> None:
    path.with_suffix(".img").write_bytes(_CUBE)
    _each(lambda: sum(1 for _ in read_spectral(path, "radiance").blocks()), lambda: _compared(path))


# --- made to do harm --------------------------------------------------------------------------------------------------


def _attribute(name: str, kind: str, data: bytes) -> bytes:
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<I", len(data)) + data


def exr_header(size_px: tuple[int, int], names: Sequence[str], compression: int, *more: bytes) -> bytes:
    """Return the header of a part of half floats."""
    width, height = size_px
    listed = b"".join(name.encode() + b"\0" + struct.pack("<iB3xii", 1, 0, 1, 1) for name in sorted(names))
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    attributes = (
        _attribute("channels", "chlist", listed + b"\0"),
        _attribute("compression", "compression", bytes([compression])),
        _attribute("dataWindow", "box2i", window),
        _attribute("displayWindow", "box2i", window),
        _attribute("lineOrder", "lineOrder", b"\0"),
        _attribute("pixelAspectRatio", "float", floats(1)),
        _attribute("screenWindowCenter", "v2f", floats(0, 0)),
        _attribute("screenWindowWidth", "float", floats(1)),
        _attribute("chromaticities", "chromaticities", floats(*PRIMARIES)),
    )
    return b"".join((*attributes, *more)) + b"\0"


def _exr(header: bytes, flags: int = 0) -> bytes:
    return struct.pack("<ii", 20000630, 2 | flags) + header


def black_exr(size_px: tuple[int, int], names: Sequence[str]) -> bytes:
    """Return a whole picture of zeros by zip: a thousandth of what it takes in memory."""
    width, height = size_px
    head = _exr(exr_header(size_px, names, 3))
    # OpenEXR stores differences of bytes, plus 128.
    blocks = [
        zlib.compress(b"\0" + b"\x80" * (min(16, height - row) * width * len(names) * 2 - 1), 9)
        for row in range(0, height, 16)
    ]
    at = len(head) + 8 * len(blocks)
    offsets, body = b"", b""
    for number, block in enumerate(blocks):
        offsets += struct.pack("<Q", at + len(body))
        body += struct.pack("<ii", 16 * number, len(block)) + block
    return head + offsets + body


@cache
def crafted_exr() -> Mapping[str, bytes]:
    small, large = (64, 16), (10_000, 10_000)
    many = [f"c{number:03d}" for number in range(253)]
    tiles = {"one tile": (10_000, 10_000, 0), "tiny tiles": (1, 1, 0), "ripmap of tiny tiles": (1, 1, 2)}
    made = {
        "200 channels": black_exr((268, 250), [*"RGB", *many[:197]]),
        "17 megapixels of 200 channels": _exr(exr_header((4288, 4000), [*"RGB", *many[:197]], 3)) + bytes(5000),
        "100 megapixels of 256 channels": _exr(exr_header(large, [*"RGB", *many], 3)) + bytes(20_000),
        "wide": _exr(exr_header((100_000_000, 1), "RGB", 3)) + bytes(100),
        "tall": _exr(exr_header((1, 100_000_000), "RGB", 3)) + bytes(100),
        "beyond 32 bits": _exr(exr_header((2**31 - 1, 2**31 - 1), "RGB", 3)) + bytes(100),
        "an attribute of 2 GB": _exr(b"comment\0string\0" + struct.pack("<i", 2**31 - 1) + bytes(100)),
        "an attribute of -1 byte": _exr(b"comment\0string\0" + struct.pack("<i", -1) + bytes(100)),
        "an attribute of 40 MB": _exr(exr_header(small, "RGB", 3, _attribute("comment", "string", bytes(40_000_000)))),
        "100,000 attributes": _exr(
            b"".join(_attribute(f"a{number}", "int", bytes(4)) for number in range(100_000))
            + exr_header(small, "RGB", 3)
        ),
        "100,000 channels": _exr(exr_header(small, [f"c{number}" for number in range(100_000)], 3)) + bytes(100),
        "names of 250 characters": black_exr(small, ["n" * 250 + str(number) for number in range(50)]),
        "a preview of 3.6 GB": _exr(
            exr_header(small, "RGB", 3, _attribute("preview", "preview", struct.pack("<II", 30_000, 30_000)))
        ),
        "multiView is a number": _exr(exr_header(small, "RGB", 3, _attribute("multiView", "int", bytes(4))))
        + bytes(100),
        "no UTF-8": _exr(exr_header(small, "RGB", 3, _attribute("\xff\xfe", "string", b"\xff\xfe"))) + bytes(9),
        "20,000 parts": _exr(
            b"".join(
                exr_header(
                    small,
                    "RGB",
                    3,
                    _attribute("name", "string", f"p{number}".encode()),
                    _attribute("type", "string", b"scanlineimage"),
                    _attribute("chunkCount", "int", struct.pack("<i", 1)),
                )
                for number in range(20_000)
            )
            + b"\0",
            0x1000,
        ),
    }
    for compression in range(12):
        made[f"no pixels, compression {compression}"] = _exr(exr_header(large, "RGB", compression)) + bytes(100)
    for name, (across, down, mode) in tiles.items():
        tile = _attribute("tiles", "tiledesc", struct.pack("<IIB", across, down, mode))
        made[name] = _exr(exr_header(large, "RGB", 3, tile), 0x200) + bytes(1000)
    # What damage did to tracebacks before: an error text of OpenEXR that holds the file's own bytes.
    for at, name in enumerate(("channels", "compression", "dataWindow", "lineOrder", "chromaticities")):
        head = exr_bases()[2]
        made[f"{name} is called something else"] = head.replace(name.encode(), bytes([0xFF - at]) * len(name), 1)
    return made


def _chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def _png(size_px: tuple[int, int], form: tuple[int, int], data: bytes, before: bytes = b"") -> bytes:
    head = _chunk(b"IHDR", struct.pack(">IIBBBBB", *size_px, *form, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + head + before + _chunk(b"IDAT", data) + _chunk(b"IEND", b"")


@cache
def crafted_png() -> Mapping[str, bytes]:
    small, large = (64, 64), (16_384, 6_100)
    pixels, bomb = zlib.compress(bytes(64 * 193)), zlib.compress(bytes(300_000_000), 9)
    return {
        "100 megapixels, none there": _png(large, (8, 2), b""),
        "100 megapixels of 16 bits, none there": _png(large, (16, 6), b""),
        "2 ** 31 pixels a side": _png((2**31 - 1, 2**31 - 1), (8, 2), b""),
        "a text of 300 MB": _png(small, (8, 2), pixels, _chunk(b"zTXt", b"a\0\0" + bomb)),
        "an international text of 300 MB": _png(small, (8, 2), pixels, _chunk(b"iTXt", b"a\0\1\0\0\0" + bomb)),
        "a profile of 300 MB": _png(small, (8, 2), pixels, _chunk(b"iCCP", b"a\0\0" + bomb)),
        "300,000 chunks": _png(small, (8, 2), pixels, _chunk(b"tEXt", b"a\0b") * 300_000),
        "cICP of 1 byte": _png(small, (8, 2), pixels, _chunk(b"cICP", b"\1")),
        "gAMA of 0": _png(small, (8, 2), pixels, _chunk(b"gAMA", bytes(4))),
        "nothing after its beginning": b"\x89PNG\r\n\x1a\n",
    }


@cache
def crafted_jpeg() -> Mapping[str, bytes]:
    progressive = _pillow(np.full((2000, 3000, 3), 99, np.uint8), format="JPEG", progressive=True)
    scan = progressive[progressive.rindex(b"\xff\xda") : -2]
    whole = bytearray(jpeg_bases()[0])
    at = whole.index(b"\xff\xc0") + 5
    whole[at : at + 4] = struct.pack(">HH", 65_535, 65_535)
    return {"3000 scans": progressive[:-2] + scan * 3000 + progressive[-2:], "65535 pixels a side": bytes(whole)}


def tiff(size_px: tuple[int, int], data: bytes = bytes(100), /, **tags: tuple[int, int, int]) -> bytes:
    """Return a TIFF of RGB of 16 bits; ``tags`` are type, count and value by ``t`` and their number."""
    width, height = size_px
    entries = {
        **{256: (4, 1, width), 257: (4, 1, height), 258: (3, 1, 16), 259: (3, 1, 1), 262: (3, 1, 2), 273: (4, 1, 8)},
        **{277: (3, 1, 3), 278: (4, 1, height), 279: (4, 1, len(data)), 284: (3, 1, 1), 339: (3, 1, 1)},
        **{int(tag[1:]): value for tag, value in tags.items()},
    }
    listed = b"".join(struct.pack("<HHII", tag, *entries[tag]) for tag in sorted(entries))
    return b"II*\0" + struct.pack("<I", 8 + len(data)) + data + struct.pack("<H", len(entries)) + listed + bytes(4)


@cache
def crafted_tiff() -> Mapping[str, bytes]:
    large = (16_384, 6_100)
    loop = struct.pack("<H", 1) + struct.pack("<HHII", 256, 4, 1, 1) + struct.pack("<I", 8)
    return {
        "100 megapixels, none there": tiff(large),
        "100 megapixels of floats, none there": tiff(large, t258=(3, 1, 32), t339=(3, 1, 3)),
        "a strip of 4 GB": tiff(large, t279=(4, 1, 2**32 - 1)),
        "65535 samples": tiff((1000, 1000), t277=(3, 1, 65_535)),
        "compressed, cut short": tiff(large, zlib.compress(bytes(1_000_000)), t259=(3, 1, 8)),
        "65535 entries of 4 GB": b"II*\0"
        + struct.pack("<IH", 8, 65_535)
        + struct.pack("<HHII", 270, 2, 2**32 - 1, 8) * 65_535
        + bytes(4),
        "a directory that follows itself": b"II*\0" + struct.pack("<I", 8) + loop,
        "a profile of 4 GB": tiff((8, 8), bytes(384), t34675=(7, 2**32 - 1, 8)),
    }


@cache
def crafted_dng() -> Mapping[str, bytes]:
    raw = {"t262": (3, 1, 32_803), "t277": (3, 1, 1), "t50706": (1, 4, 0x401)}
    raw |= {"t33421": (3, 2, 2 | 2 << 16), "t33422": (1, 4, 0x02010100)}
    jpeg = b"\xff\xd8\xff\xc3" + bytes(4000)
    wide = b"\xff\xd8\xff\xc3\0\x11\x10\xff\xff\xff\xff\x04" + bytes(4000)
    return {
        "200 megapixels, none there": tiff((20_000, 10_000), bytes(100), **raw),
        "3600 megapixels": tiff((60_000, 60_000), bytes(100), **raw),
        "lossless JPEG of nothing": tiff((14_000, 14_000), jpeg, **raw | {"t259": (3, 1, 7)}),
        "lossless JPEG, small": tiff((400, 400), wide, **raw | {"t259": (3, 1, 7)}),
        "linear, none there": tiff((14_000, 14_000), bytes(100), **raw | {"t262": (3, 1, 34_892), "t277": (3, 1, 3)}),
        "no value of its compression": tiff((32, 24), bytes(100), **raw | {"t259": (3, 0, 0)}),
        "no value of its bits": tiff((32, 24), bytes(100), **raw | {"t258": (3, 0, 0), "t259": (3, 1, 8)}),
        "another filter": tiff((32, 24), bytes(1536), **raw | {"t33422": (1, 4, 0x02050301)}),
    }


@cache
def crafted_envi() -> Mapping[str, bytes]:
    base = envi_bases()[0].decode()
    library = base.replace("ENVI Standard", "ENVI Spectral Library")
    return {
        "10 ** 18 pixels": base.replace("= 8\n", "= 1000000000\n").replace("= 6\n", "= 1000000000\n").encode(),
        "2 ** 31 bands": base.replace(f"bands = {len(WAVES)}", "bands = 2147483647").encode(),
        "a library of 2 ** 31 spectra": library.replace("= 6\n", "= 2147483647\n").encode(),
    }


@cache
def crafted_codes() -> Mapping[str, bytes]:
    def npy(shape: str) -> bytes:
        head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}\n".encode()
        return b"\x93NUMPY\x01\0" + struct.pack("<H", len(head)) + head

    return {"32 GB": npy("(4000000000,)"), "beyond 64 bits": npy("(9" * 1 + "9" * 30 + ",)"), "deep": npy("(" * 900)}


FORMATS = (
    Format("exr", ".exr", exr_bases, _read_exr, crafted=crafted_exr),
    Format("png", ".png", png_bases, _read_ordinary, crafted=crafted_png),
    Format("jpeg", ".jpg", jpeg_bases, _read_ordinary, crafted=crafted_jpeg),
    Format("webp", ".webp", webp_bases, _read_ordinary),
    Format("tiff", ".tif", tiff_bases, _read_tiff, crafted=crafted_tiff),
    Format("dng", ".dng", dng_bases, _read_dng, crafted=crafted_dng),
    Format("envi", ".hdr", envi_bases, _read_envi, text=True, crafted=crafted_envi),
    Format("codes", ".codes", coded_bases, read_coded, crafted=crafted_codes),
    Format("own", ".own", own_bases, read_coded),
)
