"""How measures are compared with observers, in Python and typed: here, so that help appears before numpy is there."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from analysis.choices import Adjust, Filter
from documents.options import Typed


@dataclass(frozen=True, slots=True)
class AgreementOptions:
    """How measures are compared with observers, and what is written.

    Attributes
    ----------
    photographs
        Stimulus that the others are measured against, or FACTOR=LEVEL for one in each group; repeat for several.
        Default: the experiment's reference picture.
    limits
        Limit within which the measure sees no difference; repeat for each measure. Default: delta-e-2000=1.4, that of
        compare.
    task
        Answers to compare with: pairs, series, ratings or ratings:SCALE. Default: the first that there are.
    rule
        Which observers to leave out.
    alpha
        Significance level. Default: the experiment's.
    adjust
        Correction for the number of pairs. Default: the experiment's.
    experiment
        Experiment file of the results. Default: experiments/NAME.yaml, or the study that holds them.
    page
        HTML page to write, with figures.
    csv_folder
        Folder for the tables as CSV.
    """

    photographs: Annotated[tuple[str, ...], Typed("--photograph", "STIMULUS")] = ()
    limits: Annotated[
        Mapping[str, float], Typed("--limit", "MEASURE=VALUE", read="extensions.agreement.options.limit_of")
    ] = field(default_factory=dict)
    task: Annotated[str | None, Typed(metavar="TASK")] = None
    rule: Filter = field(default_factory=Filter)
    alpha: float | None = None
    adjust: Adjust | None = None
    experiment: Path | None = None
    page: Annotated[Path | None, Typed("-o --output")] = None
    csv_folder: Annotated[Path | None, Typed("--csv")] = None


def limit_of(text: str) -> tuple[str, float]:
    """Return a measure and its limit, written as ``flip=0.05``; ValueError for anything else."""
    measure, _, number = text.rpartition("=")
    try:
        limit = float(number)
    except ValueError:
        limit = math.nan
    if not measure or not math.isfinite(limit):
        raise ValueError(f"'{text}' is no limit of a measure, such as flip=0.05")
    return measure, limit
