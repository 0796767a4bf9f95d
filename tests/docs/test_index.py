"""README.md fits one screen and leads to docs/index.md, which lists every page of docs/; pages name all kinds."""

from __future__ import annotations

import re
from pathlib import Path
from typing import get_args

from runner.blocks import AnyBlock
from runner.presenter import MODES

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
_LINK = re.compile(r"\]\(([^)#\s]+)")
ONE_SCREEN = 62


def _links(page: Path) -> set[Path]:
    """Return the files that a page links to."""
    targets = _LINK.findall(page.read_text(encoding="utf-8"))
    return {(page.parent / target).resolve() for target in targets if "://" not in target}


def test_the_index_lists_every_page() -> None:
    pages = {page.resolve() for page in DOCS.glob("*.md") if page.name != "index.md"}
    missing = sorted(page.name for page in pages - _links(DOCS / "index.md"))
    assert not missing, f"docs/index.md does not list {', '.join(missing)}"


def test_the_readme_fits_one_screen_and_leads_to_the_index() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= ONE_SCREEN
    assert (DOCS / "index.md").resolve() in _links(ROOT / "README.md")


def test_the_pages_name_every_kind_of_block_and_every_mode() -> None:
    kinds = [get_args(spec.model_fields["kind"].annotation)[0] for spec in get_args(get_args(AnyBlock)[0])]
    assert len(kinds) >= 10
    for page, names in (("session.md", kinds), ("display.md", list(MODES)), ("modes.md", list(MODES))):
        text = (DOCS / page).read_text(encoding="utf-8")
        assert [name for name in names if f"`{name}`" not in text] == [], page
