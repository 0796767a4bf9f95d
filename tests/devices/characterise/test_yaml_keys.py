"""Keys set inside a YAML text; every other character stays."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.characterise.mode_file import set_keys
from devices.errors import DeviceError
from documents.yaml import parse_yaml

TEXT = """\
# above
a: 1    # kept
modes:   # of the screen
    # about flat
    flat:
        black: [0,   0.00, 1e-3]   # old

        curve:   # bent
          kind: 'gog'
          # inside
        note: |
          several
          lines
    # about the other
    other: {same_as: flat}
    # still of modes
# of the whole file
last: "2"
"""


def test_a_key_is_replaced_where_it_stands() -> None:
    after, gone = set_keys(TEXT, ("modes", "flat"), {"curve": ["curve: new"]}, "f")
    old = "        curve:   # bent\n          kind: 'gog'\n"
    assert after == TEXT.replace(old, "        curve: new\n")
    assert gone == 1


def test_a_key_is_added_behind_the_last_with_the_comments_that_follow_it() -> None:
    after, gone = set_keys(TEXT, ("modes",), {"third": ["third:", "  same_as: flat"]}, "f")
    still = "    # still of modes\n"
    assert after == TEXT.replace(still, still + "    third:\n      same_as: flat\n")
    assert gone == 0


def test_a_block_text_ends_where_it_ends() -> None:
    after, _ = set_keys(TEXT, ("modes", "flat"), {"more": ["more: 1"], "note": ["note: short"]}, "f", ["black"])
    assert "        note: short\n        more: 1\n    # about the other\n" in after
    assert "black" not in after


@pytest.mark.parametrize("ending", ["\r\n", "\n"])
def test_line_endings_and_a_last_line_without_one_stay(ending: str) -> None:
    text = TEXT.replace("\n", ending)
    after, _ = set_keys(text, ("modes",), {"third": ["third: 1"]}, "f")
    assert after.replace(f"    third: 1{ending}", "") == text
    after, _ = set_keys(f"m:{ending}  a: 1", ("m",), {"b": ["b: 2"]}, "f")
    assert after == f"m:{ending}  a: 1{ending}  b: 2{ending}"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("m: {a: 1}\n", "f:1:4: 'm' is written in braces"),
        ("m:\n  ? a\n  : 1\n", "f:2:5: 'a' shares its line"),
        ("m:\n  a: &x {k: 1}\n  b: *x\n", "used elsewhere"),
        ("n: 1\n", "there is no mapping 'm'"),
        ("m: [\n", "not valid YAML"),
    ],
)
def test_what_cannot_be_set_is_refused_with_its_place(text: str, says: str) -> None:
    with pytest.raises(Exception, match=says) as caught:
        set_keys(text, ("m",), {"a": ["a: 2"]}, "f")
    assert isinstance(caught.value, DeviceError) or "YAML" in says


def test_an_alias_that_does_not_refer_to_it_stays() -> None:
    after, _ = set_keys("m:\n  a: &x {k: 1}\n  b: *x   # too\n", ("m",), {"c": ["c: 2"]}, "f")
    assert after == "m:\n  a: &x {k: 1}\n  b: *x   # too\n  c: 2\n"
    after, _ = set_keys("m:\n  a: &x {k: 1}\n  b: *x\n  c: 2\n", ("m",), {"b": ["b: 2"]}, "f")
    assert after == "m:\n  a: &x {k: 1}\n  b: 2\n  c: 2\n"


WORDS = st.text("abc", min_size=1, max_size=2)
VALUES = st.sampled_from(
    [
        "1",
        "[1, 2]  # said",
        "{k: v}",
        "'q # q'",
        "|\n{i}  two\n{i}  lines",
        "\n{i}  deep:\n{i}    er: 1\n{i}    # end",
        "",
    ]
)


@settings(max_examples=15)
@given(
    keys=st.dictionaries(WORDS, VALUES, min_size=1, max_size=4),
    name=WORDS,
    indent=st.sampled_from(["  ", "   "]),
    comments=st.lists(st.sampled_from(["", "# c", "  # c", "      # c"]), min_size=5, max_size=5),
)
def test_any_layout_reads_as_wanted_and_no_other_line_changes(
    keys: dict[str, str], name: str, indent: str, comments: list[str]
) -> None:
    lines = ["top: 1", "m:"]
    for comment, (key, value) in zip(comments, keys.items(), strict=False):
        lines += [comment, f"{indent}{key}: {value.replace('{i}', indent)}"]
    text = "\n".join([*lines, comments[-1], "z: 3"]) + "\n"
    if parse_yaml(text, "f").data["m"] is None:
        return
    after, _ = set_keys(text, ("m",), {name: [f"{name}: [new, 7]"]}, "f")
    assert parse_yaml(after, "f").data == {"top": 1, "m": {**parse_yaml(text, "f").data["m"], name: ["new", 7]}, "z": 3}
    left = after.replace(f"{indent}{name}: [new, 7]\n", "", 1)
    if name not in keys:
        assert left == text
    assert all(line in text.split("\n") for line in left.split("\n"))
