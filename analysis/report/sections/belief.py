"""Can the scores be believed: fit, order, ties, catch trials, agreement."""

from __future__ import annotations

from analysis.errors import ResultsError
from analysis.observers.catch_trials import catch_results
from analysis.observers.concordance import Concordance
from analysis.report.blocks import Facts, Section
from analysis.report.sections.scores import fit_words
from analysis.report.summary import Summary
from analysis.report.words import fixed, p_words, percent
from analysis.scaling.pair_fit import ModelFit, fit_model


def belief_section(summary: Summary, agreement: Concordance | None) -> Section:
    """Return what speaks for and against the scores."""
    comparisons = summary.scores.comparisons
    simulated = " (simulated)" if summary.simulated else ""
    sessions = f"{len(summary.sessions)} session{'' if len(summary.sessions) == 1 else 's'}"
    rows = [
        ("Observers", f"{len(summary.observers)}{simulated}, in {sessions}"),
        ("Comparisons", f"{summary.trials:,}" + (f", and {comparisons.ties:g} ties" if comparisons.ties else "")),
        ("Goodness of fit", fit_words(summary)),
    ]
    rows += _sides(summary)
    rows += _ties(summary)
    if agreement is not None:
        rows.append(("Agreement", agreement_words(agreement)))
    caught = catch_results(summary.sessions)
    if caught.obvious:
        missed = sum(wrong for wrong, _ in caught.missed.values())
        rows.append(("Catch trials", f"{caught.obvious - missed} of {caught.obvious} obvious ones answered right."))
    rows.append(("Response time", f"Median {fixed(summary.response_time_s, 2)} s"))
    return Section("belief", "Can the scores be believed?", (Facts(tuple(rows)),))


def agreement_words(agreement: Concordance) -> str:
    """Say how well observers agree, and how likely that is among strangers or coins."""
    words = f"Kendall's u = {fixed(agreement.u, 3)} between {agreement.observers} observers"
    if agreement.strangers_p is not None:
        return (
            f"{words}; between strangers with judgements as firm, so much or more has {p_words(agreement.strangers_p)}."
        )
    if agreement.chance is not None:
        return f"{words}; were each answer the toss of a coin, so much or more has {p_words(agreement.chance.p)}."
    return f"{words}."


def _sides(summary: Summary) -> list[tuple[str, str]]:
    if summary.first_share is None or summary.first_share_interval is None:
        return []
    low, high = summary.first_share_interval
    words = (
        f"{percent(summary.first_share, 1)} of the answers chose the position “{first_position(summary)}” "
        f"(95 %: {fixed(100 * low, 1)} to {fixed(100 * high, 1)})."
    )
    ordered = order_fit(summary)
    if ordered is not None and ordered.order_test is not None:
        effect = ordered.parameters[-1]
        if effect.factor is not None:
            value, least, most = effect.factor
            words += (
                f" With the stimuli's differences allowed for, it multiplies the odds by {fixed(value, 2)} "
                f"({fixed(least, 2)} to {fixed(most, 2)}); likelihood-ratio test {p_words(ordered.order_test.p)}."
            )
    return [("Side or order", words)]


def order_fit(summary: Summary) -> ModelFit | None:
    """Return the fit with an order effect; None where it cannot be fitted."""
    if summary.estimate.way != "ml" or summary.estimate.plain.separated:
        return None
    try:
        found = fit_model(summary.scores.comparisons, order_effect=True, covariance=summary.estimate.covariance)
    except ResultsError:
        return None
    return found if found.separation is None else None


def _ties(summary: Summary) -> list[tuple[str, str]]:
    comparisons = summary.scores.comparisons
    if not comparisons.ties:
        return []
    share = comparisons.ties / (comparisons.ties + float(comparisons.count.sum()))
    words = f"{percent(share, 1)} of the answers prefer neither; the scores leave them out."
    tied = tie_fit(summary)
    if tied is not None and tied.parameters[0].factor is not None:
        value, low, high = tied.parameters[0].factor
        words += f" Davidson's ν = {fixed(value, 2)} ({fixed(low, 2)} to {fixed(high, 2)})."
    return [("Ties", words)]


def tie_fit(summary: Summary) -> ModelFit | None:
    """Return Davidson's fit of ties; None without ties, or where it has no maximum."""
    if not summary.scores.comparisons.ties:
        return None
    try:
        found = fit_model(summary.scores.comparisons, "davidson", covariance=summary.estimate.covariance)
    except ResultsError:
        return None
    return found if found.separation is None else None


def first_position(summary: Summary) -> str:
    """Return what the first position is called."""
    for session in summary.sessions:
        for trial in session.trials:
            if "first_position" in trial.data:
                return str(trial.data["first_position"])
    return "first"
