"""Observer metamerism: run time against error over the spacing of spectra and the number of persons.

Beside it colour-science computes the same differences person by person from the same functions.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from curves import program, seconds, sized
from promises import Promise, worst

from devices.colour_matching import ColorimetricObserver, colorimetric_observer
from devices.readings import xyz_from_spectra
from extensions.colour_observers import ScreenSpectra, individual_observers, observer_metamerism

FINE = np.arange(390.0, 781.0)
PERSONS, THEIRS, REFERENCE = sized(((10, 100, 1000), 10, 4000), ((10,), 2, 50))
SPACINGS = (1, 5, 10, 20)


def _bump(waves: np.ndarray, middle_nm: float, width_nm: float) -> np.ndarray:
    return np.asarray(np.exp(-(((waves - middle_nm) / width_nm) ** 2)))


def _paint(waves: np.ndarray) -> np.ndarray:
    return np.asarray(0.04 + 0.35 * _bump(waves, 465, 45) + 0.25 / (1 + np.exp((690 - waves) / 10)))


def _screen(waves: np.ndarray) -> ScreenSpectra:
    primaries = np.stack([_bump(waves, middle, 18) for middle in (628, 532, 458)])
    return ScreenSpectra(waves, np.zeros(len(waves)), 0.01 * primaries)


def _theirs(persons: tuple[ColorimetricObserver, ...], lamp: np.ndarray, shown: np.ndarray) -> list[float]:
    from colour.colorimetry import MultiSpectralDistributions, SpectralDistribution, sd_to_XYZ_integration
    from colour.difference import delta_E_CIE2000
    from colour.models import XYZ_to_Lab, XYZ_to_xy

    ends = np.ones(len(FINE))
    ends[[0, -1]] = 0.5
    found = []
    for person in persons:
        cmfs = MultiSpectralDistributions(dict(zip(FINE, person.functions_at(FINE), strict=True)))
        white, asked, got = (
            sd_to_XYZ_integration(SpectralDistribution(dict(zip(FINE, light * ends, strict=True))), cmfs, k=683.0)
            for light in (lamp, lamp * _paint(FINE), shown)
        )
        labs = [XYZ_to_Lab(xyz / white[1], XYZ_to_xy(white)) for xyz in (asked, got)]
        found.append(float(delta_E_CIE2000(labs[0], labs[1])))
    return found


def run() -> dict[str, object]:
    """Time drawing persons, their differences and colour-science's; errors are in ΔE00 or shares of white."""
    match, lamp = colorimetric_observer("CIE 1931 2"), np.ones(len(FINE))
    everyone = individual_observers(REFERENCE, 10.0, seed=2)
    rows: list[dict[str, object]] = []

    def differences(persons: tuple[ColorimetricObserver, ...]) -> np.ndarray:
        paint = {"paint": _paint(FINE)}
        found = observer_metamerism(paint, lamp, FINE, _screen(FINE), persons, matched_for=match)
        return np.asarray(found.delta_e_00[0])

    reference = float(np.percentile(differences(everyone), 95))
    for count in PERSONS:
        persons = individual_observers(count, 10.0, seed=1)
        error = abs(float(np.percentile(differences(persons), 95)) - reference)
        rows += [
            {
                "series": "persons drawn",
                "parameter": str(count),
                "seconds": seconds(partial(individual_observers, count, 10.0), repeats=1),
                "error": 0.0,
            },
            {
                "series": f"their differences; error of the 95th percentile against {REFERENCE} others",
                "parameter": str(count),
                "seconds": seconds(partial(differences, persons), repeats=3),
                "error": error,
            },
        ]
    few = individual_observers(THEIRS, 10.0, seed=1)
    whole = observer_metamerism({"paint": _paint(FINE)}, lamp, FINE, _screen(FINE), few, matched_for=match)
    light = lamp * whole.white_luminance_cd_m2 / (match.efficacy_lm_W * np.trapezoid(match.functions_at(FINE)[:, 1]))
    shown = whole.drive[0] @ _screen(FINE).primaries
    theirs = np.array(_theirs(few, light, shown))
    taken = seconds(partial(_theirs, few, light, shown), repeats=1)
    error = float(np.abs(theirs - whole.delta_e_00[0]).max())
    rows.append({"series": "colour-science", "parameter": str(THEIRS), "seconds": taken, "error": error})
    rng = np.random.default_rng(1)
    middles, widths = rng.uniform(430, 650, (200, 3, 1)), rng.uniform(12, 60, (200, 3, 1))
    for spacing in SPACINGS:
        waves = np.arange(390.0, 781.0, spacing)
        whole_light = np.exp(-(((FINE - middles) / widths) ** 2)).sum(axis=1)
        part = np.exp(-(((waves - middles) / widths) ** 2)).sum(axis=1)
        true, ours = (
            xyz_from_spectra(whole_light, FINE, "CIE 2015 10"),
            partial(xyz_from_spectra, part, waves, "CIE 2015 10"),
        )
        off = np.abs(ours() - true).max(axis=1) / true[:, 1]
        rows.append(
            {
                "series": "XYZ of 200 spectra of three peaks; error: 95th percentile, share of Y",
                "parameter": f"{spacing} nm",
                "seconds": seconds(ours, repeats=3),
                "error": float(np.percentile(off, 95)),
            }
        )
    promises = [
        Promise("a person's ΔE00 against colour-science", worst(rows, series="colour-science"), 1e-5, "error"),
        Promise(
            "XYZ of spectra every 5 nm, a share of Y", worst(rows, series="XYZ of", parameter="5 nm"), 0.02, "error"
        ),
    ]
    return {"title": "Observer metamerism of a paint beside a screen", "rows": rows, "promises": promises}


if __name__ == "__main__":
    program("observer_metamerism", run)
