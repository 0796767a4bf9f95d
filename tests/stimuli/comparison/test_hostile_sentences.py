"""Every sentence of a verdict from numbers that are unknown, infinite, nought or far too large."""

from __future__ import annotations

import itertools
import math
import re

import pytest

from stimuli.comparison import Evidence, SparklePair, judge, outcome_lines, passing_lines
from stimuli.comparison.by_pixel import DifferenceSummary
from stimuli.comparison.evidence import RegistrationEvidence, sparkle_reasons
from stimuli.comparison.verdict import Limits

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
        for together in (None, *HOSTILE):
            pair = SparklePair("width", photo, photo_se, rendering, rendering_se, "px", "plate", together)
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
