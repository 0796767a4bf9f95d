"""What a report says of trials of a kind beside comparisons of pairs: one form for all, which the kind's file names."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from analysis.classes.conclusions import Conclusion
from analysis.comparisons.comparisons import Comparisons
from analysis.errors import ResultsError
from analysis.kinds.kinds import KINDS
from analysis.records.lines import Header
from analysis.records.session_record import SessionLog
from analysis.report.checks import FailedCheck
from analysis.report.references import Citations
from analysis.scaling.robust_tests import SEED, draws_for
from analysis.series import observer_means
from documents import Finding
from documents.extensions import ExtensionError, Registry
from documents.pages import Section
from documents.text import did_you_mean


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
    again
        Asks its questions of other answers, of fewer observers: how robust the conclusions are; None where it is not
        said. ``cautions`` stand beside them.
    task, analysis, draws, p_values, families, effects
        What Methods say of it: what observers did besides, how it was computed (with the works that are cited), the
        random draws, the p values that count, families of tests, and effect sizes.
    observers, vision
        Returns the sections that follow the table of observers; what Methods say of the observers' vision.
    by_observers
        Whether a test of pairs that were compared has the observer as its unit, by a bootstrap.
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
    again: Callable[[Comparisons], Iterable[Conclusion]] | None = None
    cautions: Sequence[str] = ()
    task: Sequence[str] = ()
    draws: Sequence[str] = ()
    p_values: Sequence[str] = ()
    families: Sequence[str] = ()
    observers: Callable[[], Iterable[Section]] = tuple
    vision: str = ""
    by_observers: bool = False


def draws_of_means() -> str:
    """Say how many random draws an interval of means over observers makes."""
    return (
        f"{observer_means.REPLICATES:,} bootstrap samples of the observers for each interval of means "
        f"(seed {observer_means.SEED})"
    )


def draws_of_weights(observers: int) -> str:
    """Say how many random draws a test by bootstrap over observers makes."""
    return f"{draws_for(observers):,} draws for each test by bootstrap over observers (seed {SEED})"


def _fits(name: str, kind: object) -> str | None:
    return None if callable(kind) else "is no function that returns a part"


# By the name that a kind of record has for it.
PARTS: Registry[Callable[[Sequence[SessionLog]], Part | None]] = Registry(
    "cyclopean.report_parts",
    {
        "ratings": "analysis.report.ratings:ratings_part",
        "preferences": "analysis.report.ratings:preferences_part",
        "series": "analysis.report.series:series_part",
    },
    _fits,
)
# Of pairs that were compared and have scores; each is asked of every report.
SCALE_PARTS: Registry[Callable[[Comparisons, Header], Part | None]] = Registry("cyclopean.scale_parts", {}, _fits)


def parts_of(
    sessions: Sequence[SessionLog], taken: Callable[[], Collection[str]] = tuple, only: str = ""
) -> tuple[tuple[Part, ...], tuple[FailedCheck, ...]]:
    """Return the parts that have answers in ``sessions``, in the order of the kinds that name them.

    A part of another package that cannot be made, or whose key is another's or one that ``taken`` returns, is a failed
    check, and the others stay as they are. ``only`` is the name of the one that is made, where not all are.

    Raises
    ------
    ResultsError
        If no trial of the sessions names ``only``.
    """
    names = dict.fromkeys(record.report_part for record in KINDS.values())
    if only:
        there = sorted({trial.report_part for session in sessions for trial in session.trials} - {""})
        if only not in there:
            remedy = did_you_mean(only, there) if there else "leave it out"
            raise ResultsError(Finding(f"the results have no part '{only}'", remedy=remedy))
        names = {only: None}
    return _made(PARTS, filter(None, names), taken, sessions)


def scale_parts_of(
    comparisons: Comparisons, header: Header, taken: Callable[[], Collection[str]]
) -> tuple[tuple[Part, ...], tuple[FailedCheck, ...]]:
    """Return the parts that are asked of pairs that were compared, and what failed as `parts_of` does."""
    return _made(SCALE_PARTS, SCALE_PARTS.every(), taken, comparisons, header)


def _made(
    registry: Registry[Any], names: Iterable[str], taken: Callable[[], Collection[str]], *of: Any
) -> tuple[tuple[Part, ...], tuple[FailedCheck, ...]]:
    parts: list[Part] = []
    failed = []
    for name in names:
        try:
            part = _part(registry, name, taken, [one.key for one in parts], *of)
        except ExtensionError as error:
            finding = error.findings[0]
            failed.append(FailedCheck(f"The part '{name}' of the report", finding.message, finding.remedy or ""))
        else:
            parts += [part] if part is not None else []
    return tuple(parts), tuple(failed)


def _part(
    registry: Registry[Any], name: str, taken: Callable[[], Collection[str]], others: Collection[str], *of: Any
) -> Part | None:
    with registry.blamed(name):
        part: Part | None = registry.wanted(name, "part of the report")(*of)
        # What another package's says later is tried here, where the package can be named.
        if part is not None and registry.offer(name):
            if part.key and part.key in {*others, *taken()}:
                raise ValueError(f"its key '{part.key}' is taken")
            part.sections({}), part.analysis(Citations()), tuple(part.conclusions())
    return part
