"""Scores within groups as tables for the terminal."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from analysis.scaling.grouped import GroupedScores
from analysis.scaling.scores import Scores
from analysis.scaling.terminal import print_scores, problem_lines
from documents.text import clean_console

if TYPE_CHECKING:
    from rich.console import Console


def print_groups(
    grouped: GroupedScores, further: Callable[[Scores], object] | None = None, console: Console | None = None
) -> None:
    """Print the table of each group under its name, then the pooled one, and whether the groups agree.

    Parameters
    ----------
    grouped
        What to print.
    further
        Called after each table, to print more about it.
    console
        Where to print; standard output if None.

    Examples
    --------
    >>> import io
    >>> from rich.console import Console
    >>> from analysis.comparisons import Answer, from_answers
    >>> from analysis.scaling import score_groups
    >>> answers = [Answer("a", "b", 30, group="church"), Answer("b", "a", 10, group="church")]
    >>> console = Console(file=io.StringIO(), width=120)
    >>> print_groups(score_groups(from_answers(answers)), console=console)
    >>> console.file.getvalue().split()[:4]
    ['church', 'item', 'wins', 'of']
    """
    from rich.text import Text

    console = console or clean_console()
    tables = [*grouped.groups, *([("all groups together", grouped.pooled)] if grouped.pooled else [])]
    for name, scores in tables:
        console.print(Text(name, style="bold"))
        print_scores(scores, console=console)
        if further:
            further(scores)
        console.print()
    for line in agreement_lines(grouped):
        console.print(Text(line, style="dim"))


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
