"""The display that pictures are made for, beyond its pixels: what it can show, and from where it is seen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from devices.display.display_file import EyeModels
from devices.display.rig_file import Rig


@dataclass(frozen=True, eq=False, slots=True)
class DisplaySetup:
    """What each eye is shown, and where the eyes are. Only recipes that ask for one of them depend on it."""

    models: EyeModels
    distance_mm: float
    interpupillary_distance_mm: float

    @classmethod
    def of(cls, rig: Rig) -> DisplaySetup:
        """Return a rig's."""
        return cls(rig.models, rig.distance_mm, rig.interpupillary_distance_mm)

    def range_json(self) -> dict[str, Any]:
        """Return the numbers that decide what saturates, for a cache's key and a manifest."""
        return {
            eye: {
                "black_XYZ_cd_m2": model.black_XYZ_cd_m2.tolist(),
                "primaries_XYZ_cd_m2": model.primaries_XYZ_cd_m2.tolist(),
            }
            for eye, model in (("left", self.models.left), ("right", self.models.right))
        }

    def viewing_json(self) -> dict[str, float]:
        """Return where the eyes are."""
        return {"distance_mm": self.distance_mm, "interpupillary_distance_mm": self.interpupillary_distance_mm}
