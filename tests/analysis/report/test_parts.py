"""A page for every kind of answers, and every figure as a file."""

from __future__ import annotations

import base64
import io
import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest
from PIL import Image

from analysis.errors import ResultsError
from analysis.observers import Filter
from analysis.records import SessionLog
from analysis.report import SCALE_PARTS, Report, describe, listed, write_report
from analysis.report.page import render, sections_of
from analysis.report.ratings import sign_test
from documents import InputError
from documents.pages import write_figure_files
from tests.answers import changed, new_answer
from tests.choice import nightly
from tests.kept import known
from tests.pages import Page

pytestmark = pytest.mark.usefixtures("unreviewed")


# A page for every kind of answers: each part where its records are, and what people wrote stays text.

Maker = Callable[..., SessionLog]
Sessions = Callable[..., list[SessionLog]]
UTC = "2026-01-01T00:00:00.000+00:00"


def keys(report: Report) -> list[str]:
    return [section.key for section in sections_of(report, {}, {})]


@pytest.mark.usefixtures("undrawn")
def test_only_preferences_make_a_report(preferring: Sessions) -> None:
    report = describe(preferring())
    assert keys(report) == ["conclusions", "preferences", "seen", "clipping", "timing", "not_reported", "methods"]
    assert report.pairs is None
    assert any("stereo and flat" in sentence for sentence in report.sentences)
    json.dumps(report.to_json(), allow_nan=False)
    assert "Stereo has" in Page(render(report)).text


@pytest.mark.usefixtures("undrawn")
def test_only_choices_from_series_make_a_report(choosing: Sessions) -> None:
    report = describe(choosing())
    assert keys(report)[1:6] == ["series", "series-ratings", "steps", "series-tests", "series-agreement"]
    assert report.by_part["series"] is not None
    json.dumps(report.to_json(), allow_nan=False)
    page = Page(render(report))
    for kind in ("base", "grey"):
        assert kind in page.text


def test_only_ratings_make_a_report(rating: Sessions) -> None:
    report = describe(rating())
    assert keys(report) == ["ratings", "seen", "clipping", "timing", "not_reported", "methods"]
    json.dumps(report.to_json(), allow_nan=False)
    assert "6 observers, 18 ratings." in report.sentences


@pytest.mark.nightly
def test_one_observer_of_each_kind_makes_a_page(preferring: Sessions, choosing: Sessions, rating: Sessions) -> None:
    for sessions in (preferring(1), choosing(1), rating(1)):
        text = Page(render(describe(sessions))).text
        assert "nan" not in re.findall(r"[a-z]+", text.lower())


@pytest.mark.usefixtures("undrawn")
def test_all_kinds_in_one_session_stand_on_one_page(make_session: Maker, rating: Sessions) -> None:
    answers = [("a", "b"), ("b", "c"), ("c", "a"), ("b", "a")]
    sessions = [
        replace(pairs, records=(*pairs.answers, *(changed(one, block=2) for one in rated.answers)))
        for pairs, rated in zip(
            (make_session(f"{number:02d}", names="abc", answers=answers) for number in range(1, 7)),
            rating(),
            strict=True,
        )
    ]
    report = describe(sessions)
    assert report.kinds == ("Paired comparisons", "Ratings")
    assert {"scores", "comparisons", "observers", "ratings"} <= set(keys(report))


def test_sessions_without_an_answer_are_refused(make_session: Maker) -> None:
    with pytest.raises(ResultsError, match="no answer"):
        describe([make_session(answers=[], complete=False)])


def test_complete_sessions_that_ask_nothing_are_reported_without_scores(make_session: Maker) -> None:
    report = describe([make_session(answers=[])])
    assert not report.kinds
    assert any(note.startswith("There are no scores") for note in report.notes)


@pytest.mark.usefixtures("undrawn")
def test_unanimous_observers_leave_doubt(preferring: Sessions) -> None:
    report = describe(preferring(6, chance=1.0))
    section = next(one for one in sections_of(report, {}, {}) if one.key == "preferences")
    table = next(one for one in section.tables() if one.name == "preferences")
    # Wilson for 6 of 6: 6 / (6 + 1.96²).
    assert table.rows[-1][-1] == pytest.approx((6 / (6 + 1.959963984540054**2), 1.0))


@pytest.mark.usefixtures("undrawn")
def test_whoever_is_left_out_is_named_with_the_rule(
    sessions: list[SessionLog], described: Report, tmp_path: Path
) -> None:
    report = write_report(sessions[:8], tmp_path / "report.html", rule=Filter(without=("07",)))
    text = Page((tmp_path / "report.html").read_text(encoding="utf-8")).text
    assert "07" not in known(report.pairs).observers
    assert text.count("Left out: 07 (by hand).") == 3  # beside the table of observers, in Methods, and in their list
    assert "No observer was left out." in Page(render(described)).text


