"""Writing captured codes as PNG: the numbers of the framebuffer, with no colour space claimed for them."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
from pathlib import Path

from PIL import Image

from documents import Finding
from runner.presenter.errors import PresentationError
from runner.presenter.surfaces.gl_calls import Codes


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
    """Write each buffer of ``captured`` (uint8, height, width, 3) and return the files.

    Every file is complete before any of them gets its name.
    """
    check_screenshot_path(path)
    files = screenshot_files(captured, path)
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=".screenshot-") as folder:
        for name, codes in captured.items():
            Image.fromarray(codes).save(Path(folder) / f"{name}.png", format="PNG")
        for name, file in files.items():
            (Path(folder) / f"{name}.png").replace(file)
    return list(files.values())
