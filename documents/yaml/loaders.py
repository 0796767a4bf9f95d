"""PyYAML's safe loader with the scalars of YAML 1.2, by its own parser and by the one of libyaml.

PyYAML reads YAML 1.1, in which ``NO`` is false, ``12:30`` is 750 and ``1e-3`` is a string. The resolvers
here are those of the YAML 1.2 core schema (https://yaml.org/spec/1.2.2/#103-core-schema).

The parser in C takes an eighth of the time. Nodes are composed in Python from its events all the same: libyaml's
own composing recurses without a limit, and ends the process where lists are nested deeply enough.
"""

from __future__ import annotations

import math
import re
from typing import Any

import yaml
from yaml.composer import Composer
from yaml.constructor import SafeConstructor
from yaml.resolver import Resolver

if yaml.__with_libyaml__:  # as in all wheels of PyYAML
    from yaml._yaml import CParser

MAX_NODES = 100_000
# Integers beyond 4300 digits cannot be written again (`sys.set_int_max_str_digits`).
_LONGEST_NUMBER = 100
# Text that libyaml may take otherwise: it allows tabs and comments in more places, counts a byte order mark as a
# column.
_UNLIKE = re.compile(r"[\t\ufeff]|[|>]#")


class Loader(yaml.SafeLoader):
    """A document's nodes and values, by PyYAML's own parser; no more than ``MAX_NODES``, and a key for each."""

    yaml_implicit_resolvers: dict[str, list[tuple[str, re.Pattern[str]]]] = {}  # noqa: RUF012 - PyYAML's own design
    composed = 0

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """Compose a node, of so many at most: composing is what takes long in a large file."""
        self.composed += 1
        if self.composed > 2 * MAX_NODES:  # keys are nodes too
            mark = self.peek_event().start_mark  # type: ignore[no-untyped-call]  # PyYAML has no types there
            raise yaml.MarkedYAMLError(problem=f"it holds more than {MAX_NODES} values", problem_mark=mark)
        return super().compose_node(parent, index)


Loader.add_implicit_resolver(
    "tag:yaml.org,2002:bool", re.compile(r"^(?:true|True|TRUE|false|False|FALSE)$"), list("tTfF")
)
Loader.add_implicit_resolver("tag:yaml.org,2002:null", re.compile(r"^(?:~|null|Null|NULL|)$"), ["~", "n", "N", ""])
Loader.add_implicit_resolver(
    "tag:yaml.org,2002:int", re.compile(r"^(?:[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+)$"), list("-+0123456789")
)
Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(
        r"^(?:[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$"
    ),
    list("-+0123456789."),
)


def _construct_int(loader: Loader, node: yaml.ScalarNode) -> int:
    text = str(loader.construct_scalar(node))
    if len(text) > _LONGEST_NUMBER:
        raise ValueError(f"no whole number has more than {_LONGEST_NUMBER} digits")
    base = {"0o": 8, "0x": 16}.get(text[:2], 10)
    return int(text[2:] if base != 10 else text, base)


def _construct_float(loader: Loader, node: yaml.ScalarNode) -> float:
    text = str(loader.construct_scalar(node)).lower()
    value = float(text.replace(".inf", "inf").replace(".nan", "nan"))
    if math.isinf(value) and not text.endswith("inf"):
        raise ValueError("no number is that large")
    return value


Loader.add_constructor("tag:yaml.org,2002:int", _construct_int)
Loader.add_constructor("tag:yaml.org,2002:float", _construct_float)


class QuickLoader(Loader):
    """The same nodes and values from libyaml's events; an error where the parsers place or take something otherwise."""

    def __init__(self, text: str) -> None:
        Composer.__init__(self)
        SafeConstructor.__init__(self)
        Resolver.__init__(self)
        parser = CParser(text)
        vars(self).update(
            {name: getattr(parser, name) for name in ("check_event", "peek_event", "get_event", "dispose")}
        )

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """Compose a node; not a value that is left out, nor one that holds '?' between brackets."""
        node = super().compose_node(parent, index)
        if isinstance(node, yaml.ScalarNode) and not node.style:
            between_brackets = isinstance(parent, yaml.CollectionNode) and parent.flow_style
            if not node.value or (between_brackets and "?" in node.value):
                raise yaml.YAMLError("the parsers place or take this value otherwise")
        return node


def can_be_quick(text: str) -> bool:
    """Tell whether libyaml is there and would take ``text`` as PyYAML's own parser does."""
    return yaml.__with_libyaml__ and not _UNLIKE.search(text)
