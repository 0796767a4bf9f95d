"""The measures there are, by name: ours, and those of other packages (`docs/extend.md`)."""

from __future__ import annotations

from collections.abc import Iterable
from inspect import isabstract
from typing import Any

from documents import did_you_mean
from documents.extensions import Registry
from stimuli.errors import StimulusError
from stimuli.measures.measure import Measure

# What a measure says of itself: without it no table can be printed.
_SAID = ("name", "title", "unit", "better", "identical", "source")


def _wrong(name: str, kind: Any) -> str | None:
    """Return what is wrong with what a package offers as the measure of that name."""
    if not (isinstance(kind, type) and issubclass(kind, Measure)) or isabstract(kind):
        return "is no Measure with all that one has"
    if missing := [what for what in _SAID if not hasattr(kind, what)]:
        return f"does not say its {missing[0]}"
    if kind.name != name:
        return f"names itself {kind.name}, not {name}"
    if kind.better not in ("lower", "higher"):
        return f"says that '{kind.better}' is better, neither lower nor higher"
    try:
        kind()
    except Exception as error:
        return f"cannot be made ({type(error).__name__}: {error})"
    return None


MEASURES: Registry[type[Measure]] = Registry(
    "cyclopean.measures",
    {
        "delta-e-2000": "stimuli.measures.difference_map:DeltaE2000",
        "s-cielab": "stimuli.measures.scielab:SCielab",
    },
    _wrong,
)


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
    return tuple(name for name in MEASURES.names() if not installed_only or MEASURES[name]().is_installed)


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
    ExtensionError
        If it is another package's, and cannot be used.

    Examples
    --------
    >>> measure_named("s-cielab").better
    'lower'
    """
    kind = MEASURES.get(name)
    if kind is None:
        raise StimulusError.of(f"there is no measure '{name}'", did_you_mean(name, [*MEASURES.names(), "all"]))
    measure = kind()
    if measure.missing:
        raise StimulusError.of(
            f"the measure '{name}' needs the package {measure.package}, which is not installed",
            f"{measure.missing}, or leave out '{name}'",
        )
    return measure


def asked_names(names: Iterable[str]) -> tuple[str, ...]:
    """Return the words of ``names`` one by one, where several have commas between, as they are typed."""
    listed = (names,) if isinstance(names, str) else names
    return tuple(part.strip() for name in listed for part in name.split(",") if part.strip())


def package_of(name: str) -> tuple[str, ...]:
    """Return the remark that a measure is another package's, with its version; nothing for ours."""
    whose = MEASURES.whose(name)
    return (f"it is of {whose}",) if whose else ()


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
        raise StimulusError.of("no measure is named", f"choose from {', '.join(MEASURES.names())}, or all")
    every = [one for name in asked for one in (measure_names(installed_only=True) if name == "all" else (name,))]
    return tuple(measure_named(name) for name in dict.fromkeys(every))
