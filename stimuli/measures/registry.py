"""The measures there are, by name."""

from __future__ import annotations

from collections.abc import Iterable

from documents import did_you_mean
from documents.arrays import Floats32
from stimuli.errors import StimulusError
from stimuli.measures.cvvdp import ColorVideoVDP
from stimuli.measures.difference_map import difference_map
from stimuli.measures.flip import Flip, HdrFlip
from stimuli.measures.measure import MapMeasure, Measure
from stimuli.measures.pu_measures import PuPsnr, PuSsim
from stimuli.measures.scielab import SeenPicture
from stimuli.measures.scielab_1996 import SCielab1996
from stimuli.measures.viewing import ViewingConditions
from stimuli.pictures.rows import Rows

# Colour differences as measures: CIEDE2000 as the pictures are, and as the eye resolves them.


class DeltaE2000(MapMeasure):
    """The mean of CIEDE2000 over the pixels."""

    name = "delta-e-2000"
    title = "ΔE00"
    unit = "ΔE"
    better = "lower"
    identical = 0.0
    source = "Sharma2005"
    map_title = "ΔE00"
    map_highest = 10.0

    def error_map(self, reference_XYZ: Rows, test_XYZ: Rows, viewing: ViewingConditions) -> Floats32:
        """Return ΔE00 of each pixel, float32 (height, width)."""
        return difference_map(reference_XYZ, test_XYZ, viewing.cielab_white_XYZ)


class SCielab(MapMeasure):
    """The mean of CIEDE2000 over the pixels of both pictures as the eye resolves them."""

    name = "s-cielab"
    title = "S-CIELAB"
    unit = "ΔE"
    better = "lower"
    identical = 0.0
    source = "Johnson2003"
    map_title = "ΔE00 of what the eye resolves"
    map_highest = 10.0

    def error_map(self, reference_XYZ: Rows, test_XYZ: Rows, viewing: ViewingConditions) -> Floats32:
        """Return ΔE00 of each pixel, float32 (height, width)."""
        white, density = viewing.cielab_white_XYZ, viewing.pixels_per_degree
        seen = [SeenPicture(picture, density, white) for picture in (reference_XYZ, test_XYZ)]
        return difference_map(seen[0], seen[1], white, filtered=True)


# In the order in which they are printed.
_MEASURES: tuple[Measure, ...] = (
    DeltaE2000(),
    SCielab(),
    SCielab1996(),
    Flip(),
    HdrFlip(),
    PuSsim(),
    PuPsnr(),
    ColorVideoVDP(),
)
_BY_NAME = {measure.name: measure for measure in _MEASURES}


def measure_names(installed_only: bool = False) -> tuple[str, ...]:
    """Return the names of the measures there are, in the order in which they are printed.

    Parameters
    ----------
    installed_only
        Leave out those whose package is not there.

    Returns
    -------
    tuple of str
        Names for `measure_named`.

    Examples
    --------
    >>> "delta-e-2000" in measure_names()
    True
    """
    return tuple(measure.name for measure in _MEASURES if measure.is_installed or not installed_only)


def measure_named(name: str) -> Measure:
    """Return a measure by its name.

    Parameters
    ----------
    name
        One of `measure_names`.

    Returns
    -------
    Measure
        The measure, ready to be used.

    Raises
    ------
    StimulusError
        If there is none of that name, or its package is not installed.

    Examples
    --------
    >>> measure_named("s-cielab").better
    'lower'
    """
    measure = _BY_NAME.get(name)
    if measure is None:
        raise StimulusError.of(f"there is no measure '{name}'", did_you_mean(name, [*_BY_NAME, "all"]))
    if not measure.is_installed:
        raise StimulusError.of(
            f"the measure '{name}' needs the package {measure.package}, which is not installed",
            f"{_remedy(measure)}, or leave out '{name}'",
        )
    return measure


def asked_names(names: Iterable[str]) -> tuple[str, ...]:
    """Return the words of ``names`` one by one, where several have commas between, as they are typed."""
    listed = (names,) if isinstance(names, str) else names
    return tuple(part.strip() for name in listed for part in name.split(",") if part.strip())


def missing_package(name: str) -> str | None:
    """Return what to type to install what the measure of that name needs; None where nothing is missing."""
    measure = _BY_NAME[name]
    return None if measure.is_installed else _remedy(measure)


def _remedy(measure: Measure) -> str:
    return f"pip install '.[{measure.extra}]'"


def measures_named(names: Iterable[str]) -> tuple[Measure, ...]:
    """Return measures by name, each once.

    Parameters
    ----------
    names
        Names of `measure_names`, each alone or several with commas between; ``all`` stands for those that are
        installed.

    Returns
    -------
    tuple of Measure
        The measures, in the order in which they are named.

    Raises
    ------
    StimulusError
        If there is none of a name, or its package is not installed.

    Examples
    --------
    >>> [measure.title for measure in measures_named(["s-cielab,delta-e-2000"])]
    ['S-CIELAB', 'ΔE00']
    """
    asked = asked_names(names)
    if not asked:
        raise StimulusError.of("no measure is named", f"choose from {', '.join(_BY_NAME)}, or all")
    every = [one for name in asked for one in (measure_names(installed_only=True) if name == "all" else (name,))]
    return tuple(measure_named(name) for name in dict.fromkeys(every))
