"""Observer metamerism: an object and its picture on a screen, which match for one observer, seen by others.

The screen's light is its black plus a share of each primary, so that its XYZ for the matching observer are those of the
object. The spectra differ all the same, and to another observer so do the colours. Each observer's difference is ΔE00
against that observer's own white: a perfect diffuser in the object's light [Asano2016].

How differently observers see the display beside an object is judged on white paper in daylight, matched on the screen:
the spectra of screen and daylight differ, so that a match for one observer is none for others. Persons are those of
[Asano2016], 10° being the field of a plate beside a screen.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from devices.colour import delta_e_2000, xyz_to_lab
from devices.colour_matching import STANDARD_OBSERVERS, ColorimetricObserver, colorimetric_observer
from devices.diagnostics import Check, Diagnosis, DisplayCheck, PlotAxes, Readout, Trace, numbers
from devices.errors import DeviceError
from devices.readings import Measurements
from documents import Finding, pages
from documents.arrays import Floats
from documents.pages import Block
from documents.text import counted
from extensions.colour_observers.individuals import individual_observers

_FULL, _DARK = 0.999, 1e-3
MOST_NM, _SEEN_NM = 20.0, (400.0, 700.0)
# A screen whose white differs from the sum of its primaries by more than this is said to be not additive.
_ADDITIVE = 0.02
_GAMUT = 1e-6
_MOST_CONDITION = 1e6


@dataclass(frozen=True, slots=True, eq=False)
class ScreenSpectra:
    """A screen's light: radiance in W/(sr m² nm) at ``wavelengths_nm`` (m,).

    ``black`` (m,) is that of black; ``primaries`` (3, m) that of red, green and blue at full drive above black.
    ``notes`` are sentences on the readings.
    """

    wavelengths_nm: Floats
    black: Floats
    primaries: Floats
    notes: tuple[str, ...] = ()


def screen_spectra(readings: Measurements, file: str | None = None) -> ScreenSpectra:
    """Return a screen's black and primaries from readings with spectra.

    Parameters
    ----------
    readings
        Readings of at least red, green and blue at full drive; repeated ones are averaged.
    file
        The readings' file, for messages.

    Returns
    -------
    ScreenSpectra
        Black (none where it was not read) and primaries above black.

    Raises
    ------
    DeviceError
        If there are no spectra, or a primary at full drive was not read.
    """
    if readings.spectra is None or readings.wavelengths_nm is None:
        raise DeviceError(Finding("the readings have no spectra", file, remedy="measure with a spectroradiometer"))
    codes, spectra = readings.codes, readings.spectra

    def mean(wanted: tuple[int, int, int]) -> Floats | None:
        lit = np.array(wanted, dtype=bool)
        rows = np.all(np.where(lit, codes >= _FULL, codes <= _DARK), axis=1)
        return np.asarray(spectra[rows].mean(axis=0)) if rows.any() else None

    notes = []
    black = mean((0, 0, 0))
    if black is None:
        notes.append("black was not read: it counts as none")
        black = np.zeros(spectra.shape[1])
    alone = {"red": mean((1, 0, 0)), "green": mean((0, 1, 0)), "blue": mean((0, 0, 1))}
    missing = [name for name, spectrum in alone.items() if spectrum is None]
    if missing:
        what = (
            f"{' and '.join(missing)} at full drive, the others at 0, {'was' if len(missing) == 1 else 'were'} not read"
        )
        raise DeviceError(Finding(what, file, remedy="measure the primaries: display measure --set additivity"))
    primaries = np.stack([spectrum - black for spectrum in alone.values() if spectrum is not None])
    white = mean((1, 1, 1))
    if white is not None:
        light = float((white - black).sum())
        off = float((black + primaries.sum(axis=0) - white).sum()) / light if light > 0 else 0.0
        if abs(off) > _ADDITIVE:
            notes.append(f"the primaries together radiate {100 * off:+.1f} % against white: the screen is not additive")
    return ScreenSpectra(readings.wavelengths_nm, black, primaries, tuple(notes))


@dataclass(frozen=True, slots=True, eq=False)
class ObserverMetamerism:
    """How differently observers see objects and their pictures on a screen.

    Attributes
    ----------
    objects
        The objects' names, n.
    observers
        The names of the individual observers, k.
    matched_for
        The observer for whom screen and object have the same XYZ.
    white_luminance_cd_m2
        The luminance of a perfect diffuser in the object's light, for that observer.
    drive
        The shares of the screen's primaries, shape (n, 3), in 0..1.
    delta_e_00
        ΔE00 between object and screen, shape (n, k).
    lab_difference
        CIELAB of the screen minus that of the object, shape (n, k, 3).
    standard_delta_e_00
        ΔE00 for each standard observer, by name, shape (n,).
    outside
        The names of objects that the screen cannot match; their rows are NaN.
    notes
        Sentences on the readings.
    who
        Who the individual observers are, and in what field they see, in words.
    """

    objects: tuple[str, ...]
    observers: tuple[str, ...]
    matched_for: str
    white_luminance_cd_m2: float
    drive: Floats
    delta_e_00: Floats
    lab_difference: Floats
    standard_delta_e_00: Mapping[str, Floats]
    outside: tuple[str, ...]
    notes: tuple[str, ...]
    who: str = "observers see"

    def told(self) -> Iterator[str | Block]:
        """Yield what people read of it: each object's differences, and who sees the largest."""
        white = f"white at {self.white_luminance_cd_m2:.4g} cd/m²"
        yield f"Matched for {self.matched_for}, {white}; ΔE00 that {self.who}"
        headings = ("object", "median", "90 %", "95 %", "worst", "seen by", *self.standard_delta_e_00)
        yield pages.Table.of_texts("", headings, map(self._cells, range(len(self.objects))), words=(0, 5))
        yield from (f"Note: {note}." for note in self.notes)

    def _cells(self, index: int) -> list[str]:
        name, of = self.objects[index], self.summary(index)
        if name in self.outside:
            return [name, *["–"] * 4, "outside the gamut", *["–"] * len(self.standard_delta_e_00)]
        numbers = [f"{of[key]:.2f}" for key in ("median", "p90", "p95", "worst")]
        standard = [f"{values[index]:.2f}" for values in self.standard_delta_e_00.values()]
        return [name, *numbers, str(of["worst_observer"]), *standard]

    def summary(self, index: int) -> dict[str, Any]:
        """Return median, 90th and 95th percentile and worst ΔE00 of object number ``index``, and who sees the worst."""
        values = self.delta_e_00[index]
        if self.objects[index] in self.outside:
            return {"median": None, "p90": None, "p95": None, "worst": None, "worst_observer": None}
        median, p90, p95 = np.percentile(values, [50, 90, 95])
        worst = int(np.argmax(values))
        return {
            "median": float(median),
            "p90": float(p90),
            "p95": float(p95),
            "worst": float(values[worst]),
            "worst_observer": self.observers[worst],
        }

    def to_json(self) -> dict[str, Any]:
        """Return the numbers."""
        objects = {}
        for index, name in enumerate(self.objects):
            inside = name not in self.outside
            standard = {who: float(values[index]) for who, values in self.standard_delta_e_00.items()}
            differences = self.lab_difference[index].round(4).tolist()
            each = [
                {"observer": who, "delta_e_00": float(value), "delta_L": L, "delta_a": a, "delta_b": b}
                for who, value, (L, a, b) in zip(self.observers, self.delta_e_00[index], differences, strict=True)
            ]
            objects[name] = {
                **self.summary(index),
                "drive": self.drive[index].tolist(),
                "standard_observers": standard if inside else {},
                "observers": each if inside else [],
            }
        return {
            "matched_for": self.matched_for,
            "white_luminance_cd_m2": self.white_luminance_cd_m2,
            "objects": objects,
            "outside_gamut": list(self.outside),
            "said": list(self.notes),
        }


