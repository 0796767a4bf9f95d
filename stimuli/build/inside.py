"""Files that belong to a recipe: in its folder or below, so that the folder can be copied as a whole."""

from __future__ import annotations

from pathlib import PurePosixPath, PureWindowsPath
from typing import Annotated

from pydantic import AfterValidator


def _inside(value: str) -> str:
    path = PurePosixPath(value)
    if not value or path.is_absolute() or PureWindowsPath(value).drive or "\\" in value or ".." in path.parts:
        raise ValueError("name a file in the recipe's own folder or below it, without '..'; copy the picture there")
    return value


InsideFile = Annotated[str, AfterValidator(_inside)]
