"""Patches to show a display and measure: which codes, in which order, and how the instrument stands for each."""

from devices.patches.arrangement import Arrangement, PatchEye, Place
from devices.patches.patch import Patch, PatchSet, Step, steps
from devices.patches.sets import BUILT_IN, find_patches, find_sets

__all__ = [
    "BUILT_IN",
    "Arrangement",
    "Patch",
    "PatchEye",
    "PatchSet",
    "Place",
    "Step",
    "find_patches",
    "find_sets",
    "steps",
]
