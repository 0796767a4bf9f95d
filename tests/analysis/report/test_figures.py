"""Figures, their colours, and tables as CSV."""

from __future__ import annotations

import csv
import io
import re
import warnings
from collections.abc import Callable
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.records import SessionLog
from analysis.report import Report
from analysis.report.bars import BarFigure
from analysis.report.figures import draw_classes, draw_scores, runs
from analysis.report.scores import WHITE_FROM, tint
from analysis.report.summary import Summary, summarise
from analysis.series import Estimated
from documents.figures import HATCHES, MARKERS, SERIES_COLOURS, class_colours
from documents.figures.palette import CLASS_COLOURS, FURTHER_COLOURS
from documents.pages import Column, Table, csv_text, write_csv_files
from documents.pages.blocks import inert
from tests.analysis.report.conftest import scores_with, uses
from tests.kept import known

# The pictures of the scores and the classes: every mark where it belongs, every name.

Maker = Callable[..., SessionLog]
WIDTH_IN = 7.6
LABELS = ("1", "1+2", "2+3+4", None, "4+12")


@pytest.fixture
def summary(make_session: Maker) -> Summary:
    """Five stimuli in one, two, three and no classes; no score for the fourth."""
    found = summarise([make_session(f"{number:02d}", names="abcde") for number in range(12)])
    items = [replace(item, label=label) for item, label in zip(found.scores.items, LABELS, strict=True)]
    items[3] = replace(items[3], log10_score=None)
    return replace(found, scores=scores_with(found.scores, items=tuple(items)))


def test_each_score_has_its_interval_a_ring_and_a_part_of_its_marker_for_each_class(summary: Summary) -> None:
    rows: dict[float, list[tuple[str, float]]] = {}
    for paint, x, y in uses(draw_scores(summary, WIDTH_IN).svg):
        if "stroke-width: 0.8" not in paint:  # a tick
            rows.setdefault(y, []).append((paint, x))
    scored = [one for one in zip(summary.scores.items, summary.log10_interval, strict=True) if one[0].log10_score]
    values, places = [], []
    for (_, marks), (item, (low, high)) in zip(sorted(rows.items()), scored, strict=True):
        assert sorted(paint for paint, _ in marks if "stroke" not in paint) == sorted(
            f"fill: {colour}" for colour in class_colours(item.label)
        )
        ends = sorted(x for paint, x in marks if "stroke-width: 1.3" in paint)
        (centre,) = {x for paint, x in marks if "stroke-width: 1.3" not in paint}
        assert sum("fill: none" in paint for paint, _ in marks) == 1
        values += [low, item.log10_score, high]
        places += [ends[0], centre, ends[1]]
    slope, start = np.polyfit(values, places, 1)
    np.testing.assert_allclose(places, slope * np.array(values) + start, atol=1e-3)


def test_rows_fall_into_stretches() -> None:
    assert runs([]) == []
    assert runs([3]) == [(3, 3)]
    assert runs([0, 1, 2, 4, 6, 7]) == [(0, 2), (4, 4), (6, 7)]


def test_every_stimulus_and_class_is_named_and_every_membership_has_a_dot(described: Report) -> None:
    summary = known(described.pairs)
    svg = draw_classes(summary, 7.6).svg
    words = re.findall(r"<text[^>]*>([^<]*)</text>", svg)
    for item in summary.scores.items:
        assert item.name in words
    members = known(summary.scores.classes).members
    assert [str(number + 1) for number in range(len(members))] == [word for word in words if word.isdigit()]
    assert svg.count("fill: #ffffff; stroke: #23282d") == sum(len(group) for group in members)
    shares = [word for word in words if word.endswith("%")]
    assert len(shares) == len(summary.scores.items) - 1


def test_without_draws_there_are_no_shares(make_session: Maker) -> None:
    summary = summarise([make_session(names="ab", answers=[("a", "b"), ("b", "a")])])
    assert "%</text>" not in draw_classes(summary, 4.2).svg


# Colours of classes and of series stay apart in grey and to the colour-blind; others differ by more than colour.

# ΔE00 of 2 to 3 is what an eye sees of two patches side by side; these lie apart, and in print.
LEAST_DELTA_E, LEAST_DELTA_L = 12.0, 11.0
PAPER, FIRST = "#ffffff", 5
VISIONS = (None, "Protanomaly", "Deuteranomaly", "Tritanomaly")


