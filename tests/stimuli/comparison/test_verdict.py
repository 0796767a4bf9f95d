"""The verdict: every number against its limit, with its reason."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from stimuli.comparison import Evidence, Region, RegionTable, SparklePair, judge
from stimuli.comparison.areas import AreaMean
from stimuli.comparison.by_pixel import DifferenceSummary, seen_regions
from stimuli.comparison.disparities import EyesPair
from stimuli.comparison.evidence import RegistrationEvidence
from stimuli.comparison.eye_evidence import EyesEvidence
from stimuli.comparison.table import region_table
from stimuli.comparison.verdict import Limits, Reason, Verdict, together
from stimuli.measures import SeenPicture, difference_map

WHITE = np.array([96.42, 100.0, 82.49])
SQUARE = np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 9.0]])
SMALL = DifferenceSummary(1000, 0.4, 0.3, 0.9, 1.2, 2.0, 1.4, 0.5)
LARGE = DifferenceSummary(1000, 3.1, 2.8, 9.0, 12.0, 20.0, 1.4, 66.0)


def table(*lightness: float, saturated: float = 0.0) -> RegionTable:
    """Grey regions: the rendering's luminance times these."""
    names = [chr(ord("a") + place) for place in range(len(lightness))]
    regions = [Region(name, "rectangle", SQUARE, SQUARE, name) for name in names]
    photo = [AreaMean(400, 0.4 * WHITE, np.zeros(3), None, saturated)] * len(lightness)
    rendering = [AreaMean(400, 0.4 * share * WHITE, np.zeros(3), None, 0.0) for share in lightness]
    return region_table(regions, photo, rendering, WHITE)


def depth(across: float, error: float) -> EyesEvidence:
    measures = {"disparity across": EyesPair(1.0, 1.0 + across, across, error)}
    return EyesEvidence(measures | {"disparity down": EyesPair(0.0, 0.0, 0.0, 0.01)}, squares=(20, 20))


def only(verdict: Verdict, outcome: str) -> Reason:
    (reason,) = [one for one in verdict.reasons if one.outcome == outcome]
    return reason


def test_all_within_is_validated() -> None:
    evidence = Evidence(
        table(1.0, 1.0),
        SMALL,
        SMALL,
        (SparklePair("density", 100.0, 5.0, 100.0, 5.0, "per cm²", "plate"),),
        RegistrationEvidence(0.02),
        depth(0.01, 0.02),
    )
    verdict = judge(evidence)
    assert verdict.decision == "validated"
    assert {reason.outcome for reason in verdict.reasons} == {"passes"}
    subjects = {reason.subject.split()[0] for reason in verdict.reasons}
    assert subjects == {"regions", "as", "per", "sparkle", "registration", "disparity"}
    json.dumps(verdict.to_json(), allow_nan=False)


def test_a_region_over_the_limit_fails_by_name_and_number() -> None:
    verdict = judge(Evidence(table(1.0, 1.0, 1.0, 1.5)))
    assert verdict.decision == "not validated"
    first = verdict.reasons[0]
    assert (first.subject, first.outcome, first.limit) == ("region d", "fails", 1.4)
    assert first.value is not None
    assert first.value > 1.4
    assert f"ΔE00 {first.value:.2f}" in first.sentence


def test_the_limit_may_be_set() -> None:
    evidence = Evidence(table(1.0, 1.05))
    assert judge(evidence).decision == "validated"
    assert judge(evidence, Limits(delta_e=0.5)).decision == "not validated"
    with pytest.raises(ValidationError, match="delta_e"):
        Limits(delta_e=-1)
    with pytest.raises(ValidationError, match="sparkle_z"):
        Limits(sparkle_z=math.nan)


def test_what_cancels_at_the_distance_passes_and_is_noted() -> None:
    verdict = judge(Evidence(table(1.0), LARGE, SMALL))
    assert verdict.decision == "validated"
    notes = [reason.sentence for reason in verdict.having("noted")]
    assert len(notes) == 2
    assert all("it cancels at the viewing distance" in note for note in notes)


