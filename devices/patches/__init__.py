"""Patches to show a display and measure: which codes, in which order."""

from devices.patches.order import Step, steps
from devices.patches.patch import Patch, PatchSet
from devices.patches.sets import BUILT_IN, find_patches

__all__ = ["BUILT_IN", "Patch", "PatchSet", "Step", "find_patches", "steps"]
