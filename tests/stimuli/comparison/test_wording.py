"""What is read first, and how: the verdict, what fails, what is noted, and in few lines what is kept."""

from __future__ import annotations

import itertools
import math
import re

import pytest

from stimuli.comparison import (
    Evidence,
    Outcome,
    SparklePair,
    decision_sentence,
    judge,
    outcome_lines,
    passing_heading,
    passing_lines,
)
from stimuli.comparison.by_pixel import DifferenceSummary
from stimuli.comparison.evidence import RegistrationEvidence, sparkle_reasons
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


HOSTILE = (math.nan, math.inf, 0.0, 0.37, 1e12)
# What no sentence has: a number that is none, an exponent, a number without its own decimals, a space too many.
NO_SENTENCE = re.compile(r"\bnan\b|\binf\b|\d[eE][+-]?\d|-0\.0*\b(?!\d)|  | [,.:;]")


def wrong(line: str) -> bool:
    return bool(NO_SENTENCE.search(line))


def test_what_is_looked_for_is_found() -> None:
    bad = ("sparkle width is nan px", "133 ± 1.1e+02 % more", "differs by inf", "lay (-0.00, 0.10) px beside")
    assert all(wrong(line) for line in bad)
    assert not wrong("sparkle width is unknown in the rendering and 2.2881 ± 0.0074 px in the photograph")


def test_sparkle_of_any_numbers() -> None:
    for photo, photo_se, rendering, rendering_se in itertools.product(HOSTILE, repeat=4):
        for joint_se in (None, *HOSTILE):
            pair = SparklePair("width", photo, photo_se, rendering, rendering_se, "px", "plate", joint_se)
            (reason,) = sparkle_reasons([pair], Limits())
            assert not wrong(reason.sentence), reason.sentence


def test_what_is_not_known_is_said_in_words() -> None:
    pair = SparklePair("width", 2.28812, 0.00742, math.nan, math.nan, "px", "plate")
    (reason,) = sparkle_reasons([pair], Limits())
    assert reason.outcome == "cannot say"
    assert reason.sentence == (
        "sparkle width on 'plate' is unknown in the rendering and 2.2881 ± 0.0074 px in the photograph: "
        "there are too few sparkles"
    )
    (reason,) = sparkle_reasons([SparklePair("contrast", 2.0, 0.4, 4.652, 2.08)], Limits())
    assert "4.7 ± 2.1 in the rendering and 2.00 ± 0.40 in the photograph, 130 ± 110 % more" in reason.sentence


@pytest.mark.parametrize("residual", [None, 0.0, 1e-9, 0.37, 113.2, 1e12])
@pytest.mark.parametrize("share", [0.0, 1e-9, 0.37, 100.0])
@pytest.mark.parametrize("mean", [0.0, 1e-9, 1.2, 113.2])
def test_maps_and_registration_of_any_numbers(residual: float | None, share: float, mean: float) -> None:
    summary = DifferenceSummary(
        pixels=100, mean=mean, median=mean, p95=mean, p99=mean, largest=mean, limit=1.4, above_limit_percent=share
    )
    registration = RegistrationEvidence(residual, (-0.021, 113.0), (1e-9, 0.0), -0.011)
    for seen, other in itertools.product((None, summary), (False, True)):
        evidence = Evidence(per_pixel=summary, seen=seen, registration=registration, other_flakes=other)
        verdict = judge(evidence, Limits())
        for outcome in ("fails", "cannot say", "noted"):
            assert not any(wrong(line) for line in outcome_lines(verdict, outcome))
        assert not any(wrong(line) for line in passing_lines(verdict))
