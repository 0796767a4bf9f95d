"""README.md fits one screen and leads to docs/index.md, which lists every page of docs/ once or more."""

from __future__ import annotations

import re
from pathlib import Path

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
