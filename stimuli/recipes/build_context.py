"""The inputs of a picture beside its recipe: the display, the files that it names, the version of the code."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from devices.colour_matching import DEFAULT_OBSERVER
from devices.display import EyeModels, Rig
from documents.files import sha256_of_json
from stimuli.recipes.values import Step

if TYPE_CHECKING:
    from stimuli.pictures.coded import CodedPicture
    from stimuli.pictures.stereo_image import StereoImage
    from stimuli.recipes.banded_picture import BandedPicture
    from stimuli.recipes.values import SparklesSpec

Factors = Mapping[str, str | float]
# What is being done, and how many pictures of how many are done.
Progress = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False, slots=True)
class DisplaySetup:
    """The display's models for both eyes, the place of the eyes, and the colorimetric observer of the models' XYZ.

    Only recipes that use models or places depend on them.
    """

    models: EyeModels
    distance_mm: float
    interpupillary_distance_mm: float
    observer: str = DEFAULT_OBSERVER

    @classmethod
    def of(cls, rig: Rig) -> DisplaySetup:
        """Return the setup of a rig."""
        return cls(rig.models, rig.spec.distance_mm, rig.spec.interpupillary_distance_mm, rig.observer)

    def range_json(self) -> dict[str, Any]:
        """Return the numbers that decide what saturates, for a cache's key and a manifest."""
        return {
            eye: {
                "black_XYZ_cd_m2": model.black_XYZ_cd_m2.tolist(),
                "primaries_XYZ_cd_m2": model.primaries_XYZ_cd_m2.tolist(),
                **({"ambient_XYZ_cd_m2": model.ambient_XYZ_cd_m2.tolist()} if model.ambient_XYZ_cd_m2.any() else {}),
                "light_of_code_1": model.limits[1].tolist(),
            }
            for eye, model in (("left", self.models.left), ("right", self.models.right))
        }

    def viewing_json(self) -> dict[str, float]:
        """Return where the eyes are."""
        return {"distance_mm": self.distance_mm, "interpupillary_distance_mm": self.interpupillary_distance_mm}


@dataclass(frozen=True, slots=True)
class BuildContext:
    """The inputs of a picture beside its recipe.

    ``folder`` is the recipe's, ``file_hashes`` holds the SHA-256 of each file that the recipe names,
    ``generator_version`` is raised when the code makes other pictures of the same recipe, and ``extension`` is the
    package of a kind that is not ours, with its version: a new version makes its pictures anew.
    """

    folder: Path
    file_hashes: Mapping[str, str]
    pixel_pitch_mm: float
    setup: DisplaySetup | None
    generator_version: int
    extension: Mapping[str, str] = field(default_factory=dict)

    def key(self, sparkles: SparklesSpec | None, **parts: Any) -> str:
        """Return the key of a picture: the hash of everything that its pixels and its steps depend on."""
        counted = None if sparkles is None else sparkles.model_dump(mode="json")
        everywhere = {"version": self.generator_version, "pixel_pitch_mm": self.pixel_pitch_mm, "sparkles": counted}
        by = {"extension": dict(self.extension)} if self.extension else {}
        return sha256_of_json({**everywhere, **by, **parts})


@dataclass(frozen=True, eq=False, slots=True)
class MadePicture:
    """A stimulus before it is written: its picture, its factors, and the steps that led to it, for the manifest.

    It is the codes of its file if no step changed them; of one that is ``exact``, single precision is kept. Where it is
    yet to be made, some rows at a time, and turns out to be unusual, ``plainly`` makes it at once.
    """

    name: str
    image: StereoImage | CodedPicture | BandedPicture
    factors: Factors
    steps: tuple[Step, ...]
    exact: bool = False
    plainly: Callable[[], MadePicture] | None = None
