"""What is wrong with a file, and what to write instead: findings in place of what pydantic says."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from pydantic import BaseModel
from pydantic_core import ErrorDetails

from documents.findings import Finding
from documents.text.words import counted, did_you_mean, nearest
from documents.yaml.expected import (
    ALLOWED,
    Location,
    Node,
    as_written,
    constants,
    either,
    example_of,
    homes_of,
    in_words,
    is_far,
    keys_at,
    limit_words,
    nodes_at,
    plain,
    shorter_or_longer,
    written,
)
from documents.yaml.ranges import LEAST
from documents.yaml.source import Path_, YamlSource

_SHOWN = 60
_NUMBER = re.compile(r"\s*([-+]?\d+)(?:([.,])(\d+))?\s*([^\d\s.,].{0,20})?")
# What a unit is in that of a key, which is the end of its name.
_UNITS = ("mm", "um", "cm", "px", "s", "hz", "deg")
_IN_UNITS = {
    ("cm", "mm"): 10.0,
    ("m", "mm"): 1000.0,
    ("in", "mm"): 25.4,
    ("inch", "mm"): 25.4,
    ("ms", "s"): 0.001,
    ("min", "s"): 60.0,
    ("%", "percent"): 1.0,
    ("%", ""): 0.01,
    ("Hz", "hz"): 1.0,
    ("°", "deg"): 1.0,
}
_NUMBERS = ("number", "integer")
_LENGTHS = ("too_short", "too_long", "string_too_short", "string_too_long")


def file_findings(
    errors: Sequence[ErrorDetails], source: YamlSource, model: type[BaseModel], most: int
) -> list[Finding]:
    """Return a finding for each fault of a file that is no ``model``, in the order of the file, ``most`` at most."""
    all_errors = _without_echoes(_one_of_each_union(list(errors), source.data))
    faults = [_Fault(error, source, model) for error in all_errors[:most]]
    findings = [replace(fault.finding(), path=fault.path, code=fault.kind) for fault in faults]
    findings.sort(key=lambda finding: (finding.line or 0, finding.column or 0))
    more = len(all_errors) - most
    if more > 0:
        findings.append(Finding(f"there are {more} more faults", source.file, remedy="mend these first"))
    return list(dict.fromkeys(findings))


class _Fault:
    """One of pydantic's errors: what stands where, and what is wanted there."""

    def __init__(self, error: ErrorDetails, source: YamlSource, model: type[BaseModel]) -> None:
        self.kind, self.value, self.context = error["type"], error["input"], error.get("ctx", {})
        self.words = error["msg"].removeprefix("Value error, ").removeprefix("Assertion failed, ")
        self.location: Location = error["loc"]
        self.path = _real_path(self.location, source.data)
        if self.kind == "missing":
            self.path += self.location[-1:]
        self.key = self.path[-1] if self.path else ""
        self.source, self.model = source, model

    @property
    def nodes(self) -> list[Node]:
        return nodes_at(self.model, self.location)

    def finding(self) -> Finding:
        if self.kind == "extra_forbidden":
            what = f"unknown key '{_called(self.path)}'"
            return self.source.finding(self.path, what, self._right_key(), key=True)
        if self.kind == "missing":
            return self._missing()
        if self.kind in ("union_tag_invalid", "union_tag_not_found"):
            return self._kind_of_entry()
        if self.kind == "extension":
            return self.source.finding((*self.path, "kind"), self.words, self.context["remedy"])
        if self.value is None:
            return self._found(
                "has no value", self._instead() + ("" if self._must_stand() else ", or leave the key out")
            )
        if self.kind in ("value_error", "assertion_error"):
            return self._by_its_model()
        if self.kind in _LENGTHS:
            return self._length()
        return self._found(f"is {_short(written(self.value))}", self._remedy())

    def _found(self, what: str, remedy: str) -> Finding:
        return self.source.finding(self.path, f"{self._name()} {what}", remedy)

    def _name(self) -> str:
        return f"'{_called(self.path)}'" if self.path else "the file"

    def _missing(self) -> Finding:
        if isinstance(self.location[-1], int):  # of a list with so many entries
            self.location = self.location[:-1]
            self.path = _real_path(self.location, self.source.data)
            self.key = self.path[-1]
            many = len(_held(self.source.data, self.path))
            return self._found(f"holds {counted(many, 'value', 'values')}", self._instead())
        remedy = f"add '{self.key}:'"
        if self.nodes and all("const" in node for node in self.nodes):
            remedy = f"add '{self._line(in_words(self.model, self.nodes))}'"
        elif example := example_of(self.nodes):
            remedy = f"add '{self.key}:', such as {self.key}: {example}"
        elif (words := in_words(self.model, self.nodes)) not in ("text", "a value"):
            remedy += f", {words}"
        return self.source.finding(self.path[:-1], f"the key '{_called(self.path)}' is missing", remedy)

    def _right_key(self) -> str:
        """Return the key that was meant, or the place where this key belongs."""
        key, above = str(self.key), self.location[:-1]
        known = keys_at(self.model, above)
        if near := nearest(key, known):
            return f"did you mean '{near}'?"
        if homes := homes_of(self.model, key, above):
            return f"it belongs below '{homes[0]}:'"
        outer = self.path[:-1]
        if outer and isinstance(outer[-1], str) and key in keys_at(self.model, outer[:-1]):
            return f"it belongs beside '{outer[-1]}:', not below it"
        if key.isdecimal():
            return "a comma separates entries: write a decimal point, such as 0.5"
        return did_you_mean(key, known, None if known else "remove it")

    def _kind_of_entry(self) -> Finding:
        key = str(self.context.get("discriminator", "kind")).strip("'")
        name = f"{_called(self.path)}.{key}" if self.path else key
        options = [str(value) for node in self.nodes for value in constants(node, key)]
        if self.kind == "union_tag_not_found":
            remedy = f"add '{key}:', " + either(options) if options else f"add '{key}:'"
            return self.source.finding(self.path, f"{self._name()} has no '{key}'", remedy)
        value = self.value.get(key) if isinstance(self.value, dict) else self.value
        remedy = did_you_mean(str(value), options, None if options else "install the package that adds it")
        what = f"'{name}' has no value" if value is None else f"'{name}' is {_short(written(value))}"
        return self.source.finding((*self.path, key), what, remedy)

    def _by_its_model(self) -> Finding:
        """Return what the model itself says, which is written for people."""
        if isinstance(self.value, dict | list | tuple):
            return self.source.finding(self.path, f"{self._name()}: {self.words}" if self.path else self.words)
        # Not of an abbreviation, such as CIE.
        words = self.words if self.words[1:2].isupper() else self.words[:1].lower() + self.words[1:]
        return self._found(f"is {_short(written(self.value))}", words)

    def _length(self) -> Finding:
        name = "string" if self.kind.startswith("string") else "array"
        least, most = self.context.get("min_length"), self.context.get("max_length")
        node: Node = {"type": name, **({} if least is None else {"minLength": least, "minItems": least})}
        node |= {} if most is None else {"maxLength": most, "maxItems": most}
        many = len(self.value) if isinstance(self.value, str | list | tuple | dict) else 0
        nothing, remedy = "holds nothing", f"give it {shorter_or_longer(node)}"
        if name == "string":
            nothing, one, several = "is empty", "character", "characters"
            remedy = remedy if many else self._instead()
        else:
            one, several = "entry", "entries"
            if any("prefixItems" in node for node in self.nodes):
                remedy = self._instead()
        return self._found(f"holds {counted(many, one, several)}" if many else nothing, remedy)

    def _is_low(self) -> bool:
        """Tell whether the value is no number above 0, which is wanted."""
        return isinstance(self.value, int | float) and self.value <= 0 and self.context.get("ge") == LEAST

    def _remedy(self) -> str:
        if self.kind == "literal_error":
            options = [str(value) for node in self.nodes for value in node.get("enum", [node.get("const")])]
            options = [option for option in options if option != "None"]
            if len(options) > 1 and isinstance(self.value, str):
                return did_you_mean(self.value, options)
            return self._instead()
        if self.kind == "string_pattern_mismatch":
            pattern = str(self.context.get("pattern", ""))
            return f"use {ALLOWED[pattern]}" if pattern in ALLOWED else f"write text that matches {pattern}"
        if self.kind == "string_type" and isinstance(self.value, bool | int | float):
            return f"this is text: put quotes around it, {self._line(repr(written(self.value)))}"
        if self.kind.startswith(("greater_than", "less_than")):
            limit = next(value for key, value in self.context.items() if key in ("ge", "gt", "le", "lt"))
            if is_far(limit) and not self._is_low():
                return f"write {limit_words(limit, lower=self.kind.startswith('greater_than'))}"
            return f"write {in_words(self.model, [node for node in self.nodes if node.get('type') in _NUMBERS])}"
        if self.kind == "finite_number":
            return "write a finite number"
        if self.kind == "int_from_float":
            return f"write {in_words(self.model, self.nodes)}"
        if isinstance(self.value, str) and self._wants_number() and (number := self._number(self.value)):
            return number
        return self._instead()

    def _instead(self) -> str:
        """Return what to write."""
        nodes = self.nodes
        mapping = as_written(self.model, nodes, self.value)
        if mapping is not None and all(node.get("type") in ("object", "null") for node in nodes):
            such_as = "keys, such as " if sum(node.get("type") == "object" for node in nodes) > 1 else ""
            return f"write {such_as}{self._line(mapping)}"
        if self._wants_list_of(self.value):
            return f"write a list: {self._line(f'[{plain(self.value)}]')}"
        words = in_words(self.model, nodes)
        if all("const" in node for node in nodes):
            return f"write {self._line(words)}"
        example = example_of(nodes)
        return f"write {words}" + (f", such as {self._line(example)}" if example else "")

    def _number(self, text: str) -> str | None:
        """Return what to write for a text such as ``70 cm`` or ``0,27``; None if it holds no number."""
        match = _NUMBER.fullmatch(text)
        if not match:
            return None
        number, unit = float(match[1] + (f".{match[3]}" if match[3] else "")), (match[4] or "").strip()
        name = next((part for part in reversed(self.path) if isinstance(part, str)), "")
        wanted = name.rpartition("_")[2]
        if not unit or unit == wanted:
            return f"write the number alone: {self._line(f'{number:.12g}')}"
        if (factor := _IN_UNITS.get((unit, wanted)) or _IN_UNITS.get((unit, ""))) is not None:
            return f"write the number alone: {self._line(f'{number * factor:.12g}')}"
        return "write the number alone" + (f", in {wanted}" if wanted in _UNITS else "")

    def _line(self, value: str) -> str:
        return f"{self.key}: {value}" if isinstance(self.key, str) and self.key else value

    def _wants_number(self) -> bool:
        return any(node.get("type") in _NUMBERS for node in self.nodes)

    def _wants_list_of(self, value: object) -> bool:
        if isinstance(value, bool) or not isinstance(value, str | int | float):
            return False
        wanted = "string" if isinstance(value, str) else "number"
        nodes = [node for node in self.nodes if node.get("type") != "null"]
        lists = [node for node in nodes if node.get("type") == "array" and node.get("minItems", 1) <= 1]
        return bool(lists) and all(node.get("items", {}).get("type") == wanted for node in lists) and nodes == lists

    def _must_stand(self) -> bool:
        if not isinstance(self.key, str) or not self.path:
            return True
        return any(self.key in node.get("required", ()) for node in nodes_at(self.model, self.location[:-1]))


