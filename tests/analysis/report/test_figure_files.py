"""Every figure as SVG and PDF: the page's own, whole, and nothing replaced unless asked for."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest

from analysis.records import SessionLog
from analysis.report import Report, describe, write_report
from analysis.report.page import render, sections_of
from documents import InputError
from documents.pages import write_figure_files
from tests.answers import changed
from tests.choice import nightly

Maker = Callable[..., SessionLog]
Sessions = Callable[..., list[SessionLog]]
SVG = "{http://www.w3.org/2000/svg}"
pytestmark = pytest.mark.usefixtures("unreviewed")


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
        replace(first, answers=(*first.answers, *(changed(trial, block=2) for trial in second.answers)))
        for first, second in zip(one, other, strict=True)
    ]
    write_report(both, tmp_path / "report.html", csv_folder=tmp_path / "csv", figure_folder=tmp_path / "figures")
    assert len(list((tmp_path / "csv").glob("ratings_*.csv"))) == 2
    assert len(list((tmp_path / "figures").glob("ratings_*.svg"))) == 2


@pytest.mark.nightly
def test_names_in_other_scripts_and_with_marks_make_whole_files(make_session: Maker, tmp_path: Path) -> None:
    names = ("<script>x()</script>", "משטח א", "塗装 $x_1$ & co")
    answers = [(a, b) for a in names for b in names if a != b] * 2
    sessions = [make_session(f"{number}", names=names, answers=answers) for number in range(3)]
    report = describe(sessions)
    scores = sections_of(report, {}, {})[1].figures()[:1]
    svg, pdf = write_figure_files(scores, tmp_path)
    text = "".join(ElementTree.parse(svg).getroot().itertext())
    assert all(name in text for name in names)
    assert pdf.read_bytes().rstrip().endswith(b"%%EOF")
    assert "<script" not in render(report)
