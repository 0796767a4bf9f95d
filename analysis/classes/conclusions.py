"""One line a question: what was estimated, what is concluded of it, and how robust that is.

Page, terminal, JSON and Methods read this form. That a difference is not significant is called *not distinguished*: it
may be there all the same. Only a test against a margin says *equivalent*.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal

from documents.text import JsonResult

Verdict = Literal["distinguished", "not distinguished", "equivalent"]
LEVEL = 0.05
MAJORITY = 0.5


def verdict_of(differs: bool) -> Verdict:
    """Return what people read of a test: that a difference is significant, or that it may be there all the same."""
    return "distinguished" if differs else "not distinguished"


def p_words(p: float) -> str:
    """Return a p value as "p = 0.012" or "p < 0.001"."""
    return "p < 0.001" if p < 0.001 else f"p = {p:.3f}"


@dataclass(frozen=True, slots=True)
class Conclusion(JsonResult):
    """The answer to one question.

    Attributes
    ----------
    question
        What was asked, such as "a over b" or "effect of 'view'".
    verdict, p
        What is concluded, and the p value that it follows from, after the correction for the number of tests; None
        without a test.
    by_observers
        Whether p and interval have the observer as the unit; if not, they treat all answers as independent.
    estimate, low, high
        In ``unit``, with the ends of its 95 % interval, which stands for itself. None where the question is about
        several numbers at once, and an end where none is known.
    unit
        Such as "JND" or "nats".
    margin
        Of items that are equivalent: within what, such as "0.5jnd".
    stands, others
        Share (0 to 1) of other analyses, such as "744 analyses", that conclude the same; None where there are none.
    p_independent
        Beside a ``p`` by observers, the one that treats all answers as independent; None where there is none.
    """

    question: str
    verdict: Verdict | None
    p: float | None
    by_observers: bool
    estimate: float | None = None
    low: float | None = None
    high: float | None = None
    unit: str = ""
    margin: str = ""
    stands: float | None = None
    others: str = ""
    p_independent: float | None = None

    @property
    def basis(self) -> str:
        """What the interval and p take for independent, in words."""
        return "by observers" if self.by_observers else "if all answers were independent"

    @property
    def verdict_words(self) -> str:
        """The verdict, with the margin of items that are equivalent."""
        return f"equivalent within ± {self.margin}" if self.verdict == "equivalent" else self.verdict or "not tested"

    @property
    def robustness(self) -> str:
        """How often the conclusion stands, in words; empty where there are no other analyses."""
        if self.stands is None:
            return ""
        return f"stands in {'only ' * (self.stands < MAJORITY)}{100 * self.stands:.0f} % of {self.others}"

    @property
    def sentence(self) -> str:
        """Estimate, interval, verdict and robustness in a sentence."""
        parts = []
        if self.estimate is not None:
            parts.append(f"{_fixed(self.estimate)} {self.unit}".rstrip() + self._ends)
        parts.append(self.verdict_words + ("" if self.p is None else f" ({p_words(self.p)} {self.basis})"))
        parts += [self.robustness] if self.robustness else []
        return f"{self.question}: {', '.join(parts)}."

    @property
    def _ends(self) -> str:
        return f" (95 %: {self.interval})" if self.interval else ""

    @property
    def interval(self) -> str:
        """The ends of the interval in words, of one that has no upper end too; empty without an interval."""
        if self.low is None:
            return ""
        return f"at least {_fixed(self.low)}" if self.high is None else f"{_fixed(self.low)} to {_fixed(self.high)}"


def concluded(question: str, by_observers: float | None, independent: float | None, level: float = LEVEL) -> Conclusion:
    """Return the conclusion of a test from its two p values: by observers where there is one."""
    p = independent if by_observers is None else by_observers
    verdict = None if p is None else verdict_of(p <= level)
    beside = None if by_observers is None else independent
    return Conclusion(question, verdict, p, by_observers is not None, p_independent=beside)


def with_shares(
    conclusions: Iterable[Conclusion], others: Iterable[Conclusion], level: float = LEVEL
) -> tuple[Conclusion, ...]:
    """Return ``conclusions``, each with the share of analyses that conclude the same: its own and those of ``others``.

    Each p value of a conclusion at ``level`` is an analysis, also the one that treats all answers as independent.
    """
    mine = tuple(conclusions)
    analyses: dict[str, list[Verdict]] = {}
    for one in (*mine, *others):
        found = [verdict_of(p <= level) for p in (one.p, one.p_independent) if p is not None]
        analyses.setdefault(one.question, []).extend(found)
    return tuple(_with_share(one, analyses[one.question]) for one in mine)


def _with_share(one: Conclusion, verdicts: list[Verdict]) -> Conclusion:
    if one.verdict is None:
        return one
    share = verdicts.count(one.verdict) / len(verdicts)
    return replace(one, stands=share, others=f"{len(verdicts):,} analyses")


def _fixed(value: float) -> str:
    return f"{value:.2f}".replace("-", "−")
