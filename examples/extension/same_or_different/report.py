"""d' of each observer: how well they tell pictures apart, whatever they prefer to answer.

Macmillan and Creelman (2005), chapter 9: of independent observations, p(c) unbiased = Phi((z(H) - z(F)) / 2) and
d' = 2 z((1 + sqrt(2 p(c) - 1)) / 2); rates are (count + 0.5) / (n + 1), so that none is 0 or 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt

from scipy.stats import norm

from analysis.records import SessionLog
from analysis.report import Part
from documents import counted
from documents.pages import Column, Section, Table
from same_or_different.record import SameOrDifferentRecord


def d_prime(hits: int, different: int, false_alarms: int, same: int) -> float:
    """Return d', 0 where an observer calls same pictures different as often as others."""
    hit, false = (hits + 0.5) / (different + 1), (false_alarms + 0.5) / (same + 1)
    unbiased = norm.cdf((norm.ppf(hit) - norm.ppf(false)) / 2)
    return float(2 * norm.ppf((1 + sqrt(max(0.0, 2 * unbiased - 1))) / 2))


def part(sessions: Sequence[SessionLog]) -> Part | None:
    """Return what a report says of same-or-different trials; None without any."""
    rows = []
    for log in sessions:
        trials = log.of(SameOrDifferentRecord)
        unlike = [trial.answer == "different" for trial in trials if trial.first != trial.second]
        alike = [trial.answer == "different" for trial in trials if trial.first == trial.second]
        if trials:
            value = d_prime(sum(unlike), len(unlike), sum(alike), len(alike))
            rows.append((log.header.observer, len(trials), value))
    if not rows:
        return None
    measured = Column("d′", "d_prime", "number", 2)
    columns = (Column("observer", "observer"), Column("trials", "trials", "number"), measured)
    table = Table("same_or_different", "d′ of each observer", columns, tuple(rows))
    return Part(
        key="same_or_different",
        result=[dict(zip(("observer", "trials", "d_prime"), row, strict=True)) for row in rows],
        sentences=(f"{counted(len(rows), 'observer', 'observers')} told whether pictures were the same.",),
        sections=lambda pictures: (Section("same_or_different", "Same or different", (table,)),),
        analysis=lambda cited: "d′ is that of independent observations (Macmillan and Creelman 2005).",
        effects="The effect size of same-or-different trials is d′.",
    )
