"""What a reader must know before the numbers: simulation, missing answers, changed files, penalised fits."""

from __future__ import annotations

from collections.abc import Sequence

from analysis.observers.responses import catch_results
from analysis.ratings.preferences import preferences
from analysis.records.session_record import SessionLog
from analysis.report.estimate import Estimate
from analysis.scaling.scores import Scores

FEWEST_EXPECTED = 5.0
FEWEST_FOR_CHOSEN_PAIRS = 5


def notes_on(sessions: Sequence[SessionLog], found: Estimate) -> tuple[str, ...]:
    """Return the notes on paired comparisons, the weightiest first."""
    return (*on_sessions(sessions), *_on_answers(sessions, found.scores), *_on_fit(found))


def on_sessions(sessions: Sequence[SessionLog]) -> list[str]:
    """Return what must be known of the sessions, whatever was asked in them."""
    notes = []
    simulated = sum(session.header.simulated for session in sessions)
    if simulated == len(sessions):
        notes.append("All observers are simulated: these answers say nothing about people.")
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
        notes.append(f"{torn} {'log ends' if torn == 1 else 'logs end'} in a line cut short, which is not counted.")
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
        who = ", ".join(f"{observer} ({wrong} of {met})" for observer, (wrong, met) in catch.missed.items())
        notes.append(f"Catch trials with an obvious answer were answered otherwise by {who}.")
    if catch.identical:
        notes.append(
            f"Of {catch.identical} pairs of one stimulus with itself, the first place was chosen in {catch.first} "
            f"and the second in {catch.second}."
        )
    preferred = preferences(sessions)
    if preferred.by_observer:
        notes.append(preferred.sentence)
    return notes


def _on_fit(found: Estimate) -> list[str]:
    scores, plain = found.scores, found.plain
    comparisons = scores.comparisons
    notes = []
    if found.way == "learnt_prior":
        few = len(comparisons.observers) < FEWEST_FOR_CHOSEN_PAIRS
        notes.append(
            "Pairs were chosen by the answers before them. Scores are therefore the posterior under a normal prior "
            "whose width is learnt from the answers: a plain fit would make stimuli look further apart than they are. "
            + ("With so few observers, classes, consistency" if few else "Classes, consistency")
            + " and order effects are not to be read as if pairs had been drawn at random."
        )
    elif plain.separated:
        why = " ".join(plain.separation.sentences if plain.separation else ())
        if found.way == "firth":
            notes.append(f"No finite scores maximise the likelihood, so Firth's penalised fit is shown. {why}")
        else:
            notes.append(f"The stimuli have no common scale, so there are no scores. {why}")
    if not scores.fit.separated and not scores.fit.converged:
        notes.append(f"The fit did not converge in {scores.fit.iterations} steps.")
    fewest = _fewest_expected(scores)
    if fewest is not None and scores.fit.df > 0 and fewest < FEWEST_EXPECTED:
        notes.append(
            f"Some pairs have expected counts below {FEWEST_EXPECTED:g} (the smallest is {fewest:.2g}): the goodness "
            "of fit is a rough guide."
        )
    return notes


def _fewest_expected(scores: Scores) -> float | None:
    from analysis.scaling.laws import probabilities

    if scores.fit.separated:
        return None
    totals = scores.comparisons.totals
    expected = totals * probabilities(scores.fit.theta)
    return float(expected[totals > 0].min())
