"""What a report says of trials of a kind beside comparisons of pairs: one form for all, which the kind's file names."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from analysis.classes.conclusions import Conclusion
from analysis.kinds.kinds import KINDS
from analysis.records.session_record import SessionLog
from analysis.report.checks import FailedCheck
from analysis.report.references import Citations
from analysis.scaling.robust_tests import SEED, draws_for
from analysis.series import observer_means
from documents.pages import Section


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A ``result``, and what is said of it.

    Attributes
    ----------
    key
        Under which the result stands in JSON; without one there is none.
    sentences, notes
        What stands in the page's head: the numbers of observers and answers, and what a reader needs before them.
    sections
        Returns the part's sections, with the pictures to show beside stimuli.
    failed, conclusions
        The checks that failed, and what is concluded.
    task, analysis, draws, p_values, families, effects
        What Methods say of it: what observers did besides, how it was computed (with the works that are cited), the
        random draws, the p values that count, families of tests, and effect sizes.
    observers, vision
        Returns the sections that follow the table of observers; what Methods say of the observers' vision.
    """

    key: str = ""
    result: Any = None
    sentences: Sequence[str] = ()
    sections: Callable[[Mapping[str, str]], Sequence[Section]] = lambda pictures: ()
    analysis: Callable[[Citations], str] = lambda cited: ""
    effects: str = ""
    notes: Sequence[str] = ()
    failed: Sequence[FailedCheck] = ()
    conclusions: Callable[[], Iterable[Conclusion]] = tuple
    task: Sequence[str] = ()
    draws: Sequence[str] = ()
    p_values: Sequence[str] = ()
    families: Sequence[str] = ()
    observers: Callable[[], Iterable[Section]] = tuple
    vision: str = ""


def draws_of_means() -> str:
    """Say how many random draws an interval of means over observers makes."""
    return (
        f"{observer_means.REPLICATES:,} bootstrap samples of the observers for each interval of means "
        f"(seed {observer_means.SEED})"
    )


def draws_of_weights(observers: int) -> str:
    """Say how many random draws a test by bootstrap over observers makes."""
    return f"{draws_for(observers):,} draws for each test by bootstrap over observers (seed {SEED})"


def parts_of(sessions: Sequence[SessionLog]) -> tuple[Part, ...]:
    """Return the parts that have answers in ``sessions``, in the order of the kinds that name them."""
    named = dict.fromkeys(filter(None, (record.report_part for record in KINDS.values())))
    found = (
        getattr(import_module(module), name)(sessions) for module, _, name in (each.partition(":") for each in named)
    )
    return tuple(part for part in found if part is not None)