def observer_metamerism(
    reflectances: Mapping[str, Floats],
    light: Floats,
    wavelengths_nm: Floats,
    screen: ScreenSpectra,
    observers: Sequence[ColorimetricObserver],
    *,
    matched_for: ColorimetricObserver,
    white_luminance_cd_m2: float | None = None,
) -> ObserverMetamerism:
    """Return how differently observers see objects and the screen that matches them for one observer.

    All spectra are joined by straight lines and summed at every nm over the range that all of them cover.

    Parameters
    ----------
    reflectances
        Spectral reflectance of each object by its name, shape (m,), a perfect diffuser being 1.
    light
        Spectrum of the light that falls on the objects, shape (m,), in any unit.
    wavelengths_nm
        Wavelengths of both, shape (m,), rising, at most 20 nm apart, over 400..700 nm at least.
    screen
        The screen's black and primaries.
    observers
        The individual observers; see `individual_observers`.
    matched_for
        The observer for whom the screen's XYZ are those of the object.
    white_luminance_cd_m2
        The luminance of a perfect diffuser in the light, for that observer; None takes the largest at which the screen
        can show it and every object that it can show at all.

    Returns
    -------
    ObserverMetamerism
        ΔE00 for each object and observer; objects outside the screen's gamut are named.

    Raises
    ------
    DeviceError
        If wavelengths are too coarse or too short, a reflectance is negative, the light is dark, a luminance is not
        above 0, or the primaries do not determine a colour.

    Examples
    --------
    >>> from extensions.colour_observers import categorical_observers
    >>> waves = np.arange(400.0, 701.0, 5.0)
    >>> narrow = np.stack([np.exp(-(((waves - mid) / 12.0) ** 2)) for mid in (630, 530, 460)])
    >>> screen = ScreenSpectra(waves, np.zeros(61), 0.01 * narrow)
    >>> found = observer_metamerism(
    ...     {"grey": np.full(61, 0.2)}, np.ones(61), waves, screen, categorical_observers(2.0),
    ...     matched_for=colorimetric_observer("CIE 2015 2"),
    ... )
    >>> bool(found.standard_delta_e_00["CIE 2015 2"][0] < 1e-9), bool(found.summary(0)["worst"] > 2)
    (True, True)
    """
    if white_luminance_cd_m2 is not None and not (np.isfinite(white_luminance_cd_m2) and white_luminance_cd_m2 > 0):
        raise _wrong(f"the luminance of white is {white_luminance_cd_m2}", "give a number above 0")
    fine = _common_nm(wavelengths_nm, screen.wavelengths_nm, matched_for.name)
    at_nm = {name: np.interp(fine, wavelengths_nm, values) for name, values in reflectances.items()}
    lamp = np.interp(fine, wavelengths_nm, light)
    black = np.interp(fine, screen.wavelengths_nm, screen.black)
    primaries = np.stack([np.interp(fine, screen.wavelengths_nm, row) for row in screen.primaries])
    width = np.ones(len(fine))
    width[[0, -1]] = 0.5

    def seen(observer: ColorimetricObserver, spectra: Floats) -> Floats:
        return np.asarray(observer.efficacy_lm_W * (spectra * width) @ observer.functions_at(fine))

    wrong = [name for name, values in at_nm.items() if not np.all(np.isfinite(values) & (values >= 0))]
    if wrong:
        raise _wrong(f"the reflectance of {wrong[0]} is negative or not finite", "give shares from 0 up")
    white = seen(matched_for, lamp)
    if not white[1] > 0:
        raise _wrong("the light has no luminance", "give the spectrum of a light")
    lamp = lamp / white[1]  # of 1 cd/m² from here on
    spectra = np.array(list(at_nm.values())) * lamp
    colours = seen(matched_for, primaries)
    if not np.all(np.isfinite(colours)) or np.linalg.cond(colours) > _MOST_CONDITION:
        remedy = "check that each was read at full drive, the others at 0"
        raise _wrong("the screen's primaries are so nearly alike that they do not determine a colour", remedy)
    to_drive = np.linalg.inv(colours)
    # Drive is linear in the luminance of white: what it rises by per cd/m², and where it begins.
    rise, start = seen(matched_for, spectra) @ to_drive, -seen(matched_for, black) @ to_drive
    luminance = white_luminance_cd_m2 or _largest(np.vstack([rise, (white / white[1]) @ to_drive]), start)
    drive = start + luminance * rise
    bad = np.any((drive < -_GAMUT) | (drive > 1 + _GAMUT), axis=1)
    shown = black + drive @ primaries

    def lab(observer: ColorimetricObserver) -> tuple[Floats, Floats]:
        own = seen(observer, luminance * lamp)
        return xyz_to_lab(seen(observer, luminance * spectra), own), xyz_to_lab(seen(observer, shown), own)

    pairs = [lab(observer) for observer in observers]
    asked, got = (np.stack([pair[side] for pair in pairs], axis=1) for side in (0, 1))
    apart, difference = delta_e_2000(asked, got), got - asked
    apart[bad], difference[bad] = np.nan, np.nan
    standard = {name: delta_e_2000(*lab(colorimetric_observer(name))) for name in STANDARD_OBSERVERS}
    for values in standard.values():
        values[bad] = np.nan
    names = tuple(at_nm)
    outside = tuple(name for name, wrong in zip(names, bad, strict=True) if wrong)
    who = tuple(observer.name for observer in observers)
    notes = screen.notes
    if outside:
        notes += (f"the screen cannot show {counted(len(outside), 'object', 'objects')}: {', '.join(outside[:5])}",)
    return ObserverMetamerism(
        names, who, matched_for.name, float(luminance), drive, apart, difference, standard, outside, notes
    )


