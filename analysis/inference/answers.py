"""Answers to reviewers: those that were asked for, and the tables of each."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeAlias

from analysis.classes.conclusions import verdict_of
from analysis.inference.chances import PairProbabilities, pair_probabilities
from analysis.inference.cross_validation import ModelComparison, compare_models
from analysis.inference.fit_of_pairs import PairResiduals, pair_residuals
from analysis.inference.multiverse_analysis import Multiverse, multiverse
from analysis.inference.tost import Equivalence, equivalence
from analysis.inference.transitivity_tests import Transitivity, transitivity
from analysis.scaling.laws import models_beside
from analysis.scaling.scores import Scores
from documents.pages import Block, Column, Paragraph, Table
from documents.text import counted

ReviewAnswer: TypeAlias = PairProbabilities | Equivalence | Transitivity | PairResiduals | ModelComparison | Multiverse
MOST_LINES = 15
MOST_ROWS = 100
FEWEST_FOR_MODELS = 3


def review(
    scores: Scores, *, pairs: bool = False, margin: str | None = None, checks: bool = False, choices: bool = False
) -> dict[str, ReviewAnswer]:
    """Return what reviewers ask of scores, by the keys of `cyclopean scores --json`.

    Parameters
    ----------
    scores
        Scores of paired comparisons, by any law.
    pairs
        The probability of every pair, as `pair_probabilities` gives it: key ``pairs``.
    margin
        Equivalence within this margin, as `equivalence` gives it: key ``equivalence``; None for no tests.
    checks
        Whether the model fits: ``transitivity`` (left out without three items that were all compared), ``residuals``
        and, with at least three observers, ``model_comparison``.
    choices
        How the conclusions depend on the analysis, as `multiverse` gives it: key ``multiverse``.

    Returns
    -------
    dict[str, ReviewAnswer]
        Each answer has ``to_json()``, and `answer_blocks` gives what is shown of it.

    Raises
    ------
    ResultsError
        As the functions named above.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> from analysis.scaling import score
    >>> scores = score(from_answers([Answer("a", "b", 30), Answer("b", "a", 10)]))
    >>> list(review(scores, pairs=True, margin="1jnd", checks=True))
    ['pairs', 'equivalence', 'residuals']
    """
    answers: dict[str, ReviewAnswer] = {}
    if pairs:
        answers["pairs"] = pair_probabilities(scores)
    if margin is not None:
        answers["equivalence"] = equivalence(scores, margin)
    if checks:
        triples = transitivity(scores)
        if triples is not None:
            answers["transitivity"] = triples
        answers["residuals"] = pair_residuals(scores)
        if len(scores.comparisons.observers) >= FEWEST_FOR_MODELS:
            answers["model_comparison"] = compare_models(
                scores.comparisons, models_beside(scores.fit.model, ties=scores.comparisons.ties > 0)
            )
    if choices:
        answers["multiverse"] = multiverse(scores)
    return answers


def answer_blocks(answer: ReviewAnswer) -> list[Block]:
    """Return one answer as a table, and a sentence with the verdict.

    Parameters
    ----------
    answer
        What `review`, or one of the functions that it calls, returns.

    Returns
    -------
    list
        Blocks for `documents.pages`.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> from analysis.inference import pair_probabilities
    >>> from analysis.scaling import score
    >>> from documents.pages import print_blocks
    >>> scores = score(from_answers([Answer("a", "b", 30), Answer("b", "a", 10)]))
    >>> print_blocks(answer_blocks(pair_probabilities(scores)))
     Stimulus  over      P            95 %   JND      p
     a         b     0.750  0.598 to 0.860  1.00  0.001
    """
    blocks: list[Block] = [
        replace(table, title="", rows=table.rows[: _most(answer)]) for table in answer_tables(answer)
    ]
    if isinstance(answer, ModelComparison):
        blocks += [Paragraph(f"{name} is left out: {why}", small=True) for name, why in answer.left_out]
    if isinstance(answer, Multiverse) and answer.skipped:
        name, why = answer.skipped[0]
        words = f"{counted(len(answer.skipped), 'analysis', 'analyses')} could not be made, such as {name}: {why}"
        blocks.append(Paragraph(words, small=True))
    if not isinstance(answer, PairProbabilities):
        blocks.append(Paragraph(answer.sentence, small=True))
    return blocks


def _most(answer: ReviewAnswer) -> int | None:
    """Return how many rows of a table the terminal shows; None for all."""
    if isinstance(answer, PairResiduals):
        return max(MOST_LINES, len(answer.flagged))
    return MOST_LINES if isinstance(answer, Transitivity | Multiverse) else None


def answer_tables(answer: ReviewAnswer) -> list[Table]:
    """Return an answer's tables, folded on a page."""
    if isinstance(answer, PairProbabilities):
        return [_pairs(answer)]
    if isinstance(answer, Equivalence):
        return [_equivalence(answer)]
    if isinstance(answer, Transitivity):
        return [_triples(answer)] if answer.broken else []
    if isinstance(answer, PairResiduals):
        return [_residuals(answer)]
    return [_models(answer)] if isinstance(answer, ModelComparison) else _multiverse(answer)


