"""From the records of sessions to comparisons: one experiment at a time, each session once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeGuard

from analysis.comparisons.comparisons import Answer, Comparisons, from_answers
from analysis.comparisons.session_groups import SessionGroups, session_groups
from analysis.errors import ResultsError
from analysis.kinds.pair import PairRecord
from analysis.kinds.trial import Trial
from analysis.records.results import refuse_mixtures
from analysis.records.session_record import SessionLog
from documents import Finding


def is_comparison(trial: Trial) -> TypeGuard[PairRecord]:
    """Return whether ``trial`` compares two stimuli for the sake of their scores: catch trials do not."""
    return isinstance(trial, PairRecord) and trial.is_scored


def from_sessions(sessions: Sequence[SessionLog]) -> Comparisons:
    """Gather the paired comparisons of one experiment's sessions.

    Answers that prefer neither stimulus stand apart, as ties; catch trials are left out. Where the pairs were chosen
    within groups, such as scenes, and none links them, or where blocks compared stimuli of their own, each answer has
    its group: the level of the factor that tells the groups apart, or else the number of the block.

    Parameters
    ----------
    sessions
        Sessions of one experiment, as `read_results` returns them.

    Returns
    -------
    Comparisons
        Who was preferred over whom, by which observer.

    Raises
    ------
    ResultsError
        If there is no session or no answer, a session stands there twice, the sessions belong to different
        experiments or show different stimuli, or a trial names no stimulus of its header.

    Examples
    --------
    >>> from pathlib import Path
    >>> from analysis.kinds import new_trial
    >>> from analysis.records import SessionLog, new_header
    >>> pair = ({"name": "a"}, {"name": "b"})
    >>> header = new_header("views", "01", "s1", "2026-01-31T09:30:00Z", seed=1, stimuli=pair)
    >>> answer = {"first": "a", "second": "b", "answer": "first", "chosen": "a", "rejected": "b"}
    >>> trial = new_trial(0, 0, "all_pairs", (), 1.2, "2026-01-31T09:31:00Z", answer)
    >>> log = SessionLog(Path("session.jsonl"), header, (trial,), complete=True)
    >>> comparisons = from_sessions([log])
    >>> comparisons.items, comparisons.wins.tolist()
    (('a', 'b'), [[0.0, 1.0], [0.0, 0.0]])
    """
    return grouped_comparisons(sessions)[0]


def grouped_comparisons(sessions: Sequence[SessionLog]) -> tuple[Comparisons, SessionGroups | None]:
    """Return the comparisons of `from_sessions`, and their groups.

    Parameters
    ----------
    sessions
        Sessions of one experiment, as `read_results` returns them.

    Returns
    -------
    tuple[Comparisons, SessionGroups | None]
        The comparisons, and the groups that they fall into; None if the comparisons link all stimuli.

    Raises
    ------
    ResultsError
        As `from_sessions`.

    Examples
    --------
    >>> from pathlib import Path
    >>> from analysis.kinds import new_trial
    >>> from analysis.records import SessionLog, new_header
    >>> stimuli = tuple({"name": name, "factors": {"scene": name[0]}} for name in ("a1", "a2", "b1", "b2"))
    >>> header = new_header("views", "01", "s1", "2026-01-31T09:30:00Z", seed=1, stimuli=stimuli)
    >>> def data(scene):
    ...     one, other = f"{scene}1", f"{scene}2"
    ...     pair = {"first": one, "second": other, "answer": "first", "chosen": one, "rejected": other}
    ...     return {**pair, "group": scene, "group_factor": "scene"}
    >>> utc = "2026-01-31T09:31:00Z"
    >>> trials = tuple(new_trial(0, n, "all_pairs", (), 1.2, utc, data(scene)) for n, scene in enumerate("ab"))
    >>> _, groups = grouped_comparisons([SessionLog(Path("session.jsonl"), header, trials, complete=True)])
    >>> groups.factor, groups.names
    ('scene', ('a', 'b'))
    """
    refuse_mixtures(sessions)
    header = sessions[0].header
    compared = [
        (trial, _answer(session.header.observer, trial))
        for session in sessions
        for trial in session.trials
        if is_comparison(trial)
    ]
    groups = session_groups(header, compared)
    group_of = groups.group_of if groups else {}
    answers = [answer for _, answer in compared]
    if groups or any(answer.group for answer in answers):
        answers = [replace(answer, group=group_of.get(answer.winner, "")) for answer in answers]
    ties = sum(answer.tie for answer in answers)
    if ties == len(answers):
        files = ", ".join(str(session.file) for session in sessions[:3])
        why = f": {'the one answer prefers' if ties == 1 else f'all {ties} answers prefer'} neither" if ties else ""
        raise ResultsError(
            Finding(f"the results have no paired comparison{why}", files, remedy="answer some trials first")
        )
    return from_answers(answers, header.stimulus_names, groups.names if groups else ()), groups


def _answer(observer: str, trial: PairRecord) -> Answer:
    tied = trial.first, trial.second
    return Answer(
        trial.chosen or tied[0], trial.rejected or tied[1], 1.0, observer, tied[0], trial.is_tie, trial.group or ""
    )
