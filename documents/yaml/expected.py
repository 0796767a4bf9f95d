"""What a model wants at a place of a file, in words and as it would be written, from the model's JSON Schema."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from types import MappingProxyType
from typing import Any, TypeAlias

from pydantic import BaseModel

from documents.text.words import counted
from documents.yaml.ranges import LEAST

Location: TypeAlias = tuple[str | int, ...]
Node: TypeAlias = dict[str, Any]

# The patterns of names in words; others are shown as they are.
ALLOWED = MappingProxyType(
    {
        r"^[a-z0-9][a-z0-9_-]*$": "small letters a to z, digits, '_' and '-', and none of these two first",
        r"^[a-z][a-z0-9_]*$": "small letters a to z, digits and '_', a letter first",
        r"^[a-z][a-z0-9_]{0,59}$": "at most 60 small letters a to z, digits and '_', a letter first",
    }
)
_PLAIN = re.compile(r"[A-Za-z_./][\w./ -]{0,58}")
_MOST_KEYS = 4
_FAR = 1e9
_MANY: Mapping[Any, str] = MappingProxyType(
    {"number": "numbers", "integer": "whole numbers", "string": "texts", "array": "lists"}
)


@cache
def _schema(model: type[BaseModel]) -> Node:
    return model.model_json_schema()


def nodes_at(model: type[BaseModel], location: Location) -> list[Node]:
    """Return the parts of the schema that may stand at ``location``; pydantic's union tags in it are passed over."""
    nodes = _branches(model, _schema(model))
    for part in location:
        following: list[Node] = []
        for node in nodes:
            if isinstance(part, int) and "items" in node:
                following += _branches(model, node["items"])
            elif isinstance(part, int) and part < len(node.get("prefixItems", ())):
                following += _branches(model, node["prefixItems"][part])
            elif str(part) in node.get("properties", {}):
                following += _branches(model, node["properties"][str(part)])
            elif isinstance(node.get("additionalProperties"), dict):
                following += _branches(model, node["additionalProperties"])
        tagged = [node for node in nodes if part in constants(node, "kind") + constants(node, "test")]
        nodes = following or tagged or nodes
    return nodes


def constants(node: Node, key: str) -> list[Any]:
    """Return what ``key`` may be in a mapping, where only some words are allowed."""
    held = node.get("properties", {}).get(key, {})
    return [held["const"]] if "const" in held else list(held.get("enum", []))


def keys_at(model: type[BaseModel], location: Location) -> list[str]:
    """Return the keys that are known at ``location``."""
    return list(dict.fromkeys(name for node in nodes_at(model, location) for name in node.get("properties", {})))


def homes_of(model: type[BaseModel], key: str, location: Location) -> list[str]:
    """Return the keys of ``location`` below which ``key`` is known."""
    nodes = nodes_at(model, location)
    below = ((name, inner) for node in nodes for name, inner in node.get("properties", {}).items())
    homes = [
        name for name, inner in below if any(key in branch.get("properties", {}) for branch in _branches(model, inner))
    ]
    return list(dict.fromkeys(homes))


def in_words(model: type[BaseModel], nodes: Sequence[Node]) -> str:
    """Return what may stand there: ``a number above 0``, ``true or false``, ``all, or a list of texts``."""
    kept = [node for node in nodes if node.get("type") != "null"] or list(nodes)
    mappings = [node for node in kept if node.get("type") == "object"]
    if len(mappings) > 2:
        kept = [node for node in kept if node not in mappings[1:]]
    words = ", or ".join(dict.fromkeys(_words(model, node) for node in kept))
    return f"such as {words}" if len(mappings) > 2 else words


def as_written(model: type[BaseModel], nodes: Sequence[Node], value: object = None) -> str | None:
    """Return the keys that must stand there, such as ``{gamma: 2.2}``; None where no keys are wanted.

    ``value`` is what stands there instead: it is taken for the one key that must, where it could be meant for that.
    """
    for node in nodes:
        if node.get("type") == "object":
            return _mapping(model, node, value)
    return None


def example_of(nodes: Sequence[Node]) -> str | None:
    """Return an example, as YAML, where the model gives one."""
    return next((written(node["examples"][0]) for node in nodes if node.get("examples")), None)


