"""The verdict and its wording, and measures that are asked for."""

from __future__ import annotations

import itertools
import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from stimuli.comparison import (
    CompareOptions,
    Evidence,
    Outcome,
    PairedArea,
    RegionTable,
    SparklePair,
    compare_pictures,
    decision_sentence,
    judge,
    outcome_lines,
    passing_heading,
    passing_lines,
)
from stimuli.comparison.areas import AreaMean
from stimuli.comparison.binocular_reasons import BinocularEvidence
from stimuli.comparison.by_pixel import DifferenceSummary, seen_regions
from stimuli.comparison.disparities import EyesPair
from stimuli.comparison.sparkles import sparkle_reasons
from stimuli.comparison.table import region_table
from stimuli.comparison.verdict import Limits, Reason, Verdict, decimals, together
from stimuli.measures import SeenPicture, ViewingConditions, difference_map
from tests.stimuli.comparison.scenes import PLATE, RIG, Cyclopean, compared, few, lies, written

# The verdict: every number against its limit, with its reason.

WHITE = np.array([96.42, 100.0, 82.49])
SQUARE = np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 9.0]])
SMALL = DifferenceSummary(1000, 0.4, 0.3, 0.9, 1.2, 2.0, 1.4, 0.5)
LARGE = DifferenceSummary(1000, 3.1, 2.8, 9.0, 12.0, 20.0, 1.4, 66.0)


def table(*lightness: float, saturated: float = 0.0) -> RegionTable:
    """Grey regions: the rendering's luminance times these."""
    names = [chr(ord("a") + place) for place in range(len(lightness))]
    regions = [PairedArea(name, "rectangle", SQUARE, SQUARE, name) for name in names]
    photo = [AreaMean(400, 0.4 * WHITE, np.zeros(3), None, saturated)] * len(lightness)
    rendering = [AreaMean(400, 0.4 * share * WHITE, np.zeros(3), None, 0.0) for share in lightness]
    return region_table(regions, photo, rendering, WHITE)


def depth(across: float, error: float) -> BinocularEvidence:
    measures = {"disparity across": EyesPair(1.0, 1.0 + across, across, error)}
    return BinocularEvidence(measures | {"disparity down": EyesPair(0.0, 0.0, 0.0, 0.01)}, squares=(20, 20))


def only(verdict: Verdict, outcome: str) -> Reason:
    (reason,) = [one for one in verdict.reasons if one.outcome == outcome]
    return reason


