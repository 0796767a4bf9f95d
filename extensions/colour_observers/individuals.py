"""Individual observers: persons with normal colour vision as they differ from the average [Asano2016].

Eight numbers make a person of one age: how dense lens, macular pigment and the three photopigments are, and where the
photopigments absorb most. Each is normally distributed with the standard deviation that Asano, Fairchild and Blondé
fitted to colour matches. Cone fundamentals follow by CIE 170-1, and x̄, ȳ, z̄ by the matrix of CIE 170-2 for the field
and age 32, after each fundamental was scaled to the area that it has at age 32.
"""

from __future__ import annotations

from dataclasses import astuple, fields
from functools import lru_cache

import numpy as np

from devices.colour_matching import (
    CANDELA_NM,
    ColorimetricObserver,
    Departure,
    cie_2006_name,
    cone_fundamentals,
    quantal_fundamentals,
    xyz_from_lms,
)
from devices.errors import DeviceError
from documents import Finding
from documents.arrays import Floats

# Standard deviations as fitted to the matches [Asano2016]: lens, macula, L, M, S densities; shifts of L, M, S in nm.
STANDARD_DEVIATIONS = Departure(0.187, 0.365, 0.09, 0.09, 0.074, 2.0, 1.5, 1.3)
# A density is no less than none; a cone without pigment sees nothing, and no matches are known of it.
_LEAST = Departure(-1.0, -1.0, -0.99, -0.99, -0.99, -100.0, -100.0, -100.0)
_MOST_OBSERVERS = 100_000
# Age, and departures (lens, macula, L, M, S in percent; shifts in nm), of the ten categorical observers [Asano2020].
_CATEGORIES = (
    (38, 0, 0, 0, 0, 0, 0, 0, 0),
    (30, -22.93222627, 6.962191825, -11.10653472, -4.958219425, 7.590745679, -0.092437331, 0.333817959, -0.787800703),
    (56, 17.00795756, -10.9947934, 0.591105848, -5.487150663, -1.01365926, 0.851065129, 0.507858148, 0.713851142),
    (33, -8.340002495, -43.58029486, 5.872093409, 4.529927987, 0.186598643, -1.039069074, -1.413070735, 0.05733172),
    (38, 1.602521874, 54.7328797, 3.709006239, 16.05725407, -1.820357289, 1.142685675, -1.122374849, 0.233255808),
    (45, 7.014940575, -35.31193258, 4.783942642, 11.60120636, -4.476222883, -0.609794229, -1.270910749, -0.061290033),
    (31, -33.96024786, 36.26361433, 7.288647348, 7.407740592, -4.616621316, -0.615094438, 0.147189064, 0.798124933),
    (51, 15.03832669, 30.83508015, 2.397270797, -8.69630897, -0.046782564, 0.492360583, 0.082763693, 0.127790838),
    (35, -18.25564091, -11.93214792, -2.432612941, -6.993460894, -9.905415639, 0.34234673, -0.57907462, -0.086908738),
    (68, 10.85868301, -15.99733179, 0.6930381, -10.33191228, 9.313008, 0.746978772, 0.41841603, 0.424340588),
)


def individual_observers(
    count: int, field_deg: float, *, ages_years: tuple[float, float] = (20.0, 60.0), seed: int = 1
) -> tuple[ColorimetricObserver, ...]:
    """Return individual observers drawn at random.

    Parameters
    ----------
    count
        How many, 1 to 100 000.
    field_deg
        The field of view in degrees, 1 to 10.
    ages_years
        Ages are drawn evenly between these two, whole years, 20 to 80.
    seed
        The random seed; the same seed gives the same persons, and the first of more.

    Returns
    -------
    tuple of ColorimetricObserver
        Functions at 390..830 nm, every nm.

    Raises
    ------
    DeviceError
        If the count, the field or an age is out of range.

    Examples
    --------
    >>> persons = individual_observers(3, 10.0, seed=7)
    >>> [(person.name, person.functions.shape) for person in persons][:1]
    [('person 1, age 55', (441, 3))]
    """
    if not 1 <= count <= _MOST_OBSERVERS:
        raise DeviceError(Finding(f"{count} observers are asked for", remedy=f"1 to {_MOST_OBSERVERS}"))
    if ages_years[0] > ages_years[1]:
        what = f"ages run from {ages_years[0]:g} to {ages_years[1]:g}"
        raise DeviceError(Finding(what, remedy="write the youngest first"))
    for age in ages_years:
        cie_2006_name(field_deg, age)
    persons = []
    for number in range(1, count + 1):
        rng = np.random.default_rng([seed, number])
        age = int(rng.integers(int(np.ceil(ages_years[0])), int(ages_years[1]), endpoint=True))
        drawn = rng.standard_normal(8) * np.array(astuple(STANDARD_DEVIATIONS))
        drawn = np.maximum(drawn, astuple(_LEAST))
        persons.append(individual_observer(f"person {number}, age {age}", field_deg, age, Departure(*drawn.tolist())))
    return tuple(persons)


def categorical_observers(field_deg: float) -> tuple[ColorimetricObserver, ...]:
    """Return the ten categorical observers of Asano and Fairchild, the average one of age 38 first [Asano2020].

    Parameters
    ----------
    field_deg
        The field of view in degrees, 1 to 10.

    Returns
    -------
    tuple of ColorimetricObserver
        Functions at 390..830 nm, every nm.

    Raises
    ------
    DeviceError
        If the field is out of range.

    Examples
    --------
    >>> [observer.name for observer in categorical_observers(2.0)][:2]
    ['category 1, age 38', 'category 2, age 30']
    """
    scale = np.array([100.0] * 5 + [1.0] * 3)
    return tuple(
        individual_observer(
            f"category {number}, age {age}", field_deg, age, Departure(*(np.array(departure) / scale).tolist())
        )
        for number, (age, *departure) in enumerate(_CATEGORIES, start=1)
    )


def individual_observer(name: str, field_deg: float, age_years: float, departure: Departure) -> ColorimetricObserver:
    """Return the observer of an age who departs from the average of that age by ``departure``.

    Parameters
    ----------
    name
        A name for the person.
    field_deg
        The field of view in degrees, 1 to 10.
    age_years
        The age in years, 20 to 80.
    departure
        How far densities and peaks are from the average.

    Returns
    -------
    ColorimetricObserver
        Functions at 390..830 nm, every nm.

    Raises
    ------
    DeviceError
        If the field or the age is out of range, or a density would be negative, or that of a cone nothing.
    """
    cie_2006_name(field_deg, age_years)
    low = [part.name for part in fields(departure) if not getattr(departure, part.name) >= getattr(_LEAST, part.name)]
    if low:
        what = f"'{low[0]}' of {name} is {getattr(departure, low[0]):g}"
        raise DeviceError(Finding(what, remedy=f"{getattr(_LEAST, low[0]):g} is the least"))
    waves, areas, matrix = _average(field_deg)
    own = quantal_fundamentals(field_deg, age_years, departure) * waves[:, None]
    functions = own * (areas / own.sum(axis=0)) @ matrix.T
    efficacy = 683.0 / float(np.interp(CANDELA_NM, waves, functions[:, 1]))
    return ColorimetricObserver(name, field_deg, float(age_years), waves, functions, efficacy)


@lru_cache(maxsize=16)
def _average(field_deg: float) -> tuple[Floats, Floats, Floats]:
    """Return wavelengths, the areas of the fundamentals at age 32, and the matrix from them to XYZ."""
    waves, average = cone_fundamentals(field_deg, 32.0)
    return waves, average.sum(axis=0), xyz_from_lms(field_deg, 32.0)
