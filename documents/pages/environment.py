"""Templates of HTML pages: text is escaped, and a name that nothing defines is an error.

Every page begins by including ``head.html.j2``, which is here: it alone says what a browser may load and run in pages.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from jinja2 import Environment


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
    >>> environment = page_environment("analysis.report")
    >>> environment.from_string("<p>{{ text }}</p>").render(text="a < b")
    '<p>a &lt; b</p>'
    """
    from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

    return Environment(
        loader=ChoiceLoader([PackageLoader(package) for package in (*packages, __package__)]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
