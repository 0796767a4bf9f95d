"""The choices in the records of sessions, and the design of the series.

The design names the factors of the stimuli that distinguish the series, and the factor that rises along them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from analysis.errors import ResultsError
from analysis.kinds.best_of_series import BestOfSeriesRecord
from analysis.records.results import damaged, refuse_mixtures
from analysis.records.session_record import SessionLog
from analysis.records.times import in_time
from documents import Finding

Factors = Mapping[str, str | float]


@dataclass(frozen=True, slots=True)
class Series:
    """One series: ``kind`` is how it was made (such as base, brighter, grey) and ``paint`` what it shows.

    ``levels`` has a number for each of ``stimuli``: the value of the factor that rises along the series, or the
    position, from 1.
    """

    name: str
    kind: str
    paint: str
    stimuli: tuple[str, ...]
    levels: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Design:
    """The series, and the factors that are used for kind (``by``), paint (``across``) and levels (``along``).

    ``by`` None: all series are of the kind ``all``, or, if ``across`` is None too, each is a kind of its own.
    ``across`` None: all series have the same paint, with an empty name. ``along`` None: levels are positions from 1.
    """

    series: tuple[Series, ...]
    by: str | None
    across: str | None
    along: str | None

    @property
    def kinds(self) -> tuple[str, ...]:
        """The kinds, each once, in the order of the series."""
        return tuple(dict.fromkeys(series.kind for series in self.series))

    @property
    def paints(self) -> tuple[str, ...]:
        """The paints, each once, in the order of the series."""
        return tuple(dict.fromkeys(series.paint for series in self.series))

    def levels(self, kind: str | None = None) -> tuple[float, ...]:
        """Return all levels of the series of one kind, or of all, rising."""
        return tuple(sorted({x for series in self.series if kind in (None, series.kind) for x in series.levels}))


def design(
    series: Mapping[str, tuple[str, ...]],
    factors: Mapping[str, Factors],
    *,
    by: str | None = None,
    across: str | None = None,
    along: str | None = None,
) -> Design:
    """Return the design of ``series`` (stimuli by the series' name) from their stimuli's ``factors``.

    Without names, ``along`` is the first numerical factor that rises strictly along every series; ``by`` is ``series``
    if that is constant within each series, else the last factor that is constant within and differs between series;
    ``across`` is ``paint``, else the first further factor of that sort.

    Raises
    ------
    ResultsError
        If a named factor cannot be used as named.
    """
    names = list(
        dict.fromkeys(name for stimuli in series.values() for stimulus in stimuli for name in factors[stimulus])
    )
    rising = [name for name in names if all(_rises(name, stimuli, factors) for stimuli in series.values())]
    constant = [name for name in names if all(_is_constant(name, stimuli, factors) for stimuli in series.values())]
    distinguishing = [name for name in constant if len({factors[stimuli[0]][name] for stimuli in series.values()}) > 1]
    along = _named(along, rising, "rises along every series") or next(iter(rising), None)
    by = _named(by, constant, "is the same within each series") or _usual_factor(
        "series", constant, distinguishing[::-1], across
    )
    across = _named(across, constant, "is the same within each series") or _usual_factor(
        "paint", constant, distinguishing, by
    )
    return Design(
        tuple(
            Series(
                name=name,
                kind=str(factors[stimuli[0]][by]) if by else "all" if across else name,
                paint="" if across is None else str(factors[stimuli[0]][across]),
                stimuli=stimuli,
                levels=tuple(
                    float(number + 1 if along is None else factors[stimulus][along])
                    for number, stimulus in enumerate(stimuli)
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


def _usual_factor(usual: str, constant: Sequence[str], distinguishing: Sequence[str], taken: str | None) -> str | None:
    if usual in constant and usual != taken:
        return usual
    return next((name for name in distinguishing if name not in (taken, "series", "paint")), None)


def _rises(name: str, stimuli: Sequence[str], factors: Mapping[str, Factors]) -> bool:
    values: list[float] = []
    for stimulus in stimuli:
        value = factors[stimulus].get(name)
        if isinstance(value, bool) or not isinstance(value, int | float):
            return False
        values.append(float(value))
    return all(low < high for low, high in pairwise(values))


def _is_constant(name: str, stimuli: Sequence[str], factors: Mapping[str, Factors]) -> bool:
    return (
        all(name in factors[stimulus] for stimulus in stimuli)
        and len({factors[stimulus][name] for stimulus in stimuli}) == 1
    )


KIND = "best_of_series"


@dataclass(frozen=True, slots=True)
class Choice:
    """An observer's choice from a series.

    Attributes
    ----------
    observer, series
        Indices into the observers and the series.
    index
        Index of the chosen picture, from 0.
    ratings, rating_times_s
        By the scale's name.
    dwell_s, visits
        For each picture of the series: for how long it was shown in total, and how often.
    response_time_s
        From the first picture's onset to the choice.
    """

    observer: int
    series: int
    index: int
    ratings: Mapping[str, float]
    rating_times_s: Mapping[str, float]
    dwell_s: tuple[float, ...]
    visits: tuple[int, ...]
    response_time_s: float

    @property
    def path_length(self) -> int:
        """How many pictures were shown, returns included."""
        return sum(self.visits)


@dataclass(frozen=True, slots=True)
class Choices:
    """All choices of one experiment.

    ``observers`` are sorted; ``choices`` are in the order of observers, series and time; ``scales`` names every scale
    with a rating.
    """

    design: Design
    observers: tuple[str, ...]
    scales: tuple[str, ...]
    choices: tuple[Choice, ...]

    @property
    def counts(self) -> NDArray[np.intp]:
        """Shape (observers, series): how often each observer chose from each series."""
        shape = len(self.observers), len(self.design.series)
        flat = [choice.observer * shape[1] + choice.series for choice in self.choices]
        counts = np.bincount(np.array(flat, dtype=np.intp), minlength=shape[0] * shape[1])
        return np.asarray(counts.reshape(shape), dtype=np.intp)

    @property
    def complete(self) -> tuple[int, ...]:
        """Indices of the observers who chose from every series at least once."""
        return tuple(np.flatnonzero((self.counts > 0).all(axis=1)).tolist())

    def rating_matrix(self, scale: str) -> NDArray[np.float64]:
        """Return each observer's mean rating of each series, shape (observers, series); NaN where there is none."""
        total, count = np.zeros(self.counts.shape), np.zeros(self.counts.shape)
        for choice in self.choices:
            if scale in choice.ratings:
                total[choice.observer, choice.series] += choice.ratings[scale]
                count[choice.observer, choice.series] += 1
        return np.asarray(np.divide(total, count, out=np.full(total.shape, np.nan), where=count > 0))


def gather(
    sessions: Sequence[SessionLog], *, by: str | None = None, across: str | None = None, along: str | None = None
) -> Choices:
    """Read the choices from the sessions of an experiment: each trial's last attempt, without practice.

    ``by``, ``across`` and ``along`` are factors of the stimuli, as in `analysis.series.choices.design`.

    Raises
    ------
    ResultsError
        If the sessions cannot be analysed together, have no choice or an inconsistent choice, or if a series has
        different pictures in two sessions.
    """
    refuse_mixtures(sessions)
    factors: dict[str, Factors] = {**sessions[0].header.factors}
    trials = [(session, trial) for session in in_time(sessions) for trial in session.of(BestOfSeriesRecord)]
    if not trials:
        files = ", ".join(str(session.file) for session in sessions[:3])
        raise ResultsError(
            Finding("the results hold no choice from a series", files, remedy="answer some trials first")
        )
    names = _names([(session, trial, trial.series, trial.stimuli) for session, trial in trials])
    series = {names[trial.block, trial.series, trial.stimuli]: trial.stimuli for _, trial in trials}
    place = {name: number for number, name in enumerate(factors)}
    ordered = dict(sorted(series.items(), key=lambda item: (place[item[1][0]], item[0])))
    observers = tuple(sorted({session.header.observer for session, _ in trials}))
    numbers = {name: number for number, name in enumerate(ordered)}
    people = {name: number for number, name in enumerate(observers)}
    choices = [
        _choice(trial, people[session.header.observer], numbers[names[trial.block, trial.series, trial.stimuli]])
        for session, trial in trials
    ]
    choices.sort(key=lambda choice: (choice.observer, choice.series))
    scales = sorted({scale for choice in choices for scale in choice.ratings})
    known = [scale for scale in ("similarity", "difficulty") if scale in scales]
    scales = known + [scale for scale in scales if scale not in known]
    whole = design(ordered, factors, by=by, across=across, along=along)
    return Choices(whole, observers, tuple(scales), tuple(choices))


def _names(
    shown: Sequence[tuple[SessionLog, BestOfSeriesRecord, str, tuple[str, ...]]],
) -> dict[tuple[int, str, tuple[str, ...]], str]:
    """Return what a series is called, by block, recorded name and pictures.

    Where a name stands for other pictures in another block, each has the numbers of its blocks added.

    Raises
    ------
    ResultsError
        If one block shows other pictures under a name in another session.
    """
    where: dict[str, dict[tuple[str, ...], dict[int, SessionLog]]] = {}
    in_one_session: dict[tuple[Path, int, str], set[tuple[str, ...]]] = {}
    for session, trial, name, stimuli in shown:
        where.setdefault(name, {}).setdefault(stimuli, {}).setdefault(trial.block, session)
        in_one_session.setdefault((session.file, trial.block, name), set()).add(stimuli)
    # Factors may have made two series of one name in one block: a session then shows both.
    twice = {(block, name) for (_, block, name), both in in_one_session.items() if len(both) > 1}
    for session, trial, name, stimuli in shown:
        for other, blocks in where[name].items():
            if other != stimuli and trial.block in blocks and (trial.block, name) not in twice:
                raise _other_pictures(session, trial, name, blocks[trial.block])
    labels: dict[tuple[int, str, tuple[str, ...]], str] = {}
    for name, by_stimuli in where.items():
        for stimuli, blocks in by_stimuli.items():
            label = name if len(by_stimuli) == 1 else f"{name} ({_in_words(sorted(blocks))})"
            if any((block, name) in twice for block in blocks):
                label = f"{label[:-1]}, {stimuli[0]} to {stimuli[-1]})"
            labels |= {(block, name, stimuli): label for block in blocks}
    return labels


def _other_pictures(session: SessionLog, trial: BestOfSeriesRecord, name: str, other: SessionLog) -> ResultsError:
    what = f"shows other pictures as '{name}' than {other.file}"
    if session.header.hashes.get("experiment") == other.header.hashes.get("experiment"):
        return damaged(session, trial, what)
    remedy = "the experiment was changed between them: report the sessions before and after that separately"
    where = f"the trial {trial.trial} of block {trial.block}"
    return ResultsError(Finding(f"{where} {what}", str(session.file), remedy=remedy))


def _in_words(blocks: Sequence[int]) -> str:
    return f"block{'s' * (len(blocks) > 1)} {', '.join(str(block + 1) for block in blocks)}"


def _choice(trial: BestOfSeriesRecord, observer: int, series: int) -> Choice:
    ratings = {name: float(value) for name, value in trial.ratings.items()}
    visits = Counter(place for place, _ in trial.path)
    shown = tuple(visits[place] for place in range(len(trial.members)))
    times_s, dwell_s = trial.rating_times_s, tuple(trial.dwell_s)
    return Choice(observer, series, trial.chosen_index, ratings, times_s, dwell_s, shown, trial.response_time_s)
