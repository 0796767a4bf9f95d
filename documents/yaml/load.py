"""From a YAML file to a checked pydantic model, with every fault located."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import ErrorDetails

from documents.findings import Finding, InputError
from documents.text.words import did_you_mean
from documents.yaml.source import Path_, YamlSource, read_yaml

# Nobody reads more; a file of nothing but faults would take minutes to explain.
MOST_FINDINGS = 100
_SHOWN = 60

# The patterns of names in words; others are shown as they are.
_ALLOWED = {
    r"^[a-z0-9][a-z0-9_-]*$": "small letters a to z, digits, '_' and '-', and none of these two first",
    r"^[a-z][a-z0-9_]*$": "small letters a to z, digits and '_', a letter first",
    r"^[a-z][a-z0-9_]{0,59}$": "at most 60 small letters a to z, digits and '_', a letter first",
}

Model = TypeVar("Model", bound=BaseModel)

Kind = Literal["experiment", "display", "verification", "camera", "regions", "rig", "recipe"]

# The first key that is there decides.
KIND_BY_KEY = MappingProxyType(
    {
        "blocks": "experiment",
        "modes": "display",
        "nominal": "display",
        "onset_error_ms": "verification",
        "onsets": "verification",
        "matrix_XYZ_cd_m2": "camera",
        "regions": "regions",
        "mode": "rig",
        "kind": "recipe",
    }
)
_CALLED = MappingProxyType(
    {
        "experiment": "an experiment",
        "display": "a display file",
        "verification": "a photodiode's record",
        "camera": "a camera file",
        "regions": "a file of areas to compare",
        "rig": "a rig file",
        "recipe": "a recipe or observers file",
    }
)
# What only a file of the wanted kind has: with it, it is that kind, and has faults.
_OWN = MappingProxyType({"rig": ("display",), "recipe": ("kind",)})
_WANTED = MappingProxyType({**_CALLED, "recipe": "a recipe"})


class Strict(BaseModel):
    """Base of every model of a YAML file: frozen; unknown keys, NaN and infinity are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def load_document(path: Path, model: type[Model], kind: Kind | None = None) -> tuple[Model, YamlSource]:
    """Read the YAML file at ``path`` as a ``model``, of the ``kind`` of files that is wanted.

    Returns the model and its source, so that later checks can still name lines.

    Parameters
    ----------
    path
        The file to read.
    model
        The pydantic model that its keys must satisfy.
    kind
        The kind of file that is wanted; None takes any.

    Returns
    -------
    tuple
        The model and its source, so that later checks can still name lines.

    Raises
    ------
    InputError
        With one finding per fault: file, line, column, key, value and the nearest valid spelling. A file of another
        kind is reported as that alone.

    Examples
    --------
    >>> class Note(Strict):
    ...     text: str
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "note.yaml")
    ...     _ = file.write_text("text: bright")
    ...     load_document(file, Note)[0].text
    'bright'
    """
    source = read_yaml(path)
    try:
        return model.model_validate(source.data), source
    except ValidationError as error:
        if kind and (wrong := wrong_kind(source, kind)):
            raise InputError(wrong) from None
        raise InputError(_findings(error.errors(include_url=False), source, model)) from None


def wrong_kind(source: YamlSource, wanted: Kind) -> Finding | None:
    """Return that a file is of another kind than ``wanted``, where its keys show that; else None."""
    data: Any = source.data
    if not isinstance(data, dict):
        return None
    own = _OWN.get(wanted) or tuple(key for key, kind in KIND_BY_KEY.items() if kind == wanted)
    key = next((key for key in KIND_BY_KEY if key in data), None)
    if key is None or KIND_BY_KEY[key] == wanted or any(name in data for name in own):
        return None
    what = f"this is {_CALLED[KIND_BY_KEY[key]]}, not {_WANTED[wanted]}"
    remedy = f"{_WANTED[wanted]} has '{own[0]}:'; check the path"
    return source.finding((key,), what, remedy, key=True)


def _findings(errors: Iterable[ErrorDetails], source: YamlSource, model: type[BaseModel]) -> list[Finding]:
    all_errors = _without_echoes(list(errors))
    findings = [_finding(error, source, model) for error in all_errors[:MOST_FINDINGS]]
    findings.sort(key=lambda finding: (finding.line or 0, finding.column or 0))
    more = len(all_errors) - MOST_FINDINGS
    if more > 0:
        findings.append(Finding(f"there are {more} more faults", source.file, remedy="mend these first"))
    return findings


