"""What reviewers ask: probabilities of pairs, equivalence, checks of the model, and other ways to analyse."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

from analysis.classes.conclusions import Conclusion
from analysis.errors import ResultsError
from analysis.inference.answers import ReviewAnswer, answer_tables
from analysis.inference.chances import PairProbabilities, PairProbability, pair_probabilities
from analysis.inference.conclusions import pair_conclusions
from analysis.inference.cross_validation import compare_models
from analysis.inference.fit_of_pairs import pair_residuals
from analysis.inference.multiverse_analysis import Multiverse, multiverse
from analysis.inference.tost import Equivalence, equivalence
from analysis.inference.transitivity_tests import transitivity
from analysis.report.grouped import GroupedSummary
from analysis.report.summary import Summary
from documents.pages import Block, Cell, Column, Facts, Paragraph, Section, ShownAs, Table

MOST_ITEMS = 30  # all pairs of more fill no page
REPLICATES = 1000
Review = Mapping[str, ReviewAnswer]


def review_of(summary: Summary, *, checks: bool = True) -> Review:
    """Return what reviewers ask of the scores, by its key in JSON; what cannot be computed is left out.

    Whether the model fits only with ``checks``, other analyses only where `no_other_analyses` has no reason, and
    equivalence only where the experiment names a margin (``analysis: {margin: 0.5jnd}``).

    Raises
    ------
    ResultsError
        If the experiment's margin is none.
    """
    scores, level = summary.scores, summary.alpha
    if scores.classes is None or len(scores.items) > MOST_ITEMS:
        return {}
    makers: dict[str, Callable[[], ReviewAnswer | None]] = {"pairs": lambda: pair_probabilities(scores)}
    if checks:
        makers |= {
            "transitivity": lambda: transitivity(scores, alpha=level, replicates=REPLICATES),
            "residuals": lambda: pair_residuals(scores, alpha=level),
            "model_comparison": lambda: compare_models(scores.comparisons),
        }
    if not no_other_analyses(summary):
        makers["multiverse"] = lambda: multiverse(scores, adjustments=("none", "holm", "bh"))
    answers = {}
    for key, make in makers.items():
        try:
            answer = make()
        except ResultsError:
            continue
        if answer is not None:
            answers[key] = answer
    margin = summary.header.analysis.margin
    if margin is not None:
        answers["equivalence"] = equivalence(scores, margin, alpha=level)
    return answers


def group_reviews_of(grouped: GroupedSummary) -> dict[str, Review]:
    """Return the probabilities of pairs, equivalence and other analyses of each scale, by its name."""
    return {name: review_of(part, checks=False) for name, part in grouped.scales}


def no_other_analyses(summary: Summary) -> str:
    """Return why the answers are not analysed in other ways, in words; empty where they are."""
    if summary.scores.classes is None:
        return "there are no classes"
    if len(summary.scores.items) > MOST_ITEMS:
        return f"there are more than {MOST_ITEMS} stimuli"
    if summary.estimate.method == "ml":
        return ""
    return "only a penalty or a prior keeps the scores finite, which the other laws do not have"


def warning_of(review: Review) -> str:
    """Return which conclusions a minority of the other analyses shares; empty if there are none, or no analyses."""
    answer = review.get("multiverse")
    return answer.warning if isinstance(answer, Multiverse) else ""


def reviewers_section(scales: Sequence[tuple[str, Summary, Review]]) -> Section | None:
    """Return the answers on each scale: a sentence for each, and their tables folded; None without any.

    ``scales`` are their names, scores and answers; one scale has no name.
    """
    facts: list[tuple[str, str]] = []
    tables: list[Block] = []
    for name, summary, review in scales:
        for key, term in TERMS.items():
            answer = review.get(key)
            assert not isinstance(answer, PairProbabilities)  # they have a table of their own
            words = _missing(summary, key) if answer is None else answer.sentence
            facts += [(f"{name}: {term}" if name else term, words)] if words else []
            tables += [_named(table, name) for table in _tables(answer)]
    pairs = _pairs(scales)
    if pairs is None:
        return None
    words = (
        "Each interval stands for itself. A pair is flagged where its answers depart from the scores by more than "
        "chance; the p values are corrected for the number of pairs. Transitivity is compared with simulated studies "
        "that have the fitted scores. Models are compared by how well they predict observers who were left out. Other "
        "analyses: every law, kind of standard errors and correction, with each observer left out in turn."
    )
    return Section("reviewers", "For reviewers", (Facts(tuple(facts)), pairs, *tables, Paragraph(words, small=True)))


def _missing(summary: Summary, key: str) -> str:
    why = no_other_analyses(summary) if key == "multiverse" else ""
    return f"Not made: {why}." if why else ""


def _tables(answer: ReviewAnswer | None) -> list[Table]:
    """Return an answer's tables that are not among those of all pairs, nor in another section."""
    if answer is None or isinstance(answer, Equivalence):
        return []
    return answer_tables(answer)[-1:]


