"""What people type during a session stays text on the page: notes, answers to questions, names of observers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from analysis.records import Note, SessionLog, Trial
from analysis.report import write_report

Maker = Callable[..., SessionLog]
HOSTILE = "<script>x()</script><img src=x onerror=x()></td></table><iframe src=//x></iframe>{{ 7*7 }}"
UTC = "2026-01-01T00:00:00.000+00:00"


class _Tags(HTMLParser):
    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: set[str] = set()
        self.attributes: set[str] = set()
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.attributes |= {name for name, _ in attrs}


@pytest.mark.usefixtures("undrawn")
def test_notes_and_typed_answers_are_inert(make_session: Maker, tmp_path: Path) -> None:
    answers = [("a", "b"), ("b", "a"), ("a", "b")]
    plain = make_session(names="ab", answers=answers)
    typed = Trial(9, 0, "questionnaire", ((f"text {HOSTILE}", 1.0),), 1.0, UTC, {"name": HOSTILE, "answer": HOSTILE})
    spoiled = replace(plain, answers=(*plain.answers, typed), notes=(Note(HOSTILE, HOSTILE, 0, 0, UTC),))
    pages = []
    for number, session in enumerate((plain, spoiled)):
        page = tmp_path / f"{number}.html"
        write_report([session], page)
        pages.append(_Tags(page.read_text(encoding="utf-8")))
    assert not {"script", "img", "iframe"} & pages[1].tags
    assert pages[1].attributes <= pages[0].attributes
