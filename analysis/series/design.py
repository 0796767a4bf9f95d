"""How series hang together: what tells them apart, and what rises along them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from analysis.errors import ResultsError
from documents import Finding

Factors = Mapping[str, str | float]


@dataclass(frozen=True, slots=True)
class Series:
    """One series: ``kind`` says how it was made (such as base, brighter, grey) and ``paint`` what it shows.

    ``levels`` holds one number for each of ``stimuli``: the value of the factor that rises along the series, or the
    place from 1 on.
    """

    name: str
    kind: str
    paint: str
    stimuli: tuple[str, ...]
    levels: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Design:
    """The series, and the factors that were taken for kind (``by``), paint (``across``) and levels (``along``).

    ``by`` None: they are all of the kind ``all``, or, if ``across`` is None too, each is a kind of its own. ``across``
    None: they all show one thing, with the empty name.
    ``along`` None: levels are places from 1 on.
    """

    series: tuple[Series, ...]
    by: str | None
    across: str | None
    along: str | None

    @property
    def kinds(self) -> tuple[str, ...]:
        """The kinds, each once, in the order of the series."""
        return tuple(dict.fromkeys(one.kind for one in self.series))

    @property
    def paints(self) -> tuple[str, ...]:
        """The paints, each once, in the order of the series."""
        return tuple(dict.fromkeys(one.paint for one in self.series))

    def levels(self, kind: str | None = None) -> tuple[float, ...]:
        """Return all levels of the series of one kind, or of all, rising."""
        return tuple(sorted({x for one in self.series if kind in (None, one.kind) for x in one.levels}))


def design(
    series: Mapping[str, tuple[str, ...]],
    factors: Mapping[str, Factors],
    *,
    by: str | None = None,
    across: str | None = None,
    along: str | None = None,
) -> Design:
    """Find out how ``series`` (stimuli by the series' name) hang together from their stimuli's ``factors``.

    What is left out is found: ``along`` is the first factor that is a number and rises strictly along every series;
    ``by`` is ``series`` if that is the same within each series, or else the last factor that is so and differs among
    them; ``across`` is ``paint``, or else the first further one of these.

    Raises
    ------
    ResultsError
        If a factor that is named does not do what it is named for.
    """
    names = list(dict.fromkeys(name for stimuli in series.values() for one in stimuli for name in factors[one]))
    rising = [name for name in names if all(_rises(name, stimuli, factors) for stimuli in series.values())]
    constant = [name for name in names if all(_is_constant(name, stimuli, factors) for stimuli in series.values())]
    telling = [name for name in constant if len({factors[stimuli[0]][name] for stimuli in series.values()}) > 1]
    along = _named(along, rising, "rises along every series") or next(iter(rising), None)
    by = _named(by, constant, "is the same within each series") or _found("series", constant, telling[::-1], across)
    across = _named(across, constant, "is the same within each series") or _found("paint", constant, telling, by)
    return Design(
        tuple(
            Series(
                name=name,
                kind=str(factors[stimuli[0]][by]) if by else "all" if across else name,
                paint="" if across is None else str(factors[stimuli[0]][across]),
                stimuli=stimuli,
                levels=tuple(
                    float(number + 1 if along is None else factors[one][along]) for number, one in enumerate(stimuli)
                ),
            )
            for name, stimuli in series.items()
        ),
        by,
        across,
        along,
    )


def _named(name: str | None, possible: Sequence[str], does: str) -> str | None:
    if name is not None and name not in possible:
        remedy = "one that does: " + ", ".join(possible) if possible else "leave it out"
        raise ResultsError(Finding(f"there is no factor '{name}' that {does}", remedy=remedy))
    return name


def _found(usual: str, constant: Sequence[str], telling: Sequence[str], taken: str | None) -> str | None:
    if usual in constant and usual != taken:
        return usual
    return next((name for name in telling if name not in (taken, "series", "paint")), None)


def _rises(name: str, stimuli: Sequence[str], factors: Mapping[str, Factors]) -> bool:
    values: list[float] = []
    for one in stimuli:
        value = factors[one].get(name)
        if isinstance(value, bool) or not isinstance(value, int | float):
            return False
        values.append(float(value))
    return all(one < other for one, other in pairwise(values))


def _is_constant(name: str, stimuli: Sequence[str], factors: Mapping[str, Factors]) -> bool:
    return all(name in factors[one] for one in stimuli) and len({factors[one][name] for one in stimuli}) == 1
