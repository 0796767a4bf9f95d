"""Every page says first what a browser may do with it: no script runs and nothing is fetched."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from documents.figures import drawing, drawn
from documents.pages import Figure, Gallery, Page, PagePicture, Section, page_html
from tests.pages import INJECTED, opened, policy_of, works_and_runs_nothing

ROOT = Path(__file__).parents[3]
FLOORS = ("documents", "devices", "stimuli", "analysis", "runner", "extensions", "cyclopean")
HEAD = "documents/pages/templates/page.html.j2"
# White, one pixel.
PICTURE = (
    "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJ"
    "AAAADUlEQVR42mP8/5+hHgAHggJ/PchI7wAAAABJRU5ErkJggg=="
)


def files_of(pattern: str) -> dict[str, str]:
    """Return the files of the program that are called so, by their place."""
    found = [file for floor in FLOORS for file in (ROOT / floor).rglob(pattern)]
    return {file.relative_to(ROOT).as_posix(): file.read_text("utf-8") for file in found}


def test_one_place_begins_pages() -> None:
    files = files_of("*.py") | files_of("*.j2")
    begun = [name for name, text in files.items() if re.search(r"<html|<head\b|<!doctype", text, re.IGNORECASE)]
    assert begun == [HEAD]


@pytest.fixture(scope="module")
def page() -> str:
    """A page with a style, an attribute of style, a picture, and a drawing that has its own."""
    with drawing("d", 2.0, 1.0) as (figure, axes):
        axes.imshow([[0.0, 1.0]])
        blocks = Figure("d", drawn(figure, "d")), Gallery((PagePicture("p", (("", PICTURE),)),))
    html = page_html(Page("kind", "title", "of", (Section("s", "S", blocks),)))
    assert all(f"<{tag}" in html for tag in ("style", "img", "image"))
    assert 'style="' in html
    return html


def test_scripts_and_fetching_are_not_allowed(page: str) -> None:
    allowed = policy_of(page)
    assert allowed.pop("style-src") == "'unsafe-inline'"
    assert allowed.pop("img-src") == "data:"
    assert allowed.pop("default-src") == "'none'"
    assert set(allowed.values()) <= {"'none'"}
    assert not policy_of(page.replace("<head>\n", '<head>\n<meta charset="utf-8">\n'))


@pytest.mark.nightly
def test_a_page_is_drawn_and_what_was_injected_does_not_run(page: str, tmp_path: Path) -> None:
    works_and_runs_nothing(page, tmp_path)


@pytest.mark.nightly
def test_without_the_policy_it_would_run(page: str, tmp_path: Path) -> None:
    bare = tmp_path / "bare.html"
    bare.write_text(re.sub("<meta http-equiv.*?>", "", page).replace("</body>", f"{INJECTED}</body>"))
    assert opened(bare, tmp_path / "profile")[0] == "owned"
