"""All results of an experiment, computed once for the page, the terminal and JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

from analysis.classes.conclusions import Conclusion
from analysis.kinds.kinds import KINDS
from analysis.observers.filters import KeptSessions
from analysis.observers.table import ObserverTable
from analysis.records.lines import Header
from analysis.records.seen import what_eyes_saw
from analysis.records.session_record import SessionLog
from analysis.report.checklist import Methods
from analysis.report.checks import FailedCheck
from analysis.report.grouped import GroupedSummary
from analysis.report.not_reported import UnreportedField, unreported
from analysis.report.part import Part
from analysis.report.reviewers import Review
from analysis.report.summary import Summary
from analysis.simulation.smallest import SmallestDifference
from documents.text import JsonResult


@dataclass(frozen=True, slots=True, eq=False)
class Report(JsonResult):
    """The results on the page; None for what has no records.

    Attributes
    ----------
    header
        Header of the first session that was kept.
    sessions
        The sessions that were kept.
    kept
        The rule by which observers were left out, and who was.
    pairs, groups
        Paired comparisons: scores and classes, on one scale or, where pairs were compared within groups, on one for
        each.
    scale_parts, observers
        What else is said of them, such as what the stimuli's factors do, and the observer table.
    review
        What reviewers ask of the scores, by its key in JSON; empty without scores on one scale.
    group_reviews
        Of scores within groups, the probability of every pair, equivalence and other analyses, by the group's name.
    parts
        What is said of trials of other kinds, as these name it: series, ratings, preferences, thresholds.
    notes
        Sentences that a reader needs before the numbers.
    failed
        The checks that failed, with reason and remedy.
    methods
        What a Methods section says, item by item, with blanks for what nobody recorded.
    conclusions
        What is concluded of each question, the headline first.
    part
        The name of the one part that was asked for; empty where all were.
    """

    header: Header
    sessions: tuple[SessionLog, ...]
    kept: KeptSessions
    pairs: Summary | None
    groups: GroupedSummary | None
    scale_parts: tuple[Part, ...]
    observers: ObserverTable | None
    review: Review
    group_reviews: Mapping[str, Review]
    parts: tuple[Part, ...]
    notes: tuple[str, ...]
    failed: tuple[FailedCheck, ...]
    methods: Methods = field(default_factory=Methods)
    conclusions: tuple[Conclusion, ...] = ()
    part: str = ""
    json_keys: ClassVar = {
        "kept": "left_out",
        "pairs": "*",
        "groups": "*",
        "failed": "failed_checks",
        "observers": "observer_table",
        "by_part": "*",
        "by_scale": "*",
        "number": "sessions",
    }
    json_names: ClassVar = (
        "header.experiment header.question number kept what_eyes_saw pairs groups conclusions notes failed by_scale "
        "observers review group_reviews by_part methods not_reported"
    )

    @property
    def kinds(self) -> tuple[str, ...]:
        """The kinds of tasks, in words, such as "Paired comparisons"."""
        kinds = dict.fromkeys(trial.kind for session in self.sessions for trial in session.trials)
        records = (record for kind, record in KINDS.items() if kind in kinds)
        headings = (record.heading for record in records if self.part in ("", record.report_part))
        return tuple(dict.fromkeys(filter(None, headings)))

    @property
    def smallest(self) -> SmallestDifference | None:
        """The smallest difference that the design finds, as `analysis.report.summary.ReportSummary` has it."""
        compared = self.pairs or self.groups
        return compared.smallest if compared else None

    @property
    def headline(self) -> str:
        """The main conclusion in a sentence; empty where nothing is tested."""
        return f"Main conclusion. {self.conclusions[0].sentence}" if self.conclusions else ""

    @property
    def sentences(self) -> tuple[str, ...]:
        """The numbers of observers and answers, a sentence for each part."""
        sentences = [compared.sentence for compared in (self.pairs, self.groups) if compared is not None]
        if self.smallest is not None and self.smallest.nats is not None:
            sentences.append(self.smallest.sentence)  # one that finds nothing is among the notes
        return (*sentences, *(sentence for part in self.all_parts for sentence in part.sentences))

    @property
    def by_part(self) -> dict[str, Any]:
        """The result of each part; those of series and of ratings are always there."""
        return {"series": None, "ratings": None} | {part.key: part.result for part in self.parts if part.key}

    @property
    def by_scale(self) -> dict[str, Any]:
        """The result of each part of pairs that were compared; that of factors is always there."""
        return {"factors": None} | {part.key: part.result for part in self.scale_parts if part.key}

    @property
    def cautions(self) -> list[str]:
        """What to bear in mind of the conclusions."""
        return [caution for part in self.scale_parts for caution in part.cautions]

    @property
    def all_parts(self) -> tuple[Part, ...]:
        """The parts of pairs that were compared, then those of other trials."""
        return (*self.scale_parts, *self.parts)

    @property
    def number(self) -> int:
        """How many sessions there are."""
        return len(self.sessions)

    @property
    def what_eyes_saw(self) -> list[dict[str, Any]]:
        """What observers saw, each with how many sessions it is of."""
        return [{"sessions": count, **seen.to_json()} for seen, count in what_eyes_saw(self.sessions).items()]

    @property
    def not_reported(self) -> tuple[UnreportedField, ...]:
        """What the sessions hold and the report does not show."""
        return unreported(self.sessions)
