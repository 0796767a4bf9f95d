"""The pages of reference that `tools/api_page.py` writes beside docs/api.md: keys, options and records of a log.

Each is made from what the program itself reads by: the schemas of files, the commands, the types of a log's lines.
"""

from __future__ import annotations

import inspect
import json
import re
from collections import ChainMap
from collections.abc import Iterator
from typing import Any, get_args

import click
from pydantic import BaseModel

from analysis.kinds.trial import NAMED, Trial
from documents.options import described
from documents.yaml import described_schema

LONG = 80  # characters
NEAR, FAR = 1e-9, 1e9  # a limit nearer to 0 is 0, and one beyond is none
_KEYS = """# What keys has each file?

Made by `make api` from the schemas that `cyclopean schema KIND` prints: `check` and an editor read files by the same.
A key in bold has to be there. How to write a file is in [session.md](session.md), [display.md](display.md) and
[stimuli.md](stimuli.md).
"""
_OPTIONS = """# What commands and options are there?

Made by `make api` from the commands themselves: `cyclopean COMMAND --help` prints the same.
[check.md](check.md#how-do-i-find-out-what-to-type) says what all commands have in common.
"""
_RECORDS = """# What does each line of a session's log have?

Made by `make api` from the types that read a log. A field in bold has to be there. What is checked beyond the types,
and what the checksums prove, is in [session.md](session.md#how-do-i-read-a-sessions-log). Times are in seconds unless
the name says otherwise.
"""
# What a kind of file is called as a heading, in the order of the page.
FILES = {
    "experiment": "Experiment",
    "rig": "Rig",
    "display": "Display",
    "stimuli": "Recipe of stimuli",
    "camera": "Camera",
    "regions": "Regions",
    "observers": "Simulated observers",
    "verification": "Verification",
}


def cell(text: object) -> str:
    """Return a text as one cell of a table."""
    return " ".join(str(text).replace("|", "\\|").split())


def plain(text: str) -> str:
    """Return what a docstring says before its sections, as Markdown."""
    before = re.split(r"\n\n\w+\n---|\n\n\w.*::\n", inspect.cleandoc(text))[0]
    return re.sub(r"(?<!`)``(?!`)", "`", before)