def _one_of_each_union(errors: list[ErrorDetails], data: Any) -> list[ErrorDetails]:
    """Keep of a value that may be one of several things what is wrong with it as the nearest: the rest is noise.

    Pydantic reports it as each of them, with a tag for each in the location that is not in the data.
    """
    by_union: dict[Location, dict[object, list[ErrorDetails]]] = {}
    for error in errors:
        place = error["loc"][:-1] if error["type"] == "missing" else error["loc"]
        for start, tag in enumerate(place):
            if isinstance(tag, str) and not _stands(error["loc"][:start], tag, data):
                by_union.setdefault(error["loc"][:start], {}).setdefault(tag, []).append(error)
    dropped: list[int] = []
    for union, by_tag in by_union.items():
        if len(by_tag) < 2:
            continue
        deeper = {
            tag: [error for error in of_tag if len(_real_path(error["loc"], data)) > len(_real_path(union, data))]
            for tag, of_tag in by_tag.items()
        }
        fitting = [tag for tag, inner in deeper.items() if len(inner) == len(by_tag[tag])]
        kept = min(fitting, key=lambda tag: len(by_tag[tag])) if fitting else next(iter(by_tag))
        for other, of_tag in by_tag.items():
            dropped += map(id, of_tag if other != kept else [] if fitting else of_tag[1:])
    return [error for error in errors if id(error) not in dropped]


