"""The views of both eyes, as planes of light."""

from __future__ import annotations

from dataclasses import dataclass

from stimuli.pictures.rows import Floats32


@dataclass(frozen=True, eq=False, slots=True)
class Views:
    """The luminance of both eyes, float32 (height, width) each, in cd/m²."""

    left: Floats32
    right: Floats32
