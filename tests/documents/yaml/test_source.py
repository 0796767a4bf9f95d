"""YAML 1.2 scalars, places, and hostile files."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from documents import InputError
from documents.yaml import parse_yaml, read_yaml


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("NO", "NO"),
        ("yes", "yes"),
        ("on", "on"),
        ("true", True),
        ("12:30", "12:30"),
        ("1e-3", 1e-3),
        ("1E3", 1e3),
        ("017", 17),
        ("0o17", 15),
        ("0x1F", 31),
        ("2024-01-01", "2024-01-01"),
        ("~", None),
        ("", None),
        (".5", 0.5),
        ("-.inf", -math.inf),
        ("1_000", "1_000"),
        ("'1.1'", "1.1"),
    ],
)
def test_scalars_are_read_as_yaml_1_2(text: str, value: object) -> None:
    read = parse_yaml(f"key: {text}\n", "f.yaml").data["key"]
    assert read == value
    assert type(read) is type(value)


def test_places_count_from_one() -> None:
    source = parse_yaml("a: 1\nblocks:\n  - {kind: x, text: y}\n", "f.yaml")
    place = source.place(("blocks", 0, "text"))
    key = source.place(("blocks", 0, "text"), key=True)
    assert place is not None
    assert key is not None
    assert (place.line, place.column) == (3, 21)
    assert (key.line, key.column) == (3, 15)
    nearest = source.place(("blocks", 0, "missing"))
    assert nearest is not None
    assert nearest.line == 3


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("a: 1\na: 2\n", "stands twice"),
        ("a: !!python/object/apply:os.system [ls]\n", "is not allowed"),
        ("a: !!timestamp 2024-01-01\n", "is not allowed"),
        ("", "0 YAML documents"),
        ("a: 1\n---\nb: 2\n", "2 YAML documents"),
        ("[a]: 1\n", "a key must be a plain word"),
        ("[" * 300 + "]" * 300, "nested"),
        pytest.param("[" * 5000 + "]" * 5000, "nested", marks=pytest.mark.nightly),
    ],
)
def test_hostile_text_is_one_located_finding(text: str, part: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_yaml(text, "f.yaml")
    assert len(caught.value.findings) == 1
    assert part in str(caught.value)
    assert str(caught.value).startswith("f.yaml:")


def test_exploding_aliases_are_refused_quickly(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("documents.yaml.source.MAX_NODES", 1000)  # those of the shipped limit take a second
    text = "a: &a [x, x, x, x, x, x, x, x, x]\n"
    for name, previous in zip("bcdefghi", "abcdefgh", strict=True):
        text += f"{name}: &{name} [{', '.join([f'*{previous}'] * 9)}]\n"
    with pytest.raises(InputError, match="expands to more than"):
        parse_yaml(text, "bomb.yaml")


def test_missing_large_and_binary_files(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_yaml(tmp_path / "none.yaml")
    large = tmp_path / "large.yaml"
    large.write_bytes(b"a: " + b"x" * 10_000_000)
    with pytest.raises(InputError, match="larger than"):
        read_yaml(large)
    binary = tmp_path / "binary.yaml"
    binary.write_bytes(b"a: \xff\xfe")
    with pytest.raises(InputError, match="not UTF-8"):
        read_yaml(binary)


@pytest.mark.parametrize(
    ("text", "line", "remedy"),
    [
        ("a: 1\nb:\n\tc: 1\n", 3, "a tab stands there"),
        ("a: 1\nb:\t2\n", 2, "a tab stands there"),
        ("question: Which one: left or right?\n", 1, "text that holds a colon in quotes"),
        ("a: 1\n b: 2\n", 2, "begin below one another"),
        ("a: 1\nb: [1, 2\nc: 3\n", 3, "the '[' of line 2 is not closed"),
        (
            "blocks:\n  - {kind: all_pairs, stimuli: all\nanalysis: {alpha: 0.05}\n",
            3,
            "the '{' of line 2 is not closed",
        ),
        ("a: {b: 1}}\n", 1, "too many"),
        ("a: 1\nb: 'x\nc: 1\n", 4, "the quotation mark of line 2 is not closed"),
        ("a: 'it's'\n", 1, "continues after its quotation mark"),
        ("a:\n  - 1\n - 2\n", 3, "begin below one another"),
        ("a: 1\nb\nc: 2\n", 3, "with a space after the colon"),
        ("a: @x\n", 1, "in quotes"),
        ("a: *x\n", 1, "in quotes"),
        ('a: "c:\\dir"\n', 1, "single quotes"),
        ("# nothing yet\n", 1, "it is empty"),
        ("a: 1\n---\na: 2\n", 1, "take out the '---'"),
    ],
)
def test_what_the_parser_cannot_read_comes_with_a_remedy(text: str, line: int, remedy: str) -> None:
    with pytest.raises(InputError) as error:
        parse_yaml(text, "f.yaml")
    (finding,) = error.value.findings
    assert finding.line == line
    assert remedy in str(finding.remedy)


def test_where_nobody_can_tell_nothing_is_said() -> None:
    with pytest.raises(InputError) as error:
        parse_yaml("a: &\n", "f.yaml")
    assert error.value.findings[0].remedy is None
