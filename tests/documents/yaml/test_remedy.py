"""What is said to people whose YAML the parser cannot read."""

import pytest

from documents import InputError
from documents.yaml.source import parse_yaml


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
        ("a: 'it's'\n", 1, "goes on after its quotation mark"),
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
