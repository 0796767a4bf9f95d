"""What observers said in the sessions of an experiment, whatever the task."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np

from analysis.bootstrap import REPLICATES, SEED, draw_observers
from analysis.choices import Adjust
from analysis.classes import TIED, corrected, two_sided_p
from analysis.errors import ResultsError
from analysis.ratings import rating_tables
from analysis.records import SessionLog, refuse_mixtures
from analysis.report import MOST_ITEMS_DRAWN, AnalysisOptions, analysis_options
from analysis.series import KIND as SERIES
from analysis.series import gather
from documents import Finding
from documents.arrays import Flags, Floats
from extensions.agreement.observed import Drawn, ObservedGroup, observed_pairs

_BLOCK_NUMBERS = 4_000_000


def observed_series(sessions: Sequence[SessionLog], options: AnalysisOptions) -> tuple[ObservedGroup, ...]:
    """Return a group for each series: the share of choices that each of its pictures got; none without any."""
    if not any(trial.kind == SERIES for session in sessions for trial in session.trials):
        return ()
    choices = gather(sessions)
    series = choices.design.series
    chosen = [np.zeros((len(choices.observers), len(one.stimuli))) for one in series]
    for choice in choices.choices:
        chosen[choice.series][choice.observer, choice.index] += 1
    return tuple(
        of_means(
            one.name,
            "choices from a series",
            "share of choices",
            one.stimuli,
            times,
            np.repeat(choices.counts[:, [number]], len(one.stimuli), axis=1).astype(np.float64),
            alpha=options["alpha"],
            adjust=_simple(options["adjust"]),
        )
        for number, (one, times) in enumerate(zip(series, chosen, strict=True))
    )


def observed_ratings(sessions: Sequence[SessionLog], options: AnalysisOptions) -> tuple[ObservedGroup, ...]:
    """Return a group for each scale: the mean rating of each stimulus, larger for better; none without any.

    Ratings that followed a choice between two are left out: they hang on what a stimulus stood beside.
    """
    groups = []
    for table in rating_tables(sessions):
        if table.of != "alone":
            continue
        given = np.isfinite(table.values)
        groups.append(
            of_means(
                table.scale,
                "ratings",
                "points",
                table.stimuli,
                np.where(given, table.values, 0.0).sum(axis=2),
                given.sum(axis=2).astype(np.float64),
                alpha=options["alpha"],
                adjust=_simple(options["adjust"]),
            )
        )
    return tuple(groups)


def of_means(
    name: str,
    task: str,
    unit: str,
    stimuli: Sequence[str],
    total: Floats,
    count: Floats,
    *,
    alpha: float,
    adjust: Adjust,
) -> ObservedGroup:
    """Return a group whose scores are means over observers' answers, such as ratings or shares of choices.

    Observers are drawn as for comparisons, and the tests are those of `analysis.classes.classify` with the covariance
    between observers and Student's law.

    Parameters
    ----------
    total, count
        Shape (S, n): the sum of each observer's answers on each stimulus, and how many there are. Each stimulus has
        at least one.
    """
    people = int((count.sum(axis=1) > 0).sum())
    scores = total.sum(axis=0) / count.sum(axis=0)
    drawn = None
    differs = np.zeros((len(stimuli), len(stimuli)), dtype=np.bool_)
    if people > 1:
        differs = differing_means(total, count, np.ones((1, len(total))), alpha=alpha, adjust=adjust)[0]
        if len(stimuli) <= MOST_ITEMS_DRAWN:
            weights, means = draw_means(total, count)
            drawn = Drawn(means, means - scores, differing_means(total, count, weights, alpha=alpha, adjust=adjust))
    return ObservedGroup(name, task, unit, tuple(stimuli), scores, differs, people, drawn)


def _simple(adjust: Adjust) -> Adjust:
    """Return the correction for means: Holm's in place of the single step, which needs a model's covariance."""
    return "holm" if adjust == "maxz" else adjust


def draw_means(total: Floats, count: Floats) -> tuple[Floats, Floats]:
    """Return draws of observers, shape (R, S), and the means that they give, (R, n); those without an answer are out.

    ``total`` and ``count`` are as in `of_means`.
    """
    weights = draw_observers(len(total), REPLICATES, SEED)
    answers = weights @ count
    whole = (answers > 0).all(axis=1)
    return weights[whole], (weights @ total)[whole] / answers[whole]


def differing_means(total: Floats, count: Floats, weights: Floats, *, alpha: float, adjust: Adjust) -> Flags:
    """Return which means differ in each draw of observers, shape (R, n, n): a test of each pair by Student's law.

    Each observer moves a mean by the sum of its answers about that mean over the number of all answers; the variance
    of a difference is that of these moves between the observers. Where all observers agree without exception there is
    no spread to test by, and no significance, as in `analysis.classes.classify`.

    Parameters
    ----------
    total, count
        As in `of_means`.
    weights
        Shape (R, S): how often each observer was drawn.
    """
    n = total.shape[1]
    first, second = np.triu_indices(n, 1)
    out = np.zeros((len(weights), n, n), dtype=np.bool_)
    size = max(1, _BLOCK_NUMBERS // (len(total) * max(1, len(first))))
    for start in range(0, len(weights), size):
        drawn = weights[start : start + size]
        answers = drawn @ count
        means = (drawn @ total) / answers
        moves = (total[None] - count[None] * means[:, None]) / answers[:, None]  # (B, S, n)
        people = drawn.sum(axis=1)
        apart = moves[:, :, first] - moves[:, :, second]
        variance = (drawn[:, :, None] * apart**2).sum(axis=1) * (people / (people - 1))[:, None]
        off = np.abs(means[:, first] - means[:, second])
        error = np.sqrt(variance)
        spread = error > TIED * np.abs(means).max(axis=1, initial=0.0)[:, None]
        t = np.divide(off, error, out=np.zeros_like(off), where=spread)
        differs = corrected(two_sided_p(t, (people - 1)[:, None]), adjust) <= alpha
        block = out[start : start + size]
        block[:, first, second] = block[:, second, first] = differs
    return out


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
