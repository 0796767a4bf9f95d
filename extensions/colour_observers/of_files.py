"""Observer metamerism of objects in a file, beside a screen: see `extensions.colour_observers.metamerism`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np

from devices.colour_matching import colorimetric_observer
from devices.readings import read_measurements
from documents.options import Typed
from extensions.colour_observers.individuals import categorical_observers, individual_observers
from extensions.colour_observers.metamerism import MOST_NM, ObserverMetamerism, observer_metamerism, screen_spectra
from extensions.colour_observers.options import MetamerismOptions
from stimuli.errors import StimulusError
from stimuli.spectral import read_illuminant, read_reflectances


def metamerism_of_files(
    objects: Annotated[Path, Typed(metavar="OBJECTS.csv")], readings: Path, options: MetamerismOptions
) -> ObserverMetamerism:
    """Find how differently observers see an object beside its match on the screen.

    OBJECTS.csv has the columns wavelength_nm and the reflectance of each object. READINGS are readings of the screen
    with spectra, its primaries at full drive among them. Each object in the light is matched on the screen for one
    observer; the differences that others see are in ΔE00 against their own white.

    Parameters
    ----------
    objects
        CSV with the columns wavelength_nm and the reflectance of each object, 0 to 1, under its name.
    readings
        Readings of the screen with spectra, as `devices.readings.read_measurements` reads them.
    options
        The illuminant, a CIE one (A, D50, D65, E, FL2, …) or a CSV file with the columns wavelength_nm, value; the
        observer for whom the screen's XYZ are those of the object; and the individual observers.

    Returns
    -------
    ObserverMetamerism
        ΔE00 for each object and observer.

    Raises
    ------
    InputError
        If a file or a name is wrong, or as `observer_metamerism` and `screen_spectra`.
    """
    matched_for = colorimetric_observer(options.observer)
    degrees = matched_for.field_deg if options.field_deg is None else options.field_deg
    if options.categories:
        group, who = categorical_observers(degrees), "categorical observers"
    else:
        group = individual_observers(options.persons, degrees, ages_years=options.ages_years, seed=options.seed)
        who = f"persons of {options.ages_years[0]:g}..{options.ages_years[1]:g} years"
    screen = screen_spectra(read_measurements(readings), str(readings))
    waves, reflectances = read_reflectances(Path(objects))
    fine = np.arange(np.ceil(waves[0]), np.floor(waves[-1]) + 1)
    at_nm = {name: np.interp(fine, waves, values) for name, values in reflectances.items()}
    if np.diff(waves).max() > MOST_NM:
        gap = float(np.diff(waves).max())
        raise StimulusError.at(Path(objects), f"its wavelengths are {gap:g} nm apart", f"{MOST_NM:g} nm at most")
    found = observer_metamerism(
        at_nm,
        read_illuminant(options.illuminant, fine),
        fine,
        screen,
        group,
        matched_for=matched_for,
        white_luminance_cd_m2=options.white_luminance_cd_m2,
    )
    return replace(found, who=f"{len(group)} {who} see in a field of {degrees:g}°")
