"""Every number that people or programs can write has a range, and whoever leaves it is told where."""

from __future__ import annotations

import importlib
import pkgutil
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import pytest
from click.testing import CliRunner
from pydantic import BaseModel, Field

import analysis
import cyclopean
import devices
import documents
import runner
import stimuli
from documents import InputError
from documents.yaml import FileModel, Positive
from runner.cli.main import group

FLOORS = (documents, devices, stimuli, analysis, runner, cyclopean)
ENDS = (("minimum", "exclusiveMinimum"), ("maximum", "exclusiveMaximum"))


def models() -> list[type[BaseModel]]:
    """Return every model of the program that is checked by pydantic."""
    for floor in FLOORS:
        for module in pkgutil.walk_packages(floor.__path__, f"{floor.__name__}."):
            importlib.import_module(module.name)
    found: dict[type[BaseModel], None] = {}
    waiting: list[type[BaseModel]] = [BaseModel]
    while waiting:
        for heir in waiting.pop().__subclasses__():
            waiting.append(heir)
            if heir.__module__.partition(".")[0] in {floor.__name__ for floor in FLOORS}:
                found[heir] = None
    return list(found)


def bare(node: Any, place: str = "") -> Iterator[str]:
    """Yield the places of a JSON Schema at which a number has no lower or no upper limit."""
    if isinstance(node, list):
        for inner in node:
            yield from bare(inner, place)
    elif isinstance(node, dict):
        # An enumeration's type is that of its values.
        number = node.get("type") in ("number", "integer") and not {"const", "enum"} & set(node)
        if number and not all(any(key in node for key in end) for end in ENDS):
            yield place
        for key, inner in node.items():
            if key not in ("default", "examples"):
                yield from bare(inner, f"{place}.{key}")


@pytest.mark.nightly
def test_every_number_of_every_schema_has_a_range() -> None:
    found = models()
    assert len(found) > 150
    wanting = [f"{model.__module__}.{model.__qualname__}{place}" for model in found for place in bare(schema(model))]
    assert wanting == []


def schema(model: type[BaseModel]) -> dict[str, Any]:
    """Return the JSON Schema of a model."""
    return model.model_json_schema()


class Half(FileModel):
    """Numbers of which some have no range."""

    ranged: Positive = 1
    near: Annotated[Positive, Field(le=5)] = 1
    below: Annotated[float, Field(ge=0)] = 1
    many: tuple[Annotated[int, Field(lt=3)], ...] = ()
    named: dict[str, list[float | None]] = Field(default_factory=dict)
    flag: bool = False
    either: int | str = 1


def test_a_model_with_a_number_without_range_is_not_built() -> None:
    with pytest.raises(TypeError, match=r"Half: .*: below, many, named, either$"):
        Half.model_validate({})


LONG = {
    "hexadecimal": "0x" + "f" * 4000,
    "decimal": "9" * 5000,
    "octal": "0o" + "7" * 4000,
    "negative": "-" + "9" * 5000,
    "zeros": "0" * 5000,
    "just too long": "1" * 101,
    "below the limit of Python": "1" * 310,
    "exponent": "1e400",
    "decimals": "1" * 400 + ".5",
    "underscores": "_".join("1" * 3000),
    "sexagesimal": ":".join(["59"] * 2000),
    "infinite": ".inf",
    "nan": ".nan",
}


@pytest.mark.parametrize("written", LONG.values(), ids=LONG)
def test_a_number_beyond_all_is_named_with_its_place(tmp_path: Path, written: str) -> None:
    file = tmp_path / "file.yaml"
    file.write_text(f"schema_version: 1\nmode: flat\ndistance_mm: {written}\n", encoding="utf-8")
    told = CliRunner().invoke(group, ["check", str(file)])
    assert told.exit_code in (1, 2), told.exception
    assert isinstance(told.exception, SystemExit | InputError), told.exception
    assert re.search(r"file\.yaml:3:\d+: ", told.output + str(told.exception))
