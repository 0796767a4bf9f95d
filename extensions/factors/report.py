"""Effects of the stimuli's factors, such as view and exposure, on the scores."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from analysis.classes import ADJUSTMENT_NAMES, Conclusion
from analysis.comparisons import Comparisons
from analysis.errors import ResultsError
from analysis.records import Header
from analysis.report import Part, fixed, percent
from documents.figures import NARROW_IN, WIDE_IN
from documents.pages import Block, Column, Figure, Paragraph, Section, Table
from documents.text import counted
from extensions.factors.effects import factor_effects
from extensions.factors.result import FactorEffects

INDEPENDENT = "p if all answers were independent"


def factors_part(comparisons: Comparisons, header: Header) -> Part | None:
    """Return what a report says of the stimuli's factors; None where no effect can be estimated."""
    effects = effects_in(comparisons, header)
    if effects is None:
        return None

    def again(answers: Comparisons) -> Iterable[Conclusion]:
        found = effects_in(answers, header, tests_alone=True)
        return found.conclusions if found else ()

    return Part(
        key="factors",
        result=effects,
        sections=lambda pictures: [factors_section(effects)],
        conclusions=lambda: effects.conclusions,
        again=again,
        cautions=effects.cautions,
        analysis=lambda cited: (
            "Effects of the stimuli's factors are those of a Bradley-Terry model whose log strengths are linear in "
            f"them {cited.cite('Springall1973')}, with likelihood-ratio tests of type II."
        ),
        by_observers=any(
            [*(test.by_observers for test in effects.tests), *(test.by_observers for test in effects.interactions)]
        ),
        p_values=tuple(_p_values(effects)),
        families=tuple(_families(effects)),
        effects=_effect_words(effects),
    )


def _p_values(effects: FactorEffects) -> Iterator[str]:
    if effects.tests:
        by_observers = any(test.observer_p is not None for test in effects.tests)
        which = (
            "Of a factor's two p values the one by observers is to be reported; that" if by_observers else "The p value"
        )
        yield f"{which} of a factor's likelihood ratio treats all answers as independent."


def _families(effects: FactorEffects) -> Iterator[str]:
    if effects.tests:
        yield f"{counted(len(effects.tests), 'factor', 'factors')}, not corrected"
    crossed = [test for test in effects.interactions if test.p is not None]
    if crossed:
        yield f"{counted(len(crossed), 'interaction', 'interactions')} of factors, with {ADJUSTMENT_NAMES['holm']}"


def _effect_words(effects: FactorEffects) -> str:
    if not effects.effects:
        return ""
    by = " by observers" if any(effect.robust_p is not None for effect in effects.effects) else ""
    return f"Effects of factors are differences of log strength too, with 95 % intervals{by}."


def effects_in(comparisons: Comparisons, header: Header, *, tests_alone: bool = False) -> FactorEffects | None:
    """Return the effects of the factors in ``header`` on ``comparisons``; None where none can be estimated.

    With ``tests_alone`` without the effects themselves, as `extensions.factors.factor_effects` has it.
    """
    factors = header.factors
    if not any(factors.get(item) for item in comparisons.items):
        return None
    try:
        return factor_effects(comparisons, factors, tests_alone=tests_alone)
    except ResultsError:
        return None


def factors_section(effects: FactorEffects) -> Section:
    """Return the effects with their tests, and the share of the deviance that they explain."""
    blocks: list[Block] = [Paragraph(sentence) for sentence in effects.problem_lines]
    if effects.effects:
        blocks += [_figure(effects), *_tests(effects)]
    if effects.left_out:
        left_out = "; ".join(f"{factor.name}: {factor.reason}" for factor in effects.left_out)
        blocks.append(Paragraph(f"Not in the model: {left_out}.", small=True))
    return Section("factors", "Effects of the stimuli's factors", tuple(blocks))


def _figure(effects: FactorEffects) -> Figure:
    from extensions.factors.figure import draw_effects, drawn_rows

    columns = (
        Column("Factor", "factor"),
        Column("Level", "level"),
        Column("Effect (nats)", "effect_nats", "number", 3),
        Column("95 % by observers", "robust", "interval", 2),
        Column("p by observers", "robust_p", "p"),
        Column("95 % if all answers were independent", "model", "interval", 2),
        Column(INDEPENDENT, "p", "p"),
    )
    rows = tuple(
        (
            row.factor,
            f"{row.level} (reference)" if row.is_reference else row.level,
            row.estimate,
            row.robust_interval or (None, None),
            row.robust_p,
            row.interval or (None, None),
            row.p,
        )
        for row in drawn_rows(effects)
    )
    basis = "by observers, as the verdicts are" if effects.by_observers else "that take all answers for independent"
    caption = (
        "Effect of each level against its reference (hollow), in nats: one nat multiplies the odds of being preferred "
        f"by 2.7. Bars are 95 % intervals {basis}. The effect of a numerical factor is over its range."
    )
    table = Table("factor_effects", "Effects of the factors", columns, rows)
    return Figure("factor_effects", draw_effects(effects, WIDE_IN), draw_effects(effects, NARROW_IN), caption, table)


def _tests(effects: FactorEffects) -> list[Block]:
    blocks: list[Block] = [Paragraph(sentence) for sentence in effects.cautions]
    if effects.tests:
        columns = (
            Column("Factor", "factor"),
            Column("Verdict", "verdict"),
            Column("p by observers", "observer_p", "p"),
            Column(INDEPENDENT, "p", "p"),
            Column("Likelihood ratio", "statistic", "number", 1),
            Column("df", "df", "number"),
        )
        rows = tuple(
            (test.name, test.conclusion.verdict, test.observer_p, test.p, test.statistic, test.df)
            for test in effects.tests
        )
        blocks.append(Table("factor_tests", "Tests of each factor (type II)", columns, rows))
    if effects.interactions:
        crossed = (
            Column("Interaction", "interaction"),
            Column("Verdict", "verdict"),
            Column("p by observers (Holm)", "observer_p_holm", "p"),
            Column("p by observers", "observer_p", "p"),
            Column(f"{INDEPENDENT} (Holm)", "p_holm", "p"),
            Column(INDEPENDENT, "p", "p"),
            Column("Likelihood ratio", "statistic", "number", 1),
            Column("df", "df", "number"),
            Column("Not fitted because", "not_fitted"),
        )
        lines = tuple(
            (
                " × ".join(test.names),
                test.conclusion.verdict,
                test.observer_p_holm,
                test.by_observers.p if test.by_observers else None,
                test.p_holm,
                test.p,
                test.statistic,
                test.df,
                test.not_fitted,
            )
            for test in effects.interactions
        )
        blocks.append(Table("factor_interactions", "Interactions of two factors", crossed, lines, folded=True))
    words = explained_words(effects)
    return [*blocks, Paragraph(words)] if words else blocks


def explained_words(effects: FactorEffects) -> str:
    """Return how much the factors explain, with their lack of fit in the same sentence; empty without free scores."""
    explained = effects.explained
    if explained is None or explained.r_squared is None or explained.deviance_share is None:
        return ""
    words = (
        f"The factors explain {percent(explained.deviance_share)} of the deviance that free scores explain, and "
        f"{percent(explained.r_squared)} of the variance of the scores (R² = {fixed(explained.r_squared, 3)})"
    )
    lack = explained.conclusion
    if lack.verdict is None:
        return f"{words}."
    but = ", but stimuli differ in ways that the factors do not name" if lack.verdict == "distinguished" else ""
    return f"{words}{but}; {lack.sentence}"
