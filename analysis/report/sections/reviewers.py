"""What reviewers ask: probabilities of pairs, equivalence, checks of the model, and other ways to analyse."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from analysis.classes.conclusions import verdict_of
from analysis.errors import ResultsError
from analysis.inference.chances import PairProbabilities, pair_probabilities
from analysis.inference.choices import Multiverse, multiverse
from analysis.inference.fit_of_pairs import PairResiduals, pair_residuals
from analysis.inference.folds import ModelComparison, compare_models
from analysis.inference.terminal import ReviewAnswer
from analysis.inference.tost import Equivalence, equivalence
from analysis.inference.triples import Transitivity, transitivity
from analysis.report.blocks import Block, Cell, Column, Facts, Paragraph, Section, Table
from analysis.report.summary import Summary

MOST_ITEMS = 30  # all pairs of more fill no page
REPLICATES = 1000
MOST_ROWS = 100
Review = Mapping[str, ReviewAnswer]


def review_of(summary: Summary) -> Review:
    """Return what reviewers ask of the scores, by its key in JSON; what cannot be computed is left out.

    Other analyses only where the scores are maximum likelihood, and equivalence only where the experiment names a
    margin (``analysis: {margin: 0.5jnd}``).

    Raises
    ------
    ResultsError
        If the experiment's margin is none.
    """
    scores, level = summary.scores, summary.alpha
    if scores.classes is None or len(scores.items) > MOST_ITEMS:
        return {}
    makers: dict[str, Callable[[], ReviewAnswer | None]] = {
        "pairs": lambda: pair_probabilities(scores),
        "transitivity": lambda: transitivity(scores, alpha=level, replicates=REPLICATES),
        "residuals": lambda: pair_residuals(scores, alpha=level),
        "model_comparison": lambda: compare_models(scores.comparisons),
    }
    if summary.estimate.method == "ml":
        makers["multiverse"] = lambda: multiverse(scores, adjustments=("none", "holm", "bh"))
    answers = {}
    for key, make in makers.items():
        try:
            answer = make()
        except ResultsError:
            continue
        if answer is not None:
            answers[key] = answer
    margin = summary.header.analysis.get("margin")
    if margin is not None:
        answers["equivalence"] = equivalence(scores, str(margin), alpha=level)
    return answers


def warning_of(review: Review) -> str:
    """Return which conclusions a minority of the other analyses shares; empty if there are none, or no analyses."""
    answer = review.get("multiverse")
    return answer.warning if isinstance(answer, Multiverse) else ""


def reviewers_section(review: Review) -> Section | None:
    """Return the answers: a sentence for each, and their tables folded; None without any."""
    facts: list[tuple[str, str]] = []
    tables: list[Block] = []
    for key, term in TERMS.items():
        answer = review.get(key)
        if answer is None:
            continue
        if isinstance(answer, PairProbabilities):
            tables.append(_pairs(answer))
            continue
        facts.append((term, answer.sentence))
        if isinstance(answer, Equivalence):
            tables.append(_equivalence(answer))
        elif isinstance(answer, Transitivity):
            tables += [_triples(answer)] if answer.broken else []
        elif isinstance(answer, PairResiduals):
            tables.append(_residuals(answer))
        elif isinstance(answer, ModelComparison):
            tables.append(_models(answer))
        else:
            tables += _analyses(answer)
    if not tables:
        return None
    words = (
        "Each interval stands for itself. A pair is flagged where its answers depart from the scores by more than "
        "chance; the p values are corrected for the number of pairs. Transitivity is compared with simulated studies "
        "that have the fitted scores. Models are compared by how well they predict observers who were left out. Other "
        "analyses: every law, kind of standard errors and correction, with each observer left out in turn."
    )
    return Section("reviewers", "For reviewers", (Facts(tuple(facts)), *tables, Paragraph(words, small=True)))


TERMS = {
    "pairs": "Pairs",
    "equivalence": "Equivalence",
    "transitivity": "Transitivity",
    "residuals": "Badly fitted pairs",
    "model_comparison": "Other models",
    "multiverse": "Other analyses",
}
_BOTH = (Column("Stimulus", "first"), Column("over", "second"))


def _pairs(result: PairProbabilities) -> Table:
    ties = any(pair.tie for pair in result.pairs)
    columns = [*_BOTH, Column("P", "probability", "number", 3), Column("95 %", "probability", "interval", 3)]
    if ties:
        columns += [Column("P (tie)", "tie", "number", 3), Column("95 %", "tie", "interval", 3)]
    columns += [Column("JND", "difference_jnd", "number", 2), Column("p", "p", "p")]
    rows = []
    for pair in result.pairs:
        won, tie = pair.first_preferred, pair.tie
        cells: list[Cell] = [pair.first, pair.second, won.value, (won.low, won.high)]
        cells += [tie.value, (tie.low, tie.high)] if tie else []
        rows.append((*cells, pair.difference / result.jnd, pair.p))
    title = "Probability that each stimulus is preferred over each other one"
    return Table("pairs", title, tuple(columns), tuple(rows), folded=True)


def _equivalence(result: Equivalence) -> Table:
    columns = (
        Column("Stimulus", "first"),
        Column("and", "second"),
        Column("Difference", "difference", "number", 3),
        Column("p (equivalent)", "p_equivalent", "p"),
        Column("p (distinguished)", "p_different", "p"),
        Column("Verdict", "verdict"),
    )
    rows = tuple(
        (pair.first, pair.second, pair.difference, pair.p_equivalent, pair.p_different, pair.verdict)
        for pair in result.pairs
    )
    return Table("equivalence", f"Equivalence within ± {result.margin_text}", columns, rows, folded=True)


def _triples(result: Transitivity) -> Table:
    columns = (
        Column("a", "a"),
        Column("b", "b"),
        Column("c", "c"),
        Column("a over b", "a_over_b", "number", 2),
        Column("b over c", "b_over_c", "number", 2),
        Column("a over c", "a_over_c", "number", 2),
        Column("Breaks", "breaks"),
    )
    rows = tuple((*triple.items, *triple.shares, triple.breaks) for triple in result.broken)
    return Table("transitivity", "Triples that break stochastic transitivity", columns, rows, folded=True)


def _residuals(result: PairResiduals) -> Table:
    columns = (
        *_BOTH,
        Column("Observed", "observed", "number", 2),
        Column("Expected", "expected", "number", 2),
        Column("z", "z", "number", 2),
        Column("p", "p_adjusted", "p"),
        Column("Flag", "flag"),
    )
    rows = tuple(
        (pair.first, pair.second, pair.observed, pair.expected, pair.z, pair.p_adjusted, "flag" * pair.flagged or None)
        for pair in result.pairs[: max(MOST_ROWS, len(result.flagged))]
    )
    return Table("residuals", "Pairs by how badly they fit", columns, rows, folded=True)


def _models(result: ModelComparison) -> Table:
    columns = (
        Column("Model", "model"),
        Column("log p per answer", "log_p_per_answer", "number", 4),
        Column("per observer, against the best", "difference", "number", 3),
        Column("s.e.", "difference_se", "number", 3),
    )
    rows = tuple((model.name, model.per_answer, model.difference, model.difference_se) for model in result.models)
    return Table("models", "Models by how well they predict observers left out", columns, rows, folded=True)


def _analyses(result: Multiverse) -> list[Block]:
    pairs = Table(
        "other_analyses_pairs",
        f"How often each conclusion about a pair stands in {len(result.analyses):,} analyses",
        (
            Column("Stimulus", "first"),
            Column("and", "second"),
            Column("here", "here"),
            Column("stands", "stands", "number", 2),
        ),
        tuple((pair.first, pair.second, verdict_of(pair.differs), pair.stands) for pair in result.pairs),
        folded=True,
    )
    choices = Table(
        "other_analyses_choices",
        "What each choice of the analysis changes: share of the conclusions about pairs that stand",
        (Column("Choice", "choice"), Column("Value", "value"), Column("stand", "stand", "number", 3)),
        tuple((choice.choice.replace("_", " "), choice.value, choice.stands) for choice in result.choices),
        folded=True,
    )
    return [pairs, choices]
