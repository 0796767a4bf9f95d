"""Files made to do harm, or to look like what they are not."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Annotated, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel, ConfigDict, Field

from documents import InputError, load_document
from documents.text import hidden_character, visible
from documents.yaml import parse_yaml, read_yaml
from documents.yaml.load import MOST_FINDINGS


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid")
    kind: Literal["part"]
    number: float = 0.0


class _File(BaseModel):
    model_config = ConfigDict(extra="forbid")
    name: str = ""
    parts: list[Annotated[_Part, Field()]] = []


@pytest.mark.parametrize("mark", ["\\u202e", "\\u2066", "\\u200f", "\\x1b", "\\0", "\\x7f", "\\x9b", "\\ud800"])
@pytest.mark.parametrize("text", ['name: "good{}bad"\n', '"na{}me": good\n', 'name: good\nlist: [1, "{}"]\n'])
def test_marks_that_hide_or_turn_text_are_refused_where_they_stand(mark: str, text: str) -> None:
    with pytest.raises(InputError, match=r"f.yaml:\d:\d+: .*\(U\+") as caught:
        parse_yaml(text.format(mark), "f.yaml")
    assert hidden_character(str(caught.value)) is None  # the message itself is safe to print


def test_a_direction_mark_that_is_typed_and_not_escaped_is_refused_too() -> None:
    with pytest.raises(InputError, match=r"f.yaml:1:7: .*U\+202E"):
        parse_yaml("name: user\u202egnp.exe\n", "f.yaml")


def test_words_of_any_script_are_welcome() -> None:
    words = "naïve — µ, 日本語, עברית, العربية, é, 🙂, tab\tand\nline"
    assert hidden_character(words) is None
    assert parse_yaml('name: "naïve — µ, 日本語, עברית, العربية, 🙂"\n', "f.yaml").data["name"].startswith("naïve")


@given(st.text())
def test_what_is_made_visible_has_nothing_hidden_and_one_line(text: str) -> None:
    shown = visible(text)
    assert hidden_character(shown) is None
    assert not set(shown) & set("\t\n\r")
    assert shown.encode().decode() == shown  # every character can be written
    assert visible(shown) == shown


def test_a_thousand_faults_are_told_in_part_and_soon(tmp_path: Path) -> None:
    path = tmp_path / "f.yaml"
    path.write_text("".join(f"key{index}: 1\n" for index in range(1000)))
    began_s = time.process_time()
    with pytest.raises(InputError) as caught:
        load_document(path, _File)
    findings = caught.value.findings
    assert len(findings) == MOST_FINDINGS + 1
    assert findings[-1].message == f"there are {1000 - MOST_FINDINGS} more faults"
    assert time.process_time() - began_s < 10


def test_long_keys_and_values_are_told_in_part(tmp_path: Path) -> None:
    path = tmp_path / "f.yaml"
    for text in ("{}: 1\n", "name: [{}]\n", "parts: [{{kind: {}}}]\n", "parts: [{{kind: part, number: {}}}]\n"):
        path.write_text(text.format("x" * 50_000))
        with pytest.raises(InputError) as caught:
            load_document(path, _File)
        assert len(str(caught.value)) < 500
    for text in ("a: " + "9" * 50_000, "a: !" + "t" * 200 + " 1", ("b" * 50_000 + ": 1\n") * 2):
        with pytest.raises(InputError) as caught:
            parse_yaml(text, "f.yaml")
        assert len(str(caught.value)) < 700


def test_a_list_of_more_values_than_anyone_writes_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("documents.yaml.source.MAX_NODES", 1000)  # those of the shipped limit take seconds
    assert len(parse_yaml("a: [" + "1," * 900 + "]", "f.yaml").data["a"]) == 900
    with pytest.raises(InputError, match="holds more than 1000 values"):
        parse_yaml("a: [" + "1," * 2100 + "]", "f.yaml")


def test_recursive_anchors_are_refused_whichever_way_they_lie() -> None:
    for text in ("a: &x {b: *x}\n", "&x [1, [*x]]\n", "a: &x {b: &y {c: *x, d: *y}}\n"):
        with pytest.raises(InputError, match="the value that contains it"):
            parse_yaml(text, "f.yaml")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with names")
def test_a_pipe_is_refused_and_not_waited_for(tmp_path: Path) -> None:
    path = tmp_path / "pipe.yaml"
    os.mkfifo(path)
    with pytest.raises(InputError, match="this is a pipe, not a file"):
        read_yaml(path)
