"""How differently observers see the display beside an object: white paper in daylight, matched on the screen.

The spectra of screen and daylight differ, so that a match for one observer is none for others; how much lies in the
primaries' spectra. Persons are those of [Asano2016], 10° being the field of a plate beside a screen.
"""

from __future__ import annotations

import numpy as np

from devices.colour_matching import colorimetric_observer, individual_observers
from devices.diagnostics.diagnosis import Check, Diagnosis, Line, Panel, Table, numbers
from devices.diagnostics.metamerism import observer_metamerism, screen_spectra
from devices.errors import DeviceError
from devices.readings import Measurements

OBSERVERS_DIFFER = Check(
    "observer_metamerism", "White beside daylight, to other observers", None, "ΔE00", "Asano et al. 2016"
)
_PERSONS, _FIELD_DEG, _AGES = 500, 10.0, (20.0, 60.0)


def observers_differ(measurements: Measurements) -> Diagnosis:
    """Report the ΔE00 that 95 of 100 persons stay below between D65 on white paper and its match on the screen."""
    if measurements.spectra is None:
        return OBSERVERS_DIFFER.unjudged("The readings are XYZ alone, without spectra.")
    try:
        screen = screen_spectra(measurements)
    except DeviceError as error:
        return OBSERVERS_DIFFER.unjudged(f"{error.findings[0].message[0].upper()}{error.findings[0].message[1:]}.")
    # Importing all of colour-science takes a second; only readings with spectra wait for it.
    from colour.colorimetry.datasets import SDS_ILLUMINANTS

    waves = np.arange(380.0, 781.0)
    daylight = SDS_ILLUMINANTS["D65"]
    light = np.interp(waves, np.asarray(daylight.wavelengths), np.asarray(daylight.values))
    persons = individual_observers(_PERSONS, _FIELD_DEG, ages_years=_AGES)
    matched_for = colorimetric_observer(measurements.observer)
    try:
        found = observer_metamerism(
            {"white": np.ones(len(waves))}, light, waves, screen, persons, matched_for=matched_for
        )
    except DeviceError as error:
        return OBSERVERS_DIFFER.unjudged(f"{error.findings[0].message[0].upper()}{error.findings[0].message[1:]}.")
    if found.outside:
        return OBSERVERS_DIFFER.unjudged("D65 lies outside the gamut.")
    of = found.summary(0)
    standard = {name: float(values[0]) for name, values in found.standard_delta_e_00.items()}
    words = (
        f"White in D65 is matched on the screen for {matched_for.name}°: persons of {_AGES[0]:g} to {_AGES[1]:g} years "
        f"see {of['median']:.2g} ΔE00 in the middle, 95 of 100 up to {of['p95']:.2g}, in a field of {_FIELD_DEG:g}°; "
        f"CIE 2015 10° sees {standard['CIE 2015 10']:.2g}. display metamerism computes it for objects of your own."
    )
    seen = np.sort(found.delta_e_00[0])
    share = 100 * np.arange(1, len(seen) + 1) / len(seen)
    lines = (Line("persons", numbers(seen), numbers(share), "ink", "line"),)
    rows = (("persons, median", of["median"]), ("persons, 95th percentile", of["p95"]), ("worst", of["worst"]))
    return OBSERVERS_DIFFER.described(
        of["p95"],
        words,
        series=(Panel("who sees less", "ΔE00", "persons, %", lines),),
        table=Table(("observer", "ΔE00"), (*rows, *standard.items())),
    )
