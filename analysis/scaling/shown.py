"""Scores, and scores within groups, as tables and sentences for pages and the terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, get_args

from analysis.scaling.clustered import ByObserver
from analysis.scaling.counts import count_pairs
from analysis.scaling.grouped import GroupedScores
from analysis.scaling.lack_of_fit import one_scale
from analysis.scaling.laws import LAWS, Model
from analysis.scaling.profile import why_by_standard_errors
from analysis.scaling.result import ModelMethod, Parameter
from analysis.scaling.scores import Scores
from analysis.scaling.separation import are_apart, separation_of_method
from documents.pages import Block, Column, Heading, Paragraph, ShownAs, Table
from documents.text import counted

Published = Mapping[str, tuple[float, str]]

TOO_MANY = "no classes: the items overlap in too many to list"
ONLY_PENALTY = "Only the penalty keeps the scores finite; some differences have no upper end."
METHODS = {"ml": "maximum likelihood", "firth": "Firth's penalised likelihood", "map": "maximum a posteriori"}
ADJUSTMENTS = {"none": "unadjusted", "holm": "Holm", "bh": "Benjamini-Hochberg", "maxz": "single-step max z"}
NAMES = {"nu": "ties, ν", "eta": "ties, η", "order": "order effect"}
BASES = {True: "(bootstrap over observers)", False: "(takes all answers for independent)"}


def score_blocks(scores: Scores, published: Published | None = None) -> list[Block]:
    """Return a table of the items, best first, then how the fit was made and what else was estimated.

    Parameters
    ----------
    scores
        What to show.
    published
        For each item, where there is one, a score and class published before, shown beside.

    Returns
    -------
    list
        Blocks for `documents.pages`.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> from analysis.scaling import score
    >>> table = score_blocks(score(from_answers([Answer("a", "b", 30), Answer("b", "a", 10)])))[0]
    >>> [column.heading for column in table.columns]
    ['item', 'wins', 'of', 'score', 'log10', 'se (nats)', 'class']
    """
    in_jod = LAWS[scores.fit.model].unit != "nats"
    unit = scores.jnd if in_jod else 1.0
    names = ("JOD", "se (JOD)") if in_jod else ("score", "log10", "se (nats)")
    columns = [Column("item", "item"), Column("wins", "wins", "number"), Column("of", "of", "number")]
    columns += [Column(name, name, "number", 4) for name in (*names, *(["quasi se"] if scores.quasi else []))]
    columns.append(Column("class", "class", "class"))
    if published:
        columns += [Column("published", "published", "number", 4), Column("class", "published_class", "class")]
    rows = []
    for item in scores.items:
        theta, se, quasi_se = (None if v is None else v / unit for v in (item.theta, item.se, item.quasi_se))
        values = [theta, se] if in_jod else [item.score, item.log10_score, se]
        counts = [ShownAs(count, f"{count:g}") for count in (item.wins, item.comparisons)]
        beside = published.get(item.name, (None, None)) if published else ()
        rows.append((item.name, *counts, *values, *([quasi_se] if scores.quasi else []), item.label, *beside))
    lines = (Paragraph(line, small=True) for line in summary_lines(scores))
    return [Table("scores", "", tuple(columns), tuple(rows)), *lines]


def summary_lines(scores: Scores) -> list[str]:
    """Say how the model was fitted, how well it fits, and what was estimated beside the strengths."""
    fit, classes, goodness = scores.fit, scores.classes, scores.fit.goodness
    if goodness is None:
        return ["No finite estimate: complete separation."]
    plain = fit.model == "bradley-terry" and fit.method != "map" and not fit.parameters
    grouped = f"classes at alpha {classes.alpha:g}, {ADJUSTMENTS[classes.adjust]}" if classes else TOO_MANY
    tested = one_scale(scores.comparisons, fit)
    deviance = f"deviance {goodness.deviance:.4g}" + (f" on {goodness.df} df" if fit.method != "map" else "")
    if plain:
        lines = [f"{METHODS[fit.method]}; {deviance}; {grouped}"]
    else:
        prior = f", prior sd {fit.prior_sd:g}" if fit.prior_sd else ""
        likelihood = f"log likelihood {fit.log_likelihood:.6g}"
        lines = [f"{fit.model}, {METHODS[fit.method]}{prior}; {likelihood}; {deviance}; {grouped}"]
    if fit.method == "firth" and fit.held_by_penalty:
        ties = LAWS[fit.model].parameter is not None
        apart = separation_of_method(fit.counts, scores.comparisons.items, ties=ties, method="ml")
        lines.append(ONLY_PENALTY + (f" {' '.join(apart.sentences)}" if apart else ""))
    if fit.clustered is not None:
        lines.append(_clustered(fit.covariance_kind, fit.clustered))
    why = why_by_standard_errors(fit)
    lines += [f"two items are tested by standard errors: {why}"] if why else []
    if tested is not None:
        basis = BASES[tested.by_observers]
        lines.append(
            f"test of one scale: Pearson's χ² = {tested.statistic:.4g} on {tested.df} df, p = {tested.p:.2g} {basis}"
        )
        lines += [tested.caveat] if tested.caveat else []
    if fit.held_by_prior:
        lines.append("Only the prior keeps these scores finite. " + " ".join(fit.held_by_prior.sentences))
    if classes and classes.without_spread:
        lines.append(
            f"{counted(classes.without_spread, 'pair has', 'pairs have')} no spread between observers, who all agree: "
            "not significant."
        )
    lines += [f"the model '{fit.model}' is of {LAWS.whose(fit.model)}"] if LAWS.whose(fit.model) else []
    lines += [_line(parameter) for parameter in fit.parameters]
    if fit.order_test:
        test = fit.order_test
        value, basis = (test.by_observers or test).statistic, BASES[test.by_observers is not None]
        lines.append(f"test of no order effect: χ² = {value:.4g} on 1 df, p = {test.conclusion.p:.2g} {basis}")
    if scores.quasi is not None:
        low, high = scores.quasi.worst_below, scores.quasi.worst_above
        lines.append(f"quasi-variances: standard errors of differences are off by {low:+.1%} to {high:+.1%}")
    if fit.ties_left_out:
        them = "it" if fit.ties_left_out == 1 else "them"
        prefers = counted(fit.ties_left_out, "answer prefers", "answers prefer")
        lines.append(f"{prefers} neither item; this model leaves {them} out (davidson and rao-kupper do not).")
    return lines


def _clustered(kind: str, clustered: ByObserver) -> str:
    return (
        f"standard errors by {clustered.observers} observers, {kind}: the answers vary "
        f"{float(clustered.spread.scale[0]):.3g} times as much as if all were independent; Student's t with "
        f"{clustered.freedom_words}"
    )


def _line(parameter: Parameter) -> str:
    name = NAMES[parameter.name]
    if parameter.factor is None:
        return f"{name}: {parameter.estimate:+.4g} sd (95 % {parameter.low:.4g} to {parameter.high:.4g})"
    value, low, high = parameter.factor
    return f"{name}: {'× ' if parameter.name == 'order' else ''}{value:.4g} (95 % {low:.4g} to {high:.4g})"


def remedies(scores: Scores) -> dict[str, dict[str, Any]]:
    """Return what to type instead where there are no finite scores, and the same as arguments of `score`.

    Each gives finite scores to these very comparisons; there is none where no answer prefers an item.
    """
    fit = scores.fit
    ordered = fit.counts.ordered
    ways: dict[str, dict[str, Any]] = {
        f"--method {method}": {"model": fit.model, "method": method, "order_effect": ordered}
        for method in _finite_methods(scores, fit.model, ordered=ordered)
    }
    if ordered:
        ways |= _first_finite(scores, fit.model, "without --order-effect")
    if not ways and LAWS[fit.model].parameter:
        ways |= _first_finite(scores, "bradley-terry", "--model bradley-terry" + " without --order-effect" * ordered)
    return ways


def _first_finite(scores: Scores, model: Model, words: str) -> dict[str, dict[str, Any]]:
    """Return the first finite method without an order effect: the one that was asked for if it is."""
    asked = scores.fit.method
    for method in sorted(_finite_methods(scores, model, ordered=False), key=lambda one: one != asked):
        flag = "" if method == asked else f"--method {method} "
        return {flag + words: {"model": model, "method": method, "order_effect": False}}
    return {}


def _finite_methods(scores: Scores, model: Model, *, ordered: bool) -> list[ModelMethod]:
    """Return the methods that give finite strengths to the answers, without those that cannot."""
    ties, items = LAWS[model].parameter is not None, scores.comparisons.items
    counts, _ = count_pairs(scores.comparisons, ordered=ordered, ties=ties)
    if not (counts.won.any() or counts.lost.any()):
        return []
    methods: tuple[ModelMethod, ...] = get_args(ModelMethod)
    return [one for one in methods if separation_of_method(counts, items, ties=ties, method=one) is None]


def problem_lines(scores: Scores) -> list[str]:
    """Say why there are no scores and what to do, or that the iteration did not converge; else return nothing.

    Parameters
    ----------
    scores
        Scores of paired comparisons, as `score` returns them.

    Returns
    -------
    list[str]
        Lines of plain text; empty if the fit converged.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> from analysis.scaling import score
    >>> problem_lines(score(from_answers([Answer("a", "b", 30), Answer("b", "a", 10)])))
    []
    >>> problem_lines(score(from_answers([Answer("a", "b", 30)])))[0]
    'no finite scores fit these comparisons:'
    """
    fit = scores.fit
    if fit.separation:
        why = [f"  {sentence}" for sentence in fit.separation.sentences]
        ways = " or ".join(remedies(scores))
        collect = "Collect more comparisons"
        if not scores.comparisons.count.any():
            collect = "Collect answers that prefer an item"
        elif are_apart(fit.counts):
            collect = "Compare items of different groups with each other"
        remedy = f"{collect}, or ask for scores that stay finite: {ways}." if ways else f"{collect}."
        return ["no finite scores fit these comparisons:", *why, f"  {remedy}"]
    return [] if fit.converged else [f"the fit did not converge in {fit.iterations} steps"]


def group_blocks(grouped: GroupedScores, further: Callable[[Scores], Iterable[Block]] | None = None) -> list[Block]:
    """Return the table of each group under its name, then the pooled one, and whether the groups agree.

    Parameters
    ----------
    grouped
        What to show.
    further
        Gives what more is to be shown after each table.

    Returns
    -------
    list
        Blocks for `documents.pages`.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> from analysis.scaling import score_groups
    >>> answers = [Answer("a", "b", 30, group="church"), Answer("b", "a", 10, group="church")]
    >>> group_blocks(score_groups(from_answers(answers)))[0]
    Heading(text='church')
    """
    blocks: list[Block] = []
    for name, scores in [*grouped.groups, *([("all groups together", grouped.pooled)] if grouped.pooled else [])]:
        blocks += [Heading(name), *score_blocks(scores), *(further(scores) if further else ())]
    return [*blocks, *(Paragraph(line, small=True) for line in agreement_lines(grouped))]


def agreement_lines(grouped: GroupedScores) -> list[str]:
    """Return whether the groups agree, and what to bear in mind, in sentences.

    Parameters
    ----------
    grouped
        Scores within groups, as `score_groups` returns them.

    Returns
    -------
    list[str]
        Lines of plain text.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> from analysis.scaling import score_groups
    >>> agreement_lines(score_groups(from_answers([Answer("a", "b", 3, group="x"), Answer("b", "a", group="x")])))
    ['No pooled scale: no item occurs in several groups. Give what recurs the same name in every group.']
    """
    test = grouped.agreement
    if grouped.pooled is None:
        lines = ["No pooled scale: no item occurs in several groups. Give what recurs the same name in every group."]
    elif test is None:
        lines = []
    elif test.f is None or test.p is None:
        lines = [
            f"one scale for all groups: χ² = {test.statistic:.4g} on {test.df} df, p = {test.p_model:.2g} if all "
            f"answers are independent; no test by observers: {test.missing}"
        ]
    else:
        lines = [
            f"one scale for all groups: F = {test.f:.4g} on {test.df_between:.3g} and {test.df_within:.3g} df, "
            f"p = {test.p:.2g}, by observer"
        ]
    return [*lines, *grouped.notes]


def group_problem_lines(grouped: GroupedScores) -> list[str]:
    """Say of each group why it has no scores and what to do; of the pooled scale too.

    Parameters
    ----------
    grouped
        Scores within groups, as `score_groups` returns them.

    Returns
    -------
    list[str]
        Lines of plain text; empty if every fit converged.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> from analysis.scaling import score_groups
    >>> answers = [Answer("a", "b", 3, group="church"), Answer("b", "a", group="church"), Answer("c", "d", group="sea")]
    >>> group_problem_lines(score_groups(from_answers(answers)))[0]
    "the group 'sea': no finite scores fit these comparisons:"
    """
    lines = []
    named = [(f"the group '{name}'", scores) for name, scores in grouped.groups]
    for name, scores in [*named, *([("all groups together", grouped.pooled)] if grouped.pooled else [])]:
        problems = problem_lines(scores)
        if problems:
            lines += [f"{name}: {problems[0]}", *problems[1:]]
    return lines
