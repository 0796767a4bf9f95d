"""From a file to a spectral picture."""

from __future__ import annotations

from pathlib import Path

from documents import Finding
from stimuli.errors import StimulusError
from stimuli.spectral.picture import Quantity, SpectralPicture


def read_spectral(path: Path, quantity: Quantity | None = None) -> SpectralPicture:
    """Return the spectral picture at ``path``, OpenEXR (.exr) or ENVI (.hdr, or the data beside it).

    Only the header is read; the values come with `SpectralPicture.blocks`. ``quantity`` says what they are where the
    file does not.

    Raises
    ------
    StimulusError
        If the file is missing or neither; if its bands do not rise, leave out a part of 400..700 nm, or are more than
        20 nm apart; if it does not say what its values are. The finding names file and reason.
    """
    from stimuli.spectral.envi_bands import envi_bands
    from stimuli.spectral.exr_bands import exr_bands

    path = Path(path)
    if not path.is_file() and path.suffix.lower() != ".hdr":
        raise StimulusError(Finding("there is no such file", str(path), remedy="check the path"))
    return (exr_bands if path.suffix.lower() == ".exr" else envi_bands)(path, quantity)