def written(value: object) -> str:
    """Return a value as it would stand in a line of YAML; text in quotes."""
    if value is None:
        return "empty"
    if isinstance(value, str):
        return repr(value)
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {written(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(written, value)) + "]"
    return json.dumps(value) if isinstance(value, bool | int) else repr(value)


def plain(value: object) -> str:
    """Return a value as it would stand in a line of YAML; text without quotes where it needs none."""
    return value if isinstance(value, str) and _PLAIN.fullmatch(value) else written(value)


def either(options: Iterable[object]) -> str:
    """Return ``a, b or c``."""
    *first, last = [plain(option) for option in options]
    return f"{', '.join(first)} or {last}" if first else last


def range_words(node: Node) -> str:
    """Return the limits of a number in words, with a space before; empty if there are none that are near."""
    ends = (node.get(key) for key in ("minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum"))
    low, high, above, below = (None if end is None or is_far(end) else end for end in ends)
    if node.get("minimum") == LEAST:
        above = 0
    if low is not None and high is not None:
        return f" from {_number(low)} to {_number(high)}"
    if low is not None and below is not None:
        return f" from {_number(low)} to below {_number(below)}"
    parts = [
        f" above {_number(above)}" if above is not None else "",
        f" of at least {_number(low)}" if low is not None else "",
        f" below {_number(below)}" if below is not None else "",
        f" of at most {_number(high)}" if high is not None and above is None else "",
        f", {_number(high)} at most" if high is not None and above is not None else "",
    ]
    return "".join(parts)


def is_far(limit: float) -> bool:
    """Tell whether a limit only keeps off what nobody means: then it is said to whoever passes it."""
    return abs(limit) >= _FAR or abs(limit) == LEAST


def limit_words(limit: float, *, lower: bool) -> str:
    """Return a limit in words: ``a number of at most 1e+12``."""
    return f"a number of at {'least' if lower else 'most'} {_number(limit)}"


def _number(value: float) -> str:
    return f"{value:.0f}" if value == int(value) and abs(value) < 1e9 else f"{value:g}"


def _branches(model: type[BaseModel], node: Node) -> list[Node]:
    while "$ref" in node:
        beside = {key: value for key, value in node.items() if key != "$ref"}
        node = {**_schema(model).get("$defs", {})[node["$ref"].rsplit("/", 1)[-1]], **beside}
    choices = [*node.get("anyOf", []), *node.get("oneOf", [])]
    examples = {"examples": node["examples"]} if "examples" in node else {}
    return [{**branch, **examples} for choice in choices for branch in _branches(model, choice)] or [node]


def _words(model: type[BaseModel], node: Node) -> str:
    kind = node.get("type")
    if "const" in node:
        return plain(node["const"])
    if "enum" in node:
        return either(node["enum"])
    if kind == "boolean":
        return "true or false"
    if kind in ("number", "integer"):
        return ("a whole number" if kind == "integer" else "a number") + range_words(node)
    if kind == "string":
        allowed = ALLOWED.get(node.get("pattern", ""))
        return f"text of {allowed}" if allowed else "text"
    if kind == "array":
        return _list_words(model, node)
    if kind == "object":
        return _mapping(model, node, None)
    return "nothing" if kind == "null" else "a value"


def _list_words(model: type[BaseModel], node: Node) -> str:
    if "prefixItems" in node:
        kinds = {branch.get("type") for item in node["prefixItems"] for branch in _branches(model, item)}
        return (
            f"a list of {len(node['prefixItems'])} {_MANY.get(kinds.pop(), 'values') if len(kinds) == 1 else 'values'}"
        )
    items = _branches(model, node.get("items", {}))
    if len(items) == 1 and "enum" in items[0]:
        return f"a list of {either(items[0]['enum'])}"
    if any(item.get("type") == "object" for item in items):
        inner = next(item for item in items if item.get("type") == "object")
        return f"a list such as [{_mapping(model, inner, None)}]" if len(items) == 1 else "a list"
    kinds = {item.get("type") for item in items}
    many = _MANY.get(kinds.pop(), "values") if len(kinds) == 1 else "values"
    least, most = node.get("minItems"), node.get("maxItems")
    if least and least == most:
        return f"a list of {least} {many}"
    return f"a list of at least {least} {many}" if least and least > 1 else f"a list of {many}"


def _mapping(model: type[BaseModel], node: Node, value: object) -> str:
    properties = node.get("properties", {})
    if not properties:
        return "{NAME: ...}"
    must = node.get("required", [])
    if not must:
        names = list(properties)[:_MOST_KEYS]
        more = ", ..." if len(properties) > len(names) else ""
        return "{" + ", ".join(f"{name}: ..." for name in names) + more + "}"
    return "{" + ", ".join(_entries(model, properties, must, value)) + "}"


def _entries(model: type[BaseModel], properties: Node, must: Sequence[str], value: object) -> Iterator[str]:
    for name in must:
        branches = _branches(model, properties[name])
        if len(must) == 1 and _could_be(branches, value):
            yield f"{name}: {plain(value)}"
        elif "const" in branches[0]:
            yield f"{name}: {plain(branches[0]['const'])}"
        else:
            yield f"{name}: {example_of(branches) or '...'}"


def _could_be(branches: Sequence[Node], value: object) -> bool:
    kinds = {branch.get("type") for branch in branches}
    if isinstance(value, bool) or value is None:
        return False
    if isinstance(value, int | float):
        return bool(kinds & {"number", "integer"})
    return isinstance(value, str) and "string" in kinds


def shorter_or_longer(node: Node) -> str:
    """Return how long a text or a list may be, in words."""
    one, many = ("character", "characters") if node.get("type") == "string" else ("entry", "entries")
    least, most = (node.get(f"{end}{'Length' if many == 'characters' else 'Items'}") for end in ("min", "max"))
    if least is not None and least == most:
        return counted(least, one, many)
    parts = [f"at least {least}" if least else "", f"at most {most}" if most is not None else ""]
    return f"{' and '.join(filter(None, parts))} {one if (most or least) == 1 else many}"
