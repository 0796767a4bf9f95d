"""Types that the entries of an experiment file share."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

Words = Annotated[str, Field(min_length=1, max_length=2000)]
Line = Annotated[str, Field(min_length=1, max_length=300)]
Label = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$", max_length=64)]
ShortSeconds = Annotated[float, Field(ge=0, le=60)]
Seconds = Annotated[float, Field(gt=0, le=600)]