def _without_echoes(errors: list[ErrorDetails]) -> list[ErrorDetails]:
    """Leave out that a list is too short where its entries are there, and wrong: pydantic counts the right ones."""
    within = {error["loc"][:end] for error in errors for end in range(len(error["loc"]))}
    return [error for error in errors if error["type"] != "too_short" or error["loc"] not in within]


def _finding(error: ErrorDetails, source: YamlSource, model: type[BaseModel]) -> Finding:
    path = _real_path(error["loc"], source.data)
    name = ".".join(_short(str(part)) for part in path) or "the file"
    kind = error["type"]
    key = path[-1] if path else ""
    if kind == "extra_forbidden":
        known = _fields_at(model, error["loc"][:-1])
        return source.finding(path, f"unknown key '{name}'", _nearest(str(key), known), key=True)
    if kind == "missing":
        return source.finding(path[:-1], f"the key '{name}' is missing", f"add '{key}:'")
    if kind in ("union_tag_invalid", "literal_error"):
        context = error.get("ctx", {})
        expected = str(context.get("expected_tags") or context.get("expected") or "")
        value = context.get("tag", error["input"])
        options = [word.strip().strip("'") for word in expected.replace(" or ", ", ").split(",")]
        if kind == "union_tag_invalid":
            name = f"{name}.kind" if path else "kind"
            path = (*path, "kind")
        return source.finding(path, f"'{name}' is {_short(repr(value))}", _nearest(str(value), options))
    if kind == "union_tag_not_found":
        return source.finding(path, f"'{name}' has no 'kind'", "add 'kind:'")
    if kind == "too_short":
        least = error.get("ctx", {}).get("min_length", 1)
        return source.finding(path, f"'{name}' holds too little", f"give it at least {least}")
    value = _short(repr(error["input"]))
    if kind == "string_pattern_mismatch" and (allowed := _ALLOWED.get(error.get("ctx", {}).get("pattern", ""))):
        return source.finding(path, f"'{name}' is {value}", allowed)
    message = error["msg"].removeprefix("Value error, ").removeprefix("Assertion failed, ")
    return source.finding(path, f"'{name}' is {value}", message[:1].lower() + message[1:])


def _short(text: str) -> str:
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 3]}..."


def _real_path(location: tuple[str | int, ...], data: Any) -> Path_:
    """Drop the union tags that pydantic puts into a location: keep what exists in the data."""
    path: list[str | int] = []
    here = data
    for index, part in enumerate(location):
        last = index == len(location) - 1
        if isinstance(here, dict) and (part in here or last):
            here = here.get(part)
        elif isinstance(here, list) and isinstance(part, int) and part < len(here):
            here = here[part]
        elif not last:
            continue
        else:
            if not isinstance(part, int):
                continue
        path.append(part)
    return tuple(path)


def _nearest(word: str, options: Iterable[str]) -> str:
    known = sorted(set(options))
    return did_you_mean(word, known, None if known else "remove it")


@cache
def _schema(model: type[BaseModel]) -> dict[str, Any]:
    return model.model_json_schema()


def _fields_at(model: type[BaseModel], location: tuple[str | int, ...]) -> set[str]:
    """Field names that the schema allows at ``location``, found through its JSON Schema."""
    schema = _schema(model)
    definitions = schema.get("$defs", {})

    def resolve(node: dict[str, Any]) -> dict[str, Any]:
        while "$ref" in node:
            node = definitions[node["$ref"].rsplit("/", 1)[-1]]
        return node

    def branches(node: dict[str, Any]) -> list[dict[str, Any]]:
        node = resolve(node)
        choices = [*node.get("anyOf", []), *node.get("oneOf", [])]
        return [branch for choice in choices for branch in branches(choice)] or [node]

    nodes = branches(schema)
    for part in location:
        following: list[dict[str, Any]] = []
        for node in nodes:
            if isinstance(part, int) and "items" in node:
                following += branches(node["items"])
            elif str(part) in node.get("properties", {}):
                following += branches(node["properties"][str(part)])
            elif isinstance(node.get("additionalProperties"), dict):
                following += branches(node["additionalProperties"])
        tagged = [n for n in nodes if n.get("properties", {}).get("kind", {}).get("const") == part]
        nodes = following or tagged or nodes
    return {name for node in nodes for name in node.get("properties", {})}
