"""How results are reported and exported, and the power of an experiment found: the options, in Python and typed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from analysis.choices import REPLICATES, SEED, TARGET, Adjust, CovarianceChoice, DistancePrior, Filter, Interval, Model
from documents.options import Typed


@dataclass(frozen=True, slots=True, kw_only=True)
class ClassOptions:
    """How perceptual classes are made, where not as the experiment says.

    Attributes
    ----------
    alpha
        Significance level for a difference between two stimuli. Default: the experiment's.
    adjust
        Correction for multiple comparisons. Default: the experiment's.
    covariance
        Standard errors from the model, or clustered by observer. Default: the experiment's.
    """

    alpha: float | None = None
    adjust: Adjust | None = None
    covariance: CovarianceChoice | None = None


@dataclass(frozen=True, slots=True)
class ReportOptions(ClassOptions):
    """How results are reported.

    Attributes
    ----------
    rule
        Which observers to leave out.
    part
        Make only this part of the report, such as series, ratings, preferences, thresholds or vision.
    experiment
        Experiment file, for pictures of the stimuli and facts for Methods. Default: experiments/NAME.yaml.
    pictures
        Show the stimuli on the page, if they are in the cache.
    pdf
        Also print the page to PDF, beside it; needs Chromium or Chrome.
    csv_folder
        Folder for the tables as CSV.
    figure_folder
        Folder for the figures, each as SVG and as PDF.
    replace
        With --figures, replace figures that are there already.
    """

    rule: Filter = field(default_factory=Filter)
    part: Annotated[str | None, Typed(metavar="NAME")] = None
    experiment: Path | None = None
    pictures: Annotated[bool, Typed("--thumbnails/--no-thumbnails")] = True
    pdf: bool = False
    csv_folder: Annotated[Path | None, Typed("--csv")] = None
    figure_folder: Annotated[Path | None, Typed("--figures")] = None
    replace: bool = False


@dataclass(frozen=True, slots=True)
class About:
    """What a dataset says of itself, and whose sessions are in it.

    Attributes
    ----------
    name
        Name of the dataset. Default: the experiments' names.
    authors
        Author of the dataset; repeat for each.
    license
        Licence of the dataset, such as CC0 or CC-BY-4.0.
    with_simulated
        Export simulated observers beside people; without it they are exported only where nobody else answered.
    facts
        What a paper must say of each experiment and no log can, by the code of the item.
    """

    name: str | None = None
    authors: Annotated[tuple[str, ...], Typed("--author")] = ()
    license: str | None = None
    with_simulated: bool = False
    facts: Mapping[str, Mapping[str, str]] = field(default_factory=dict)


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

    observers: Annotated[Sequence[int], Typed(metavar="NUMBERS", read="runner.reports.options.numbers_of")] = tuple(
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


@dataclass(frozen=True, slots=True)
class ScoresOptions:
    """How a table of paired comparisons is read, and its items are scored.

    Attributes
    ----------
    layout
        Layout of the table: winner-loser, pwcmp, items, options, matrix or trials. Default: by its columns.
    choice_codes
        What the column of choices has for the first option, the second and so on, and then for neither, with commas
        between.
    keep_na
        Take NA, NaN, None and the like for names; without it they are missing values, whose lines are left out.
    alpha
        Significance level for a difference between two items.
    adjust
        Correction for multiple comparisons. Default: holm; none with --method pwcmp.
    model
        Model of the answers; davidson and rao-kupper have ties, thurstone (Case V) gives JOD. Default: bradley-terry;
        thurstone with --method pwcmp.
    method
        Auto: maximum likelihood (ml), or Firth's penalty (firth) where some items always win. Or a Gaussian prior
        (map), or JOD as pwcmp has them.
    jod_zero
        Item at 0 JOD with --method pwcmp. Default: the table's first item.
    distance_prior
        pwcmp's prior on distances: that of its present version (gaussian), that of 2017, or none. Default: gaussian.
    prior_sd
        Standard deviation of the prior on each log score. Default with map: 2.
    order_effect
        Fit the advantage of being shown first; needs the column 'first'.
    covariance
        Standard errors: model takes all answers for independent, the others only observers. Auto: shrinkage where the
        table names observers.
    quasi_variances
        Add an error bar for each item whose squares add up for the difference of any two.
    pairs
        Add the probability that each item is preferred over each other one.
    margin
        Test each pair for equivalence within a margin: 0.5jnd, 55:45 or 0.2nats.
    checks
        Check the model: transitivity, badly fitted pairs, and how well each model predicts new observers.
    multiverse
        Repeat the analysis by every model, covariance and correction, and without each observer.
    observers
        random: observers differ, as drawn from a distribution; scores of the typical one, and a new one's answers.
    observer_scores
        File of each observer's scores to write; with --observers random.
    """

    layout: Annotated[str | None, Typed(metavar="NAME")] = None
    choice_codes: Annotated[str | Sequence[str] | None, Typed(metavar="A,B,TIE")] = None
    keep_na: bool = False
    alpha: float = 0.05
    adjust: Adjust | None = None
    model: Model | None = None
    method: Literal["auto", "ml", "firth", "map", "pwcmp"] = "auto"
    jod_zero: Annotated[str | None, Typed(metavar="ITEM")] = None
    distance_prior: DistancePrior | None = None
    prior_sd: float | None = None
    order_effect: bool = False
    covariance: CovarianceChoice = "auto"
    quasi_variances: bool = False
    pairs: bool = False
    margin: Annotated[str | None, Typed(metavar="MARGIN")] = None
    checks: bool = False
    multiverse: bool = False
    observers: Literal["alike", "random"] = "alike"
    observer_scores: Annotated[Path | None, Typed(metavar="FILE.csv")] = None

    @property
    def codes(self) -> tuple[str, ...]:
        """The texts of ``choice_codes``, none without."""
        given = self.choice_codes or ()
        return tuple(code.strip() for code in (given.split(",") if isinstance(given, str) else given))
