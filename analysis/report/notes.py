"""Notes that a reader needs before the numbers: simulation, missing answers, changed files, penalised fits."""

from __future__ import annotations

from collections.abc import Sequence

from analysis.observers.responses import catch_results
from analysis.ratings.preferences import preferences
from analysis.records.session_record import SessionLog
from analysis.report.estimate import Estimate
from analysis.scaling.scores import Scores

FEWEST_EXPECTED = 5.0
FEWEST_FOR_CHOSEN_PAIRS = 5


def notes_on(sessions: Sequence[SessionLog], estimate: Estimate) -> tuple[str, ...]:
    """Return the notes on paired comparisons, the most important first."""
    return (*on_sessions(sessions), *_on_answers(sessions, estimate.scores), *_on_fit(estimate))


def on_sessions(sessions: Sequence[SessionLog]) -> list[str]:
    """Return the notes on sessions of any kind."""
    notes = []
    simulated = sum(session.header.simulated for session in sessions)
    if simulated == len(sessions):
        notes.append("All observers are simulated: these are not answers of people.")
    elif simulated:
        notes.append(
            f"{simulated} of {len(sessions)} sessions {'is' if simulated == 1 else 'are'} simulated, mixed with "
            "those of people."
        )
    incomplete = sum(not session.complete for session in sessions)
    if incomplete:
        what = "session was" if incomplete == 1 else "sessions were"
        notes.append(f"{incomplete} {what} not completed; the answers given until then are counted.")
    torn = sum(bool(session.torn_tail) for session in sessions)
    if torn:
        notes.append(f"{torn} {'log ends' if torn == 1 else 'logs end'} in an incomplete line, which is not counted.")
    notes += [
        f"The {name} changed between sessions."
        for name in sorted({key for session in sessions for key in session.header.hashes})
        if len({str(session.header.hashes.get(name)) for session in sessions}) > 1
    ]
    if len({str(session.header.display.get("mode")) for session in sessions}) > 1:
        notes.append("The sessions were shown in different display modes.")
    remarks = dict.fromkeys(str(remark) for session in sessions for remark in session.header.remarks)
    return notes + list(remarks)


def _on_answers(sessions: Sequence[SessionLog], scores: Scores) -> list[str]:
    notes = []
    comparisons = scores.comparisons
    if comparisons.ties:
        total = comparisons.ties + int(comparisons.count.sum())
        notes.append(
            f"{comparisons.ties} of {total} answers {'prefers' if comparisons.ties == 1 else 'prefer'} neither "
            f"stimulus; the scores leave {'it' if comparisons.ties == 1 else 'them'} out."
        )
    catch = catch_results(sessions)
    if catch.missed:
        who = ", ".join(f"{observer} ({wrong} of {answered})" for observer, (wrong, answered) in catch.missed.items())
        notes.append(f"Obvious catch trials were missed by {who}.")
    if catch.identical:
        notes.append(
            f"Of {catch.identical} pairs of a stimulus with itself, the first position was chosen in {catch.first} "
            f"and the second in {catch.second}."
        )
    preferred = preferences(sessions)
    if preferred.by_observer:
        notes.append(preferred.sentence)
    return notes


def _on_fit(estimate: Estimate) -> list[str]:
    scores, plain = estimate.scores, estimate.plain
    comparisons = scores.comparisons
    notes = []
    if estimate.method == "learnt_prior":
        few = len(comparisons.observers) < FEWEST_FOR_CHOSEN_PAIRS
        notes.append(
            "Pairs were chosen by the answers before them. Scores are therefore the posterior under a normal prior "
            "whose standard deviation is learnt from the answers: maximum likelihood would overestimate differences. "
            + ("With so few observers, classes, consistency" if few else "Classes, consistency")
            + " and order effects do not have the properties that they have for pairs drawn at random."
        )
    elif plain.separated:
        why = " ".join(plain.separation.sentences if plain.separation else ())
        if estimate.method == "firth":
            notes.append(f"There is no finite estimate: complete separation. Firth's penalised fit is shown. {why}")
        else:
            notes.append(f"The stimuli have no common scale, so there are no scores. {why}")
    if not scores.fit.separated and not scores.fit.converged:
        notes.append(f"The fit did not converge in {scores.fit.iterations} steps.")
    fewest = _fewest_expected(scores)
    if fewest is not None and scores.fit.df > 0 and fewest < FEWEST_EXPECTED:
        notes.append(
            f"Some pairs have expected counts below {FEWEST_EXPECTED:g} (the smallest is {fewest:.2g}): the goodness "
            "of fit is approximate."
        )
    return notes


def _fewest_expected(scores: Scores) -> float | None:
    from analysis.scaling.laws import probabilities

    if scores.fit.separated:
        return None
    totals = scores.comparisons.totals
    expected = totals * probabilities(scores.fit.theta)
    return float(expected[totals > 0].min())
