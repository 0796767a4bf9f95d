"""YAML documents as plain data, with the place of every key and value."""

from __future__ import annotations

import math
import re
from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml
from yaml.composer import Composer
from yaml.constructor import SafeConstructor
from yaml.resolver import Resolver

from documents.files.paths import with_slashes
from documents.files.regular_files import read_regular
from documents.findings import Finding, InputError
from documents.text.words import hidden_character

if yaml.__with_libyaml__:  # as in all wheels of PyYAML
    from yaml._yaml import CParser

# PyYAML's safe loader with the scalars of YAML 1.2, by its own parser and by the one of libyaml.
#
# PyYAML reads YAML 1.1, in which ``NO`` is false, ``12:30`` is 750 and ``1e-3`` is a string. The resolvers
# here are those of the YAML 1.2 core schema (https://yaml.org/spec/1.2.2/#103-core-schema).
#
# The parser in C takes an eighth of the time. Nodes are composed in Python from its events all the same: libyaml's
# own composing recurses without a limit, and ends the process where lists are nested deeply enough.

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


MAX_BYTES = 1_000_000
MAX_DEPTH = 100
_SHOWN = 60

Path_ = tuple[str | int, ...]

_CORE_TAGS = {f"tag:yaml.org,2002:{name}" for name in ("null", "bool", "int", "float", "str", "seq", "map")}


# What the parser says, and what to do about it. The first that is found holds.
_REMEDIES = (
    (r"character '\\t'", "a tab stands there: put spaces"),
    (r"found character '", "put the text in quotes"),
    (
        r"mapping values are not allowed",
        "put text that holds a colon in quotes; keys that belong together begin below one another",
    ),
    (r"but got '\?'", "put text that ends with '?' in quotes"),
    (r"could not find expected ':'", "write 'key: value', with a space after the colon"),
    (r"expected ',' or '([}\]])'", "the '{open}' of line {line} is not closed, or a comma is missing"),
    (r"unexpected end of stream", "the quotation mark of line {line} is not closed"),
    (r"expected <block end>, but found '[}\]]'", "there is one '}}' or ']' too many"),
    (r"expected <block end>, but found '<scalar>'", "text continues after its quotation mark: write '' for ' in it"),
    (r"unknown escape character", "write paths with forward slashes; other text with backslashes in single quotes"),
    (r"expected <block end>", "keys of one block, or the hyphens of one list, begin below one another"),
    (r"alias|anchor", "put text that begins with '*' or '&' in quotes"),
)


@dataclass(frozen=True, slots=True)
class Place:
    """Line and column, counted from 1."""

    line: int
    column: int


@dataclass(frozen=True, slots=True)
class YamlSource:
    """A parsed document: plain Python data, and where each key and value of it stands."""

    file: str
    data: Any
    keys: dict[Path_, Place] = field(repr=False)
    values: dict[Path_, Place] = field(repr=False)

    def place(self, path: Path_, *, key: bool = False) -> Place | None:
        """Return the place of the value at ``path`` (of its key if asked), else of its nearest ancestor."""
        for length in range(len(path), -1, -1):
            ancestor = path[:length]
            node = self.keys.get(ancestor) if key or length < len(path) else None
            node = node or self.values.get(ancestor)
            if node:
                return node
        return None

    def finding(
        self, path: Path_, message: str, remedy: str | None = None, *, key: bool = False, code: str = ""
    ) -> Finding:
        """Return a finding about the value at ``path`` (about its key if asked), with its line and column."""
        place = self.place(path, key=key)
        line, column = (place.line, place.column) if place else (None, None)
        return Finding(message, self.file, line, column, remedy, tuple(path), code)