def test_regions_too_small_to_be_seen_do_not_fail() -> None:
    small = Evidence(table(1.5, 0.6), seen=SMALL, seen_regions={"a": 0.3, "b": 0.4})
    verdict = judge(small)
    assert verdict.decision == "validated"
    assert "it cancels with what is beside" in verdict.having("noted")[0].sentence
    assert judge(replace(small, seen_regions={"a": 0.3, "b": 3.0})).decision == "not validated"
    assert judge(replace(small, seen_regions={"a": 0.3})).decision == "not validated"


def test_a_checkerboard_of_regions_cancels_where_the_eye_is_far() -> None:
    board = np.indices((64, 64)).sum(axis=0) // 2 % 2
    photo = np.asarray(0.4 * WHITE * (1 + 0.2 * (board[..., None] - 0.5)), dtype=np.float32)
    rendering = np.asarray(0.4 * WHITE * (1 - 0.2 * (board[..., None] - 0.5)), dtype=np.float32)
    regions = [Region("cell", "cell", SQUARE / 9 * 2 + 20, SQUARE / 9 * 2 + 20, "g")]
    near, far = (
        seen_regions(
            difference_map(SeenPicture(photo, ppd, WHITE), SeenPicture(rendering, ppd, WHITE), WHITE, filtered=True),
            regions,
        )
        for ppd in (4, 200)
    )
    assert near["cell"] > 2
    assert far["cell"] < 0.1


def test_what_is_seen_fails() -> None:
    verdict = judge(Evidence(table(1.0), LARGE, LARGE))
    assert verdict.decision == "not validated"
    assert all(reason.subject == "as seen" for reason in verdict.having("fails"))
    assert not any("cancels" in reason.sentence for reason in verdict.reasons)


def test_without_a_distance_a_local_difference_is_left_open() -> None:
    assert judge(Evidence(table(1.0), LARGE)).decision == "cannot say"
    assert judge(Evidence(table(1.0), SMALL)).decision == "validated"


def test_a_few_bad_pixels_do_not_fail_and_many_do() -> None:
    few, many = (replace(SMALL, above_limit_percent=share) for share in (4.9, 5.1))
    assert judge(Evidence(seen=few)).decision == "validated"
    assert only(judge(Evidence(seen=many)), "fails").measure == "share above the limit"


def test_pictures_that_lie_apart_say_nothing_of_pixels() -> None:
    verdict = judge(Evidence(table(1.0), LARGE, LARGE, registration=RegistrationEvidence(0.4)))
    assert verdict.decision == "cannot say"
    reason = only(verdict, "cannot say")
    assert (reason.measure, reason.value, reason.limit) == ("residual", 0.4, 0.25)


@pytest.mark.parametrize(
    ("photo", "photo_se", "rendering", "rendering_se", "outcome"),
    [
        (100.0, 2.0, 130.0, 2.0, "fails"),  # large and certain
        (100.0, 2.0, 70.0, 2.0, "fails"),
        (100.0, 0.5, 105.0, 0.5, "noted"),  # certain and small: five percent more sparkle
        (100.0, 20.0, 130.0, 20.0, "cannot say"),  # large, but may be chance
        (100.0, 2.0, 101.0, 2.0, "passes"),
        (4.0, 2.0, 4.2, 2.0, "cannot say"),  # too few to tell
        (4.0, 2.0, 4.0, 2.0, "passes"),  # the very same
        (0.0, 1.0, 0.0, 1.0, "passes"),
        (0.0, 1.0, 50.0, 7.0, "fails"),
        (0.0, 1.0, 1.0, 1.0, "cannot say"),
        (50.0, 7.0, 0.0, 1.0, "fails"),
        (math.nan, math.nan, math.nan, math.nan, "noted"),
        (3.0, math.nan, 4.0, 0.1, "cannot say"),
        (math.nan, math.nan, 4.0, 0.1, "cannot say"),
    ],
)
def test_sparkle_must_differ_by_more_than_chance_and_by_more_than_matters(
    photo: float, photo_se: float, rendering: float, rendering_se: float, outcome: str
) -> None:
    pair = SparklePair("density", photo, photo_se, rendering, rendering_se, "per cm²", "plate")
    verdict = judge(Evidence(sparkle=(pair,)))
    (reason,) = verdict.reasons
    assert reason.outcome == outcome
    assert (reason.subject, reason.measure) == ("sparkle on 'plate'", "density")
    json.dumps([verdict.to_json(), pair.to_json()], allow_nan=False)


