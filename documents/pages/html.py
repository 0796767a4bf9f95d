"""Sections as one self-contained HTML page: text is escaped, and a name that nothing defines is an error.

Every page begins by including ``head.html.j2``, which is here: it alone says what a browser may load and run in pages.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

from documents.figures import Drawing, class_colours
from documents.files import write_whole
from documents.pages.blocks import Section, cell_text

if TYPE_CHECKING:
    from jinja2 import Environment


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
    """

    kind: str
    title: str
    of: str
    sections: tuple[Section, ...]
    question: str = ""
    sentences: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    failed: tuple[tuple[str, str, str], ...] = ()


def page_html(page: Page) -> str:
    """Return the page as HTML that needs nothing but itself.

    Examples
    --------
    >>> "<h1>Plates &amp; spheres</h1>" in page_html(Page("Report", "Plates & spheres", "report", ()))
    True
    """
    from markupsafe import Markup

    numbers = count(1)

    def drawn(drawing: Drawing) -> Markup:
        # matplotlib escapes text.
        return Markup(own_names(drawing.svg, f"f{next(numbers)}"))

    return page_environment().get_template("page.html.j2").render(page=page, sections=page.sections, drawn=drawn)


def own_names(svg: str, prefix: str) -> str:
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
def page_environment(*packages: str) -> Environment:
    """Return the environment that looks for templates in each of ``packages`` in turn.

    Parameters
    ----------
    packages
        Names of packages with a folder ``templates``; the first that has a template is used, this room the last.

    Returns
    -------
    jinja2.Environment
        Escapes what it inserts into HTML; a name that is not defined raises an error. It is the same one for the same
        packages, so that a template is compiled once.

    Examples
    --------
    >>> environment = page_environment()
    >>> environment.from_string("<p>{{ text }}</p>").render(text="a < b")
    '<p>a &lt; b</p>'
    """
    from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=ChoiceLoader([PackageLoader(package) for package in (*packages, __package__)]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(told=cell_text, colours=class_colours)
    return environment
