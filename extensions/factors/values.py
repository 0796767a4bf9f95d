"""The values of the stimuli's factors: numbers, or levels by name."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

from analysis.errors import ResultsError
from analysis.records import SessionLog
from documents import Finding
from documents.text import JsonResult

Kind = Literal["categorical", "numeric", "log2"]
Value = str | float


@dataclass(frozen=True, slots=True)
class Omitted(JsonResult):
    """A factor that is not in the model, and why."""

    name: str
    reason: str


@dataclass(frozen=True, slots=True)
class Factor(JsonResult):
    """One factor of ``n`` stimuli.

    Attributes
    ----------
    name
        As the recipe calls it.
    kind
        ``categorical``; ``numeric``, in its own unit; or ``log2``, a number above zero whose effect is per doubling.
    values
        n numbers, or the n names of levels.
    levels
        Of a categorical factor: the reference level first, then the others as they are met, or by size if they are
        numbers. Empty for numbers.
    """

    name: str
    kind: Kind
    values: tuple[Value, ...]
    levels: tuple[str, ...] = ()
    json_keys: ClassVar = {"values": None}


@dataclass(frozen=True, slots=True)
class FactorOptions:
    """How factors are to be read: ``use`` these, in this order; ``categorical`` numbers; logarithms; references."""

    use: Sequence[str] | None = None
    categorical: Sequence[str] = ()
    log: Sequence[str] = ()
    references: Mapping[str, Value] | None = None


def read_factors(
    items: Sequence[str], factors: Mapping[str, Mapping[str, Any]], options: FactorOptions
) -> tuple[list[Factor], list[Omitted]]:
    """Return the factors that vary among ``items``, in order, and those that do not or are not known of every item.

    Without ``use`` a factor that has a level of its own for every item, as a name has, is left out too.

    Raises
    ------
    ResultsError
        If an item has no factors, an option names no factor or no level, or a number is not finite, or not above zero
        where its logarithm is asked for.
    """
    for item in items:
        if item not in factors:
            what = f"there are no factors of '{item}'"
            raise ResultsError(Finding(what, remedy="give every compared item its factors, at least an empty mapping"))
    known = tuple(dict.fromkeys(name for item in items for name in factors[item]))
    references = options.references or {}
    for name in (*(options.use or ()), *options.categorical, *options.log, *references):
        if name not in known:
            remedy = "expected one of: " + ", ".join(known) if known else "the stimuli have no factors"
            raise ResultsError(Finding(f"there is no factor '{name}'", remedy=remedy))
    for name in options.log:
        if name in options.categorical or name in references:
            what = f"the factor '{name}' cannot be both levels and a logarithm"
            raise ResultsError(Finding(what, remedy="name it once"))
    varying, left_out = [], []
    for name in dict.fromkeys(options.use) if options.use is not None else known:
        values = [factors[item].get(name) for item in items]
        unknown = [item for item, value in zip(items, values, strict=True) if value is None]
        if unknown:
            more = f" and {len(unknown) - 1} more" if len(unknown) > 1 else ""
            left_out.append(Omitted(name, f"it is not known of '{unknown[0]}'{more}"))
            continue
        factor = _read(name, values, name in options.categorical, name in options.log, references.get(name))
        if _is_constant(factor):
            left_out.append(Omitted(name, f"it is {_text(values[0])} for every stimulus"))
        elif options.use is None and len(factor.levels) == len(items) > 2:
            left_out.append(Omitted(name, "every stimulus has a level of its own: it names them and explains nothing"))
        else:
            varying.append(factor)
    return varying, left_out


def session_factors(sessions: Sequence[SessionLog]) -> dict[str, dict[str, Value]]:
    """Return the factors of each stimulus, by name, as the headers of ``sessions`` give them.

    Parameters
    ----------
    sessions
        Sessions whose stimuli belong together.

    Returns
    -------
    dict[str, dict[str, Value]]
        For each stimulus, the value of each factor: text or a number. It is empty for a stimulus without factors.

    Raises
    ------
    ResultsError
        If two sessions give different factors of one stimulus.

    Examples
    --------
    >>> from pathlib import Path
    >>> from analysis.records import new_header
    >>> stimuli = ({"name": "a", "factors": {"view": "stereo", "exposure": 0.5}},)
    >>> header = new_header("views", "01", "s1", "2026-01-31T09:30:00Z", seed=1, stimuli=stimuli)
    >>> session_factors([SessionLog(Path("session.jsonl"), header, (), complete=True)])
    {'a': {'view': 'stereo', 'exposure': 0.5}}
    """
    factors: dict[str, dict[str, Value]] = {}
    source: dict[str, SessionLog] = {}
    for session in sessions:
        for name, mine in session.header.factors.items():
            if factors.setdefault(name, mine) != mine:
                what = f"this session and {source[name].file} give different factors of '{name}'"
                raise ResultsError(Finding(what, str(session.file), 1, 1, "analyse them separately"))
            source.setdefault(name, session)
    return factors


def _read(name: str, values: Sequence[Any], categorical: bool, log: bool, reference: Value | None) -> Factor:
    numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in values)
    if log and not numbers:
        raise ResultsError(Finding(f"the factor '{name}' is no number", remedy="take logarithms of numbers only"))
    if numbers:
        for value in values:
            if not math.isfinite(value) or (log and value <= 0):
                expected = "a number above zero" if log else "a finite number"
                raise ResultsError(Finding(f"the factor '{name}' is {value:g}", remedy=f"expected {expected}"))
    if numbers and not categorical and reference is None:
        return Factor(name, "log2" if log else "numeric", tuple(math.log2(v) if log else float(v) for v in values))
    # A number of its own for each level, so that 1 and 1.0 are one level.
    met = sorted({float(value) for value in values}) if numbers else list(dict.fromkeys(values))
    levels = [_text(value) for value in met]
    if len(set(levels)) < len(levels):
        levels = [repr(value) for value in met]
    if reference is not None:
        wanted = _text(float(reference) if numbers and not isinstance(reference, str) else reference)
        if wanted not in levels:
            what = f"the factor '{name}' has no level '{wanted}'"
            raise ResultsError(Finding(what, remedy="expected one of: " + ", ".join(levels)))
        levels_by_reference = [wanted, *(level for level in levels if level != wanted)]
    else:
        levels_by_reference = levels
    named = dict(zip(met, levels, strict=True))
    return Factor(name, "categorical", tuple(named[value] for value in values), tuple(levels_by_reference))


def _text(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _is_constant(factor: Factor) -> bool:
    if factor.kind == "categorical":
        return len(factor.levels) < 2
    numbers = [float(value) for value in factor.values]
    return max(numbers) - min(numbers) <= 1e-12 * max(abs(number) for number in numbers)
