"""Answers to reviewers: those that were asked for, and each as tables for the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeAlias

from analysis.classes.conclusions import verdict_of
from analysis.inference.chances import Chance, PairProbabilities, pair_probabilities
from analysis.inference.choices import NOBODY, Multiverse, multiverse
from analysis.inference.fit_of_pairs import PairResiduals, pair_residuals
from analysis.inference.folds import ModelComparison, compare_models
from analysis.inference.tost import Equivalence, equivalence
from analysis.inference.triples import Transitivity, transitivity
from analysis.scaling.scores import Scores
from documents.text import clean_console, counted, print_rows

if TYPE_CHECKING:
    from rich.console import Console

ReviewAnswer: TypeAlias = PairProbabilities | Equivalence | Transitivity | PairResiduals | ModelComparison | Multiverse
MOST_LINES = 15
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
        Each answer has ``to_json()``, and `print_answer` prints it.

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
            answers["model_comparison"] = compare_models(scores.comparisons)
    if choices:
        answers["multiverse"] = multiverse(scores)
    return answers


def print_answer(answer: ReviewAnswer, console: Console | None = None) -> None:
    """Print one answer as a table, and a sentence with the verdict.

    Parameters
    ----------
    answer
        What `review`, or one of the functions that it calls, returns.
    console
        Where to print; standard output if None.

    Examples
    --------
    >>> from rich.console import Console
    >>> from analysis.comparisons import Answer, from_answers
    >>> from analysis.inference import pair_probabilities
    >>> from analysis.scaling import score
    >>> scores = score(from_answers([Answer("a", "b", 30), Answer("b", "a", 10)]))
    >>> print_answer(pair_probabilities(scores), Console(width=100))
     item  over      P           95 %   JND       p
     a     b     0.750  0.598 – 0.860  1.00  0.0014
    """

    console = console or clean_console()
    if isinstance(answer, PairProbabilities):
        _pairs(answer, console)
        return
    if isinstance(answer, Equivalence):
        _equivalence(answer, console)
    elif isinstance(answer, Transitivity):
        _transitivity(answer, console)
    elif isinstance(answer, PairResiduals):
        _residuals(answer, console)
    elif isinstance(answer, ModelComparison):
        _models(answer, console)
    else:
        _multiverse(answer, console)
    _say([answer.sentence], console)


def _pairs(result: PairProbabilities, console: Console) -> None:
    heads = ["item", "over", "P", f"{100 * result.level:.3g} %", "JND", "p"]
    ties = any(pair.tie for pair in result.pairs)
    if ties:
        heads[4:4] = ["P (tie)", f"{100 * result.level:.3g} %"]
    rows = []
    for pair in result.pairs:
        cells = [pair.first, pair.second, *_chance(pair.first_preferred)]
        cells += _chance(pair.tie) if pair.tie else []
        rows.append([*cells, f"{pair.difference / result.jnd:.2f}", "–" if pair.p is None else f"{pair.p:.2g}"])
    print_rows(heads, rows, console, words=(0, 1))


def _chance(chance: Chance) -> list[str]:
    return [f"{chance.value:.3f}", f"{chance.low:.3f} – {chance.high:.3f}"]


def _equivalence(result: Equivalence, console: Console) -> None:
    rows = []
    for pair in result.pairs:
        verdict = (
            f"{pair.verdict}, yet distinguished from 0" if pair.verdict == "equivalent" and pair.is_different else ""
        )
        numbers = [f"{pair.difference:.3f}", f"{pair.p_equivalent:.2g}", f"{pair.p_different:.2g}"]
        rows.append([pair.first, pair.second, *numbers, verdict or pair.verdict])
    headings = ["item", "and", "difference", "p (equivalent)", "p (distinguished)", "verdict"]
    print_rows(headings, rows, console, words=(0, 1, 5))


def _transitivity(result: Transitivity, console: Console) -> None:
    rows = [
        [*triple.items, *(f"{share:.2f}" for share in triple.shares), triple.breaks]
        for triple in result.broken[:MOST_LINES]
    ]
    if rows:
        headings = ["a", "b", "c", "a over b", "b over c", "a over c", "what"]
        print_rows(headings, rows, console, words=(0, 1, 2, 6))


def _residuals(result: PairResiduals, console: Console) -> None:
    rows = [
        [pair.first, pair.second, f"{pair.observed:.2f}", f"{pair.expected:.2f}", _z(pair.z), _p(pair.p_adjusted)]
        for pair in result.pairs[: max(MOST_LINES, len(result.flagged))]
    ]
    print_rows(["item", "over", "observed", "expected", "z", "p"], rows, console, words=(0, 1))


def _models(result: ModelComparison, console: Console) -> None:
    rows = [
        [model.name, f"{model.per_answer:.4f}", f"{model.difference:.3f}", f"{model.difference_se:.3f}"]
        for model in result.models
    ]
    print_rows(["model", "log p per answer", "per observer, against the best", "se"], rows, console)
    _say([f"{name} is left out: {why}" for name, why in result.left_out], console)


def _multiverse(result: Multiverse, console: Console) -> None:
    unsure = sorted((pair for pair in result.pairs if pair.stands < 1), key=lambda pair: pair.stands)
    rows = [[pair.first, pair.second, verdict_of(pair.differs), f"{pair.stands:.0%}"] for pair in unsure[:MOST_LINES]]
    if rows:
        print_rows(["item", "and", "what", "stands"], rows, console, words=(0, 1, 2))
    items = [[item.name, item.label, f"{item.stands:.0%}"] for item in result.by_item]
    print_rows(["item", "class", "stands"], items, console, words=(0, 1))
    people = [line for line in result.choices if line.choice == "left_out" and line.value != NOBODY]
    lines = [line for line in result.choices if line.choice != "left_out"] + people[:3]
    rows = [[line.choice.replace("_", " "), line.value, f"{line.stands:.1%}"] for line in lines]
    print_rows(["choice", "value", "conclusions that stand"], rows, console, words=(0, 1))
    if result.skipped:
        name, why = result.skipped[0]
        _say(
            [f"{counted(len(result.skipped), 'analysis', 'analyses')} could not be made, such as {name}: {why}"],
            console,
        )


def _z(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"


def _p(value: float | None) -> str:
    return "–" if value is None else f"{value:.2g}"


def _say(lines: Sequence[str], console: Console) -> None:
    from rich.text import Text

    for line in lines:
        console.print(Text(line, style="dim"))