def test_all_within_is_validated() -> None:
    evidence = Evidence(
        table(1.0, 1.0),
        SMALL,
        SMALL,
        (SparklePair("density", 100.0, 5.0, 100.0, 5.0, "per cm²", "plate"),),
        lies(0.02),
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
    regions = [PairedArea("cell", "cell", SQUARE / 9 * 2 + 20, SQUARE / 9 * 2 + 20, "g")]
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
    verdict = judge(Evidence(table(1.0), LARGE, LARGE, registration=lies(0.4)))
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
    regions = [PairedArea(str(place), "patch", SQUARE, SQUARE, "chart") for place in range(24)]
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
    lay = lies(0.02, (0.4, 0.0), (0.01, 0.01), 2.0)
    said = [reason.sentence for reason in judge(Evidence(table(1.0), registration=lay)).having("noted")]
    assert "(0.40, 0.00) px" in said[0]
    assert "2.00°" in said[1]
    within = lies(0.02, (0.4, 0.0), (0.2, 0.2), 0.0)
    assert not judge(Evidence(table(1.0), registration=within)).having("noted")


def test_the_right_mean_colour_and_the_wrong_sparkle_fail() -> None:
    pairs = (SparklePair("density", 400.0, 20.0, 520.0, 22.8), SparklePair("contrast", 3.0, 0.1, 3.01, 0.1))
    verdict = judge(Evidence(table(1.0), SMALL, SMALL, pairs))
    assert verdict.decision == "not validated"
    assert "30.0 ± 8.6 % more" in only(verdict, "fails").sentence


# What is read first, and how: the verdict, what fails, what is noted, and in few lines what is kept.
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
    registration = lies(residual, (-0.021, 113.0), (1e-9, 0.0), -0.011)
    for seen, other in itertools.product((None, summary), (False, True)):
        evidence = Evidence(per_pixel=summary, seen=seen, registration=registration, other_flakes=other)
        verdict = judge(evidence, Limits())
        for outcome in ("fails", "cannot say", "noted"):
            assert not any(wrong(line) for line in outcome_lines(verdict, outcome))
        assert not any(wrong(line) for line in passing_lines(verdict))


# `cyclopean compare --measures`: the table in the terminal, in JSON and on the page, and what is refused.

NAMES = "delta-e-2000,s-cielab,pu-ssim,pu-psnr"


@pytest.mark.nightly
@pytest.mark.usefixtures("undrawn")
def test_a_pair_has_a_row_for_each_measure_and_a_figure_for_each_eye(tmp_path: Path, cyclopean: Cyclopean) -> None:
    photo = written(tmp_path / "a.exr", few(), few(1.0))
    other = written(tmp_path / "b.exr", few(gain=1.02), few(1.0, gain=1.04))
    page = tmp_path / "out.html"
    words = ("--regions", PLATE, "--rig", RIG, "--measures", "delta-e-2000", "--measures", NAMES, "-o", page)
    found = compared(cyclopean, photo, other, *words, expect=None)
    rows = {row["name"]: row for row in found["measures"]}
    assert list(rows) == NAMES.split(",")
    for eye in ("left", "right"):
        # One engine: the mean over the same pixels.
        assert rows["delta-e-2000"][eye] == pytest.approx(found["eyes"][eye]["per_pixel"]["mean"], abs=1e-5)
        assert rows["s-cielab"][eye] == pytest.approx(found["eyes"][eye]["as_seen"]["mean"], abs=1e-5)
    for name in ("delta-e-2000", "s-cielab", "pu-ssim"):
        assert rows[name]["binocular"] == pytest.approx((rows[name]["left"] + rows[name]["right"]) / 2, rel=1e-12)
    assert rows["delta-e-2000"]["left"] < rows["delta-e-2000"]["right"]
    assert rows["pu-psnr"]["left"] > rows["pu-psnr"]["binocular"] > rows["pu-psnr"]["right"]
    assert "both eyes</th>" in page.read_text(encoding="utf-8")


def test_identical_pictures_have_no_number_for_infinity(tmp_path: Path, cyclopean: Cyclopean) -> None:
    photo = written(tmp_path / "a.exr", few())
    found = compared(cyclopean, photo, photo, "--regions", PLATE, "--rig", RIG, "--measures", NAMES)
    assert [row["both"] for row in found["measures"]] == [0.0, 0.0, 1.0, None]


def test_only_pixels_that_count_are_measured(tmp_path: Path) -> None:
    light = few()
    spoilt = few(gain=1.02).copy()
    spoilt[:40] *= 3.0
    regions = tmp_path / "regions.yaml"
    height, width = light.shape[:2]
    middle = f"{{kind: rectangle, name: middle, box: [20, 60, {width - 40}, {height - 80}]}}"
    regions.write_text(f"schema_version: 1\nregions:\n  - {middle}\n", encoding="utf-8")
    photo = written(tmp_path / "a.exr", light)
    viewing = ViewingConditions(45.0, np.array([95.0, 100.0, 108.9]))
    options = CompareOptions(register="none", viewing=viewing, measures=("delta-e-2000", "pu-ssim"))
    values = {}
    for name, other in (("plain", few(gain=1.02)), ("spoilt", spoilt)):
        table = compare_pictures(photo, written(tmp_path / f"{name}.exr", other), regions, options).measures
        assert table is not None
        values[name] = [row.eyes["both"].value for row in table.rows]
    assert values["spoilt"] == values["plain"]


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--rig", RIG, "--measures", "flipp"), "there is no measure 'flipp' (did you mean 'flip'?)"),
        (("--measures", "pu-ssim"), "give --rig RIG.yaml"),
        (("--rig", RIG, "--measures", ","), "no measure is named"),
    ],
)
def test_what_cannot_be_measured_is_refused_in_one_line(
    tmp_path: Path, cyclopean: Cyclopean, words: tuple[object, ...], complaint: str
) -> None:
    files = tmp_path / "no.exr", tmp_path / "no.exr"
    told = cyclopean("compare", *files, "--regions", PLATE, "-o", tmp_path / "o.html", *words, expect=2)
    assert complaint in told.stderr
    assert len(told.stderr.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.nightly
def test_measures_make_a_table_and_do_not_change_the_verdict(tmp_path: Path, cyclopean: Cyclopean) -> None:
    photo, other = written(tmp_path / "a.exr", few()), written(tmp_path / "b.exr", few(gain=1.05))
    words = ("--regions", PLATE, "--rig", RIG)
    plain = compared(cyclopean, photo, other, *words, expect=None)
    measured = compared(cyclopean, photo, other, *words, "--measures", NAMES, expect=None)
    assert measured["verdict"] == plain["verdict"]
    assert measured["measures"] is not None
    assert plain["measures"] is None
