"""The page in a real browser: it loads, asks for nothing, and text stays text."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from PIL import Image

from analysis.records import SessionLog
from analysis.report import Report, write_report
from analysis.report.figures import draw_scores
from analysis.report.page import render
from analysis.report.words import plain
from tests.analysis.report.conftest import scores_with
from tests.kept import known
from tests.pages import Page, browsed, works_and_runs_nothing

Maker = Callable[..., SessionLog]


@pytest.fixture(scope="module")
def written(described: Report, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its page, drawn once."""
    page = tmp_path_factory.mktemp("written") / "report.html"
    page.write_text(render(described, {"2.1 stereo": (0.2574, "1")}), encoding="utf-8")
    return page


def test_the_page_asks_for_nothing_outside_itself(written: Path) -> None:
    page = written.read_text(encoding="utf-8")
    assert "http" not in page.replace("http-equiv", "")
    assert "@import" not in page
    assert not re.search(r"url\((?!#)", page)
    for tag, attributes in Page(page).tags:
        assert tag not in ("script", "iframe", "object", "embed", "base", "img")
        for name in ("src", "href", "xlink:href", "srcset", "action"):
            value = attributes.get(name) or "#"
            assert value.startswith(("#", "data:,", "data:image/png;base64,"))


def test_the_page_can_be_heard(written: Path) -> None:
    page = Page(written.read_text(encoding="utf-8"))
    for tag, attributes in page.tags:
        if tag == "svg":
            assert attributes.get("role") == "img"
            assert attributes.get("aria-label")
        if tag == "th":
            assert attributes.get("scope") in ("row", "col")
    anchors = {str(attributes["id"]) for tag, attributes in page.tags if tag == "section"}
    links = [str(attributes["href"])[1:] for tag, attributes in page.tags if tag == "a"]
    assert sorted(links) == sorted(anchors)


@pytest.mark.nightly
def test_the_page_opens_without_an_error_and_runs_nothing(written: Path, tmp_path: Path) -> None:
    works_and_runs_nothing(written.read_text(encoding="utf-8"), tmp_path)


def test_text_from_people_stays_text(make_session: Maker, tmp_path: Path) -> None:
    mark = "document.title='owned'"
    hostile = (f"<script>{mark}</script>", f'"><img src=x onerror="{mark}">', "$x_1$ & </svg>", "{{ 7*7 }}")
    answers = [(a, b) for a in hostile for b in hostile if a != b] * 2
    session = make_session(
        f"<script>{mark}</script>",
        names=hostile,
        answers=answers,
        question=f"<b onclick={mark}>?</b>",
        experiment=f"</title><script>{mark}</script>",
        remarks=(f"<script>{mark}</script>",),
        software={f"<script>{mark}</script>": f"<script>{mark}</script>"},
    )
    page = tmp_path / "report.html"
    write_report([session], page, published={hostile[0]: (0.5, "1")})
    text = page.read_text(encoding="utf-8")
    parsed = Page(text)
    assert not {"script", "img", "b"} & parsed.names
    assert not any(name.startswith("on") for _, attributes in parsed.tags for name in attributes)
    assert "{{ 7*7 }}" in parsed.text
    assert "$x_1$ & </svg>" in parsed.text
    assert ": report</title>" in text


@pytest.mark.usefixtures("undrawn")
def test_items_that_share_no_scale_still_make_a_page(make_session: Maker, tmp_path: Path) -> None:
    answers = [("a", "b"), ("b", "a"), ("c", "d"), ("d", "c")]
    write_report([make_session(names="abcd", answers=answers)], tmp_path / "deep" / "report.html")
    page = (tmp_path / "deep" / "report.html").read_text(encoding="utf-8")
    assert "no common scale" in page
    assert "nan" not in Page(page).text.lower()


@pytest.mark.usefixtures("undrawn")
def test_a_header_without_clipping_leaves_the_section_out(make_session: Maker, tmp_path: Path) -> None:
    session = make_session(names="ab", answers=[("a", "b"), ("b", "a")], stimuli=({"name": "a"}, {"name": "b"}))
    write_report([session], tmp_path / "report.html")
    assert 'id="clipping"' not in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_values_of_a_header_become_words() -> None:
    value = {"resolution_px": [1920, 1080], "stereo": False, "glasses": None, "panel": {"bits": 8}}
    assert plain(value) == "resolution (pixels): 1920, 1080; stereo: no; glasses: –; panel: bits: 8"


@pytest.mark.nightly
def test_a_phone_scrolls_the_page_one_way_only(sessions: list[SessionLog], tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    out = io.BytesIO()
    Image.new("RGB", (200, 130)).save(out, "PNG")
    write_report(sessions, page, thumbnails={"2.1 stereo": {"left": out.getvalue(), "right": out.getvalue()}})
    frame = tmp_path / "frame.html"
    frame.write_text(
        '<body><iframe src="report.html" style="width:390px;height:800px;border:0"></iframe><p></p><script>'
        "onload = () => { const root = frames[0].document.documentElement;"
        "document.querySelector('p').textContent = 'wide ' + root.scrollWidth + ' of ' + root.clientWidth; }"
        "</script>"
    )
    told = browsed(frame, tmp_path / "profile", "--allow-file-access-from-files", "--dump-dom")
    found = known(re.search(r"wide (\d+) of (\d+)", told.stdout))
    assert int(found.group(1)) <= int(found.group(2))


def test_stimuli_in_very_many_classes_leave_room_for_the_picture(described: Report) -> None:
    summary = known(described.pairs)
    crowded = scores_with(
        summary.scores,
        items=tuple(
            replace(item, label="+".join(str(number) for number in range(1, 40))) for item in summary.scores.items
        ),
    )
    svg = draw_scores(replace(summary, scores=crowded), 4.2).svg
    assert "1+2+3+4+5+…" in svg
