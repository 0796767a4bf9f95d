"""How far observers agree, in words and as a table: Kendall's u of paired comparisons, and coefficients of series."""

from __future__ import annotations

from analysis.observers.concordance import Concordance
from analysis.report.words import fixed, p_words
from analysis.series.agreement import Coefficient, SeriesAgreement
from documents.pages import Block, Cell, Column, Paragraph, ShownAs, Table

LEVEL = 0.05


def agreement_words(agreement: Concordance) -> str:
    """Return the agreement between observers and its test, in words."""
    p, others = agreement.strangers_p, "observers with unrelated tastes would"
    if p is None and agreement.chance is not None:
        p, others = agreement.chance.p, "observers who answer at random would"
    scale = f"Kendall's u = {fixed(agreement.u, 3)} between {agreement.observers} observers"
    scale += f", where 0 is as by chance, 1 is full agreement and {fixed(agreement.least, 3)} the least possible."
    if p is None:
        return scale
    if p < LEVEL:
        return f"Observers agree more than {others} ({p_words(p)}). {scale}"
    less = " They disagree more often than they agree." if agreement.u < 0 else ""
    return f"It was not shown that observers agree more than {others} ({p_words(p)}).{less} {scale}"


def series_agreement(agreement: SeriesAgreement) -> tuple[Block, ...]:
    """Return the coefficients of choices from series and their ratings, and why some of them are not defined."""
    columns = (
        Column("Of", "of"),
        Column("Coefficient", "coefficient"),
        Column("Value", "value", "number", 2),
        Column("95 %", "value", "interval", 2),
        Column("p", "p", "p"),
        Column("Note", "note"),
    )
    coefficients = [("choices", coefficient) for coefficient in agreement.choices]
    coefficients += [(scale, coefficient) for scale, many in agreement.ratings.items() for coefficient in many]
    reasons = list(dict.fromkeys(coefficient.reason for _, coefficient in coefficients if coefficient.reason))
    rows = tuple(
        (
            of,
            coefficient.name,
            _bounded(coefficient.value, coefficient),
            _bounded_interval(coefficient),
            coefficient.p,
            f"({reasons.index(coefficient.reason) + 1})" if coefficient.reason else None,
        )
        for of, coefficient in coefficients
    )
    used = len(columns) if reasons else len(columns) - 1
    title = f"Agreement between {agreement.observers} observers over {agreement.series} series"
    table = Table("series_agreement", title, columns[:used], tuple(row[:used] for row in rows))
    notes = [Paragraph(f"({number}) {reason}", small=True) for number, reason in enumerate(reasons, start=1)]
    words = (
        "All coefficients are 1 if the observers agree completely. 0 means agreement as by chance for κ and α, and no "
        "agreement for W and ICC; p is of the test of no agreement."
    )
    return table, *notes, Paragraph(words, small=True)


def _bounded(value: float | None, coefficient: Coefficient) -> Cell:
    """Return a value; in words where there is none, or where it is below what means anything."""
    if value is None:
        return ShownAs(None, "not defined")
    least = coefficient.least
    return ShownAs(value, f"≤ {least:g}") if least is not None and value < least else value


def _bounded_interval(coefficient: Coefficient) -> Cell:
    low, high, least = coefficient.low, coefficient.high, coefficient.least
    if high is None or least is None or (low is not None and low >= least):
        return low, high
    # An end below what means anything, or, of a mean over observers, none at all.
    return ShownAs((low, high), f"≤ {least:g}" if high < least else f"≤ {least:g} to {fixed(high, 2)}")