def test_a_ratios_error_is_that_of_repetition() -> None:
    rng = np.random.default_rng(1)
    photo, rendering = rng.normal(100, 3, 20000), rng.normal(120, 4, 20000)
    told = SparklePair("density", 100, 3, 120, 4).relative_se
    assert told == pytest.approx(np.std(rendering / photo), rel=0.03)


@pytest.mark.parametrize(
    ("across", "error", "decision"),
    [
        (0.4, 0.01, "validated"),
        (0.9, 0.01, "not validated"),
        (0.6, 0.2, "cannot say"),
        (math.nan, 0.1, "cannot say"),
        (0.0, 0.5, "validated"),
        (0.0, 1.1, "cannot say"),  # no difference found, but known less well than to the limit of 0.5 px
        (4.0, 1.1, "not validated"),
    ],
)
def test_disparity(across: float, error: float, decision: str) -> None:
    verdict = judge(Evidence(eyes=depth(across, error)))
    assert verdict.decision == decision


def test_nothing_to_judge_is_no_verdict() -> None:
    assert judge(Evidence()).decision == "cannot say"
    verdict = judge(Evidence(table(1.0, saturated=0.5)))
    assert verdict.decision == "cannot say"
    assert "no region is left" in only(verdict, "cannot say").sentence
    assert "saturated" in only(verdict, "noted").sentence


def test_one_eye_decides_for_both() -> None:
    good, bad = judge(Evidence(table(1.0))), judge(Evidence(table(2.0)))
    both = together({"left eye": good, "right eye": bad})
    assert both.decision == "not validated"
    assert all(reason.sentence.startswith("right eye: ") for reason in both.having("fails"))
    assert together({"left eye": good, "right eye": good}).decision == "validated"
    with pytest.raises(ValueError, match="no verdicts"):
        together({})


def test_a_scatter_that_all_share_names_nobody() -> None:
    rng = np.random.default_rng(2)
    colours = WHITE * rng.uniform(0.1, 0.9, (24, 3))
    regions = [Region(str(place), "patch", SQUARE, SQUARE, "chart") for place in range(24)]
    photo = [AreaMean(400, colour, np.zeros(3), None, 0.0) for colour in colours]
    rendering = [AreaMean(400, c * rng.normal(1, 0.02, 3), np.zeros(3), None, 0.0) for c in colours]
    notes = judge(Evidence(region_table(regions, photo, rendering, WHITE))).having("noted")
    assert len(notes) <= 2
    common = [AreaMean(400, colour * [1.02, 1.0, 1.0], np.zeros(3), None, 0.0) for colour in colours]
    (shift,) = judge(Evidence(region_table(regions, photo, common, WHITE))).having("noted")
    assert "shifted alike" in shift.sentence


def test_a_map_of_another_limit_is_not_judged() -> None:
    assert judge(Evidence(seen=SMALL), Limits(delta_e=1.0)).decision == "cannot say"


def test_how_the_pictures_lay_is_noted() -> None:
    lay = RegistrationEvidence(0.02, (0.4, 0.0), (0.01, 0.01), 2.0)
    said = [reason.sentence for reason in judge(Evidence(table(1.0), registration=lay)).having("noted")]
    assert "(0.40, 0.00) px" in said[0]
    assert "2.00°" in said[1]
    within = RegistrationEvidence(0.02, (0.4, 0.0), (0.2, 0.2), 0.0)
    assert not judge(Evidence(table(1.0), registration=within)).having("noted")


def test_the_right_mean_colour_and_the_wrong_sparkle_fail() -> None:
    pairs = (SparklePair("density", 400.0, 20.0, 520.0, 22.8), SparklePair("contrast", 3.0, 0.1, 3.01, 0.1))
    verdict = judge(Evidence(table(1.0), SMALL, SMALL, pairs))
    assert verdict.decision == "not validated"
    assert "30.0 ± 8.6 % more" in only(verdict, "fails").sentence
