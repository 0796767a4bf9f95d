"""How results are reported and exported: the options, in Python and typed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from analysis.choices import Adjust, CovarianceChoice, DistancePrior, Filter, Model
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
    method: Literal["auto", "ml", "firth", "map", "pwcmp"] | str = "auto"  # another package may have it
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
    def way(self) -> str:
        """The name of how items are scored, as `METHODS` has it."""
        return self.method if self.observers == "alike" else f"observers.{self.observers}"

    @property
    def codes(self) -> tuple[str, ...]:
        """The texts of ``choice_codes``, none without."""
        given = self.choice_codes or ()
        return tuple(code.strip() for code in (given.split(",") if isinstance(given, str) else given))
