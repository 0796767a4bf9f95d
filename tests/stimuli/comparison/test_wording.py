"""What is read first, and how: the verdict, what fails, what is noted, and in few lines what is kept."""

from __future__ import annotations

import pytest

from stimuli.comparison import Outcome, decision_sentence, outcome_lines, passing_heading, passing_lines
from stimuli.comparison.verdict import Limits, Reason, Verdict, decimals, together


def verdict(*reasons: Reason) -> Verdict:
    return Verdict("validated", reasons, Limits())


def reason(outcome: Outcome, value: float, subject: str = "regions", measure: str = "mean ΔE00") -> Reason:
    return Reason(subject, measure, outcome, f"{subject} {outcome} by {value}", value, 1.4)


def test_what_both_eyes_share_is_said_once() -> None:
    both = together(
        {
            "left eye": verdict(reason("noted", 1.0), reason("fails", 2.0), reason("passes", 0.25, "as seen")),
            "right eye": verdict(reason("noted", 1.0), reason("fails", 3.0), reason("passes", 0.5, "as seen")),
        }
    )
    assert outcome_lines(both, "noted") == ["both eyes: regions noted by 1.0"]
    assert outcome_lines(both, "fails") == ["left eye: regions fails by 2.0", "right eye: regions fails by 3.0"]
    assert passing_heading(both) == "Within their limits, left eye / right eye:"
    assert passing_lines(both) == ["as seen: mean ΔE00 0.25 / 0.50 (limit 1.4)"]
    assert decision_sentence(both) == "Not validated: 2 limits are not kept."


def test_what_one_eye_alone_keeps_names_the_eye() -> None:
    both = together({"left eye": verdict(reason("passes", 0.2)), "right eye": verdict(reason("fails", 2.0))})
    assert passing_lines(both) == ["left eye: regions: mean ΔE00 0.20 (limit 1.4)"]


def test_numbers_of_one_subject_stand_in_one_line() -> None:
    one = verdict(reason("passes", 0.2), reason("passes", 0.3, measure="largest ΔE00"))
    assert passing_lines(one) == ["regions: mean ΔE00 0.20 (limit 1.4), largest ΔE00 0.30 (limit 1.4)"]
    assert passing_heading(one) == "Within their limits:"
    assert passing_lines(verdict(reason("fails", 2.0))) == []


@pytest.mark.parametrize("count", [3, 4])
def test_many_regions_that_fail_stand_in_one_line(count: int) -> None:
    fails = [reason("fails", 2.0 + place, f"region {place}", "ΔE00") for place in range(count)]
    both = together({"left eye": verdict(*fails, reason("fails", 2.5)), "right eye": verdict(fails[0])})
    lines = outcome_lines(both, "fails")
    many = "left eye: 4 regions differ by more than ΔE00 1.4, most of all '3' by 5.00, '2' by 4.00, '1' by 3.00"
    assert (many in lines) == (count > 3)
    assert len(lines) == (3 if count > 3 else 4)


@pytest.mark.parametrize(("value", "text"), [(-0.001, "0.00"), (0.0, "0.00"), (-0.005001, "-0.01"), (-1.0, "-1.00")])
def test_nought_has_no_sign(value: float, text: str) -> None:
    assert decimals(value, 2) == text
