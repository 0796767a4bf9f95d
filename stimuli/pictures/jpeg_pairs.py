"""Pairs in one JPEG file: the two pictures of an MPO, and the layout that a JPS states."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from stimuli.errors import StimulusError
from stimuli.pictures.packing import Packing

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
