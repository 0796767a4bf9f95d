"""Values that recipes of every kind are made of: names, seconds, views."""

from __future__ import annotations

import re
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

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
