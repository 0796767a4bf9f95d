"""The parser of libyaml reads what PyYAML's own reads, or leaves it to that."""

from __future__ import annotations

import random
import runpy
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from documents import InputError
from documents.yaml import parse_yaml, source
from documents.yaml.source import Loader, QuickLoader, can_be_quick

ROOT = Path(__file__).parents[3]
SHIPPED = sorted([*ROOT.glob("experiments/**/*.yaml"), *ROOT.glob("configs/**/*.yaml")])
PIECES = ["\t", "'", '"', ":", ": ", "- ", "#", " #", "&a ", "*a", "!", "!!str ", "|", "|-\n", ">", "\n", "{", "}"]
PIECES += ["[", "]", ",", "?", "? ", "%", "@", "`", "\\", "é", "µ", "😀", "\u2028", "\x85", "\r\n", "\r", "---\n"]
PIECES += ["...\n", "\ufeff", "~", "0x1F", "  ", "<<: ", "\x00", "\x07", "\u200f", "\\u0041"]
without_libyaml = pytest.mark.skipif(not yaml.__with_libyaml__, reason="PyYAML was built without libyaml")


def read(kind: type[Loader], text: str) -> Any:
    """Return what is read and where, or the error."""
    try:
        parsed = source._parsed(kind, text, "f.yaml")
    except (InputError, ValueError) as error:
        return str(error)
    return repr(parsed.data), parsed.keys, parsed.values  # not a number equals none


def damaged(rng: random.Random, texts: list[str]) -> str:
    """Return a piece of one of the texts, in which up to three places are changed."""
    text = rng.choice(texts)
    begin = rng.randrange(len(text))
    text = text[begin : begin + rng.randrange(20, 1500)]
    for _ in range(rng.randrange(4)):
        at = rng.randrange(len(text) + 1)
        if rng.random() < 0.7:
            text = text[:at] + rng.choice(PIECES) + text[at:]
        else:
            text = text[:at] + text[at + rng.randrange(1, 6) :]
    return text


@without_libyaml
@pytest.mark.parametrize("file", SHIPPED, ids=lambda file: file.stem)
def test_shipped_files_are_read_by_libyaml(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    assert can_be_quick(text)
    quick = read(QuickLoader, text)
    assert not isinstance(quick, str)
    assert quick == read(Loader, text)


@without_libyaml
@pytest.mark.parametrize("count", [300, pytest.param(30_000, marks=pytest.mark.stress)])
def test_damaged_files_are_read_alike(count: int) -> None:
    rng = random.Random(count)
    texts = [file.read_text(encoding="utf-8") for file in SHIPPED]
    compared = 0
    for _ in range(count):
        text = damaged(rng, texts)
        quick = read(QuickLoader, text) if can_be_quick(text) else ""
        if not isinstance(quick, str):
            compared += 1
            assert quick == read(Loader, text), text
    assert compared > count / 10


@pytest.mark.parametrize(
    "text",
    [
        "a: {b: 1,\t c: 2}\n",
        "a: 'b'\t\n",
        "- {b\ufeff: 1}\n",
        "--- a\n",
        "a: |# b\n",
        "a: ! b\n",
        "a: {b: }\n",
        "? a\n",
        "a: {b: why? so}\n",
        "a: [why?]\n",
        "[" * 400,
        "- " * 400 + "a",
        "a: 1\na: 2\n",
        "a: \ud800\n",
    ],
)
def test_what_the_parsers_take_otherwise_is_read_by_the_one_in_python(
    text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def outcome() -> Any:
        try:
            parsed = parse_yaml(text, "f.yaml")
        except InputError as error:
            return str(error)
        return parsed.data, parsed.keys, parsed.values

    with_libyaml = outcome()
    monkeypatch.setattr(source, "can_be_quick", lambda _: False)
    assert with_libyaml == outcome()


def test_no_libyaml_is_needed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(yaml, "__with_libyaml__", False)
    monkeypatch.setitem(sys.modules, "yaml._yaml", None)
    without = runpy.run_path(str(Path(source.__file__)))
    assert not without["can_be_quick"]("a: 1\n")
    monkeypatch.setattr(source, "QuickLoader", None)
    assert parse_yaml("a: [1, b]\n", "f.yaml").data == {"a": [1, "b"]}
