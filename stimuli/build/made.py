"""A stimulus as it was made, before it is written."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from stimuli.pictures.stereo_image import StereoImage


@dataclass(frozen=True, eq=False, slots=True)
class Made:
    """A stimulus as made: its picture, its factors, and the steps that led to it, for the manifest."""

    name: str
    image: StereoImage
    factors: Mapping[str, str | float]
    steps: tuple[Mapping[str, Any], ...]