def lab(colours: tuple[str, ...], vision: str | None = None) -> np.ndarray:
    """Return L*a*b* (n, 3) of colours in sRGB, as seen without one kind of cones [Machado2009]."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import colour
        from colour.blindness import matrix_cvd_Machado2009

        codes = np.array([[int(one[at : at + 2], 16) / 255 for at in (1, 3, 5)] for one in colours])
        linear = colour.models.eotf_sRGB(codes)
        if vision is not None:
            linear = np.clip(linear @ matrix_cvd_Machado2009(vision, 1.0).T, 0, 1)
        xyz = linear @ colour.RGB_COLOURSPACES["sRGB"].matrix_RGB_to_XYZ.T
        return np.asarray(colour.XYZ_to_Lab(xyz, [0.3127, 0.3290]))


@pytest.mark.parametrize("colours", [CLASS_COLOURS, SERIES_COLOURS[:FIRST]], ids=["classes", "series"])
def test_colours_stay_apart(colours: tuple[str, ...]) -> None:
    from colour.difference import delta_E_CIE2000

    for vision in VISIONS:
        seen = lab(colours, vision)
        least = min(float(delta_E_CIE2000(one, other)) for one, other in combinations(seen, 2))
        assert least >= LEAST_DELTA_E, vision
    grey = lab(colours)[:, 0]
    assert min(abs(one - other) for one, other in combinations(grey, 2)) >= LEAST_DELTA_L


def test_further_series_differ_by_hatch_and_marker_and_further_classes_by_their_number() -> None:
    assert len(set(HATCHES)) == len(set(MARKERS)) == len(set(SERIES_COLOURS)) == len(HATCHES) == len(SERIES_COLOURS)
    everything = class_colours("+".join(str(number) for number in range(1, 10)))
    assert everything == (*CLASS_COLOURS, *FURTHER_COLOURS)
    assert len(set(everything)) == len(everything)


def test_bars_have_their_hatch_in_the_figure_and_in_its_legend() -> None:
    bars = tuple(f"series {number}" for number in range(8))
    rows = tuple(tuple(Estimated(1.0 + number, 0.5, 9.0, 3, 3) for number in range(8)) for _ in range(3))
    svg = BarFigure("Bars", "group", "unit", ("a", "b", "c"), bars, rows).svg(7.6)
    hatched = re.findall(r"fill: url\(#(h[0-9a-f]+)\)", svg)
    # All but the first; three groups and the legend.
    assert {hatched.count(name) for name in hatched} == {4}
    assert len(set(hatched)) == 7


def _luminance(colour: str) -> float:
    codes = np.array([int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)])
    linear = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def contrast(one: str, other: str) -> float:
    """Return the contrast ratio of WCAG 2.2."""
    dark, bright = sorted((_luminance(one), _luminance(other)))
    return (bright + 0.05) / (dark + 0.05)


def test_text_on_the_page_has_enough_contrast() -> None:
    """Ink, soft words and links, on paper, on the notes' ground and on the wash."""
    from importlib.resources import files

    style = files("documents.pages").joinpath("templates/page.css").read_text(encoding="utf-8")
    named = dict(re.findall(r"--(\w+): (#[0-9a-f]{6})", style))
    notes = known(re.search(r"\.notes \{[^}]*background: (#[0-9a-f]{6})", style))
    for text in ("ink", "soft", "deep"):
        for ground in (named["paper"], named["wash"], notes.group(1)):
            assert contrast(named[text], ground) >= 4.5, (text, ground)
    for text in re.findall(r"(?<!-)color: (#[0-9a-f]{6})", style):
        assert contrast(text, named["wash"]) >= 4.5, text


def test_counts_can_be_read_on_every_cell_of_the_matrix() -> None:
    for share in np.linspace(0, 1, 201):
        ground = "#{:02x}{:02x}{:02x}".format(*tint(float(share)))
        assert contrast("#ffffff" if share >= WHITE_FROM else "#000000", ground) >= 4.5, share


# Tables as CSV: read back as they were, and inert in a spreadsheet.

DANGEROUS = ("=", "+", "-", "@", "\t", "\r", "\n")


def read(text: str) -> list[list[str]]:
    return list(csv.reader(io.StringIO(text, newline="")))


@settings(max_examples=20)
@given(st.text(st.characters(codec="utf-8", exclude_characters="\0")))
def test_any_text_comes_back_and_none_begins_a_formula(text: str) -> None:
    table = Table("notes", "Notes", (Column("Note", "note"), Column("Left", "left")), ((text, "end"),))
    head, row = read(csv_text(table))
    assert head == ["note", "left"]
    assert row[0] in (text, f"'{text}")
    assert not row[0].lstrip(" ").startswith(DANGEROUS)
    assert row[1] == "end"


@pytest.mark.parametrize("text", ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "  =1", "=cmd|' /C calc'!A0", "\uff1d1"])
def test_formulas_are_made_text(text: str) -> None:
    assert inert(text) == f"'{text}"


def test_numbers_stand_in_full_and_intervals_make_two_columns() -> None:
    columns = (Column("Item", "item"), Column("Score", "score", "number", 2), Column("95 %", "score", "interval", 1))
    rows = (("a", -0.1234567890123, (float("-inf"), 1 / 3)), ("b", None, (None, None)))
    assert read(csv_text(Table("t", "T", columns, rows))) == [
        ["item", "score", "score_low", "score_high"],
        ["a", "-0.1234567890123", "-inf", repr(1 / 3)],
        ["b", "", "", ""],
    ]


def test_a_tables_name_stays_in_the_folder(tmp_path: Path) -> None:
    (file,) = write_csv_files([Table("ratings_../../x", "", (Column("A", "a"),), ())], tmp_path / "in")
    assert file.parent == tmp_path / "in"
    assert file.is_file()


def test_heads_made_of_what_people_called_things_are_inert_too() -> None:
    columns = (Column("=a", "=a", "number"), Column("95 %", "=a", "interval"))
    assert read(csv_text(Table("t", "T", columns, ()))) == [["'=a", "'=a_low", "'=a_high"]]
