"""Values that recipes of every kind are made of: names, seconds, views."""

from __future__ import annotations

import re
from typing import Annotated, Literal, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, NonNegativeFloat, model_validator

from stimuli.sparkle.measures.find import Threshold

View = Literal["stereo", "flat"]
MAX_STIMULI = 1000
MAX_NAME = 60


def _seconds(value: object) -> object:
    if not isinstance(value, str):
        return value
    parts = re.fullmatch(r"(\d{1,9}(?:\.\d{1,9})?) */ *(\d{1,9}(?:\.\d{1,9})?)", value)
    if parts is None or float(parts[2]) == 0:
        raise ValueError("expected seconds, such as 0.5 or 1/15")
    return float(parts[1]) / float(parts[2])


def _name(value: object) -> str:
    if not isinstance(value, str):
        raise ValueError(f"a name is text: put quotes around it, '{value}'")
    if not re.fullmatch(rf"[A-Za-z0-9][A-Za-z0-9._-]{{0,{MAX_NAME - 1}}}", value):
        raise ValueError(
            f"a name has 1 to {MAX_NAME} letters, digits, dots, hyphens or underscores, first a letter or digit"
        )
    return value


Name = Annotated[str, BeforeValidator(_name)]
Seconds = Annotated[
    Annotated[float, Field(gt=0, le=1e6)],
    BeforeValidator(_seconds, json_schema_input_type=Annotated[float, Field(gt=0, le=1e6)] | str),
]
Views = Annotated[tuple[View, ...], Field(min_length=1, max_length=2)]


class SparklesSpec(BaseModel):
    """What counts as a sparkle where a manifest tells their number, size and contrast.

    ``times`` the local background, and above ``above_cd_m2``.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    times: NonNegativeFloat = 2.0
    above_cd_m2: NonNegativeFloat = 0.0

    @model_validator(mode="after")
    def _asks(self) -> Self:
        if self.times == 0 and self.above_cd_m2 == 0:
            raise ValueError("give 'times' the background, 'above_cd_m2', or both")
        return self

    def threshold(self) -> Threshold:
        """Return the threshold."""
        return Threshold(self.times, self.above_cd_m2)