def _walk(file: str, loader: Loader, root: yaml.Node) -> YamlSource:
    """Turn the node graph into data and places, refusing duplicate keys, cycles and exploding aliases."""
    keys: dict[Path_, Place] = {}
    values: dict[Path_, Place] = {}
    budget = MAX_NODES

    def fail(node: yaml.Node, message: str, remedy: str | None = None) -> InputError:
        mark = node.start_mark
        return InputError(Finding(message, file, mark.line + 1, mark.column + 1, remedy))

    def refuse_hidden(node: yaml.ScalarNode) -> None:
        hidden = hidden_character(str(node.value))
        if hidden is not None:
            what = f"a control character or a mark of direction (U+{ord(hidden):04X}) stands in the text"
            remedy = "remove it; it would hide or turn round what is read"
            if node.style == '"' and with_slashes(str(node.value)) != node.value:
                remedy = "between double quotes a backslash begins an escape: write paths with forward slashes"
            raise fail(node, what, remedy)

    def visit(node: yaml.Node, path: Path_, ancestors: frozenset[int]) -> Any:
        nonlocal budget
        budget -= 1
        if budget < 0:
            raise fail(node, f"the file expands to more than {MAX_NODES} values", "write out fewer aliases")
        if id(node) in ancestors:
            raise fail(node, "an alias refers to the value that contains it", "remove the recursive anchor")
        if len(ancestors) >= MAX_DEPTH:
            raise fail(node, f"values are nested more than {MAX_DEPTH} deep")
        if node.tag not in _CORE_TAGS:
            raise fail(node, f"the tag '{node.tag}' is not allowed", "write a plain value")
        if isinstance(node, yaml.ScalarNode):
            refuse_hidden(node)
        inner = ancestors | {id(node)}
        values[path] = Place(node.start_mark.line + 1, node.start_mark.column + 1)
        if isinstance(node, yaml.MappingNode):
            mapping: dict[Hashable, Any] = {}
            for key_node, value_node in node.value:
                if not isinstance(key_node, yaml.ScalarNode):
                    raise fail(key_node, "a key must be a plain word")
                refuse_hidden(key_node)
                key = str(key_node.value)
                if key in mapping:
                    raise fail(key_node, f"the key '{_short(key)}' stands twice", "keep one of them")
                keys[(*path, key)] = Place(key_node.start_mark.line + 1, key_node.start_mark.column + 1)
                mapping[key] = visit(value_node, (*path, key), inner)
            return mapping
        if isinstance(node, yaml.SequenceNode):
            return [visit(child, (*path, index), inner) for index, child in enumerate(node.value)]
        try:
            return loader.construct_object(node)
        except (yaml.YAMLError, ValueError) as error:
            problem = getattr(error, "problem", None) or str(error)
            raise fail(node, f"cannot read '{_short(str(node.value))}': {_short(problem)}") from error

    return YamlSource(file, visit(root, (), frozenset()), keys, values)


def _short(text: str) -> str:
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 3]}..."


def _documents(loader: Loader) -> Iterator[yaml.Node]:
    while loader.check_node():
        node = loader.get_node()
        if node is not None:
            yield node


def remedy_of(error: yaml.MarkedYAMLError) -> str | None:
    """Return what would most likely make the text valid; None where that is not clear.

    A line that is named is the one in which the parser began what it could not end.
    """
    begun = error.context_mark or error.problem_mark
    for pattern, remedy in _REMEDIES:
        match = re.search(pattern, error.problem or "")
        if match:
            closing = match[1] if match.groups() else ""
            return remedy.format(open={"}": "{", "]": "["}.get(closing, ""), line=begun.line + 1 if begun else 1)
    return None


def parse_yaml(text: str, file: str) -> YamlSource:
    """Parse one YAML document; ``file`` is the name that findings carry.

    Parameters
    ----------
    text
        The document.
    file
        The file's name for findings.

    Returns
    -------
    YamlSource
        Plain data, with the line and column of each key and value.

    Raises
    ------
    InputError
        If the text is no single YAML document, repeats a key, recurses, or expands beyond the limits.

    Examples
    --------
    >>> source = parse_yaml("{distance_mm: 700, mode: side-by-side}", "rig.yaml")
    >>> source.data
    {'distance_mm': 700, 'mode': 'side-by-side'}
    >>> place = source.place(("mode",))
    >>> place.line, place.column
    (1, 26)
    """
    if can_be_quick(text):
        try:
            return _parsed(QuickLoader, text, file)
        except (InputError, ValueError):  # PyYAML's own parser says what is wrong, and where
            pass
    return _parsed(Loader, text, file)


def _parsed(kind: type[Loader], text: str, file: str) -> YamlSource:
    loader: Loader | None = None
    try:
        loader = kind(text)
        nodes = list(_documents(loader))
        if len(nodes) != 1:
            remedy = "take out the '---' between them" if nodes else "it is empty, or has nothing but comments"
            raise InputError(Finding(f"the file holds {len(nodes)} YAML documents instead of one", file, 1, 1, remedy))
        return _walk(file, loader, nodes[0])
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line, column = (mark.line + 1, mark.column + 1) if mark else (1, 1)
        raise InputError(
            Finding(f"this is not valid YAML: {error.problem or error.context}", file, line, column, remedy_of(error))
        ) from error
    except RecursionError as error:
        raise InputError(Finding("this is not valid YAML: values are nested too deep", file, 1, 1)) from error
    except yaml.YAMLError as error:
        raise InputError(Finding(f"this is not valid YAML: {' '.join(str(error).split())}", file, 1, 1)) from error
    finally:
        if loader:
            loader.dispose()


def read_yaml(path: Path) -> YamlSource:
    """Read and parse the YAML file at ``path`` (UTF-8, at most 1 MB).

    Parameters
    ----------
    path
        The file: UTF-8, at most 1 MB.

    Returns
    -------
    YamlSource
        Its ``data``, with the line and column of each value.

    Raises
    ------
    InputError
        If the file is missing, unreadable, too large, not UTF-8 or not valid YAML.

    Examples
    --------
    >>> read_yaml(Path("configs/rigs/asus_vg248qe_3dvision.yaml")).data["distance_mm"]
    700
    """
    file = str(path)
    content = read_regular(path, MAX_BYTES)
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(Finding("the file is not UTF-8 text", file)) from error
    return parse_yaml(text, file)