def _wrong(message: str, remedy: str) -> DeviceError:
    return DeviceError(Finding(message, remedy=remedy))


def _common_nm(first: Floats, second: Floats, observer: str) -> Floats:
    """Return every nm that both cover; refuse what is too coarse or too short for an observer."""
    for what, waves in (("the object's", first), ("the screen's", second)):
        if len(waves) < 2:
            raise _wrong(f"{what} spectra have {len(waves)} wavelengths", "give 400..700 nm at least")
        gap = float(np.diff(waves).max())
        if waves[0] > _SEEN_NM[0] or waves[-1] < _SEEN_NM[1] or gap > MOST_NM or np.diff(waves).min() <= 0:
            over = f"{what} spectra run over {waves[0]:g}..{waves[-1]:g} nm in steps of up to {gap:g} nm"
            raise _wrong(over, f"400..700 nm in steps of at most {MOST_NM:g} nm, for {observer}")
    return np.arange(np.ceil(max(first[0], second[0])), np.floor(min(first[-1], second[-1])) + 1)


def _largest(rise: Floats, start: Floats) -> float:
    """Return the largest luminance of white at which everything that the screen can show at all stays within 1."""
    able = np.all(rise >= -_GAMUT * np.abs(rise).max(axis=1, keepdims=True), axis=1)
    with np.errstate(divide="ignore"):
        most = np.where(rise > 0, (1.0 - start) / np.where(rise > 0, rise, 1.0), np.inf).min(axis=1)
    return float(most[able].min() if able.any() else most[-1])


