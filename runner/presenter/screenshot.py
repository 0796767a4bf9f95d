"""Writing captured codes as PNG: the numbers of the framebuffer, with no colour space claimed for them.

A PNG of codes of 8 bits holds the codes. A PNG has no 10 bits, so that codes of 10 bits are held in 16, the upper 10 of
which are the code and the lower 6 its own upper 6 again (PNG specification, left bit replication): value >> 6 is the
code, and full drive is 65535 as in any other picture.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from documents import Finding
from documents.files import whole_file
from runner.presenter.errors import PresentationError
from runner.presenter.surfaces.gl_calls import Codes

# Of zlib's 1 to 9: files of screens are 5 % larger than at its usual 6, and take half the time.
_COMPRESSION = 2


def screenshot_files(captured: Mapping[str, Codes], path: Path) -> dict[str, Path]:
    """Return where each buffer goes: ``path`` itself, or ``NAME.left.png`` and ``NAME.right.png`` beside it."""
    return {name: path if name == "screen" else path.with_suffix(f".{name}.png") for name in captured}


def check_screenshot_path(path: Path) -> None:
    """Raise PresentationError if ``path`` does not end in .png or its folder cannot be written to."""
    if path.suffix.lower() != ".png":
        raise PresentationError(Finding("a screenshot is a PNG file", str(path), remedy="end the name in .png"))
    if not path.parent.is_dir():
        raise PresentationError(Finding("there is no such folder", str(path.parent), remedy="make it first"))
    if path.is_dir() or not os.access(path.parent, os.W_OK):
        raise PresentationError(Finding("this place cannot be written to", str(path), remedy="choose another"))


def write_screenshot(captured: Mapping[str, Codes], path: Path) -> list[Path]:
    """Write each buffer of ``captured`` (height, width, 3; uint8, or uint16 of 10 bits) and return the files.

    Every file is complete before any of them gets its name.
    """
    check_screenshot_path(path)
    files = screenshot_files(captured, path)
    with ExitStack() as written:
        for name, codes in captured.items():
            _write(codes, written.enter_context(whole_file(files[name], keep_suffix=True, make_folder=False)))
    return list(files.values())


def sixteen_bits(codes: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Return codes 0..1023 as 16-bit values 0..65535; ``>> 6`` gives the codes back."""
    return np.asarray((codes << 6) | (codes >> 4), dtype=np.uint16)


def _write(codes: Codes, file: Path) -> None:
    if codes.dtype == np.uint8:
        Image.fromarray(codes).save(file, format="PNG", compress_level=_COMPRESSION)
        return
    import OpenImageIO as oiio  # Pillow writes no colour of 16 bits

    height, width, channels = codes.shape
    spec = oiio.ImageSpec(width, height, channels, "uint16")
    spec.attribute("oiio:ColorSpace", "data")  # without it, the file would claim sRGB
    output = oiio.ImageOutput.create(str(file))
    if output is None or not output.open(str(file), spec):
        raise PresentationError(Finding(f"a PNG of 16 bits cannot be written: {oiio.geterror()}", str(file)))
    written = output.write_image(sixteen_bits(codes.astype(np.uint16)))
    if not (output.close() and written):
        raise PresentationError(Finding(f"a PNG of 16 bits cannot be written: {output.geterror()}", str(file)))
