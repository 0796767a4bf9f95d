"""Spectral pictures of known values, as OpenEXR and as ENVI."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.stimuli.oiio_files import save_parts

WAVES = np.arange(380.0, 781.0, 5.0)


def bumps(waves: NDArray[np.float64], shape: tuple[int, int] = (7, 9), seed: int = 0) -> NDArray[np.float64]:
    """Return smooth spectra between 0 and about 1, shape (height, width, bands)."""
    rng = np.random.default_rng(seed)
    centre = rng.uniform(400, 700, (*shape, 3, 1))
    width = rng.uniform(30, 120, (*shape, 3, 1))
    height = rng.uniform(0.05, 0.33, (*shape, 3, 1))
    return np.asarray((height * np.exp(-(((waves - centre) / width) ** 2))).sum(axis=2))


def save_exr(
    path: Path,
    values: NDArray[Any],
    waves: NDArray[np.float64] = WAVES,
    form: str = "S0.{},0nm",
    *,
    tile: int = 0,
    names: list[str] | None = None,
    attributes: dict[str, Any] | None = None,
) -> Path:
    channels = names or [form.format(f"{wave:g}") for wave in waves]
    return save_parts(path, [(attributes or {}, channels, values)], tile_px=(tile, tile) if tile else None)


def save_envi(path: Path, values: NDArray[Any], waves: NDArray[np.float64] = WAVES, **metadata: Any) -> Path:
    """Save and return the header's path."""
    from spectral.io import envi

    told = {"wavelength": [f"{wave:g}" for wave in waves], "wavelength units": "Nanometers", **metadata}
    interleave = told.pop("interleave", "bil")
    told = {key: value for key, value in told.items() if value is not None}
    order = 1 if values.dtype.byteorder == ">" else 0
    options = {"interleave": interleave, "metadata": told, "force": True, "ext": "img", "byteorder": order}
    envi.save_image(str(path), values, dtype=values.dtype, **options)
    return path
