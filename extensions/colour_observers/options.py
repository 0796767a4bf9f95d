"""For whom objects are matched on a screen, in Python and typed: here, so that help appears before numpy is there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from documents.options import Typed


@dataclass(frozen=True, slots=True)
class MetamerismOptions:
    """Under which light objects are matched on a screen, for whom, and who else sees both.

    Attributes
    ----------
    illuminant
        Light on the objects: A, D50, D65, … .
    observer
        Observer of the match.
    field_deg
        Field of the persons. Default: the observer's.
    persons
        How many to draw.
    ages_years
        Ages of the persons in years. Default: 20..60.
    seed
        Random seed of the persons.
    categories
        Take the ten categorical observers instead of drawn persons.
    white_luminance_cd_m2
        Luminance of a perfect diffuser.
    """

    illuminant: Annotated[str, Typed(metavar="NAME|LIGHT.csv")]
    observer: Annotated[str, Typed(metavar="NAME")] = "CIE 1931 2"
    field_deg: Annotated[float | None, Typed("--field", "DEG")] = None
    persons: Annotated[int, Typed(least=1, most=100_000)] = 1000
    ages_years: Annotated[tuple[float, float], Typed("--ages", "FROM..TO", between="..")] = (20.0, 60.0)
    seed: Annotated[int, Typed(least=0, most=1e40)] = 1
    categories: bool = False
    white_luminance_cd_m2: Annotated[float | None, Typed("--white-luminance", "CD_M2")] = None
