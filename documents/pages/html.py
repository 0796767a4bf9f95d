"""Sections as one self-contained HTML page: text is escaped, and a name that nothing defines is an error.

``page.html.j2`` alone says what a browser may load and run in pages.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from documents.figures import Drawing, class_colours
from documents.files import write_whole
from documents.pages.blocks import Badge, Section, cell_text

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup


@dataclass(frozen=True, slots=True)
class Page:
    """What a page says.

    Attributes
    ----------
    kind, title, question
        What kind of page it is, such as "Camera report", its heading, and the line below.
    of
        What stands in the window's title after the heading.
    sections
        Its parts.
    sentences, notes
        What it comes to, above all else, and what has to be known before reading on.
    failed
        What could not be computed: what it is, why, and what to do.
    decision
        What it comes to, in a word.
    is_wide
        Whether its tables have more columns than a page is usually wide.
    """

    kind: str
    title: str
    of: str
    sections: tuple[Section, ...]
    question: str = ""
    sentences: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    failed: tuple[tuple[str, str, str], ...] = ()
    decision: Badge | None = None
    is_wide: bool = False


def page_html(page: Page) -> str:
    """Return the page as HTML that needs nothing but itself.

    Examples
    --------
    >>> "<h1>Plates &amp; spheres</h1>" in page_html(Page("Report", "Plates & spheres", "report", ()))
    True
    """
    return _environment().get_template("page.html.j2").render(page=page, sections=page.sections)


def sections_html(sections: Iterable[Section]) -> str:
    """Return sections as a part of another page, such as a notebook, with a style that reaches no further.

    Examples
    --------
    >>> from documents.pages import Paragraph
    >>> sections_html([Section("scores", "Scores", (Paragraph("a < b"),))]).count("<p>a &lt; b</p>")
    1
    """
    template: Any = _environment().get_template("sections.html.j2").module
    style = files(__package__).joinpath("templates/page.css").read_text("utf-8").replace(":root {", "& {", 1)
    return f'<div class="cyclopean"><style>.cyclopean {{ {style} }}</style>{template.parts(tuple(sections))}</div>'


def _drawn(drawing: Drawing) -> Markup:
    from markupsafe import Markup

    # matplotlib escapes text.
    return Markup(_own_names(drawing.svg, f"f{sha256(drawing.svg.encode()).hexdigest()[:8]}"))


def _own_names(svg: str, prefix: str) -> str:
    """Return a figure whose names begin with ``prefix``, so that no other figure on the page has them."""
    names = set(re.findall(r'\bid="([^"]+)"', svg))
    if not names:
        return svg
    pattern = re.compile(
        r'(\bid="|url\(#|href="#)(' + "|".join(sorted(map(re.escape, names), key=len, reverse=True)) + r')(?=["\)])'
    )
    return pattern.sub(lambda match: f"{match[1]}{prefix}-{match[2]}", svg)


def write_page(page: Page, output: Path, *, private: bool = False) -> None:
    """Write the page as HTML, whole or not at all; its folder is made if need be. Raises OSError if it cannot."""
    write_whole(output, page_html(page), private=private)


@cache
def _environment() -> Environment:
    """Return what fills in templates: text is escaped, and a name that is not defined raises an error."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader(__package__),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(told=cell_text, colours=class_colours, drawn=_drawn)
    return environment
