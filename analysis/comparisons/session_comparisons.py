"""From the records of sessions to comparisons: one experiment at a time, each session once."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import replace

from analysis.comparisons.columns import KINDS, TIES
from analysis.comparisons.comparisons import Answer, Comparisons, from_answers
from analysis.comparisons.session_groups import SessionGroups, session_groups
from analysis.errors import ResultsError
from analysis.records.results import refuse_mixtures
from analysis.records.session_record import SessionLog, Trial
from documents import Finding


def is_comparison(trial: Trial) -> bool:
    """Return whether ``trial`` compares two stimuli for the sake of their scores: catch trials do not."""
    return trial.kind in KINDS and trial.data.get("catch") is None


def is_tie(trial: Trial) -> bool:
    """Return whether the answer prefers neither."""
    return trial.data.get("answer") in TIES


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
    >>> from analysis.records import Header, SessionLog, Trial
    >>> pair = ({"name": "a"}, {"name": "b"})
    >>> header = Header("views", "01", "s1", "2026-01-31T09:30:00Z", 1, "?", False, pair, {}, {}, {}, {}, {})
    >>> answer = {"first": "a", "second": "b", "answer": "first", "chosen": "a", "rejected": "b"}
    >>> trial = Trial(0, 0, "all_pairs", (), 1.2, "2026-01-31T09:31:00Z", answer)
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
    >>> from analysis.records import Header, SessionLog, Trial
    >>> stimuli = tuple({"name": name, "factors": {"scene": name[0]}} for name in ("a1", "a2", "b1", "b2"))
    >>> header = Header("views", "01", "s1", "2026-01-31T09:30:00Z", 1, "?", False, stimuli, {}, {}, {}, {}, {})
    >>> pairs = [{"chosen": f"{scene}1", "rejected": f"{scene}2", "group": scene} for scene in "ab"]
    >>> trials = tuple(Trial(0, n, "all_pairs", (), 1.2, "2026-01-31T09:31:00Z", pair) for n, pair in enumerate(pairs))
    >>> _, groups = grouped_comparisons([SessionLog(Path("session.jsonl"), header, trials, complete=True)])
    >>> groups.factor, groups.names
    ('scene', ('a', 'b'))
    """
    refuse_mixtures(sessions)
    header = sessions[0].header
    names = [str(stimulus["name"]) for stimulus in header.stimuli]
    known = frozenset(names)
    compared = [
        (trial, _answer(session, trial, known))
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
    return from_answers(answers, names, groups.names if groups else ()), groups


def _answer(session: SessionLog, trial: Trial, names: Set[str]) -> Answer:
    tie = is_tie(trial)
    try:
        item_a, item_b = (str(trial.data[key]) for key in (("first", "second") if tie else ("chosen", "rejected")))
    except KeyError as error:
        raise ResultsError(
            Finding(f"the {_where(trial)} has no {error}", str(session.file), remedy="restore the file")
        ) from None
    for name in (item_a, item_b):
        if names and name not in names:
            what = f"{_where(trial)} shows '{name}', no stimulus of the session"
            raise ResultsError(Finding(what, str(session.file), remedy="restore the file"))
    if item_a == item_b:
        what = f"{_where(trial)} compares '{item_a}' with itself"
        raise ResultsError(Finding(what, str(session.file), remedy="restore the file"))
    first = trial.data.get("first")
    group = trial.data.get("group")
    return Answer(
        item_a,
        item_b,
        1.0,
        session.header.observer,
        None if first is None else str(first),
        tie,
        "" if group is None else str(group),
    )


def _where(trial: Trial) -> str:
    return f"trial {trial.trial} of block {trial.block}"