_CHECK = Check("observer_metamerism", "White beside daylight, to other observers", None, "ΔE00", "Asano et al. 2016")
_PERSONS, _FIELD_DEG, _AGES = 500, 10.0, (20.0, 60.0)


def observers_differ(measurements: Measurements) -> Diagnosis:
    """Report the ΔE00 that 95 of 100 persons stay below between D65 on white paper and its match on the screen."""
    if measurements.spectra is None:
        return _CHECK.unjudged("The readings are XYZ alone, without spectra.")
    try:
        screen = screen_spectra(measurements)
    except DeviceError as error:
        return _CHECK.unjudged(f"{error.findings[0].message[0].upper()}{error.findings[0].message[1:]}.")
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
        return _CHECK.unjudged(f"{error.findings[0].message[0].upper()}{error.findings[0].message[1:]}.")
    if found.outside:
        return _CHECK.unjudged("D65 lies outside the gamut.")
    of = found.summary(0)
    standard = {name: float(values[0]) for name, values in found.standard_delta_e_00.items()}
    words = (
        f"White in D65 is matched on the screen for {matched_for.name}°: persons of {_AGES[0]:g} to {_AGES[1]:g} years "
        f"see {of['median']:.2g} ΔE00 in the middle, 95 of 100 up to {of['p95']:.2g}, in a field of {_FIELD_DEG:g}°; "
        f"CIE 2015 10° sees {standard['CIE 2015 10']:.2g}. display metamerism computes it for objects of your own."
    )
    seen = np.sort(found.delta_e_00[0])
    share = 100 * np.arange(1, len(seen) + 1) / len(seen)
    lines = (Trace("persons", numbers(seen), numbers(share), "ink", "line"),)
    rows = (("persons, median", of["median"]), ("persons, 95th percentile", of["p95"]), ("worst", of["worst"]))
    return _CHECK.described(
        of["p95"],
        words,
        series=(PlotAxes("who sees less", "ΔE00", "persons, %", lines),),
        table=Readout(("observer", "ΔE00"), (*rows, *standard.items())),
    )


OBSERVERS_DIFFER = DisplayCheck(observers_differ, after="spectral_overlap", of_primaries=True)
