"""What observers said in the sessions of an experiment, whatever the task."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, get_args

from analysis.agreement.observed import ObservedGroup, observed_pairs
from analysis.agreement.observed_means import observed_ratings, observed_series
from analysis.choices import Adjust
from analysis.errors import ResultsError
from analysis.records.results import refuse_mixtures
from analysis.records.session_record import SessionLog
from analysis.report.summary import analysis_options
from documents import Finding

Task = Literal["pairs", "series", "ratings"]
TASKS: tuple[Task, ...] = get_args(Task)


def observed_groups(
    sessions: Sequence[SessionLog],
    *,
    task: str | None = None,
    alpha: float | None = None,
    adjust: Adjust | None = None,
) -> tuple[tuple[ObservedGroup, ...], tuple[str, ...]]:
    """Return what observers said of the stimuli of an experiment, and notes.

    Paired comparisons give a group for each set of stimuli that comparisons link, such as a scene; choices from series
    one for each series; ratings one for each scale.

    Parameters
    ----------
    sessions
        Sessions of one experiment, as `analysis.records.read_results` returns them.
    task
        ``pairs``, ``series``, ``ratings``, or a scale of the ratings, such as ``ratings:depth``; None takes the first
        that there is, and of ratings the first scale.
    alpha, adjust
        Level of the tests of pairs, and their correction; those of the first session's header where None.

    Returns
    -------
    tuple
        The groups, and sentences on what was left out.

    Raises
    ------
    ResultsError
        If the sessions are of several experiments, have no answer that says which stimulus is better, or are damaged.

    Examples
    --------
    >>> from pathlib import Path
    >>> from analysis.kinds import new_trial
    >>> from analysis.records import SessionLog, new_header
    >>> stimuli = ({"name": "a"}, {"name": "b"})
    >>> header = new_header("views", "01", "s1", "2026-01-31T09:30:00Z", seed=1, stimuli=stimuli)
    >>> utc, times = "2026-01-31T09:31:00Z", {"depth": 1.0}
    >>> said = [{"stimulus": name, "ratings": {"depth": n}, "rating_times_s": times} for n, name in enumerate("ab")]
    >>> rated = [new_trial(0, n, "rating", (), 1.0, utc, data) for n, data in enumerate(said)]
    >>> groups, _ = observed_groups([SessionLog(Path("session.jsonl"), header, tuple(rated), complete=True)])
    >>> groups[0].name, groups[0].scores.tolist()
    ('depth', [0.0, 1.0])
    """
    refuse_mixtures(sessions)
    options = analysis_options(sessions, alpha, adjust, None)
    wanted, _, scale = (task or "").partition(":")
    if task is not None and (wanted not in TASKS or (scale and wanted != "ratings")):
        raise ResultsError(
            Finding(f"there is no task '{task}'", remedy="one of: pairs, series, ratings, ratings:SCALE")
        )
    pairs, notes = observed_pairs(sessions, options)
    ratings = observed_ratings(sessions, options)
    found: dict[str, tuple[ObservedGroup, ...]] = {
        "pairs": pairs,
        "series": observed_series(sessions, options),
        **{f"ratings:{group.name}": (group,) for group in ratings},
    }
    there = [name for name, groups in found.items() if groups]
    if not there:
        files = ", ".join(str(session.file) for session in sessions[:3])
        what = notes[0] if notes else "the results hold no comparison, choice or rating"
        raise ResultsError(Finding(what.rstrip("."), files, remedy="answer some trials first"))
    chosen = next((name for name in there if task is None or name == task or name.partition(":")[0] == task), None)
    if chosen is None:
        raise ResultsError(Finding(f"the results have no {task}", remedy=f"they have: {', '.join(there)}"))
    others = [name for name in there if name != chosen]
    if others:
        typed = ", ".join(f"--task {name}" for name in others)
        notes = (*notes, f"The answers are those of {chosen}; the sessions have others too: {typed}.")
    return found[chosen], notes if chosen == "pairs" else notes[len(notes) - bool(others) :]
