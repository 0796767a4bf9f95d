"""The files of a study: YAML with comments that explain each key, filled in from templates."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

from documents.text import visible

if TYPE_CHECKING:
    from jinja2 import Environment

# Text that YAML takes as it stands, in flow lists too; all else goes in quotes.
_PLAIN = re.compile(r"[A-Za-z](?:[A-Za-z0-9_./ -]*[A-Za-z0-9_./-])?")
_COMMENTS = 30  # the column where comments begin, where the line is shorter
_NOT_TEXT = re.compile(r"(?i)null|true|false|yes|no|on|off|y|n")


def flow(value: object) -> str:
    """Return a value as YAML on one line.

    Parameters
    ----------
    value
        Text, a number, true or false, or lists and mappings of them.

    Returns
    -------
    str
        What `documents.yaml` reads as the same value.

    Examples
    --------
    >>> flow({"name": "1.1", "left": "pictures/a_L.jpg", "size": [2.50, True]})
    '{name: "1.1", left: pictures/a_L.jpg, size: [2.5, true]}'
    """
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{flow(key)}: {flow(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(flow, value)) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return f"{value:.12g}"
    text = str(value)
    plain = _PLAIN.fullmatch(text) and not _NOT_TEXT.fullmatch(text)
    return text if plain else json.dumps(text, ensure_ascii=False).replace("#|", "#\\u007c")


def comment(text: str) -> str:
    """Return text that may come from file names as it can stand behind a #: on one line, without hidden characters."""
    return " ".join(visible(text).split())


def render(template: str, values: Mapping[str, Any]) -> str:
    """Return the file that ``template`` makes with ``values``; comments after ``#|`` begin in one column."""
    text = _environment().get_template(template).render(**values)
    return re.sub(r"^(.*?\S) +#\| ", lambda found: f"{found[1]:<{_COMMENTS}}  # ", text, flags=re.MULTILINE)


@cache
def _environment() -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("runner.studies"),
        autoescape=False,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"yaml": flow, "comment": comment}
    return environment