@pytest.mark.usefixtures("undrawn")
def test_pictures_stand_on_the_page_per_eye_with_words_for_each(described: Report) -> None:
    small = {"2.1 stereo": {"left": png("red"), "right": png("blue")}, "no stimulus": {"both": png("red")}}
    page = Page(render(described, {}, small))
    beside, *pictures = [attributes for tag, attributes in page.tags if tag == "img"]
    assert beside["alt"] == ""  # the name stands beside it
    assert str(beside["src"]).startswith("data:image/jpeg;base64,")
    assert [one["alt"] for one in pictures] == ["2.1 stereo, left eye", "2.1 stereo, right eye"]
    assert all(str(one["src"]).startswith("data:image/png;base64,") for one in pictures)


def png(colour: str) -> bytes:
    """Return a picture that any browser shows."""
    out = io.BytesIO()
    Image.new("RGB", (90, 60), colour).save(out, "PNG")
    return out.getvalue()


@pytest.mark.usefixtures("undrawn")
def test_the_picture_beside_a_score_is_that_of_its_stimulus(described: Report) -> None:
    names = [item.name for item in known(described.pairs).scores.items]
    colours = [(40 + 20 * place, 10, 200 - 15 * place) for place in range(len(names))]
    small = {name: {"left": png(f"rgb{colour}")} for name, colour in zip(names, colours, strict=True)}
    table = next(one for one in sections_of(described, {}, small) if one.key == "scores").tables()[0]
    assert [row[0] for row in table.rows] == names == list(table.pictures)
    for name, colour in zip(names, colours, strict=True):
        with Image.open(io.BytesIO(base64.b64decode(table.pictures[name].split(",")[1]))) as image:
            assert image.size <= (112, 80)
            middle = image.getpixel((image.width // 2, image.height // 2))
        assert middle == pytest.approx(colour, abs=8)  # JPEG


@pytest.mark.usefixtures("undrawn")
def test_a_picture_that_cannot_be_shown_is_left_out_and_named(described: Report) -> None:
    damaged = (b"", b"x", b"\x89PNG\r\n\x1a\n", png("red")[:-30], b"<svg onload='x()'/>")
    whole, *names = [item.name for item in known(described.pairs).scores.items]
    one_eye = {name: {"left": png("red"), "right": right} for name, right in zip(names, damaged, strict=True)}
    page = Page(render(described, {}, {**one_eye, whole: {"both": png("blue")}}))
    assert [one["alt"] for tag, one in page.tags if tag == "img"] == ["", f"{whole}, both eyes"]
    assert f"There is no picture of {listed(names)}." in page.text
    alone = Page(render(described, {}, {name: {"left": left} for name, left in zip(names, damaged, strict=True)}))
    assert not [tag for tag, _ in alone.tags if tag == "img"]


@pytest.mark.parametrize(("count", "of"), [(0, 1), (3, 6), (6, 6), (9, 11), (2, 15), (500, 1000)])
def test_the_sign_test_is_the_exact_binomial_one(count: int, of: int) -> None:
    from scipy.stats import binomtest

    assert sign_test(count, of) == pytest.approx(float(binomtest(count, of).pvalue), rel=1e-9)


@pytest.mark.usefixtures("undrawn")
def test_vision_tests_stand_on_every_report(preferring: Sessions) -> None:
    sessions = preferring(2)
    outcome = {"passed": False, "threshold": None, "estimate": 310.0, "pass_mark": 200.0, "unit": "arcsec"}
    taken = new_answer(0, 9, "screening", (), 1.0, UTC, {"test": "stereo_acuity", "outcome": outcome})
    sessions[1] = replace(sessions[1], records=(taken, *sessions[1].answers))
    report = describe(sessions)
    (section,) = (one for one in sections_of(report, {}, {}) if one.key == "vision")
    (table,) = section.tables()
    assert table.rows == (("02", "stereo acuity", "failed", None, 310.0, 200.0, "arcsec"),)
    assert "1 failed, and their answers are included: 02" in Page(render(report)).text
    kept = describe(sessions, rule=Filter(screening=("stereo_acuity",)))
    assert "vision" not in keys(kept)
    assert kept.kept.left_out == {"02": ("failed the vision screening: stereo acuity",)}


# Every figure as SVG and PDF: the page's own, whole, and nothing replaced unless asked for.

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def written(described: Report, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the report of twenty observers and its figures, written once."""
    folder = tmp_path_factory.mktemp("written")
    assert write_report(described.sessions, folder / "report.html", figure_folder=folder / "figures").pairs is not None
    return folder


@pytest.fixture
def fontless(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw PDF files without the letters of their fonts, which take longer than all else."""
    monkeypatch.setattr(
        "matplotlib.backends.backend_pdf.PdfFile.writeFonts", lambda file: file.writeObject(file.fontObject, {})
    )


@pytest.mark.nightly
def test_every_figure_of_the_page_is_a_file_of_both_kinds(written: Path) -> None:
    assert sorted(file.name for file in (written / "figures").iterdir()) == [
        "classes.pdf",
        "classes.svg",
        "ranking.pdf",
        "ranking.svg",
        "scores.pdf",
        "scores.svg",
    ]
    # On the page, each figure's names begin with letters of its own.
    page = re.sub(r'(\bid="|[("]#)f[0-9a-f]{8}-', r"\1", (written / "report.html").read_text(encoding="utf-8"))
    for name in ("scores", "classes"):
        svg = (written / "figures" / f"{name}.svg").read_text(encoding="utf-8")
        root = ElementTree.fromstring(svg.encode())
        assert root.tag == f"{SVG}svg"
        assert root.get("width") == "7.6in"
        # The page has the same drawing, but for what only a file needs.
        inside = svg.split(">", 2)[2].rstrip()
        assert inside in page
        pdf = (written / "figures" / f"{name}.pdf").read_bytes()
        assert pdf.startswith(b"%PDF-")
        assert pdf.rstrip().endswith(b"%%EOF")
        assert re.search(rb"/Count 1\b", pdf)
        assert b"/FontFile2" in pdf  # letters are text


@pytest.mark.usefixtures("fontless")
@pytest.mark.parametrize("kind", ["preferring", *nightly("choosing", "rating")])
def test_figures_of_every_kind_of_answer_have_files(kind: str, request: pytest.FixtureRequest, tmp_path: Path) -> None:
    sessions: list[SessionLog] = request.getfixturevalue(kind)(2)
    write_report(sessions, tmp_path / "report.html", figure_folder=tmp_path / "figures")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    files = {file.suffix: file for file in (tmp_path / "figures").iterdir()}
    assert set(files) == {".svg", ".pdf"}
    assert len(list((tmp_path / "figures").glob("*.svg"))) == page.count("<figcaption>")


@pytest.mark.usefixtures("undrawn")
def test_what_is_there_is_replaced_only_if_asked_for(make_session: Maker, tmp_path: Path) -> None:
    sessions = [make_session("01", names="abc")]
    figures, page = tmp_path / "figures", tmp_path / "report.html"
    figures.mkdir()
    (figures / "classes.svg").write_text("drawn by hand")
    with pytest.raises(InputError, match=r"classes\.svg.*--replace"):
        write_report(sessions, page, figure_folder=figures)
    assert [file.name for file in figures.iterdir()] == ["classes.svg"]
    assert (figures / "classes.svg").read_text() == "drawn by hand"
    assert not page.exists()
    write_report(sessions, page, figure_folder=figures, replace=True)
    assert (figures / "classes.svg").read_text(encoding="utf-8").startswith("<?xml")


@pytest.mark.nightly
def test_figures_are_the_same_every_time(described: Report, written: Path, tmp_path: Path) -> None:
    again = [figure for section in sections_of(described, {}, {}) for figure in section.figures()]
    for figure in again:
        svg = (written / "figures" / f"{figure.name}.svg").read_text(encoding="utf-8")
        assert figure.wide.svg_file() == svg
    (ranking,) = write_figure_files(again[1:2], tmp_path)[1:]
    assert ranking.read_bytes() == (written / "figures" / "ranking.pdf").read_bytes()


@pytest.mark.usefixtures("undrawn")
def test_scales_whose_names_are_one_file_name_have_two(rating: Sessions, tmp_path: Path) -> None:
    one, other = rating(scale="how bright?"), rating(scale="how bright!")
    both = [
        replace(first, records=(*first.answers, *(changed(trial, block=2) for trial in second.answers)))
        for first, second in zip(one, other, strict=True)
    ]
    write_report(both, tmp_path / "report.html", csv_folder=tmp_path / "csv", figure_folder=tmp_path / "figures")
    assert len(list((tmp_path / "csv").glob("ratings_*.csv"))) == 2
    assert len(list((tmp_path / "figures").glob("ratings_*.svg"))) == 2


COUNTING = """
from analysis.report import Part
from documents.pages import Section

CYCLOPEAN_INTERFACE = 1

def part(comparisons, header):
    items = len(comparisons.items)
    section = Section("counted", f"{items} stimuli", ())
    analysis = f"The {items} stimuli were counted."
    return Part("counted", items, sections=lambda pictures: [section], analysis=lambda cited: analysis)

def torn(comparisons, header):
    raise ValueError("no table")

def factors(comparisons, header):
    return Part("factors", 1)
"""


@pytest.mark.usefixtures("undrawn")
def test_another_packages_part_is_asked_of_pairs_that_were_compared(
    install: Callable[..., None], sessions: list[SessionLog], preferring: Sessions, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(SCALE_PARTS, "_loaded", {})
    install("counting", COUNTING, group=SCALE_PARTS.group, counted="part", torn="torn", effects="factors", gone="no")
    report = describe(sessions)
    told = report.to_json()
    assert told["counted"] == len(known(report.pairs).scores.items)
    assert told["factors"] != 1
    assert "counted" in keys(report)
    assert "stimuli were counted." in json.dumps(told["methods"])
    reasons = [check.reason for check in report.failed]
    for said in ("it raised ValueError: no table", "its key 'factors' is taken", "'gone'"):
        assert sum(said in reason and "counting 1.0" in reason for reason in reasons) == 1
    assert not describe(preferring()).scale_parts
