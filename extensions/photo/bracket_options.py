"""How a bracket is merged, in Python and typed: here, so that help appears before numpy is there."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from documents.options import Typed
from stimuli.develop import DevelopOptions

if TYPE_CHECKING:
    from devices.camera import Exposure
    from extensions.photo.noise import NoiseModel


@dataclass(frozen=True, slots=True)
class BracketOptions:
    """How a bracket is merged.

    Attributes
    ----------
    exposures
        Exposure, such as 1/15,8,200: once for each photograph, in their order. Default: the files' own.
    ratios
        Ratios of the exposures: as the photographs show them, or as their times say.
    reference
        Photograph whose exposure sets the level. Default: one at the camera file's exposure, else the middle one.
    ghosts
        Where something moved: refuse the bracket, or use the reference photograph alone there.
    noise
        Electrons at full scale and of read noise, such as 45000,3. Default: estimated from the photographs.
    develop
        How each photograph is read, and what becomes of the picture.
    """

    exposures: Annotated[
        tuple[Exposure, ...], Typed("--exposure", "TIME,F,ISO", read="devices.camera.parse_exposure")
    ] = ()
    ratios: Literal["measured", "stated"] = "measured"
    reference: Annotated[Path | None, Typed(metavar="PHOTO")] = None
    ghosts: Literal["refuse", "keep-reference"] = "refuse"
    noise: Annotated[NoiseModel | None, Typed(metavar="FULL,READ", read="extensions.photo.parse_noise")] = None
    develop: DevelopOptions = field(default_factory=DevelopOptions)
