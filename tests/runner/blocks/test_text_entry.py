"""What may be typed into a field, and what is wrong with it."""

from __future__ import annotations

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from runner.blocks.text_entry import Number, TextAnswer, written

AGE = Number(unit="years", lowest=16, highest=99, whole=True)


@pytest.mark.parametrize(("typed", "fault"), [("72", ""), ("16", ""), ("99", ""), ("", "Type a whole number")])
def test_a_number_in_its_range_will_do(typed: str, fault: str) -> None:
    assert AGE.fault(typed).startswith(fault)
    assert bool(AGE.fault(typed)) == bool(fault)


def test_what_is_out_of_range_is_told_with_the_range() -> None:
    assert AGE.fault("7") == "7 is too low: type a whole number from 16 to 99 years"
    assert AGE.fault("100") == "100 is too high: type a whole number from 16 to 99 years"
    assert Number(lowest=0.5).fault("0,4") == "0,4 is too low: type a number, 0.5 or more"


def test_only_numbers_can_be_typed() -> None:
    assert AGE.refusal("4x") == AGE.refusal("-4") == AGE.refusal("4.") == "Digits only"
    assert AGE.refusal("44") == ""
    assert Number().refusal("-4,5") == ""
    assert Number().refusal("4.5.6") == Number().refusal("1e3") == Number().refusal("٣") == "A number only"
    assert Number().refusal("1" * 25) == "That number is too long"


def test_a_decimal_comma_is_a_point_and_whole_numbers_stay_whole() -> None:
    assert [Number().value(one) for one in ("7,25", "7.", ".5", "+3", "-0.5")] == [7.25, 7.0, 0.5, 3, -0.5]
    assert isinstance(Number().value("7"), int)


def test_words_are_as_long_as_there_is_room() -> None:
    words = TextAnswer(max_length=5)
    assert words.refusal("abcde") == ""
    assert words.refusal("abcdef") == "There is room for 5 characters"
    assert words.value("  a b ") == "a b"


@given(st.floats(-1e9, 1e9), st.floats(-1e9, 1e9), st.booleans())
def test_the_example_can_be_typed_and_will_do(one: float, other: float, whole: bool) -> None:
    """It is what plain observers type: without it, they would type for ever."""
    lowest, highest = (round(limit, 6) for limit in sorted((one, other)))
    assume(not whole or highest - lowest >= 1)
    for field in (
        Number(lowest=lowest, highest=highest, whole=whole),
        Number(lowest=lowest, whole=whole),
        Number(highest=highest, whole=whole),
    ):
        example = field.example
        assert all(not field.refusal(example[:length]) for length in range(1, len(example) + 1))
        assert field.fault(example) == ""


def test_limits_are_written_as_people_write_them() -> None:
    assert [written(number) for number in (16.0, 0.5, -3.25, 1e9, 100.0, 0.0)] == [
        "16",
        "0.5",
        "-3.25",
        "1000000000",
        "100",
        "0",
    ]
