"""Values as YAML that reads back the same: one form for all files that are written for people to go on with."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import yaml

# A mapping or a table that is longer in braces stands in lines of its own.
_MOST_IN_A_LINE = 100
_PLAIN = re.compile(r"[^\W\d][\w -]*(?<! )")


def yaml_lines(mapping: Mapping[str, Any]) -> list[str]:
    """Return a mapping as lines of YAML, not indented: a key for each, and what is long below its key.

    Parameters
    ----------
    mapping
        By key, texts, numbers, true or false, None, and lists and mappings of these.

    Returns
    -------
    list
        The lines, without their ends. Lists of numbers stand on one line; numbers have all their digits.

    Examples
    --------
    >>> yaml_lines({"black_XYZ_cd_m2": [0.0, 1e-05, 0.25], "curve": {"kind": "gamma", "red": {"gamma": 2.2}}})
    ['black_XYZ_cd_m2: [0, 1.0e-05, 0.25]', 'curve: {kind: gamma, red: {gamma: 2.2}}']
    """
    lines = []
    for key, value in mapping.items():
        line = f"{yaml_text(key)}: {yaml_text(value)}"
        if len(line) > _MOST_IN_A_LINE and isinstance(value, Mapping):
            lines += [f"{yaml_text(key)}:", *(f"  {inner}" for inner in yaml_lines(value))]
        elif len(line) > _MOST_IN_A_LINE and isinstance(value, list | tuple) and isinstance(value[0], list | Mapping):
            lines += [f"{yaml_text(key)}:", *(f"  - {yaml_text(entry)}" for entry in value)]
        else:
            lines.append(line)
    return lines


def yaml_text(value: Any) -> str:
    """Return a value as YAML on one line, mappings in braces; what is no plain word is in quotes."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{yaml_text(key)}: {yaml_text(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(yaml_text, value)) + "]"
    if isinstance(value, float):
        return _number(value)
    style = '"' if isinstance(value, str) and not _PLAIN.fullmatch(value) else None
    dumped: str = yaml.safe_dump(value, default_style=style, width=10**6, allow_unicode=True)
    return dumped.replace("\n...", "").strip()


def _number(value: float) -> str:
    # The shortest text that reads back the same; YAML takes 1e-05 for text, so that a number needs its point.
    short = f"{value:.10g}"
    text = short if float(short) == value else repr(float(value))
    return text.replace("e", ".0e") if "e" in text and "." not in text else text
