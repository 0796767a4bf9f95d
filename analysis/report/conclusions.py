"""The questions of a study and what is concluded of each, in one form; the first is the page's headline.

How robust an answer is: for a pair, the share of the other analyses of its scores that conclude the same, or of
bootstrap samples where these cannot be made; for the rest, of the analyses without each observer, and with all answers
taken for independent.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from analysis.classes.conclusions import Conclusion, with_shares
from analysis.comparisons.comparisons import Comparisons, without_each
from analysis.errors import ResultsError
from analysis.inference.conclusions import neighbour_conclusions
from analysis.report.reviewers import Review, stands_cell
from analysis.report.summary import Summary
from analysis.scaling.grouped import score_groups
from documents.pages import Block, Column, Paragraph, Section, Table

if TYPE_CHECKING:
    from analysis.report.grouped import GroupedSummary
    from analysis.report.report import Report

MOST_ITEMS = 200
MOST_OPEN = 8
Asked = Callable[[Comparisons], Iterable[Conclusion]]


def conclusions_of(report: Report) -> tuple[Conclusion, ...]:
    """Return what is concluded of each question: the best stimulus and the next, then all but pairs, then these."""
    pairs: list[Conclusion] = []
    others: list[Conclusion] = []
    if report.pairs is not None:
        pairs += neighbours(report.pairs, report.review)
    if report.groups is not None:
        pairs += _neighbours_in_groups(report.groups, report.group_reviews)
        others += _of_agreement(report.groups)
    compared = report.pairs or report.groups
    for part in report.scale_parts:
        own = part.conclusions()
        others += _robust(own, compared.comparisons, part.again) if compared and part.again else own
    for part in report.parts:
        others += part.conclusions()
    return (*pairs[:1], *others, *pairs[1:])


def neighbours(summary: Summary, review: Review) -> Iterator[Conclusion]:
    """Yield what is concluded of each stimulus and the next in rank, best first."""
    scores = summary.scores
    if scores.classes is None or len(scores.items) > MOST_ITEMS:
        return
    yield from neighbour_conclusions(scores, review, summary.estimate.stability)


def _neighbours_in_groups(grouped: GroupedSummary, reviews: Mapping[str, Review]) -> Iterator[Conclusion]:
    for name, part in grouped.scales:
        for one in neighbours(part, reviews.get(name, {})):
            yield replace(one, question=f"{name}: {one.question}")


def _of_agreement(grouped: GroupedSummary) -> tuple[Conclusion, ...]:
    def asked(answers: Comparisons) -> Iterator[Conclusion]:
        common = {item: name for item, name in grouped.common.items() if item in answers.items}
        test = score_groups(answers, common=common, covariance="model").agreement
        if test is not None:
            yield test.conclusion(grouped.alpha)

    test = grouped.scored.agreement
    return _robust([test.conclusion(grouped.alpha)], grouped.comparisons, asked, grouped.alpha) if test else ()


def _robust(
    conclusions: Iterable[Conclusion], comparisons: Comparisons, asked: Asked, level: float = 0.05
) -> tuple[Conclusion, ...]:
    """Return ``conclusions`` with the share of analyses without each observer that conclude the same."""
    others: list[Conclusion] = []
    for answers in without_each(comparisons):
        try:
            others += asked(answers)
        except ResultsError:
            continue  # without this observer nothing can be fitted
    return with_shares(conclusions, others, level)


def conclusions_section(conclusions: tuple[Conclusion, ...], cautions: Sequence[str] = ()) -> Section | None:
    """Return the questions with their answers, and what to bear in mind of effects; None without any."""
    if not conclusions:
        return None
    bases = {one.by_observers for one in conclusions}
    mixed = len(bases) > 1
    columns = [
        Column("Question", "question"),
        Column("Estimate", "estimate", "number", 2),
        Column("Unit", "unit"),
        Column("95 %", "interval", "interval", 2),
        Column("Verdict", "verdict"),
        Column("p", "p", "p"),
        *([Column("By", "by")] if mixed else []),
        Column("Stands in", "stands"),
    ]
    rows = tuple(
        (
            one.question,
            one.estimate,
            one.unit or None,
            (one.low, one.high),
            one.verdict_words,
            one.p,
            *(["observers" if one.by_observers else "answers"] if mixed else []),
            stands_cell(one),
        )
        for one in conclusions
    )
    basis = "" if mixed else f", {conclusions[0].basis}"
    first = Table("conclusions", f"One line a question{basis}", tuple(columns), rows[:MOST_OPEN])
    rest = Table("conclusions_further", "Further questions", tuple(columns), rows[MOST_OPEN:], folded=True)
    words = (
        "Not distinguished: the difference may be there all the same. The verdict is by p, which is corrected for the "
        "number of tests; each interval stands for itself. Both have the observers as their unit, or the answers where "
        "there are too few observers. A conclusion stands in the share of other analyses of the same answers that "
        "conclude the same: of pairs, by every law, kind of standard errors and correction, and without each observer; "
        "of the rest, without each observer, and with all answers taken for independent. Shares are no probabilities."
    )
    return Section(
        "conclusions",
        "Conclusions",
        (first, *map(Paragraph, cautions), *([rest] if rest.rows else []), Paragraph(words, small=True)),
    )


def conclusions_blocks(conclusions: tuple[Conclusion, ...], cautions: Sequence[str] = ()) -> list[Block]:
    """Return what the terminal shows: the first questions, and how many more there are."""
    section = conclusions_section(conclusions, cautions)
    if section is None:
        return []
    beyond = len(conclusions) - MOST_OPEN
    words = f"{beyond} further questions are on the page, and under conclusions in JSON."
    return [*section.blocks[: 1 + len(cautions)], *([Paragraph(words)] if beyond > 0 else [])]