def _stands(location: Location, key: str, data: Any) -> bool:
    """Whether ``key`` is a key of the data at ``location``, or could be: what is missing is no tag."""
    here = _held(data, _real_path(location, data))
    return isinstance(here, dict) and key in here


def _held(data: Any, path: Path_) -> Any:
    for part in path:
        data = data[part]
    return data


def _without_echoes(errors: list[ErrorDetails]) -> list[ErrorDetails]:
    """Leave out that a list is too short where its entries are there, and wrong: pydantic counts the right ones."""
    within = {error["loc"][:end] for error in errors for end in range(len(error["loc"]))}
    return [error for error in errors if error["type"] != "too_short" or error["loc"] not in within]


def _real_path(location: Location, data: Any) -> Path_:
    """Drop the union tags that pydantic puts into a location: keep what exists in the data."""
    path: list[str | int] = []
    here = data
    for part in location:
        entry = isinstance(here, list) and isinstance(part, int) and part < len(here)
        if entry or (isinstance(here, dict) and part in here):
            here = here[part]
            path.append(part)
    return tuple(path)


def _called(path: Path_) -> str:
    """Return a place in words, entries of lists counted from 1: ``blocks.2.text``."""
    return ".".join(_short(str(part + 1 if isinstance(part, int) else part)) for part in path)


def _short(text: str) -> str:
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 3]}..."
