"""Observer metamerism of objects in a file, beside a screen: see `devices.diagnostics.observer_metamerism`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from devices.colour_matching import ColorimetricObserver, colorimetric_observer
from devices.diagnostics import ObserverMetamerism, observer_metamerism, screen_spectra
from devices.readings import Measurements
from stimuli.errors import StimulusError
from stimuli.spectral.curves import read_illuminant, read_reflectances

_MOST_NM = 20.0


def metamerism_of_files(
    objects: str | Path,
    readings: Measurements,
    illuminant: str,
    observers: Sequence[ColorimetricObserver],
    *,
    matched_for: str,
    white_luminance_cd_m2: float | None = None,
    file: str | None = None,
) -> ObserverMetamerism:
    """Return `observer_metamerism` of the objects in a CSV file under an illuminant, on a screen by its readings.

    Parameters
    ----------
    objects
        CSV with the columns wavelength_nm and the reflectance of each object, 0 to 1, under its name.
    readings
        Readings of the screen with spectra.
    illuminant
        A CIE illuminant (A, D50, D65, E, FL2, …) or a CSV file with the columns wavelength_nm, value.
    observers
        The individual observers.
    matched_for
        The name of the observer for whom the screen's XYZ are those of the object.
    white_luminance_cd_m2
        As in `observer_metamerism`.
    file
        The readings' file, for messages.

    Returns
    -------
    ObserverMetamerism
        ΔE00 for each object and observer.

    Raises
    ------
    InputError
        If a file or a name is wrong, or as `observer_metamerism` and `screen_spectra`.
    """
    waves, reflectances = read_reflectances(Path(objects))
    fine = np.arange(np.ceil(waves[0]), np.floor(waves[-1]) + 1)
    at_nm = {name: np.interp(fine, waves, values) for name, values in reflectances.items()}
    if np.diff(waves).max() > _MOST_NM:
        gap = float(np.diff(waves).max())
        raise StimulusError.at(Path(objects), f"its wavelengths are {gap:g} nm apart", f"{_MOST_NM:g} nm at most")
    return observer_metamerism(
        at_nm,
        read_illuminant(illuminant, fine),
        fine,
        screen_spectra(readings, file),
        observers,
        matched_for=colorimetric_observer(matched_for),
        white_luminance_cd_m2=white_luminance_cd_m2,
    )
