"""What the eyes saw, from logs of all ages: what they do not say is not recorded, and nothing false is said."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import pytest

from analysis.records import Change, Resumption, Seen, SessionLog, what_eyes_saw
from analysis.report import Report, describe
from analysis.report.page import sections_of
from documents.pages import Facts, Paragraph, Section
from tests.analysis.conftest import clip_cost
from tests.choice import nightly

Maker = Callable[..., SessionLog]
ANAGLYPH = {"mode": "anaglyph-red-cyan"}
pytestmark = pytest.mark.usefixtures("undrawn", "unreviewed")


@pytest.fixture
def make_session(make_session: Maker) -> Maker:
    """As elsewhere, with two stimuli and two answers: what is said of screens does not depend on them."""
    return partial(make_session, names="ab", answers=[("a", "b"), ("b", "a")])


def _text(report: Report, key: str) -> str:
    (section,) = (section for section in sections_of(report, {}, _pictures(report)) if section.key == key)
    return _words(section)


def _words(section: Section) -> str:
    words = [block.text for block in section.blocks if isinstance(block, Paragraph)]
    for block in section.blocks:
        if isinstance(block, Facts) and not block.folded:
            words += [f"{term}: {value}" for term, value in block.rows]
    return "\n".join(words)


def _pictures(report: Report) -> dict[str, dict[str, bytes]]:
    import io

    from PIL import Image

    out = io.BytesIO()
    Image.new("RGB", (4, 3)).save(out, "PNG")
    return {one.name: {"left": out.getvalue(), "right": out.getvalue()} for one in report.header.stimuli}


def _stimuli(session: SessionLog, **more: Any) -> tuple[dict[str, Any], ...]:
    return tuple({**one.given(), **more} for one in session.header.stimuli)


def test_an_old_log_of_an_anaglyph_says_that_the_cost_of_filters_is_not_recorded(make_session: Maker) -> None:
    measured = {"source": "measured 2015", "characterised_as": "anaglyph-red-cyan"}
    white = {"white_XYZ_cd_m2": {eye: [95.0, 100.0, 108.0] for eye in ("left", "right")}}
    report = describe([make_session(display={**ANAGLYPH, **measured, **white})])
    (seen,) = what_eyes_saw(report.sessions)
    assert seen.has_filters
    assert (seen.filters, seen.filters_are, seen.white_cd_m2, seen.surround_cd_m2) == (None, None, None, None)
    assert any("anaglyph" in note and "not recorded" in note for note in report.notes)
    assert "Surround: Not recorded." in _text(report, "seen")
    assert "Size: Not recorded." in _text(report, "seen")
    assert "As the display showed" not in _text(report, "stimuli")
    assert "at the eye" not in _text(report, "methods")


def test_an_old_log_of_another_mode_keeps_its_caption(make_session: Maker) -> None:
    report = describe([make_session()])
    assert "As the display showed them to each eye" in _text(report, "stimuli")
    assert "filter" not in _text(report, "seen")
    assert not any("filter" in note for note in report.notes)


def test_a_log_without_a_mode_is_said_to_have_none(make_session: Maker) -> None:
    assert "Stereo mode: Not recorded." in _text(describe([make_session(display={})]), "seen")


@pytest.mark.parametrize(
    ("mode", "pixels"),
    [("row-interleaved", "every second row"), *nightly(("side-by-side-half", "the mean of every two columns"))],
)
def test_half_of_the_pixels_is_said_where_an_eye_has_no_more(make_session: Maker, mode: str, pixels: str) -> None:
    report = describe([make_session(display={"mode": mode})])
    for key in ("stimuli", "seen", "methods"):
        assert f"{pixels} of its view" in _text(report, key)
    assert "As the display showed" not in _text(report, "stimuli")


def test_two_modes_are_told_apart(make_session: Maker) -> None:
    stimuli = _stimuli(make_session(), clipping={"left": _filtered(3.0), "right": _filtered(5.0)})
    people = [make_session("01"), make_session("02", display=ANAGLYPH, stimuli=stimuli), make_session("03")]
    report = describe(people)
    assert [(seen.mode, count) for seen, count in what_eyes_saw(people).items()] == [
        ("side-by-side", 2),
        ("anaglyph-red-cyan", 1),
    ]
    assert "in some of the sessions" in _text(report, "stimuli")
    assert "In 2 sessions:" in _text(report, "methods")
    assert "ΔE₀₀ of 4.000" in " ".join(report.notes)


def test_no_eye_saw_what_simulated_observers_answered(make_session: Maker) -> None:
    simulated = describe([make_session(simulated=True)])
    for key in ("seen", "methods"):
        assert "no eye saw anything" in _text(simulated, key)
    assert "would have shown" in _text(simulated, "stimuli")
    person = describe([make_session()])
    assert "no eye" not in _text(person, "seen") + _text(person, "methods")


def test_a_nominal_display_is_one_of_its_standard_whatever_glasses_take(make_session: Maker) -> None:
    display = {"mode": "row-interleaved", "nominal": {"kind": "srgb", "words": "sRGB"}, "glasses": "polarised"}
    report = describe([make_session(display=display)])
    assert "nominal, not measured (sRGB)" in _text(report, "seen")
    assert "polarised glasses take" in _text(report, "seen")


@pytest.mark.parametrize("measured_in", ["side-by-side", "row-interleaved"])
def test_methods_say_where_a_display_was_measured_in_another_mode(make_session: Maker, measured_in: str) -> None:
    display = {"mode": "row-interleaved", "characterised_as": measured_in, "source": "measured"}
    said = "not characterised in the mode" in _text(describe([make_session(display=display)]), "methods")
    assert said is (measured_in == "side-by-side")


def test_what_changed_when_a_session_was_resumed_is_said(make_session: Maker) -> None:
    stop = Resumption(utc="2026-01-02T05:00:00Z", accepted_changes={"rig": Change(before="a", now="b")})
    resumed = replace(make_session("01"), resumptions=(stop,))
    report = describe([resumed, make_session("02")])
    assert [(seen.changed, count) for seen, count in what_eyes_saw(report.sessions).items()] == [(("rig",), 1), ((), 1)]
    assert "The rig changed" in _text(report, "seen")
    assert any("rig changed" in note for note in report.notes)
    assert not any("changed" in note for note in describe([make_session("02")]).notes)


def test_a_display_without_stereo_has_no_crosstalk(make_session: Maker) -> None:
    flat = describe([make_session(display={"mode": "flat", "crosstalk_cancelled": False})])
    assert "Crosstalk" not in _text(flat, "methods")
    stereo = describe([make_session(display={"mode": "side-by-side", "crosstalk_cancelled": False})])
    assert "Crosstalk" in _text(stereo, "methods")


def test_light_that_evenness_and_cancelling_crosstalk_take_is_said(make_session: Maker) -> None:
    stimuli = _stimuli(make_session(), clipping={"left": clip_cost(1.0), "crosstalk": {"lift_share": 0.05}})
    even = describe([make_session(display={"mode": "side-by-side", "gain_map_delivers": 0.83}, stimuli=stimuli)])
    for key in ("seen", "methods"):
        assert "83.0 % of their luminance" in _text(even, key)
        assert "lifted by 5.00 % of white" in _text(even, key)
    as_asked = describe([make_session(display={"mode": "side-by-side", "gain_map_delivers": 1.0})])
    assert "luminance," not in _text(as_asked, "seen")


def test_costs_that_one_session_did_not_come_to_are_taken_from_another(make_session: Maker) -> None:
    whole = make_session("01")
    stopped = make_session("02", stimuli=_stimuli(whole, clipping=None))
    (seen,) = what_eyes_saw([stopped, whole])
    assert seen == Seen.of(whole)
    assert seen.clipping is not None
    assert seen.clipping.largest == 25.0
    assert Seen.of(stopped).clipping is None


def test_sizes_are_those_of_the_smallest_and_the_largest_picture(make_session: Maker) -> None:
    stimuli = _stimuli(make_session(), size_px=[400, 300], resampled="resample (area)")
    stimuli[0].update(size_px=[200, 150], resampled=None)
    panel = {"mode": "flat", "panel": {"pixel_pitch_mm": 0.25}, "distance_mm": 600.0}
    values = Seen.of(make_session(display=panel, stimuli=stimuli)).to_json()
    assert (values["smallest_width_px"], values["largest_height_px"]) == (200, 300)
    assert values["largest_width_deg"] == pytest.approx(9.53, abs=0.005)
    assert values["resampled"] == "none, resample (area)"


def _filtered(cost: float) -> dict[str, float]:
    return {**clip_cost(1.0), "projection_delta_e_00_mean": cost, "projection_delta_e_00_max": 10 * cost}
