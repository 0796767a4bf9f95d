"""Pictures written by OpenImageIO itself, as another program might."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

Part = tuple[Mapping[str, Any], Sequence[str], NDArray[Any]]


def save_parts(
    path: Path,
    parts: Sequence[Part],
    kind: str = "float",
    *,
    corner_px: tuple[int, int] = (0, 0),
    display_px: tuple[int, int, int, int] | None = None,
    tile_px: tuple[int, int] | None = None,
) -> Path:
    """Write parts of (attributes, channel names, pixels), of which OpenImageIO names channels where none are given.

    The data windows begin at ``corner_px``; the display window is (left, top, width, height), or the data window.
    """
    specs = []
    for attributes, names, pixels in parts:
        spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
        if names:
            spec.channelnames = tuple(names)
        spec.x, spec.y = corner_px
        spec.full_x, spec.full_y, spec.full_width, spec.full_height = display_px or (0, 0, spec.width, spec.height)
        if tile_px is not None:
            spec.tile_width, spec.tile_height = tile_px
        for key, value in attributes.items():
            if isinstance(value, str | int | float):
                spec.attribute(key, value)
            else:
                kind_of = "string" if isinstance(value[0], str) else "float"
                spec.attribute(key, f"{kind_of}[{len(value)}]", tuple(value))
        specs.append(spec)
    output = oiio.ImageOutput.create(str(path))
    assert output is not None
    assert output.open(str(path), specs if len(specs) > 1 else specs[0]), output.geterror()
    for index, (_, _, pixels) in enumerate(parts):
        if index:
            assert output.open(str(path), specs[index], "AppendSubimage"), output.geterror()
        written = pixels if pixels.dtype.kind == "u" else pixels.astype(np.float32)
        assert output.write_image(np.ascontiguousarray(written)), output.geterror()
    assert output.close()
    return path


def save_picture(
    path: Path, pixels: NDArray[Any], names: Sequence[str] = (), kind: str = "float", **attributes: Any
) -> Path:
    """Write one part; ``__`` in a name of an attribute stands for a colon."""
    return save_parts(path, [({name.replace("__", ":"): one for name, one in attributes.items()}, names, pixels)], kind)
