"""Notes that a reader needs before the numbers: simulation, missing answers, changed files, penalised fits."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import astuple
from itertools import chain

from analysis.comparisons.comparisons import Comparisons
from analysis.observers.fast_answers import FastAnswers
from analysis.observers.responses import catch_results
from analysis.ratings.ratings import preferences
from analysis.records.answered_by import who_answered
from analysis.records.codes import Sitting, notes_on_codes, notes_on_sittings
from analysis.records.session_record import SessionLog
from analysis.records.times import SessionTimes
from analysis.records.versions import Changes, Version
from analysis.report.estimate import Estimate
from analysis.report.seen import filters_notes
from analysis.report.words import counted, listed, some
from analysis.scaling.lack_of_fit import OneScale
from analysis.seals.seal import notes_on_seals
from analysis.simulation.smallest import SmallestDifference
from documents.files import unprotected

FEWEST_FOR_CHOSEN_PAIRS = 5
LONG_STOP_S = 12 * 3600.0  # another day


def notes_on(
    sessions: Sequence[SessionLog], estimate: Estimate, fits: OneScale | None, smallest: SmallestDifference | None
) -> tuple[str, ...]:
    """Return the notes on paired comparisons, the most important first."""
    answers = _on_answers(sessions, estimate.scores.comparisons)
    design = smallest.warnings if smallest else ()
    return (*on_sessions(sessions), *answers, *design, *_on_fit(estimate, fits))


def notes_on_groups(
    sessions: Sequence[SessionLog],
    comparisons: Comparisons,
    groups: str,
    estimates: Sequence[tuple[str, Estimate]],
    caveats: Sequence[tuple[str, str]],
    further: Sequence[str],
) -> tuple[str, ...]:
    """Return the notes on pairs that were compared within groups, the most important first.

    ``groups`` says in a sentence what the groups are, ``estimates`` are those of each, by name, and of all together,
    ``caveats`` on the test of their fit, and ``further`` are notes of their own.
    """
    notes = [*on_sessions(sessions), groups, *_on_answers(sessions, comparisons), *further]
    if any(estimate.method == "learnt_prior" for _, estimate in estimates):
        notes += _on_method(next(estimate for _, estimate in estimates if estimate.method == "learnt_prior"))
    for sentence, concerns in _CONCERNS:
        names = [name for name, estimate in estimates if concerns(estimate)]
        if names:
            notes.append(f"{sentence}: {some(names)}.")
    if caveats:
        (name, caveat), *others = caveats
        notes.append(f"In {name}: {caveat}" + (f" Likewise in {some([other for other, _ in others])}." * bool(others)))
    return tuple(notes)


def on_sessions(sessions: Sequence[SessionLog]) -> list[str]:
    """Return the notes on sessions of any kind."""
    notes = [*_on_nominal(sessions), *filters_notes(sessions)]
    who = who_answered(sessions)
    if who.all_simulated:
        notes.append("All observers are simulated: these are not answers of people.")
    elif who.are_mixed:
        count = who.simulated_sessions
        are = "is" if count == 1 else "are"
        notes.append(f"{count} of {len(sessions)} sessions {are} simulated, mixed with those of people.")
    if len({session.header.observer for session in sessions}) == 1:
        notes.append(
            "There is one observer: scores, intervals and tests are this observer's, and say nothing of others."
        )
    notes += notes_on_codes(map(Sitting.of, sessions))
    notes += notes_on_sittings(sessions)
    incomplete = sum(not session.complete for session in sessions)
    if incomplete:
        what = "session was" if incomplete == 1 else "sessions were"
        notes.append(f"{incomplete} {what} not completed; the answers given until then are counted.")
    unseen = sum(trial.wrong_screen for session in sessions for trial in session.trials)
    if unseen:
        notes.append(f"In {counted(unseen, 'trial')} the panel was larger than the screen: a part was not seen.")
    notes += _on_presses_and_windows(sessions)
    notes += [f"{sentence}." for sentence in unprotected(session.chained_from for session in recorded(sessions))]
    notes += _on_stops(sessions)
    torn = sum(bool(session.torn_tail) for session in sessions)
    if torn:
        notes.append(f"{torn} {'log ends' if torn == 1 else 'logs end'} in an incomplete line, which is not counted.")
    notes += _on_versions(sessions)
    accepted = {name for session in sessions for stop in session.resumptions for name in stop.accepted_changes}
    notes += [f"The {name} changed while a session was stopped, which was accepted." for name in sorted(accepted)]
    if len({session.header.display.mode for session in sessions}) > 1:
        notes.append("The sessions were shown in different display modes.")
    notes += notes_on_seals(sessions)
    said = {str(nominal.words) for session in sessions if (nominal := session.header.display.nominal)}
    remarks = dict.fromkeys(str(remark) for session in sessions for remark in session.header.remarks)
    return notes + [remark for remark in remarks if not any(words in remark for words in said)]


def _on_versions(sessions: Sequence[SessionLog]) -> Iterator[str]:
    """Yield what changed between sessions, by the names of files where they were kept, and who had which version."""
    begun = [session for session in sessions if session.header.hashes]
    begun.sort(key=lambda session: session.header.started_utc)
    groups: dict[tuple[tuple[str, str], ...], list[SessionLog]] = {}
    for session in begun:
        hashes = {name: str(digest) for name, digest in session.header.hashes.items() if name != "configuration"}
        groups.setdefault(tuple(sorted(hashes.items())), []).append(session)
    first, *others = groups.values() or [[]]
    changed = [c for other in others if (c := Version.of_log(other[0]).changes_since(Version.of_log(first[0])))]
    if changed:
        whole = Changes(*(tuple(dict.fromkeys(chain(*parts))) for parts in zip(*map(astuple, changed), strict=True)))
        observers = (list(dict.fromkeys(session.header.observer for session in group)) for group in groups.values())
        who = "; ".join(map(some, observers))
        subject = whole.subject[0].upper() + whole.subject[1:]
        yield f"{subject} changed between sessions{whole.names}. By version, the first one first: observers {who}."


def recorded(sessions: Sequence[SessionLog]) -> list[SessionLog]:
    """Return the sessions that were read from a log."""
    return [session for session in sessions if session.state.lines]


def _on_stops(sessions: Sequence[SessionLog]) -> Iterator[str]:
    """Yield where the clock had been set back when a session was resumed, and who was resumed on another day."""
    said = []
    for session in sessions:
        if not session.resumptions:
            continue
        stops = [stop for stop in SessionTimes.of(session).stops if stop.gap_s is None or stop.gap_s >= LONG_STOP_S]
        said += [f"{session.header.observer}'s session {session.header.session}: {stop.sentence}" for stop in stops]
    if said:
        yield f"Sessions that stood still for long, or whose clock was set back: {some(said)}."


def _on_presses_and_windows(sessions: Sequence[SessionLog]) -> Iterator[str]:
    """Yield which sessions were answered faster than anyone looks, and what became of marks and windows meanwhile."""
    for session in sessions:
        if not session.header.simulated and (haste := FastAnswers.of(session.trials)).striking:
            yield f"In session {session.header.session} of observer {session.header.observer} {haste.words}."
    unsent = sum(
        any(mark.failed is not None for mark in trial.timing_marks) for session in sessions for trial in session.trials
    )
    if unsent:
        yield f"Timing marks were not sent in {counted(unsent, 'trial')}: the trials' records say which, and why."
    counts = Counter(event.what for session in sessions for event in session.windows)
    away = sum(trial.window_lost for session in sessions for trial in session.trials)
    if counts:
        happened = {what: counts[name] for name, what in _WINDOWS.items() if counts[name]}
        parts = listed(f"{what} {counted(count, 'time')}" for what, count in happened.items())
        yield f"A window {parts} during a session; {counted(away, 'trial')} had it out of focus or minimised."


_WINDOWS = {
    "lost_focus": "lost the focus",
    "minimised": "was minimised",
    "resized": "changed its size",
    "moved": "went to another monitor",
}


def nominal_words(sessions: Sequence[SessionLog]) -> str:
    """Return what the displays of ``sessions`` that were not measured were taken for; empty if all were measured."""
    displays = [session.header.display.nominal for session in sessions]
    return "; ".join(dict.fromkeys(nominal.said for nominal in displays if nominal))


def _on_nominal(sessions: Sequence[SessionLog]) -> Iterator[str]:
    """Yield that displays were not measured: before all else, because every colour depends on it."""
    trials = [trial for session in sessions for trial in session.trials]
    not_measured = sum(trial.nominal is not None for trial in trials)
    of_headers = sum(session.header.display.nominal is not None for session in sessions)
    if not (not_measured or of_headers):
        return
    what = f"The display is nominal, not measured ({nominal_words(sessions) or 'as the trials state'})"
    if 0 < not_measured < len(trials) or 0 < of_headers < len(sessions):
        what += f" in {not_measured} of {len(trials)} trials, and measured in the others"
    yield f"{what}. Colours are those of a standard; to know them, measure it: cyclopean display measure."


def _on_answers(sessions: Sequence[SessionLog], comparisons: Comparisons) -> list[str]:
    notes = []
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
    if (same := catch.identical).trials:
        notes.append(
            f"Of {same.trials} pairs of a stimulus with itself, the first position was chosen in {same.first} "
            f"and the second in {same.second}."
        )
    preferred = preferences(sessions)
    if preferred.by_observer:
        notes.append(preferred.sentence)
    return notes


def _on_fit(estimate: Estimate, fits: OneScale | None) -> list[str]:
    scores, notes = estimate.scores, _on_method(estimate)
    if not scores.fit.separated and not scores.fit.converged:
        notes.append(f"The fit did not converge in {scores.fit.iterations} steps.")
    if fits is not None and fits.caveat:
        notes.append(fits.caveat)
    return notes


# By whether the posterior is scaled by how much observers differ.
_WIDTH_UNDER_PRIOR = {
    True: " Intervals and classes allow for observers who differ: the posterior is scaled by how much more their "
    "answers vary than the law says.",
    False: " Intervals treat all answers as independent: where observers differ, they are too narrow.",
}


def _on_method(estimate: Estimate) -> list[str]:
    plain, comparisons = estimate.plain, estimate.scores.comparisons
    if estimate.method == "learnt_prior":
        few = len(comparisons.observers) < FEWEST_FOR_CHOSEN_PAIRS
        return [
            "Pairs were chosen by the answers before them. Scores are therefore the posterior under a normal prior "
            "whose standard deviation is learnt from the answers: maximum likelihood would overestimate differences. "
            + ("With so few observers, classes, consistency" if few else "Classes, consistency")
            + " and order effects do not have the properties that they have for pairs drawn at random."
            + _WIDTH_UNDER_PRIOR[estimate.covariance == "scaled"]
        ]
    if not plain.separated:
        return []
    why = " ".join(plain.separation.sentences if plain.separation else ())
    if estimate.method == "firth":
        return [f"There is no finite estimate: complete separation. Firth's penalised fit is shown. {why}"]
    return [f"The stimuli have no common scale, so there are no scores. {why}"]


_CONCERNS: tuple[tuple[str, Callable[[Estimate], bool]], ...] = (
    (
        "There is no finite estimate, because of complete separation, and Firth's penalised fit is shown, in",
        lambda estimate: estimate.method == "firth",
    ),
    (
        "The stimuli have no common scale, because too few pairs were answered, in",
        lambda estimate: bool(estimate.plain.separated) and estimate.method == "ml",
    ),
    (
        "The fit did not converge in",
        lambda estimate: not estimate.scores.fit.separated and not estimate.scores.fit.converged,
    ),
)
