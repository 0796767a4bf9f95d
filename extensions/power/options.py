"""What is assumed of a study that is planned, and how its power is found: the options, in Python and typed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from analysis.choices import REPLICATES, SEED, TARGET, Interval
from documents.options import Typed
from runner.reports import ClassOptions

_MOST_NUMBERS, _MOST_OBSERVERS = 1000, 100_000


def numbers_of(text: str) -> tuple[int, ...]:
    """Return numbers of observers, ascending, each once: 30, or 10,20,40, or 10:60:5 for 10 to 60 in steps of 5.

    Raises
    ------
    ValueError
        If the text is anything else, or too many are asked for.
    """
    chosen: set[int] = set()
    for part in text.split(","):
        ends = part.split(":")
        if not all(end.strip().isdecimal() for end in ends) or len(ends) > 3:
            raise ValueError(f"'{part}' is neither a number nor a range such as 10:60:5")
        if any(len(end.strip()) > len(str(_MOST_OBSERVERS)) for end in ends):
            raise ValueError(f"there are {_MOST_OBSERVERS} observers at most")
        numbers = [int(end) for end in ends]
        first, last, step = numbers[0], numbers[min(1, len(ends) - 1)], numbers[2] if len(ends) == 3 else 1
        if first < 1 or not first <= last <= _MOST_OBSERVERS or step < 1:
            raise ValueError(f"'{part}' is not a number of observers")
        if (last - first) // step >= _MOST_NUMBERS:
            raise ValueError(f"'{part}' has more than {_MOST_NUMBERS} numbers")
        chosen |= set(range(first, last + 1, step))
    return tuple(sorted(chosen))


@dataclass(frozen=True, slots=True)
class PowerOptions(ClassOptions):
    """What is assumed about stimuli and observers, and how studies are simulated and tested.

    Attributes
    ----------
    observers
        Numbers of observers: 30, or first:last:step.  [default: 10:60:5]
    replicates
        Number of simulated studies for each number of observers.
    scores
        Assumed scores: a file of simulated observers, results or a table of a pilot study, or the JSON of `cyclopean
        scores`.
    simulate
        File of simulated observers: their scores and lapses.
    spread_nats
        Assume evenly spaced scores over so many nats. Default without a file: 2.
    observer_sd
        Standard deviation between observers of each stimulus's log score, in nats. Default: that of --scores or
        --observers-from, or 0.7, with a note.
    observers_from
        Results, or a table TABLE.csv with observers, that say how much observers differ.
    with_simulated
        Count simulated observers beside people in results; without it they count only where nobody else answered.
    keep_na
        Take NA, NaN, None and the like in a table for names; without it they are missing values.
    lapse_rate
        Share of random answers. Default: that of --simulate, or 0.
    pairs
        Pair of stimuli that matters; repeat for each.
    target
        Power that each of these pairs should reach.
    interval
        Intervals from standard errors, or by bootstrap over observers in each study (slow).
    seed
        Random seed; the same seed gives the same result.
    scheduler
        Address of a Dask scheduler, such as tcp://10.0.0.5:8786.
    workers
        Number of local processes. Default: as many as are useful.
    page
        HTML page to write, with curves and tables.
    table
        CSV file to write, with every value; a dash for the terminal.
    """

    observers: Annotated[Sequence[int], Typed(metavar="NUMBERS", read="extensions.power.options.numbers_of")] = tuple(
        range(10, 61, 5)
    )
    replicates: Annotated[int, Typed(least=2)] = REPLICATES
    scores: Path | None = None
    simulate: Path | None = None
    spread_nats: Annotated[float | None, Typed("--spread")] = None
    observer_sd: float | None = None
    observers_from: Path | None = None
    with_simulated: bool = False
    keep_na: bool = False
    lapse_rate: float | None = None
    pairs: Annotated[tuple[tuple[str, str], ...], Typed("--pair", "A B")] = ()
    target: Annotated[float, Typed("--power")] = TARGET
    interval: Interval = "wald"
    seed: Annotated[int, Typed(least=0, most=1e40)] = SEED
    scheduler: Annotated[str | None, Typed(metavar="ADDRESS")] = None
    workers: Annotated[int | None, Typed(least=1)] = None
    page: Annotated[Path | None, Typed("-o --output")] = None
    table: Annotated[Path | None, Typed("--csv")] = None
