"""What people who write YAML by hand most often meant, where the parser's own words do not say."""

from __future__ import annotations

import re

import yaml

# What the parser says, and what to do about it. The first that is found holds.
_REMEDIES = (
    (r"character '\\t'", "a tab stands there: put spaces"),
    (r"found character '", "put the text in quotes"),
    (
        r"mapping values are not allowed",
        "put text that holds a colon in quotes; keys that belong together begin below one another",
    ),
    (r"could not find expected ':'", "write 'key: value', with a space after the colon"),
    (r"expected ',' or '([}\]])'", "the '{open}' of line {line} is not closed, or a comma is missing"),
    (r"unexpected end of stream", "the quotation mark of line {line} is not closed"),
    (r"expected <block end>, but found '[}\]]'", "there is one '}}' or ']' too many"),
    (r"expected <block end>, but found '<scalar>'", "text goes on after its quotation mark: write '' for ' in it"),
    (r"unknown escape character", "use single quotes, in which a backslash is one"),
    (r"expected <block end>", "keys of one block, or the hyphens of one list, begin below one another"),
    (r"alias|anchor", "put text that begins with '*' or '&' in quotes"),
)


def remedy_of(error: yaml.MarkedYAMLError) -> str | None:
    """Return what would most likely make the text valid; None where nobody can tell.

    A line that is named is the one in which the parser began what it could not end.
    """
    begun = error.context_mark or error.problem_mark
    for pattern, remedy in _REMEDIES:
        found = re.search(pattern, error.problem or "")
        if found:
            closing = found[1] if found.groups() else ""
            return remedy.format(open={"}": "{", "]": "["}.get(closing, ""), line=begun.line + 1 if begun else 1)
    return None
