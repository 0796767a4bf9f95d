"""Pictures for the tests of new studies, drawn small."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from PIL import Image

Size = tuple[int, int]


def draw(file: Path, size: Size = (60, 40), seed: int = 0) -> Path:
    """Write one picture of soft stripes."""
    width, height = size
    y, x = np.mgrid[0:height, 0:width]
    rgb = [120 + 90 * np.sin((x + seed * 3) / (4 + seed % 5) + channel) * np.cos(y / 7) for channel in range(3)]
    file.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.stack(rgb, axis=-1).astype(np.uint8)).save(file)
    return file


def draw_flat(folder: Path, names: Iterable[str], size: Size = (60, 40)) -> Path:
    """Write a flat picture of each name, which may hold a folder; PNG."""
    for seed, name in enumerate(names):
        draw(folder / f"{name}.png", size, seed)
    return folder


def draw_pairs(folder: Path, names: Iterable[str], size: Size = (60, 40)) -> Path:
    """Write a left and a right JPEG of each name."""
    for seed, name in enumerate(names):
        draw(folder / f"{name}_L.jpg", size, seed)
        draw(folder / f"{name}_R.jpg", size, seed + 1)
    return folder
