"""Sessions described: what was answered becomes the results of the page, and their sentences on a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from analysis.choices import Adjust, CovarianceChoice
from analysis.comparisons.session_comparisons import grouped_comparisons, is_comparison
from analysis.errors import ResultsError
from analysis.observers.filters import Filter, keep
from analysis.observers.table import observers_in_sessions
from analysis.records.answered_by import pool
from analysis.records.results import refuse_mixtures
from analysis.records.session_record import SessionLog
from analysis.report.checks import FailedCheck, failed_checks
from analysis.report.conclusions import conclusions_blocks, conclusions_of
from analysis.report.grouped import GroupedSummary, summarise_groups
from analysis.report.methods import methods_of
from analysis.report.notes import on_sessions
from analysis.report.part import Part, parts_of, scale_parts_of
from analysis.report.report import Report
from analysis.report.reviewers import group_reviews_of, review_of
from analysis.report.scores import beside_words
from analysis.report.summary import Summary, summarise
from analysis.report.words import counted
from analysis.scaling.shown import Published, group_blocks, score_blocks
from documents import Finding
from documents.pages import Badge, Block, Paragraph

_KEYS = {
    "factors",
    "series",
    "ratings",
    *Report.json_keys.values(),
    *(name.split(".")[-1] for name in Report.json_names.split()),
}
SHUFFLES = 999  # permutations for the test against unrelated preferences: p to three digits


def describe(
    sessions: Sequence[SessionLog],
    alpha: float | None = None,
    adjust: Adjust | None = None,
    covariance: CovarianceChoice | None = None,
    rule: Filter | None = None,
    given: Mapping[str, str] | None = None,
    part: str | None = None,
) -> Report:
    """Compute all results of the sessions of an experiment.

    Parameters
    ----------
    sessions
        Sessions of one experiment, such as `analysis.records.results.read_results` gives.
    alpha, adjust, covariance
        As `analysis.report.summary.summarise`.
    rule
        Which observers to leave out; nobody if None, but simulated observers do not count beside people.
    given
        Facts for Methods that no log holds, by the code of their item (`analysis.report.METHODS_ITEMS`).
    part
        The name of the one part to make, as records have it, without scores, other parts and Methods; None makes all.

    Returns
    -------
    Report
        A part for each kind of task that has answers.

    Raises
    ------
    ResultsError
        If the sessions cannot be analysed together, have no answer or a damaged record, or ``given`` or ``part`` names
        something else; as `analysis.observers.filters`.

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
    >>> describe([log]).kinds
    ('Paired comparisons',)
    """
    rule = rule or Filter()
    refuse_mixtures(pool(sessions, with_simulated=rule.with_simulated).sessions)
    kept = keep(sessions, rule)
    remaining = kept.sessions
    answered = any(not trial.is_page for session in remaining for trial in session.trials)
    if not (answered or any(session.complete for session in remaining)):
        files = ", ".join(str(session.file) for session in remaining[:3])
        what = "the results hold no answer"
        raise ResultsError(Finding(what, files, remedy="answer some trials first"))
    pairs, grouped = (None, None) if part else _compared(remaining, alpha, adjust, covariance)
    compared = pairs or grouped
    of_scales: tuple[Part, ...] = ()
    failed: tuple[FailedCheck, ...] = ()

    def taken() -> set[str]:
        return {*_KEYS, *(compared.to_json() if compared else ()), *(one.key for one in of_scales)}

    if compared and (grouped or (pairs and pairs.scores.classes is not None)):
        of_scales, failed = scale_parts_of(compared.comparisons, compared.header, taken)
    parts, not_made = parts_of(remaining, taken, part or "")
    every = (*of_scales, *parts)
    notes = [*kept.notes]
    notes += compared.notes if compared else [*on_sessions(remaining), *(() if part else _without_scores(remaining))]
    said = {sentence for one in every for sentence in one.sentences}  # they are in the head of the page
    notes = [note for note in notes if note not in said]
    notes += [note for one in every for note in one.notes]
    observers = None
    if compared:
        observers = observers_in_sessions(remaining, shuffles=SHUFFLES, comparisons=compared.comparisons)
    report = Report(
        header=remaining[0].header,
        sessions=tuple(remaining),
        kept=kept,
        pairs=pairs,
        groups=grouped,
        scale_parts=of_scales,
        observers=observers,
        review=review_of(pairs) if pairs else {},
        group_reviews=group_reviews_of(grouped) if grouped else {},
        parts=parts,
        notes=tuple(dict.fromkeys(notes)),
        failed=failed_checks(
            remaining, compared, observers, [*failed, *not_made, *(check for one in every for check in one.failed)]
        ),
        part=part or "",
    )
    report = replace(report, conclusions=conclusions_of(report))
    return report if part else replace(report, methods=methods_of(report, given or {}))


def _compared(
    sessions: Sequence[SessionLog],
    alpha: float | None,
    adjust: Adjust | None,
    covariance: CovarianceChoice | None,
) -> tuple[Summary | None, GroupedSummary | None]:
    """Return the paired comparisons on one scale, or on one for each group; None for both without any."""
    if not any(is_comparison(trial) and not trial.is_tie for session in sessions for trial in session.trials):
        return None, None
    comparisons, groups = grouped_comparisons(sessions)
    if groups is None:
        return summarise(sessions, alpha, adjust, covariance, comparisons), None
    return None, summarise_groups(sessions, comparisons, groups, alpha, adjust, covariance)


def _without_scores(sessions: Sequence[SessionLog]) -> Iterator[str]:
    """Yield why sessions without a preference for a stimulus have no scores."""
    trials = [trial for session in sessions for trial in session.trials]
    ties = sum(is_comparison(trial) for trial in trials)
    if ties:
        yield f"There are no scores: of {counted(ties, 'comparison')} none prefers one of its stimuli."
    if not any(trial.heading for trial in trials if not trial.is_practice):
        yield "There are no scores: the sessions have no comparison, choice, preference, rating or threshold."


def report_blocks(report: Report, published: Published | None = None) -> list[Block]:
    """Return the scores, a sentence for each part, who was left out, notes, what Methods lack, and checks that failed.

    Parameters
    ----------
    report
        The results, as `describe` returns them.
    published
        Score (0 to 1) and class by stimulus, published before, to show beside the computed ones.

    Returns
    -------
    list
        Blocks for `documents.pages`.
    """
    blocks: list[Block] = []
    if report.pairs is not None:
        blocks += score_blocks(report.pairs.scores, published)
        if report.pairs.beside is not None:
            blocks.append(Paragraph(f"Beside, as the experiment asks: {beside_words(report.pairs.beside)}"))
            blocks += score_blocks(report.pairs.beside, published)
    if report.groups is not None:
        blocks += group_blocks(report.groups.scored)
    left_out = f"{report.kept.rule.sentence} {report.kept.sentence}" if report.kept.left_out else ""
    failed = [
        Paragraph(f"{check.check}. {check.reason} {check.remedy}", mark=Badge("Check failed", "bad"))
        for check in report.failed
    ]
    return [
        *blocks,
        *map(Paragraph, filter(None, (report.headline, *report.sentences))),
        *conclusions_blocks(report.conclusions, report.cautions),
        *map(Paragraph, filter(None, [left_out])),
        *(Paragraph(note, mark=Badge("Note", "open")) for note in report.notes),
        *map(Paragraph, [report.methods.sentence] if report.methods.missing else []),
        *failed,
    ]