def table(head: str, rows: list[list[str]]) -> str:
    """Return a table in Markdown without columns that are empty; nothing without rows."""
    full = [place for place in range(len(head.split())) if any(row[place] for row in rows)]
    names, rows = [head.split()[place] for place in full], [[row[place] for place in full] for row in rows]
    lines = [names, ["---"] * len(names), *([cell(each) for each in row] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n" if rows else ""


def anchor(heading: str) -> str:
    """Return the anchor of a heading, as GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-")


def spelt(name: str) -> str:
    """Return a class's name as words, such as ``both eyes`` of ``BothEyesSpec``."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name.removesuffix("Spec").removesuffix("Record")).lower()


class Section:
    """The schema of one model, and of those within it, as sections of a page: each once, after what names it first."""

    def __init__(self, title: str, schema: dict[str, Any], told: dict[str, str] | None = None) -> None:
        self.parts: dict[str, Any] = schema.get("$defs", {})
        self.headings: dict[str, str] = {}
        self.waiting: list[tuple[str, Any, dict[str, str]]] = [(title, schema, told or {})]
        self.title = title

    def written(self, level: str, *, kept: tuple[str, ...] = ()) -> Iterator[str]:
        """Yield each section, without the keys that are ``kept`` for another place."""
        while self.waiting:
            (title, schema, told), *later = self.waiting
            self.waiting = []
            rows = self.rows(title, schema, told, kept)
            self.waiting += later
            mark = level if title == self.title else level + "#"
            yield f"{mark} {title}\n\n{plain(schema.get('description', ''))}\n\n{rows}"

    def rows(self, title: str, schema: dict[str, Any], told: dict[str, str], kept: tuple[str, ...]) -> str:
        """Return the table of a model's keys; a model that is one of several lists these."""
        if "properties" not in schema and ("oneOf" in schema or "anyOf" in schema or "$ref" in schema):
            return f"One of: {self.value(schema, title)}.\n"
        rows = []
        for key, value in schema.get("properties", {}).items():
            if key in kept:
                continue
            needed = key in schema.get("required", ())
            default = value.get("default")
            usual = json.dumps(default, ensure_ascii=False)
            within = "{" in usual  # the defaults of the keys within, which have a table of their own
            usual = "" if default in (None, [], {}, "") or within or len(usual) > LONG else f"`{usual}`"
            meaning = plain(value.get("description") or told.get(key, ""))
            path = f"{title}, {key}" if ":" in title else f"{title}: {key}"
            rows.append([f"**`{key}`**" if needed else f"`{key}`", self.value(value, path), usual, meaning])
        return table("key value default meaning", rows)

    def value(self, schema: dict[str, Any], path: str) -> str:
        """Return in words what a value may be; a model that is not yet named is written later, by its ``path``."""
        if ref := schema.get("$ref"):
            return self.link(ref.rpartition("/")[2], path)
        for several in ("anyOf", "oneOf"):
            if several in schema:
                kinds = [self.value(each, path) for each in schema[several] if each.get("type") != "null"]
                return ", or ".join(dict.fromkeys(kinds))
        if "allOf" in schema:
            return self.value(schema["allOf"][0], path)
        if "const" in schema or "enum" in schema:
            words = schema.get("enum", [schema.get("const")])
            return ", ".join(f"`{word if isinstance(word, str) else json.dumps(word)}`" for word in words)
        kind = schema.get("type")
        if kind == "array":
            return self.items(schema, path)
        if kind == "object":
            inner = schema.get("additionalProperties")
            known = isinstance(inner, dict) and inner
            return f"map of names to {self.value(inner, path)}" if known and inner else "map"
        words = {"integer": "whole number", "number": "number", "boolean": "true, false", "string": "text"}
        return f"{words.get(str(kind), 'any')}{limits(schema)}"

    def items(self, schema: dict[str, Any], path: str) -> str:
        """Return in words what a list has."""
        first = schema.get("prefixItems")
        if first:
            each = [self.value(one, path) for one in first]
            return f"[{', '.join(each)}]" if len(set(each)) > 1 else f"{len(each)} of: {each[0]}"
        least, most = schema.get("minItems", 0), schema.get("maxItems", 0)
        count = f", {least} or more" if least > 1 else ""
        if most and most < FAR:
            count = f", {most} of them" if least == most else f", at most {most}"
        return f"list of {self.value(schema.get('items', {}), path)}{count}"

    def link(self, name: str, path: str) -> str:
        """Return a link to a model's section, which is written after this one if it is not yet."""
        schema = self.parts[name]
        if not {"properties", "oneOf", "anyOf"} & schema.keys():
            return self.value(schema, path)
        keys = schema.get("properties", {})
        own = keys.get("kind", {}).get("const") or keys.get("test", {}).get("const")
        if name not in self.headings:
            heading = f"{path}, {own}" if own else path
            taken = set(self.headings.values())
            if heading in taken:  # what stands at the same key, told apart by its name
                heading = f"{path}, {spelt(name)}"
            self.headings[name] = heading
            self.waiting.append((heading, schema, {}))
        label = own or path.rpartition(", ")[2].rpartition(": ")[2]
        return f"[{label}](#{anchor(self.headings[name])})"


def limits(schema: dict[str, Any]) -> str:
    """Return in words between what a number lies, or how long a text is."""
    signs = {"exclusiveMinimum": ">", "minimum": "≥", "exclusiveMaximum": "<", "maximum": "≤"}
    known = {sign: schema[key] for key, sign in signs.items() if abs(schema.get(key, FAR)) < FAR}
    if 0 < known.get("≥", 0) < NEAR:
        known = {">": 0, **known}
        del known["≥"]
    words = [f"{sign} {limit:g}" for sign, limit in known.items()]
    if schema.get("type") == "string" and schema.get("maxLength", FAR) < 100_000:
        words.append(f"of at most {schema['maxLength']} characters")
    return f" {', '.join(words)}" if words else ""


def keys_page() -> str:
    """Return docs/keys.md."""
    from runner.protocol.schemas import KINDS, json_schema

    parts = [_KEYS]
    for kind in sorted(KINDS, key=list(FILES).index):
        parts += Section(FILES[kind], json_schema(kind)).written("##")
    return "\n".join(parts).rstrip() + "\n"


def commands(command: click.Command, context: click.Context) -> Iterator[tuple[click.Context, click.Command]]:
    """Yield each command within ``command``, with its context."""
    if not isinstance(command, click.Group):
        yield context, command
        return
    for name in command.list_commands(context):
        if inner := command.get_command(context, name):
            yield from commands(inner, click.Context(inner, info_name=name, parent=context))


def options_page() -> str:
    """Return docs/options.md."""
    from runner.cli.main import group

    parts = [_OPTIONS]
    for context, command in commands(group, click.Context(group, info_name="cyclopean")):
        usage = " ".join(command.collect_usage_pieces(context)).replace("[OPTIONS] ", "").replace("[OPTIONS]", "")
        about = "\n\n".join(" ".join(part.split()) for part in plain(command.help or "").split("\n\n"))
        found = (each.get_help_record(context) for each in command.params)
        rows = [[f"`{record[0]}`", plain(record[1])] for record in found if record and record[1]]
        examples = "\n".join("    " + line.strip() for line in (command.epilog or "").splitlines()[2:])
        parts.append(f"## {context.command_path}\n\n`{context.command_path} {usage}`\n\n{about}\n")
        parts += [part + "\n" for part in (examples, table("option meaning", rows).rstrip()) if part]
    return "\n".join(parts).rstrip() + "\n"


def of_model(title: str, model: type[BaseModel], level: str, kept: tuple[str, ...] = ()) -> Iterator[str]:
    """Yield the sections of one type of line; what tables say of a column is said of its field too."""
    columns = ChainMap(*(vars(each).get("columns", {}) for each in model.__mro__))
    told = {name: words.description.removesuffix(NAMED) for name, words in columns.items()} | described(model)
    yield from Section(title, described_schema(model), told).written(level, kept=kept)


def records_page() -> str:
    """Return docs/log_records.md."""
    from analysis.kinds import KINDS
    from analysis.records import lines
    from analysis.records.pooled_batches import PooledBatch

    parts = [_RECORDS, *of_model("Header", lines.Header, "##"), *of_model("Every trial", Trial, "##")]
    common = tuple(Trial.model_fields)
    for name in KINDS.own():
        for model in forms(KINDS.get(name)):
            own = "" if model is KINDS.get(name) else f", {spelt(model.__name__)}"
            parts += of_model(f"Trial of {name}{own}", model, "##", common)
    others = [lines.Note, lines.Mark, lines.Resumption, lines.WindowEvent, lines.StimulusCosts, PooledBatch]
    for other in (*others, lines.EndRecord):
        parts += of_model(f"Line {get_args(other.model_fields['record'].annotation)[0]}", other, "##")
    return "\n".join(parts).rstrip() + "\n"


def forms(model: type[BaseModel]) -> list[type[BaseModel]]:
    """Return the types that a kind's lines may have: where a line says which, those made of it."""
    return list(model.__subclasses__()) if "of_line" in vars(model) else [model]
