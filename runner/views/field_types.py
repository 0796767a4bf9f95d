"""Types that the entries of an experiment file share."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

Words = Annotated[str, Field(min_length=1, max_length=2000)]
Line = Annotated[str, Field(min_length=1, max_length=300)]
Label = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$", max_length=64)]
ShortSeconds = Annotated[float, Field(ge=0, le=60)]
Seconds = Annotated[float, Field(gt=0, le=600)]
Factor = Annotated[str, Field(min_length=1, max_length=64)]
# Left out of what a file says where it is not given: the hash of a file that does not have it stays what it was.
OptionalFactor = Annotated[Factor | None, Field(exclude_if=lambda value: value is None)]
