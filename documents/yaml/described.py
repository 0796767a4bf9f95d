"""JSON Schemas in which every key says what it means: the words that stand below the key in its model.

Pydantic can read them too, but when a model is made, which would make every command half a second slower to start.
"""

from __future__ import annotations

import ast
import importlib
import inspect
import textwrap
from functools import cache
from itertools import pairwise
from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema
from pydantic_core import core_schema


def described_schema(model: type[BaseModel]) -> dict[str, Any]:
    """Return the JSON Schema of ``model``, with the string below each of its attributes as that key's description.

    Parameters
    ----------
    model
        A pydantic model whose attributes are followed by a string each.

    Returns
    -------
    dict
        The schema.

    Examples
    --------
    >>> from devices.display import RigSpec
    >>> described_schema(RigSpec)["properties"]["distance_mm"]["description"]
    'The viewing distance, in mm.'
    """
    return model.model_json_schema(schema_generator=_Described)


class _Described(GenerateJsonSchema):
    def model_schema(self, schema: core_schema.ModelSchema) -> dict[str, Any]:
        made = super().model_schema(schema)
        meanings = _meanings(schema["cls"])
        for key, value in made.get("properties", {}).items():
            if key in meanings:
                value.setdefault("description", meanings[key])
        return made


def _meanings(model: type[BaseModel]) -> dict[str, str]:
    """Return the string that follows each attribute, in ``model`` or in what it inherits from."""
    found: dict[str, str] = {}
    for base in reversed(model.__mro__):
        if issubclass(base, BaseModel) and base.__module__.partition(".")[0] != "pydantic":
            found |= _own_meanings(base.__module__, base.__qualname__)
    return found


@cache
def _own_meanings(module: str, name: str) -> dict[str, str]:
    try:
        source = inspect.getsource(getattr(importlib.import_module(module), name))
    except (OSError, AttributeError):  # made while the program runs, such as a model of one value
        return {}
    body = ast.parse(textwrap.dedent(source)).body[0]
    found: dict[str, str] = {}
    for attribute, words in pairwise(body.body if isinstance(body, ast.ClassDef) else []):
        if (
            isinstance(attribute, ast.AnnAssign)
            and isinstance(attribute.target, ast.Name)
            and isinstance(words, ast.Expr)
            and isinstance(words.value, ast.Constant)
        ):
            found[attribute.target.id] = inspect.cleandoc(str(words.value.value))
    return found
