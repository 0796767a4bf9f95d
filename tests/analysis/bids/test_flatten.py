"""From nested records to places and values."""

from __future__ import annotations

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from analysis.bids.flatten import flatten

LEAVES = st.none() | st.booleans() | st.integers() | st.text(max_size=3) | st.lists(st.integers(), max_size=2)
NESTED = st.dictionaries(
    st.text(max_size=3),
    st.recursive(LEAVES, lambda inner: st.dictionaries(st.text(max_size=3), inner, max_size=3), max_leaves=8),
    max_size=4,
)


def rebuilt(places: list[tuple[tuple[str, ...], Any]]) -> dict[str, Any]:
    """The obvious way back."""
    data: dict[str, Any] = {}
    for (*above, last), value in places:
        here = data
        for key in above:
            here = here.setdefault(key, {})
        here[last] = value
    return data


@given(NESTED)
def test_nothing_is_lost(data: dict[str, Any]) -> None:
    assert rebuilt(flatten(data)) == data


@given(NESTED, st.sets(st.text(max_size=3)))
def test_each_place_comes_once_whatever_the_stimuli_are_called(data: dict[str, Any], stimuli: set[str]) -> None:
    places = [place for place, _ in flatten(data, stimuli)]
    assert len(places) == len(set(places))


def test_roles_stand_for_the_stimuli() -> None:
    data = {"first": "a", "second": "b", "chosen": "b", "clipping": {"b": {"left": {"percent_any": 2}}, "a": {"x": 1}}}
    assert dict(flatten(data, {"a", "b", "c"}))["clipping", "second", "left", "percent_any"] == 2
    assert dict(flatten(data, {"a", "b", "c"}))["clipping", "first", "x"] == 1


def test_stimuli_without_a_role_stay_together() -> None:
    data = {"chosen": "b", "dwell_s": {"a": 1.0, "b": 2.0, "c": 3.0}}
    assert flatten(data, {"a", "b", "c"}) == [
        (("chosen",), "b"),
        (("dwell_s", "chosen"), 2.0),
        (("dwell_s", "others"), {"a": 1.0, "c": 3.0}),
    ]


def test_a_stimulus_called_left_does_not_take_an_eyes_place() -> None:
    data = {"first": "left", "second": "b", "clipping": {"first": {"left": 1, "right": 2}}}
    assert dict(flatten(data, {"left", "b"}))["clipping", "first", "left"] == 1


def test_keys_that_are_to_stay_whole_do() -> None:
    assert flatten({"a": {"b": 1}, "c": {"d": 2}}, whole={"a"}) == [(("a",), {"b": 1}), (("c", "d"), 2)]
