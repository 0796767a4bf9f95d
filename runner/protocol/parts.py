"""What the parts of an experiment file share."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, NonNegativeFloat, PositiveFloat

from documents.yaml.load import Strict

Words = Annotated[str, Field(min_length=1, max_length=2000)]
Line = Annotated[str, Field(min_length=1, max_length=300)]
Label = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$", max_length=64)]
ShortSeconds = Annotated[float, Field(ge=0, le=60)]
Seconds = Annotated[float, Field(gt=0, le=600)]


class LayoutSpec(Strict):
    """How a trial looks: ``size_mm`` is each picture's aperture (width, height) on the screen.

    ``reference`` is ``physical``, for a real thing beside the screen, or the name of a stimulus that is shown too.
    """

    arrangement: Literal["vertical", "horizontal"]
    size_mm: tuple[PositiveFloat, PositiveFloat]
    gap_mm: NonNegativeFloat = 10.0
    reference: Line = "physical"