def _named(table: Table, scale: str) -> Table:
    return replace(table, name=f"{table.name}_{scale}", title=f"{scale}: {table.title}") if scale else table


TERMS = {
    "equivalence": "Equivalence",
    "transitivity": "Transitivity",
    "residuals": "Badly fitted pairs",
    "model_comparison": "Other models",
    "multiverse": "Other analyses",
}
_BOTH = (Column("Stimulus", "first"), Column("over", "second"))


def _pairs(scales: Sequence[tuple[str, Summary, Review]]) -> Table | None:
    """Return all pairs of all scales: how often each is preferred, and what is concluded; None without any."""
    found = [(name, *one) for name, summary, review in scales for one in _lines(summary, review)]
    if not found:
        return None
    ties, margin = any(pair.tie for _, pair, _, _ in found), any(p is not None for *_, p in found)
    columns = [*_BOTH, Column("P", "probability", "number", 3), Column("95 %", "probability", "interval", 3)]
    if ties:
        columns += [Column("P (tie)", "tie", "number", 3), Column("95 %", "tie", "interval", 3)]
    columns += [Column("JND", "difference_jnd", "number", 2), Column("p", "p", "p")]
    columns += [Column("p (equivalent)", "p_equivalent", "p")] if margin else []
    columns += [Column("Verdict", "verdict"), Column("Stands in", "stands")]
    named = len(scales) > 1
    rows = []
    for name, pair, one, p_equivalent in found:
        won, tie = pair.first_preferred, pair.tie
        cells: list[Cell] = [pair.first, pair.second, won.value, (won.low, won.high)]
        if ties:
            cells += [tie.value, (tie.low, tie.high)] if tie else [None, None]
        cells += [one.estimate, pair.p, *([p_equivalent] if margin else []), one.verdict_words, stands_cell(one)]
        rows.append((*([name] if named else []), *cells))
    title = "How often each stimulus is preferred over each other one, and what is concluded"
    return Table("pairs", title, (*([Column("Group", "group")] if named else []), *columns), tuple(rows), folded=True)


def _lines(summary: Summary, review: Review) -> Iterator[tuple[PairProbability, Conclusion, float | None]]:
    """Yield each pair, what is concluded of it, and the p value of its equivalence."""
    found, margin = review.get("pairs"), review.get("equivalence")
    if not isinstance(found, PairProbabilities):
        return
    alike = margin.pairs if isinstance(margin, Equivalence) else [None] * len(found.pairs)
    conclusions = pair_conclusions(summary.scores, review, summary.estimate.stability)
    for pair, one, own in zip(found.pairs, conclusions, alike, strict=True):
        yield pair, one, own.p_equivalent if own else None


def stands_cell(one: Conclusion) -> ShownAs | None:
    """Return how often a conclusion stands: a share in CSV, on the page with the number of analyses."""
    return ShownAs(one.stands, one.robustness.removeprefix("stands in ")) if one.robustness else None
