"""A display that was not measured, in Python and typed: here, so that help appears at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

from documents.options import Typed

if TYPE_CHECKING:
    from devices.display.panel import PanelSpec

NominalKind: TypeAlias = Literal["srgb", "gamma2.2", "bt1886", "display-p3"]


@dataclass(frozen=True, slots=True)
class NominalOptions:
    """What is stated of a display that was not measured.

    Attributes
    ----------
    nominal
        Standard it is taken for.
    white_cd_m2
        Luminance of its white, without glasses.
    black_cd_m2
        Luminance of its black.  [default: 0.1 % of white]
    panel
        Panel, such as 1920x1080,0.2768,60,8.  [default: as the monitor reports it]
    """

    nominal: NominalKind = "srgb"
    white_cd_m2: Annotated[float, Typed(metavar="CD_M2", least=0, above=True)] = 100.0
    black_cd_m2: Annotated[float | None, Typed(metavar="CD_M2", least=0)] = None
    panel: Annotated[
        PanelSpec | None, Typed(metavar="W x H,PITCH_MM[,HZ[,BITS]]", read="devices.display.read_panel")
    ] = None
