"""What proves a part of the report: ours keep the promises, one that breaks one is found out; one alone is made."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from analysis.report import Part
from cyclopean import report
from cyclopean.testing import BrokenPromiseError, prove_report_part
from documents import InputError

RATING = "kind: rating, ratings: [{name: like, question: How good, lowest: 1, highest: 5}]"
PART = """
from analysis.kinds import KINDS
from analysis.report import Part
from documents.pages import Column, Section, Table

def part(sessions):
    given = [(log.header.observer, trial.response_time_s) for log in sessions for trial in log.of(KINDS["rating"])]
    if not given:
        return None
    table = Table("times", "", (Column("Observer", "observer"), Column("Time", "time", "number")), tuple(sorted(given)))
    section = Section("times", "Response times", (table,))
    return Part(key="times", result={"s": dict(sorted(given))}, sections=lambda pictures: (section,))
"""
BROKEN = {
    "made of its records": ("dict(sorted(given))", "set(given)"),
    "every session": ("for log in sessions for", "for log in sessions[:1] for"),
    "order of sessions": ("dict(sorted(given))", "given[:9]"),
    "not finished": ("(table,))", "(table,)) if sessions[0].complete else None"),
    "without its records": ("return None", 'return Part(sentences=["There are none."])'),
}


def _part(said: str) -> Callable[..., Part | None]:
    held: dict[str, Any] = {}
    exec(PART.replace(*BROKEN.get(said, ("", ""))), held)
    part: Callable[..., Part | None] = held["part"]
    return part


@pytest.mark.parametrize("said", BROKEN)
def test_a_broken_promise_is_found(said: str, tmp_path: Path) -> None:
    with pytest.raises(BrokenPromiseError, match=said):
        prove_report_part("ratings", RATING, tmp_path, part=_part(said))


def test_ours_and_a_sound_one_keep_the_promises_and_can_be_made_alone(tmp_path: Path) -> None:
    threshold = "kind: threshold, factor: codec, task: yes_no, stimuli: [a, b, c], trials: 4"
    for at, (name, entry) in enumerate((("ratings", RATING), ("thresholds", threshold))):
        (tmp_path / str(at)).mkdir()
        assert len(prove_report_part(name, entry, tmp_path / str(at))) == 6
    (tmp_path / "sound").mkdir()
    assert len(prove_report_part("ratings", RATING, tmp_path / "sound", part=_part(""))) == 6
    with pytest.raises(InputError, match=r"no part 'rating' \(did you mean 'ratings'"):
        report(tmp_path / "0" / "results-01", part="rating", with_simulated=True)
