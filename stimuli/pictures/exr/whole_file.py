"""An OpenEXR file written as a whole, or not at all."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from documents import Finding
from stimuli.errors import StimulusError

if TYPE_CHECKING:
    import OpenImageIO

# OpenImageIO writes the time of day into a file that has none; equal pictures must make equal files.
_NO_TIME = "0000:00:00 00:00:00"


def write_whole(path: Path, spec: OpenImageIO.ImageSpec, pixels: NDArray[np.float32]) -> None:
    """Write ``pixels`` (height, width, channels) to ``path`` as ``spec`` says, zipped and without a time.

    A file that is there already stays as it was until the new one is complete.

    Raises
    ------
    StimulusError
        If the file cannot be written.
    """
    import OpenImageIO as oiio

    spec.attribute("compression", "zip")
    spec.attribute("DateTime", _NO_TIME)
    try:
        descriptor, temporary = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=".exr", dir=path.parent)
        os.close(descriptor)
    except OSError as error:
        raise _wrong(path, error.strerror) from error
    try:
        output = oiio.ImageOutput.create(temporary)
        if output is None:
            raise _wrong(path, oiio.geterror().strip())
        written = output.open(temporary, spec) and output.write_image(pixels)
        if not (output.close() and written):
            raise _wrong(path, output.geterror().strip())
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except OSError as error:
        raise _wrong(path, error.strerror) from error
    finally:
        Path(temporary).unlink(missing_ok=True)


def _wrong(path: Path, reason: str | None) -> StimulusError:
    return StimulusError(Finding(f"the picture cannot be written: {reason}", str(path)))
