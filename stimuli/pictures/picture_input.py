"""Picture files opened through OpenImageIO, and why one cannot be."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from stimuli.errors import StimulusError

if TYPE_CHECKING:
    import OpenImageIO


def opened(
    path: Path, remedy: str = "write it again as OpenEXR", hint: OpenImageIO.ImageSpec | None = None
) -> OpenImageIO.ImageInput:
    """Return the open file at ``path``; the caller closes it.

    Raises
    ------
    StimulusError
        If OpenImageIO cannot open it.
    """
    import OpenImageIO as oiio

    picture = oiio.ImageInput.open(str(path)) if hint is None else oiio.ImageInput.open(str(path), hint)
    if picture is None:
        raise StimulusError.at(path, f"the picture cannot be read: {reason(oiio.geterror())}", remedy)
    return picture


def reason(message: str) -> str:
    """Return the last line of OpenImageIO's message that is no advice on its own settings."""
    lines = [line for line in message.splitlines() if line.strip()]
    reasons = [line for line in lines if "global attribute" not in line] or lines
    return reasons[-1].strip() if reasons else "no reason given"