_BOTH = (Column("Stimulus", "first"), Column("over", "second"))


def _pairs(result: PairProbabilities) -> Table:
    ties, level = any(pair.tie for pair in result.pairs), f"{100 * result.level:.3g} %"
    columns = [*_BOTH, Column("P", "probability", "number", 3), Column(level, "probability", "interval", 3)]
    columns += [Column("P (tie)", "tie", "number", 3), Column(level, "tie", "interval", 3)] if ties else []
    rows = []
    for pair in result.pairs:
        chances = [pair.first_preferred, *([pair.tie] if ties else [])]
        numbers = [cell for one in chances for cell in ((one.value, (one.low, one.high)) if one else (None, None))]
        rows.append((pair.first, pair.second, *numbers, pair.difference_jnd, pair.p))
    columns += [Column("JND", "difference_jnd", "number", 2), Column("p", "p", "p")]
    return Table("pairs", "How often each stimulus is preferred over each other one", tuple(columns), tuple(rows), True)


def _equivalence(result: Equivalence) -> Table:
    columns = (
        Column("Stimulus", "first"),
        Column("and", "second"),
        Column("difference", "difference", "number", 3),
        Column("p (equivalent)", "p_equivalent", "p"),
        Column("p (distinguished)", "p_different", "p"),
        Column("Verdict", "verdict"),
    )
    rows = []
    for pair in result.pairs:
        also = ", yet distinguished from 0" if pair.verdict == "equivalent" and pair.is_different else ""
        numbers = pair.difference, pair.p_equivalent, pair.p_different
        rows.append((pair.first, pair.second, *numbers, pair.verdict + also))
    return Table("equivalence", "Pairs within the margin", columns, tuple(rows), folded=True)


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


def _multiverse(result: Multiverse) -> list[Table]:
    unsure = sorted((pair for pair in result.pairs if pair.stands < 1), key=lambda pair: pair.stands)
    stands = Column("Stands", "stands", "number", 3)
    tables = (
        Table(
            "other_analyses_pairs",
            "Pairs about which some analyses conclude otherwise",
            (Column("Stimulus", "first"), Column("and", "second"), Column("What", "verdict"), stands),
            tuple((pair.first, pair.second, verdict_of(pair.differs), pair.stands) for pair in unsure),
            folded=True,
        ),
        Table(
            "other_analyses_classes",
            "Classes: share of the analyses in which each stands",
            (Column("Stimulus", "name"), Column("Class", "class", "class"), stands),
            tuple((item.name, item.label, item.stands) for item in result.by_item),
            folded=True,
        ),
        Table(
            "other_analyses_choices",
            "What each choice of the analysis changes: share of the conclusions about pairs that stand",
            (Column("Choice", "choice"), Column("Value", "value"), Column("stand", "stand", "number", 3)),
            tuple((choice.choice.replace("_", " "), choice.value, choice.stands) for choice in result.choices),
            folded=True,
        ),
    )
    return [table for table in tables if table.rows]
